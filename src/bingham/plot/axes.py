"""A fit with its data: rose (d = 2), projection of a hemisphere (d = 3), rotated axes on a sphere (d = 4)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtri

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.plot.sphere import draw_axes_cloud, draw_sphere, project
from bingham.plot.style import AXIS_COLOURS, INK, PALE, new_figure
from bingham.rotations import canonical, rotate

__all__ = ["draw_density_map", "equal_area", "plot_fit"]

FloatArray = NDArray[np.float64]

DATA, MODE, PLANE = INK, AXIS_COLOURS[0], AXIS_COLOURS[2]


def plot_fit(x: FloatArray, distribution: Bingham, *, names: Sequence[str] = (), title: str = "") -> Any:
    """Draw samples and the distribution fitted to them.

    Parameters
    ----------
    x : (n, d) ndarray
        Unit vectors, d = 2, 3 or 4.
    distribution : Bingham
        Their distribution.
    names : sequence of str
        Names of the components; ``n, e, d`` rotates the projection to geographic directions.
    title : str
        Heading.

    Returns
    -------
    matplotlib.figure.Figure
        Save it with ``savefig``.
    """
    draw = {2: _draw_rose, 3: _draw_hemisphere, 4: _draw_rotations}.get(distribution.dim)
    if draw is None:
        raise InvalidArgumentError(
            "distribution", "dimension 2, 3 or 4, which paper can show", distribution.dim, "leave the figure out"
        )
    figure = new_figure(5.5, 6.0)
    draw(figure, x, distribution, tuple(name.lower() for name in names))
    figure.suptitle(title, fontsize=11)
    return figure


def equal_area(v: FloatArray) -> FloatArray:
    """Return (..., 2): east and north on Lambert's equal-area map of the lower hemisphere, for axes (n, e, d) (..., 3).

    r = √2 sin(½ angle from straight down) ≤ 1, azimuth clockwise from north.

    Examples
    --------
    >>> import numpy as np
    >>> equal_area(np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])).tolist()
    [[0.0, 0.0], [1.0, 0.0]]
    """
    down = np.where(v[..., 2:] < 0, -v, v)
    return down[..., [1, 0]] / np.sqrt(1 + down[..., 2:])


def draw_density_map(
    axes: Any, density: Callable[[FloatArray], FloatArray], names: tuple[str, ...], mode: FloatArray
) -> tuple[FloatArray, str]:
    """Draw a density (n, 3) → (n,) on the map of `equal_area`, its edge and what lies there.

    Returns the matrix (3, 3) that takes vectors to the map's (n, e, d), and the name of the hemisphere: other frames
    than the geographic one are drawn as seen from above, first component right, second up, third towards the reader,
    on the side where the `mode` (3,) lies under the sign that it is printed with.
    """
    names = names if len(names) == 3 else ("x", "y", "z")
    geographic = names == ("n", "e", "d")
    side = 1.0 if canonical(mode)[2] > 0.0 else -1.0
    turn = np.eye(3) if geographic else np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, side]])
    grid = np.linspace(-1, 1, 301)
    east, north = np.meshgrid(grid, grid)
    square = east**2 + north**2
    across = np.sqrt(np.maximum(2 - square, 0))
    inside = square <= 1
    vectors = np.stack([north * across, east * across, 1 - square], axis=-1)[inside] @ turn
    shade = np.full(square.shape, np.nan)
    shade[inside] = density(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
    axes.contourf(east, north, shade, levels=12, cmap="Blues", alpha=0.45, antialiased=True)
    edge = np.linspace(0.0, 2 * np.pi, 361)
    axes.plot(np.cos(edge), np.sin(edge), color=INK, lw=1.0)
    labels = "NESW" if geographic else (f"+{names[1]}", f"+{names[0]}", f"−{names[1]}", f"−{names[0]}")
    for k, label in enumerate(labels):
        tick = np.array([np.sin(k * np.pi / 2), np.cos(k * np.pi / 2)])
        axes.plot(*np.outer(tick, [1.0, 1.03]), color=INK, lw=1.0)
        axes.text(*(1.12 * tick), label, ha="center", va="center", color=INK)
    return turn, "lower hemisphere" if geographic else f"hemisphere {'+' if side > 0.0 else '−'}{names[2]}"


def _draw_hemisphere(figure: Any, x: FloatArray, distribution: Bingham, names: tuple[str, ...]) -> None:
    axes = figure.subplots()
    turn, view = draw_density_map(axes, distribution.pdf, names, distribution.mode)
    axes.plot(*equal_area(x @ turn.T).T, "o", color=DATA, ms=3.5, alpha=0.6, mew=0, label=f"{len(x)} axes")
    pole, middle, mode = distribution.M.T @ turn.T
    edge = np.linspace(0.0, 2 * np.pi, 361)
    circle = np.cos(edge)[:, None] * middle + np.sin(edge)[:, None] * mode
    axes.plot(*_broken(equal_area(circle)).T, color=PLANE, lw=1.0, label="best plane and its pole")
    axes.plot(*equal_area(pole), "s", color=PLANE, ms=6, mfc="none")
    n = len(x)
    # √q of `bingham.inference.confidence_ellipse`: p (n − 1)/(n − p) F(p, n − p), p = 2.
    reach = np.sqrt(2 * (n - 1) / (n - 2) * fdtri(2, n - 2, 0.95)) if n > 3 else np.inf
    with np.errstate(over="ignore", invalid="ignore"):
        spread = reach * distribution.standard_errors(n).axes[:2, 2]
    if np.all(spread < np.pi / 2):  # wider: the data leave the mode open
        around = spread[0] * np.cos(edge)[:, None] * pole + spread[1] * np.sin(edge)[:, None] * middle
        angle = np.linalg.norm(around, axis=1, keepdims=True)
        axes.plot(*_broken(equal_area(np.cos(angle) * mode + np.sinc(angle / np.pi) * around)).T, color=MODE, lw=1.4)
    axes.plot(*equal_area(mode), "*", color=MODE, ms=9, label="mode, 95 % confidence")
    axes.set(aspect="equal", xlim=(-1.2, 1.2), ylim=(-1.2, 1.2))
    axes.set_axis_off()
    axes.set_title(f"equal area, {view}; shade: fitted density", fontsize=9)
    figure.legend(loc="outside lower center", ncols=3, fontsize=8, frameon=False)


def _broken(points: FloatArray) -> FloatArray:
    """Return a line with a gap wherever it leaves the map on one side and comes back on the other."""
    drawn = np.array(points)
    drawn[1:][np.linalg.norm(np.diff(points, axis=0), axis=1) > 0.5] = np.nan
    return drawn


def _draw_rose(figure: Any, x: FloatArray, distribution: Bingham, names: tuple[str, ...]) -> None:
    """Areas are proportional to counts, so radii go with the root of the density."""
    axes = figure.add_subplot(projection="polar")
    angle = np.arctan2(x[:, 1], x[:, 0]) % np.pi
    bins = int(np.clip(2 * np.ceil(len(x) ** (1 / 3)) * 2, 12, 72))
    count, edges = np.histogram(angle, bins=bins, range=(0, np.pi))
    density = count / (len(x) * 2 * np.diff(edges))  # over the whole circle, both ends of every axis
    for side in (0.0, np.pi):
        axes.bar(edges[:-1] + side, np.sqrt(density), width=np.diff(edges), align="edge", color=PALE, ec="white",
                 label=f"{len(x)} axes" if not side else None)  # fmt: skip
    turn = np.linspace(0, 2 * np.pi, 721)
    axes.plot(
        turn, np.sqrt(distribution.pdf(np.stack([np.cos(turn), np.sin(turn)], axis=1))), color=PLANE, label="fitted"
    )
    mode = np.arctan2(distribution.mode[1], distribution.mode[0])
    top = axes.get_ylim()[1]
    axes.plot([mode, mode + np.pi], [top, top], color=MODE, lw=1.5, label="mode")
    axes.set(yticklabels=[])
    axes.set_title(f"angle from {names[0] if names else 'the first component'}; areas ∝ counts", fontsize=9)
    figure.legend(loc="outside lower center", ncols=3, fontsize=8, frameon=False)


def _draw_rotations(figure: Any, x: FloatArray, distribution: Bingham, names: tuple[str, ...]) -> None:
    axes = figure.subplots()
    draw_sphere(axes)
    fitted = distribution.rvs(3000, rng=np.random.default_rng(0))
    draw_axes_cloud(axes, fitted, size=2.0, alpha=0.12)
    draw_axes_cloud(axes, x[np.linspace(0, len(x) - 1, min(len(x), 1000)).astype(int)], size=9.0, alpha=0.7)
    for tip, colour, name in zip(np.eye(3), AXIS_COLOURS, "xyz", strict=True):
        right, up, _ = project(rotate(distribution.mode, tip))
        axes.plot([0, right], [0, up], color=colour, lw=1.6, label=f"body {name}")
    axes.set_title(
        f"where {len(x)} rotations carry the body's axes;\nlines: mode, fine dots: fitted distribution", fontsize=9
    )
    figure.legend(loc="outside lower center", ncols=3, fontsize=8, frameon=False)
