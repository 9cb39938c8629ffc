"""Figures of the precessing body: the tip of its axis, true, measured and filtered (report Figs. 4, 5), and errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bingham.metrics import geodesic_error
from bingham.plot.studies.style import COLORS, LABELS, axes_of, new_figure
from bingham.rotations import rotate
from bingham.studies.study import StudyResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]


def draw(result: StudyResult) -> dict[str, Figure]:
    """Return the figures ``axis`` and ``error``."""
    return {"axis": _axis(result), "error": _error(result)}


def _axis(result: StudyResult) -> Figure:
    figure, axes = new_figure(9.0, 2.7, 1, 3, sharex=True, sharey=True)
    for ax, name in zip(axes_of(axes), ("truth", "measured", "bingham"), strict=True):
        tip = rotate(result.curves[name], [1.0, 0.0, 0.0])
        ax.plot(tip[:, 1], tip[:, 2], ".", ms=1.5, color=COLORS[name])
        ax.set(title=LABELS[name], xlabel="y of the body's x axis", aspect="equal")
        ax.title.set_fontsize(10)
    axes[0].set(ylabel="z of the body's x axis")
    return figure


def _error(result: StudyResult) -> Figure:
    figure, ax = new_figure(6.4, 3.0)
    truth = result.curves["truth"]
    for name in ("measured", "bingham"):
        error = np.degrees(2.0 * geodesic_error(result.curves[name], truth))
        ax.plot(np.arange(1, error.size + 1), error, color=COLORS[name], lw=0.8, label=LABELS[name])
    ax.set(xlabel="time step", ylabel="error [°]", ylim=(0.0, None))
    ax.legend(fontsize=8, frameon=False, ncols=2)
    return figure
