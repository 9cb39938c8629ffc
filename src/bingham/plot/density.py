"""The density of a Bingham distribution without samples, d = 2, 3 and 4."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bingham.errors import InvalidArgumentError
from bingham.plot.style import INK, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bingham.distributions.bingham import Bingham

__all__ = ["plot_density"]


def plot_density(distribution: Bingham, *, title: str = "") -> Figure:
    """Return a figure of the density f(x) with respect to surface area.

    d = 2: over the angle, and as a curve around the circle. d = 3: on the sphere, seen from the mode and from the side.
    d = 4: rotations; for each body axis the density of where it points, on the sphere (the density of R(q) eᵢ).

    Parameters
    ----------
    distribution : Bingham
        A single distribution, d = 2, 3 or 4.
    title : str
        Above the figure.
    """
    if distribution.shape or distribution.dim not in (2, 3, 4):
        raise InvalidArgumentError("distribution", "a single distribution with d = 2, 3 or 4", repr(distribution))
    draw = {2: _circle, 3: _sphere, 4: _rotations}[distribution.dim]
    figure = draw(distribution)
    if title:
        figure.suptitle(title)
    return figure


def _circle(distribution: Bingham) -> Figure:
    figure = new_figure(9.0, 4.0)
    angle = np.linspace(0.0, 2.0 * np.pi, 1441)
    density = distribution.pdf(np.column_stack([np.cos(angle), np.sin(angle)]))
    line = figure.add_subplot(1, 2, 1)
    line.plot(np.degrees(angle), density, color=INK)
    line.set(xlabel="angle [°]", ylabel="density", xlim=(0, 360), ylim=(0, None), xticks=range(0, 361, 90))
    round_: Any = figure.add_subplot(1, 2, 2, projection="3d")
    round_.plot(np.cos(angle), np.sin(angle), 0.0 * angle, color="#BBBBBB")
    round_.plot(np.cos(angle), np.sin(angle), density, color=INK)
    round_.set(xlabel="x₁", ylabel="x₂", zlabel="density")
    return figure


def _grid() -> tuple[Any, Any, Any]:
    colatitude, longitude = np.meshgrid(np.linspace(0.0, np.pi, 91), np.linspace(0.0, 2.0 * np.pi, 181), indexing="ij")
    return np.sin(colatitude) * np.cos(longitude), np.sin(colatitude) * np.sin(longitude), np.cos(colatitude)


def _draw_sphere(figure: Figure, place: Any, values: Any, axis: Any, label: str, top: float) -> None:
    from matplotlib import colormaps

    x, y, z = _grid()
    panel: Any = figure.add_subplot(*place, projection="3d")
    colours = colormaps["viridis"](values / top)
    panel.plot_surface(x, y, z, facecolors=colours, rcount=90, ccount=180, shade=False, antialiased=False)
    elevation, azimuth = np.degrees(np.arcsin(np.clip(axis[2], -1.0, 1.0))), np.degrees(np.arctan2(axis[1], axis[0]))
    panel.view_init(elev=float(elevation), azim=float(azimuth))
    panel.set(xlabel="x", ylabel="y", zlabel="z", box_aspect=(1, 1, 1), title=label)
    panel.set(xticks=(-1, 0, 1), yticks=(-1, 0, 1), zticks=(-1, 0, 1))


def _scale(figure: Figure, top: float, label: str) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    figure.colorbar(ScalarMappable(Normalize(0.0, top), "viridis"), ax=figure.axes, shrink=0.6, label=label)


def _sphere(distribution: Bingham) -> Figure:
    figure = new_figure(9.5, 4.2)
    density = distribution.pdf(np.stack(_grid(), axis=-1))
    top, mode = float(density.max()), np.array(distribution.mode)
    _draw_sphere(figure, (1, 2, 1), density, mode, "from the mode", top)
    side = (mode + distribution.M[:, 0]) / np.sqrt(2.0)
    _draw_sphere(figure, (1, 2, 2), density, side, "between the mode and the narrowest axis", top)
    _scale(figure, top, "density")
    return figure


def _rotations(distribution: Bingham) -> Figure:
    from bingham.rotations import rotate

    figure = new_figure(13.0, 4.2)
    directions = np.stack(_grid(), axis=-1)
    spread = [_pointing(distribution, axis, directions) for axis in np.eye(3)]
    top = max(float(values.max()) for values in spread)
    for i, (values, axis) in enumerate(zip(spread, np.eye(3), strict=True)):
        towards = rotate(np.array(distribution.mode), axis)
        view = towards + 0.6 * np.roll(towards, 1)
        view /= np.linalg.norm(view)
        _draw_sphere(figure, (1, 3, i + 1), values, view, f"body axis {'xyz'[i]}", top)
    _scale(figure, top, "density of where the axis points")
    return figure


def _pointing(distribution: Bingham, axis: Any, directions: Any) -> Any:
    """Return the density of R(q) axis at directions (..., 3): the integral over q = turns about it, in closed form.

    All q with R(q) axis = v are cos(t) a + sin(t) b for two orthonormal quaternions a, b; the density of v is
    (1/(4π)) · (area of S³ / π) times the mean over t of f, an average exp(m) I₀(r) of a 2-D Bingham density.
    """
    from scipy.special import ive

    from bingham.rotations import compose

    v = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    # A rotation from axis to v, and that after half a turn about the axis.
    half = np.concatenate([1.0 + v @ axis[:, None], np.cross(axis, v)], axis=-1)
    flat = np.linalg.norm(half, axis=-1) < 1e-9
    half[flat] = np.append(0.0, np.roll(axis, 1))
    a = half / np.linalg.norm(half, axis=-1, keepdims=True)
    b = compose(a, np.append(0.0, axis))
    A = distribution.matrix
    aa, bb, ab = (np.einsum("...i,ij,...j->...", p, A, q) for p, q in ((a, a), (b, b), (a, b)))
    middle, radius = 0.5 * (aa + bb), np.hypot(0.5 * (aa - bb), ab)
    mean = np.exp(middle + radius - distribution.log_normalizer) * ive(0.0, radius)
    return mean * 2.0 * np.pi**2 / (4.0 * np.pi)
