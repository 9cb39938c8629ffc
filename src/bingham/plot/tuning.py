"""Profiles of the log-evidence over noise densities."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.plot.style import new_figure

__all__ = ["plot_profiles"]

FloatArray = NDArray[np.float64]

# Half of the 95 % quantile of χ² with one degree of freedom: the profile's drop at the ends of a 95 % interval.
DROP_95 = 1.92


def plot_profiles(
    profiles: Mapping[str, tuple[FloatArray, FloatArray]], *, units: Mapping[str, str], title: str = ""
) -> Any:
    """Draw the drop of the log-evidence below its maximum, one panel a density.

    Parameters
    ----------
    profiles : mapping
        Name → (values (n,), log-evidence (n,)).
    units : mapping
        Name → unit, for the labels.
    title : str
        Of the figure.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(3.4 * len(profiles), 3.0)
    panels = figure.subplots(1, len(profiles), squeeze=False)[0]
    for axes, (name, (values, levels)) in zip(panels, profiles.items(), strict=True):
        axes.plot(values, levels - levels.max(), marker="o")
        axes.axhline(-DROP_95, linewidth=0.8, linestyle="--", color="0.5")
        axes.set_xscale("log")
        axes.set_yscale("symlog", linthresh=5.0)
        axes.set_xlabel(f"{name} ({units[name]})")
    panels[0].set_ylabel("log-evidence below its maximum")
    if title:
        figure.suptitle(title)
    return figure
