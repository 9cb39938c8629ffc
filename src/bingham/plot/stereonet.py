"""A sample of axes as a structural geologist prints it: net, contours, best-fit plane, mean and fold axis."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.geology import (
    draw_axes,
    draw_contours,
    draw_ellipse,
    draw_great_circle,
    draw_net,
    fabric,
    to_strike_dip,
    to_trend_plunge,
)
from bingham.plot.style import AXIS_COLOURS, INK, new_figure

__all__ = ["draw_fabric", "plot_fabric"]

FloatArray = NDArray[np.float64]

# Points drawn at most.
MOST = 5000
MEAN, PLANE = AXIS_COLOURS[0], AXIS_COLOURS[2]


def plot_fabric(x: FloatArray, *, title: str = "", projection: Any = "equal-area") -> Any:
    """Draw axes (n, 3) in north, east, down, n > 3, with their fabric, and return a ``matplotlib.figure.Figure``."""
    figure = new_figure(5.5, 6.4)
    draw_fabric(figure.subplots(), x, projection=projection)
    figure.suptitle(title, fontsize=11)
    figure.legend(loc="outside lower center", ncols=2, fontsize=8, frameon=False)
    return figure


def draw_fabric(ax: Any, x: FloatArray, *, projection: Any = "equal-area") -> None:
    """Draw axes (n, 3) with contours, best-fit plane, mean axis and fold axis and their 95 % regions on `ax`.

    Regions that reach all around the net are left out.
    """
    result = fabric(x)
    draw_net(ax, projection=projection)
    draw_contours(ax, x, projection=projection, filled=True, cmap="Greys", alpha=0.55, zorder=0.3)
    shown = x[:: -(-len(x) // MOST)]
    draw_axes(ax, shown, projection=projection, alpha=0.7, label=f"{len(x)} axes; contours every 2σ from 2σ")
    mean, pole = result.eigenvectors[:, 0], result.eigenvectors[:, 2]
    strike, dip = to_strike_dip(pole)
    label = f"best-fit plane {_azimuth(strike)}/{float(dip):02.0f}"
    draw_great_circle(ax, pole, projection=projection, color=PLANE, label=label)
    for axis, region, colour, marker, name in (
        (mean, result.mean_ellipse, MEAN, "*", "mean axis"),
        (pole, result.pole_ellipse, PLANE, "s", "pole of plane"),
    ):
        trend, plunge = to_trend_plunge(axis)
        style = {"marker": marker, "ms": 10 if marker == "*" else 6, "color": colour, "mew": 0.8, "mec": INK}
        draw_axes(ax, axis, projection=projection, label=f"{name} {_azimuth(trend)}/{float(plunge):02.0f}", **style)
        if np.all(region.semi_axes < 0.4999 * np.pi):
            draw_ellipse(ax, region, projection=projection, color=colour, label=f"its {100 * region.level:g} % region")
    s = ", ".join(f"{value:.3f}" for value in result.eigenvalues)
    ax.set_title(
        f"S {s}   K {result.K:.2f}   C {result.C:.2f}   n = {len(x)}\n{projection}, lower hemisphere", fontsize=9
    )


def _azimuth(angle: Any) -> str:
    return f"{round(float(angle)) % 360:03d}"
