"""Figures of the 2014 study: error of each run (Fig. 4), mean error over time (Fig. 5), and calibration."""

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
    """Return the figures ``rmse``, ``time`` and ``calibration``."""
    return {"rmse": _runs(result), "time": _course(result), "calibration": _calibration(result)}


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


def _calibration(result: StudyResult) -> Figure:
    figure, axes = new_figure(9.0, 3.0, 1, 4, sharey=True)
    edges = np.linspace(0.0, 1.0, 21)
    for ax, case in zip(axes_of(axes), CASES, strict=True):
        for name in FILTERS:
            heights, _ = np.histogram(result.curves[f"{case}/pit/{name}"], edges, density=True)
            ax.stairs(heights, edges, color=COLORS[name], label=LABELS[name], lw=1.6)
        ax.axhline(1.0, color="black", ls="--", lw=0.8, label="right: uniform")
        ax.set(title=f"{case} noise", xlim=(0.0, 1.0), xticks=[0.0, 0.5, 1.0], yscale="log", ylim=(0.1, 20.0))
        ax.title.set_fontsize(10)
        ax.yaxis.set_major_formatter("{x:g}")
    axes[0].set(ylabel="density")
    figure.supxlabel("reported probability of a smaller error than the true one", fontsize=10)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, fontsize=8, frameon=False)
    return figure
