"""Stereonets: functions that draw on the axes of a plot, matplotlib's own or those of mplstereonet.

On plain axes the net is the unit disc, east to the right and north up, of the lower hemisphere.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.geology.contours import exponential_density, fitted_density, kamb_density
from bingham.geology.projection import Projection, is_stereonet, map_coordinates, unproject
from bingham.inference.ellipse import ConfidenceEllipse
from bingham.validation import unit_rows

__all__ = ["draw_axes", "draw_contours", "draw_ellipse", "draw_great_circle", "draw_net"]

FloatArray = NDArray[np.float64]

TURN = np.linspace(0.0, 2.0 * np.pi, 361)
INK, PALE = "#333333", "#D5D5D5"


def draw_net(ax: Any, *, projection: Projection = "equal-area", step_deg: float | None = 10.0) -> None:
    """Draw the edge of the net, its north mark, and great and small circles every `step_deg` degrees (None: none).

    Great circles run through north and south, small circles about them. Axes of mplstereonet have a net of their own:
    their grid is switched on instead.
    """
    if is_stereonet(ax):
        ax.grid(step_deg is not None)
        return
    if step_deg is not None:
        if not 0.0 < step_deg <= 90.0:
            raise InvalidArgumentError("step_deg", "an angle from 0 to 90 degrees", step_deg)
        half = np.linspace(0.0, np.pi, 181)
        for angle in np.arange(step_deg, 180.0, step_deg):
            a = np.radians(angle)
            lines = (
                np.stack([np.cos(half), np.sin(half) * np.cos(a), np.sin(half) * np.sin(a)], axis=1),
                np.stack([np.full(181, np.cos(a)), np.sin(a) * np.cos(half), np.sin(a) * np.sin(half)], axis=1),
            )
            for line in lines:
                ax.plot(*map_coordinates(ax, line, projection), color=PALE, lw=0.4, zorder=0.5)
    ax.plot(np.sin(TURN), np.cos(TURN), color=INK, lw=1.0)
    ax.plot([0.0, 0.0], [1.0, 1.04], color=INK, lw=1.0)
    ax.text(0.0, 1.06, "N", ha="center", va="bottom", color=INK)
    ax.set(aspect="equal", xlim=(-1.1, 1.1), ylim=(-1.1, 1.2))
    ax.set_axis_off()


def draw_axes(ax: Any, x: ArrayLike, *, projection: Projection = "equal-area", **style: Any) -> None:
    """Draw the lower ends of axes x (..., 3) as points; `style` goes to ``ax.plot``."""
    right, up = map_coordinates(ax, unit_rows(x, 3, "x"), projection)
    ax.plot(np.ravel(right), np.ravel(up), **{"ls": "none", "marker": "o", "ms": 3.5, "color": INK, "mew": 0.0} | style)


def draw_great_circle(ax: Any, pole: ArrayLike, *, projection: Projection = "equal-area", **style: Any) -> None:
    """Draw the plane with the given pole (3,); `style` goes to ``ax.plot``."""
    normal = unit_rows(pole, 3, "pole")
    across = np.linalg.svd(normal[None, :])[2][1:]
    # From where the plane comes up on one side to where it does on the other.
    _draw_line(ax, np.cos(TURN)[:, None] * across[0] + np.sin(TURN)[:, None] * across[1], projection, style)


def draw_ellipse(ax: Any, ellipse: ConfidenceEllipse, *, projection: Projection = "equal-area", **style: Any) -> None:
    """Draw the edge of a confidence ellipse; where it leaves the hemisphere it comes back on the other side."""
    _draw_line(ax, ellipse.outline(721), projection, style)


def draw_contours(
    ax: Any,
    x: ArrayLike | Bingham,
    method: Literal["kamb", "exponential"] = "exponential",
    *,
    projection: Projection = "equal-area",
    sigma: float = 3.0,
    filled: bool = False,
    size: int = 61,
    **style: Any,
) -> Any:
    """Draw contours of the density of axes (n, 3), or of a distribution, and return what ``ax.contour`` does.

    Parameters
    ----------
    ax : Axes
        Of matplotlib or mplstereonet.
    x : (n, 3) array_like or Bingham
        Axes to count, or the distribution whose density (multiples of the uniform one) is drawn.
    method : {"kamb", "exponential"}
        How axes are counted: `kamb_density` or `exponential_density`, in standard deviations; by default lines start
        at 2σ above zero and are 2σ apart.
    projection : {"equal-area", "equal-angle"}
        Of plain axes.
    sigma : float
        Size of the counting circle.
    filled : bool
        Fill between the lines.
    size : int
        Points of the grid from the centre to the edge.
    **style
        For ``ax.contour`` or ``ax.contourf``: ``levels``, ``cmap``, …
    """
    if method not in ("kamb", "exponential"):
        raise InvalidArgumentError("method", "'kamb' or 'exponential'", repr(method), "or give a fitted distribution")
    # A polar grid ends on the edge of the net.
    radius = np.linspace(0.0, 1.0, size)[:, None]
    points = np.stack([radius * np.sin(TURN), radius * np.cos(TURN)], axis=-1)
    vectors = unproject(points, "equal-area" if is_stereonet(ax) else projection)
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    if isinstance(x, Bingham):
        value = fitted_density(x, vectors)
    else:
        value = (kamb_density if method == "kamb" else exponential_density)(x, vectors, sigma=sigma)
        style.setdefault("levels", np.arange(2.0, max(6.0, float(value.max()) + 2.0), 2.0))
    draw = ax.contourf if filled else ax.contour
    vectors[..., 2] = np.maximum(vectors[..., 2], 0.0)
    return draw(*map_coordinates(ax, vectors, projection), value, **style)


def _draw_line(ax: Any, line: FloatArray, projection: Projection, style: dict[str, Any]) -> None:
    """Draw a line (n, 3) on the sphere, cut where it passes through the edge of the hemisphere."""
    upper = line[:, 2] < 0.0
    crossings = np.flatnonzero(upper[1:] != upper[:-1])
    start = 0
    right: list[FloatArray] = []
    up: list[FloatArray] = []
    gap = np.array([np.nan])

    def piece(points: FloatArray, flip: bool) -> None:
        # map_coordinates takes the lower end; just on the edge rounding must not choose another one.
        points = -points if flip else points
        points = np.concatenate([points[:, :2], np.maximum(points[:, 2:], 0.0)], axis=1)
        a, b = map_coordinates(ax, points / np.linalg.norm(points, axis=1, keepdims=True), projection)
        right.extend([a, gap])
        up.extend([b, gap])

    edge: FloatArray = np.empty((0, 3))
    for k in crossings:
        t = line[k, 2] / (line[k, 2] - line[k + 1, 2])
        meeting = (1.0 - t) * line[k] + t * line[k + 1]
        meeting[2] = 0.0
        piece(np.concatenate([edge, line[start : k + 1], meeting[None]]), bool(upper[k]))
        start, edge = k + 1, meeting[None]
    piece(np.concatenate([edge, line[start:]]), bool(upper[-1]))
    ax.plot(np.concatenate(right), np.concatenate(up), **{"lw": 1.2, "color": INK} | style)
