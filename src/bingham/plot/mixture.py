"""A mixture with its data: density and components on S², rotated axes by component on S³, rose of the plane."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.mixture import BinghamMixture
from bingham.errors import InvalidArgumentError
from bingham.plot.axes import draw_density_map, equal_area
from bingham.plot.sphere import draw_sphere, project
from bingham.plot.style import INK, PALE, new_figure
from bingham.rotations import rotate

__all__ = ["COMPONENT_COLOURS", "draw_density_on_sphere", "plot_mixture", "plot_rotation_cloud"]

FloatArray = NDArray[np.float64]

# Okabe & Ito's palette, repeated beyond eight components.
COMPONENT_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7A5195", "#8C564B")
POINTS = 3000
# From north, east, down to east, north, up.
DOWN = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FAR = 0.3  # opacity of a star behind the sphere


def colour(k: int) -> str:
    """Return the colour of component k, grey for the background."""
    return PALE if k < 0 else COMPONENT_COLOURS[k % len(COMPONENT_COLOURS)]


def plot_mixture(x: FloatArray, mixture: BinghamMixture, *, names: Sequence[str] = (), title: str = "") -> Any:
    """Draw samples, coloured by component, and the mixture fitted to them.

    Parameters
    ----------
    x : (n, d) ndarray
        Unit vectors, d = 2, 3 or 4.
    mixture : BinghamMixture
        Their mixture.
    names : sequence of str
        Names of the components of a vector; ``n, e, d`` rotates the projection to geographic directions.
    title : str
        Heading.

    Returns
    -------
    matplotlib.figure.Figure
        Save it with ``savefig``.
    """
    draw = {2: _draw_plane, 3: _draw_axes, 4: _draw_rotations}.get(mixture.dim)
    if draw is None:
        raise InvalidArgumentError("mixture", "dimension 2, 3 or 4, which paper can show", mixture.dim)
    keep = np.linspace(0, len(x) - 1, min(len(x), POINTS)).astype(int)
    figure = new_figure(5.5 if mixture.dim == 2 else 9.5, 5.6 if mixture.dim != 4 else 4.0)
    draw(figure, x[keep], mixture.predict(x[keep]), mixture, tuple(name.lower() for name in names))
    for k in range(mixture.size):
        figure.axes[0].plot([], [], "o", color=colour(k), ms=5, label=f"{k + 1}: {mixture.weights[k]:.1%}")
    if mixture.background > 0.0:
        figure.axes[0].plot([], [], "o", color=PALE, ms=5, label=f"background: {mixture.background:.1%}")
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    figure.suptitle(title, fontsize=11)
    return figure


def draw_density_on_sphere(
    axes: Any, distribution: Bingham | BinghamMixture, size: int = 301, view: FloatArray | None = None
) -> None:
    """Shade the visible half of the sphere by a density on S²; its root, so that faint components show.

    view (3, 3) turns what the distribution is of into what is drawn: x, y, z with z upwards.
    """
    grid = np.linspace(-1.0, 1.0, size)
    right, up = np.meshgrid(grid, grid)
    inside = right**2 + up**2 <= 1.0
    # The screen's axes in space: those whose projections are (1, 0) and (0, 1), and towards the eye.
    frame = np.stack([np.array(project(np.eye(3))[0]), np.array(project(np.eye(3))[1])])
    towards = np.cross(frame[0], frame[1])
    depth = np.sqrt(np.maximum(1.0 - right**2 - up**2, 0.0))
    v = right[..., None] * frame[0] + up[..., None] * frame[1] + depth[..., None] * towards
    density = np.full(right.shape, np.nan)
    rows = v[inside] if view is None else v[inside] @ view
    density[inside] = np.sqrt(distribution.pdf(rows / np.linalg.norm(rows, axis=1, keepdims=True)))
    axes.imshow(density, extent=(-1, 1, -1, 1), origin="lower", cmap="Blues", alpha=0.8, interpolation="bilinear")


def _draw_axes(figure: Any, x: FloatArray, label: Any, mixture: BinghamMixture, names: tuple[str, ...]) -> None:
    left, right = figure.subplots(1, 2)
    # Down is down: of north, east, down the sphere shows east, north, up.
    compass = names == ("n", "e", "d")
    seen = DOWN if compass else np.eye(3)
    draw_density_on_sphere(left, mixture, view=seen)
    letters: Any = ("east", "north", "up") if compass else names if len(names) == 3 else ("x", "y", "z")
    draw_sphere(left, letters)
    both = np.concatenate([x, -x]) @ seen.T
    u, v, front = project(both)
    shades = np.array([colour(int(k)) for k in np.concatenate([label, label])])
    left.scatter(u[front], v[front], s=4, c=shades[front], lw=0, alpha=0.6)
    left.set_title("seen from afar; shade: root of the density", fontsize=9)
    turn, view = draw_density_map(
        right, lambda v: np.sqrt(mixture.pdf(v)), names, mixture.components.mode[int(np.argmax(mixture.weights))]
    )
    right.scatter(*equal_area(x @ turn.T).T, s=4, c=[colour(int(k)) for k in label], lw=0, alpha=0.6)
    stars = equal_area(mixture.components.mode @ turn.T)
    for k, (star, aside) in enumerate(zip(stars, _apart(stars), strict=True)):
        right.plot(*star, "*", color=colour(k), mec=INK, mew=0.6, ms=9)
        halo = {"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.7}
        line = {"arrowstyle": "-", "color": INK, "lw": 0.6, "shrinkA": 0, "shrinkB": 3}
        place = {"textcoords": "offset points", "ha": "center", "va": "center", "bbox": halo, "arrowprops": line}
        right.annotate(str(k + 1), star, xytext=16 * aside, color=INK, **place)
    right.set(aspect="equal", xlim=(-1.2, 1.2), ylim=(-1.2, 1.2))
    right.set_axis_off()
    right.set_title(f"equal area, {view}; stars: modes", fontsize=9)


def _apart(points: FloatArray) -> FloatArray:
    """Return unit directions (k, 2) that lead from each point away from the others, the near ones above all."""
    gap = points[:, None] - points
    square = np.sum(gap**2, axis=-1)
    push = np.sum(gap / np.maximum(square, 1e-12)[..., None], axis=1)
    push[np.linalg.norm(push, axis=1) < 1e-9] = [1.0, 1.0]
    return push / np.linalg.norm(push, axis=1, keepdims=True)


def _draw_rotations(figure: Any, x: FloatArray, label: Any, mixture: BinghamMixture, names: tuple[str, ...]) -> None:
    panels = figure.subplots(1, 3)
    shades = np.array([colour(int(k)) for k in label])
    for axes, tip, name in zip(panels, np.eye(3), "xyz", strict=True):
        draw_sphere(axes)
        u, v, front = project(rotate(x, tip))
        for side, strength in ((~front, 0.12), (front, 0.6)):
            axes.scatter(u[side], v[side], s=4, c=shades[side], lw=0, alpha=strength)
        for k, mode in enumerate(mixture.components.mode):
            a, b, near = project(rotate(mode, tip))
            axes.plot(a, b, "*", color=colour(k), mec=INK, ms=11, alpha=1.0 if near else FAR, zorder=3 if near else 1)
        axes.set_ylim(-1.27, 1.38)
        axes.set_title(f"where the rotations carry the body's {name} axis", fontsize=9)
    panels[1].text(0.0, -1.2, "stars: modes, pale on the far side", ha="center", va="center", fontsize=8, color=INK)


def _draw_plane(figure: Any, x: FloatArray, label: Any, mixture: BinghamMixture, names: tuple[str, ...]) -> None:
    axes = figure.add_subplot(projection="polar")
    angle = np.arctan2(x[:, 1], x[:, 0]) % np.pi
    edges = np.linspace(0.0, np.pi, 37)
    for side in (0.0, np.pi):
        below = np.zeros(36)
        for k in [*range(mixture.size), -1]:
            count = np.histogram(angle[label == k], edges)[0] / (len(x) * 2 * np.diff(edges))
            axes.bar(
                edges[:-1] + side, count, width=np.diff(edges), bottom=below, align="edge", color=colour(k), ec="w"
            )
            below += count
    turn = np.linspace(0, 2 * np.pi, 721)
    axes.plot(turn, mixture.pdf(np.stack([np.cos(turn), np.sin(turn)], axis=1)), color=INK, lw=1.2)
    axes.set(yticklabels=[])
    axes.set_title("angle; line: fitted density", fontsize=9)


def plot_rotation_cloud(
    distributions: Sequence[Bingham], *, point: ArrayLike = (0.6, 0.7, 0.387), count: int = 1000, rng: Any = None
) -> Any:
    """Draw an extended Gaussian image of each distribution: a point of the sphere rotated by `count` samples.

    The point itself is drawn in cyan, what the rotations make of it in black (Madaan et al. 2017, Fig. 9, after
    Riedel et al. 2016).
    """
    generator = np.random.default_rng(rng)
    start = np.asarray(point, dtype=np.float64)
    start = start / np.linalg.norm(start)
    figure = new_figure(3.3 * len(distributions), 3.8)
    panels = np.atleast_1d(figure.subplots(1, len(distributions)))
    for axes, distribution in zip(panels, distributions, strict=True):
        draw_sphere(axes)
        u, v, front = project(rotate(distribution.rvs(count, rng=generator), start))
        for side, strength in ((~front, 0.15), (front, 0.7)):
            axes.scatter(u[side], v[side], s=4, color="black", lw=0, alpha=strength)
        a, b, _ = project(start)
        axes.plot(a, b, "o", color="cyan", mec=INK, ms=8)
        axes.set_title("Λ = (" + ", ".join(f"{z:g}" for z in distribution.z[::-1][1:]) + ")", fontsize=9)
    return figure
