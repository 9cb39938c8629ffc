"""Profiles of the log-evidence over noise densities."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import fill
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.plot.style import AXIS_COLOURS, INK, new_figure

__all__ = ["plot_profiles"]

FloatArray = NDArray[np.float64]

# Half of the 95 % quantile of χ² with one degree of freedom: the profile's drop at the ends of a 95 % interval.
DROP_95 = 1.92
LOWEST = -10.0


def plot_profiles(
    profiles: Mapping[str, tuple[FloatArray, FloatArray]],
    *,
    units: Mapping[str, str],
    doubts: Mapping[str, str] | None = None,
    title: str = "",
) -> Any:
    """Draw the drop of the log-evidence below its maximum, one panel a density.

    Parameters
    ----------
    profiles : mapping
        Name → (values (n,), log-evidence (n,)); what lies deeper than 10 below the maximum is not shown.
    units : mapping
        Name → unit, for the labels.
    doubts : mapping, optional
        Name → why that density is not to be used (`Tuning.doubts`), written over its panel: a sharp maximum alone does
        not say that the value describes the sensor.
    title : str
        Of the figure.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.ticker import MaxNLocator

    figure = new_figure(3.4 * len(profiles), 3.3 if doubts else 3.0)
    panels = figure.subplots(1, len(profiles), squeeze=False, sharey=True)[0]
    for axes, (name, (values, levels)) in zip(panels, profiles.items(), strict=True):
        drop = levels - levels.max()
        axes.plot(values, drop, marker="o", markersize=4)
        axes.axhline(-DROP_95, linewidth=0.8, linestyle="--", color="0.5", zorder=0)
        shown = values[drop > LOWEST]
        margin = 0.05 * float(np.ptp(shown)) or 0.05 * shown[0]
        axes.set(xlim=(shown.min() - margin, shown.max() + margin), ylim=(LOWEST, 0.5))
        axes.xaxis.set_major_locator(MaxNLocator(4))
        axes.ticklabel_format(axis="x", style="sci", scilimits=(-2, 3))
        axes.set_xlabel(f"{name}\n({units[name]})")
        if doubts and name in doubts:
            axes.set_title(fill("not to be used: " + doubts[name], 34), fontsize=8, color=AXIS_COLOURS[0])
    place = {"transform": panels[-1].get_yaxis_transform(), "va": "top", "ha": "center"}
    panels[-1].text(0.5, -DROP_95 - 0.1, f"95 % above −{DROP_95}", fontsize=8, color=INK, **place)
    panels[0].set_ylabel("log-evidence below its maximum")
    if title:
        figure.suptitle(title)
    return figure
