"""Figures of the 2014 study: error of each run (Fig. 4) and mean error over time (Fig. 5)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bingham.plot.studies.style import COLORS, LABELS, axes_of, new_figure
from bingham.studies.study import StudyResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]

FILTERS = ("bingham", "axial_kalman")
CASES = ("2-D bingham", "2-D gaussian", "4-D bingham", "4-D gaussian")


def draw(result: StudyResult) -> dict[str, Figure]:
    """Return the figures ``rmse`` and ``time``."""
    return {"rmse": _runs(result), "time": _course(result)}


def _runs(result: StudyResult) -> Figure:
    figure, axes = new_figure(9.0, 3.2, 1, 4)
    for ax, case in zip(axes_of(axes), CASES, strict=True):
        values = [result.curves[f"{case}/rmse/{name}"] for name in FILTERS]
        boxes = ax.boxplot(
            values, widths=0.6, patch_artist=True, medianprops={"color": "black"}, flierprops={"markersize": 3}
        )
        for box, name in zip(boxes["boxes"], FILTERS, strict=True):
            box.set(facecolor=COLORS[name], alpha=0.7)
        ax.set(title=f"{case} noise", ylim=(0.0, None))
        ax.set_xticklabels(["Bingham", "Kalman"])
        ax.title.set_fontsize(10)
    axes[0].set(ylabel="RMSE [rad]")
    return figure


def _course(result: StudyResult) -> Figure:
    figure, axes = new_figure(7.4, 5.0, 2, 2, sharex=True)
    for ax, case in zip(axes_of(axes), CASES, strict=True):
        for name in FILTERS:
            error = result.curves[f"{case}/error/{name}"]
            ax.plot(np.arange(1, error.size + 1), error, color=COLORS[name], label=LABELS[name], lw=1.2)
        ax.set(title=f"{case} noise", ylim=(0.0, None))
        ax.title.set_fontsize(10)
    for ax in axes[1]:
        ax.set(xlabel="time step")
    for ax in axes[:, 0]:
        ax.set(ylabel="mean error [rad]")
    axes[0, 0].legend(fontsize=8, frameon=False)
    return figure
