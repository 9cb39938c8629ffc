"""Planes found in a depth image or a point cloud, each in its colour."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bingham.plot.style import PALE, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bingham.surfaces.extraction import PlaneSegments

__all__ = ["plot_planes"]

DRAWN = 20_000


def plot_planes(points: Any, found: PlaneSegments) -> Figure:
    """Return the image with its planes coloured beside its depth; a loose cloud is drawn in space."""
    from matplotlib import colormaps
    from matplotlib.patheffects import withStroke
    from matplotlib.ticker import MaxNLocator

    colours = np.array([colormaps["tab20"](k % 20)[:3] for k in range(max(len(found.planes), 1))])
    p = np.asarray(points, dtype=np.float64)
    if p.ndim == 2:
        figure = new_figure(7.0, 6.0)
        axes: Any = figure.add_subplot(projection="3d")
        rows = np.linspace(0, len(p) - 1, min(len(p), DRAWN)).astype(int)
        for k in range(-1, len(found.planes)):
            some = p[rows[found.label[rows] == k]].T
            axes.scatter(*some, s=2, color=PALE if k < 0 else colours[k], label=None if k < 0 else f"{k}")
        axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]", aspect="equal")
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            axis.set_major_locator(MaxNLocator(4))
        axes.legend(markerscale=4, frameon=False, loc="upper left")
        return figure
    figure = new_figure(11.0, 4.4)
    left, right = figure.subplots(1, 2)
    shown = left.imshow(p[..., 2], cmap="viridis")
    figure.colorbar(shown, ax=left, shrink=0.8, label="depth [m]")
    picture = np.where(found.label[..., None] >= 0, colours[np.maximum(found.label, 0)], 1.0)
    right.imshow(picture)
    for k, plane in enumerate(found.planes):
        # The label stands on a point of the plane: that nearest to the middle of its points.
        at = np.argwhere(found.label == k)
        v, u = at[np.argmin(np.sum((at - at.mean(axis=0)) ** 2, axis=1))]
        text = f"{k}\n{abs(plane.distance):.2f} m"
        halo = [withStroke(linewidth=2.0, foreground="white")]
        right.text(u, v, text, fontsize=7, ha="center", va="center", path_effects=halo)
    for axes in (left, right):
        axes.set(xticks=[], yticks=[])
    return figure
