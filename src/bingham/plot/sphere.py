"""A unit sphere on paper, seen from afar, and rotations on it as clouds of rotated axes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.notebook import project
from bingham.plot.style import AXIS_COLOURS, INK, PALE
from bingham.rotations import rotate

__all__ = ["draw_axes_cloud", "draw_axes_density", "draw_axes_path", "draw_sphere", "project"]

FloatArray = NDArray[np.float64]

JUMP = 0.5  # a longer step of a path, in radii, is a gap and no line


def draw_sphere(axes: Any, names: tuple[str, str, str] = ("x", "y", "z")) -> None:
    """Draw outline, equator and the three world axes."""
    turn = np.linspace(0.0, 2 * np.pi, 181)
    axes.plot(np.cos(turn), np.sin(turn), color=INK, lw=0.8)
    circle = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1)
    for line in (circle, circle[:, [0, 2, 1]], circle[:, [2, 0, 1]]):
        right, up, front = project(line)
        axes.plot(np.where(front, right, np.nan), up, color=PALE, lw=0.7)
        axes.plot(np.where(front, np.nan, right), up, color=PALE, lw=0.5, ls=":")
    for name, tip in zip(names, np.eye(3), strict=True):
        (right, near), (up, high) = (np.multiply(c, [1.0, 1.3]) for c in project(tip)[:2])
        axes.plot([right, near], [up, high], color=INK, lw=0.8)
        box = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.8}
        axes.text(near, high, name, color=INK, ha="center", va="center", bbox=box)
    axes.set(xlim=(-1.3, 1.3), ylim=(-1.3, 1.3), aspect="equal")
    axes.set_axis_off()


def draw_axes_cloud(axes: Any, q: ArrayLike, *, size: float = 3.0, alpha: float = 0.4) -> None:
    """Draw where rotations (n, 4) carry the body's x, y and z axes: dots, pale on the far side."""
    quaternion = np.asarray(q, dtype=np.float64)
    for tip, colour in zip(np.eye(3), AXIS_COLOURS, strict=True):
        right, up, front = project(rotate(quaternion, tip))
        for side, strength in ((~front, 0.3 * alpha), (front, alpha)):
            axes.scatter(right[side], up[side], s=size, color=colour, alpha=strength, lw=0)


def draw_axes_path(axes: Any, q: ArrayLike) -> None:
    """Draw the lines along which rotations (T, 4) carry the body's x, y and z axes: pale on the far side."""
    quaternion = np.asarray(q, dtype=np.float64)
    for tip, colour in zip(np.eye(3), AXIS_COLOURS, strict=True):
        line = rotate(quaternion, tip)
        line[1:][np.linalg.norm(np.diff(line, axis=0), axis=1) > JUMP] = np.nan
        right, up, front = project(line)
        for side, strength in ((~front, 0.25), (front, 0.7)):
            axes.plot(np.where(side, right, np.nan), up, color=colour, alpha=strength, lw=0.6)


def draw_axes_density(axes: Any, q: ArrayLike, bins: int = 70) -> None:
    """Shade how often rotations (T, 4) point the body's x, y and z axes to each place of the near side."""
    quaternion = np.asarray(q, dtype=np.float64)
    for tip, colour in zip(np.eye(3), AXIS_COLOURS, strict=True):
        right, up, front = project(rotate(quaternion, tip))
        count = np.histogram2d(right[front], up[front], bins=bins, range=[[-1, 1], [-1, 1]])[0].T
        image = np.zeros((bins, bins, 4))
        image[..., :3] = [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
        # The root lets what is seldom be seen beside what is frequent.
        image[..., 3] = 0.8 * np.sqrt(count / max(float(count.max()), 1.0))
        axes.imshow(image, extent=(-1, 1, -1, 1), origin="lower", interpolation="nearest", zorder=2)
    axes.set(xlim=(-1.3, 1.3), ylim=(-1.3, 1.3))
