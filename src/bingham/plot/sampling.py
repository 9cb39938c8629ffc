"""Point sets over the density they stand for: on the circle, on the sphere, in the tangent space of S³."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.plot.style import AXIS_COLOURS, INK, PALE

__all__ = ["draw_circle_samples", "draw_sphere_samples", "draw_tangent_samples", "tangent"]

FloatArray = NDArray[np.float64]


def draw_circle_samples(axes: Any, distribution: Bingham, points: FloatArray) -> None:
    """Draw the unit circle, a density (d = 2) as height above it, and points (m, 2) with their negatives."""
    turn = np.linspace(0.0, 2.0 * np.pi, 721)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    height = 1.0 + 0.8 * distribution.pdf(circle) / distribution.pdf(distribution.mode)
    axes.fill(height * circle[:, 0], height * circle[:, 1], color=AXIS_COLOURS[2], alpha=0.15, lw=0)
    axes.fill(circle[:, 0], circle[:, 1], color="white", lw=0)
    axes.plot(circle[:, 0], circle[:, 1], color=PALE, lw=0.8)
    both = np.concatenate([points, -points])
    axes.plot(both[: len(points), 0], both[: len(points), 1], "o", ms=4, color=AXIS_COLOURS[0])
    axes.plot(both[len(points) :, 0], both[len(points) :, 1], "o", ms=4, mfc="white", color=AXIS_COLOURS[0])
    _frame(axes, 1.9)


def draw_sphere_samples(axes: Any, distribution: Bingham, points: FloatArray, *, size: float = 7.0) -> None:
    """Draw a d = 3 distribution as shades on the globe, and those of the points ±x (m, 3) that are in front.

    The mode points at the viewer, the axis of the second largest moment to the right.
    """
    right, up = np.meshgrid(*[np.linspace(-1.0, 1.0, 301)] * 2)
    inside = right**2 + up**2 < 1.0
    depth = np.sqrt(np.where(inside, 1.0 - right**2 - up**2, 0.0))
    t = np.stack([up, right, depth], axis=-1)
    density = np.exp((t * t) @ distribution.z)
    picture = {"extent": (-1, 1, -1, 1), "origin": "lower", "cmap": "Blues", "vmin": 0.0, "vmax": 1.6}
    axes.imshow(np.where(inside, density, np.nan), **picture)
    both = np.concatenate([points, -points]) @ distribution.M
    front = both[:, 2] >= 0.0
    axes.scatter(both[front, 1], both[front, 0], s=size, color=AXIS_COLOURS[0], lw=0, zorder=3)
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    axes.plot(np.cos(turn), np.sin(turn), color=INK, lw=0.8)
    _frame(axes, 1.04)


def tangent(distribution: Bingham, points: FloatArray) -> FloatArray:
    """Return the logarithm (m, d−1) of ±x at the mode, in the principal axes: its length is the angle from the mode."""
    y = points @ distribution.M
    y = np.where(y[:, -1:] < 0.0, -y, y)
    sine = np.linalg.norm(y[:, :-1], axis=1)
    angle = np.arctan2(sine, y[:, -1])
    return y[:, :-1] * np.divide(angle, sine, out=np.ones_like(sine), where=sine > 0.0)[:, None]


def draw_tangent_samples(axes: Any, distribution: Bingham, points: FloatArray, *, rng: Any = 0) -> None:
    """Draw the first two tangent coordinates of points (m, d) over 3000 random samples of the distribution."""
    random = tangent(distribution, distribution.rvs(3000, rng=rng))
    axes.plot(random[:, 0], random[:, 1], ".", ms=1.5, color=AXIS_COLOURS[2], alpha=0.25)
    t = tangent(distribution, points)
    axes.plot(t[:, 0], t[:, 1], "o", ms=3, color=AXIS_COLOURS[0], mew=0)
    axes.set(xlabel="rad", aspect="equal", xlim=(-1.6, 1.6), ylim=(-1.6, 1.6), xticks=[-1, 0, 1], yticks=[-1, 0, 1])


def _frame(axes: Any, reach: float) -> None:
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    axes.set_axis_off()
