"""Figures of the 2013 study: an example run (Fig. 6), errors run by run (Figs. 7, 8), divergence (Fig. 3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bingham.plot.studies.style import COLORS, LABELS, new_figure
from bingham.studies.study import StudyResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]


def draw(result: StudyResult) -> dict[str, Figure]:
    """Return the figures ``run``, ``rmse`` and ``divergence``."""
    return {"run": _example(result), "rmse": _scatter(result), "divergence": _divergence(result)}


def _example(result: StudyResult) -> Figure:
    curves = result.curves
    figure, axes = new_figure(7.0, 4.6, 2, 1, sharex=True, sharey=True)

    def angle(name: str) -> np.ndarray:
        x = curves[f"example/{name}"]
        return np.degrees(np.mod(np.arctan2(x[:, 1], x[:, 0]) + 0.5 * np.pi, np.pi)) - 90.0

    steps = np.arange(1, len(curves["example/truth"]) + 1)
    for ax, name in zip(axes, ("bingham", "scalar_kalman"), strict=True):
        middle, band = angle(name), np.degrees(curves[f"example/{name}_band"])
        for turn in (-180.0, 0.0, 180.0):
            ax.fill_between(
                steps, middle - band + turn, middle + band + turn, step="mid", color=COLORS[name], alpha=0.18, lw=0
            )
        ax.plot(steps, angle("measured"), ".", ms=3, color=COLORS["measured"], label="measurement")
        ax.plot(steps, middle, ".", ms=5, color=COLORS[name], label=f"{LABELS[name]}, 95 %")
        ax.plot(steps, angle("truth"), ".", ms=2.5, color=COLORS["truth"], label="truth")
        ax.set(ylabel="axis angle [°]", ylim=(-90, 90), yticks=[-90, -45, 0, 45, 90], xlim=(0, len(steps) + 1))
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=8, ncols=3, frameon=False)
    axes[1].set(xlabel="time step")
    return figure


def _scatter(result: StudyResult) -> Figure:
    figure, axes = new_figure(7.4, 3.9, 1, 2)
    x = result.curves["rmse/bingham"]
    for ax, other in zip(axes, ("scalar_kalman", "wrapped_normal"), strict=True):
        y = result.curves[f"rmse/{other}"]
        top = 1.05 * max(x.max(), y.max())
        ax.plot([0, top], [0, top], color="black", lw=0.8)
        ax.plot(y, x, ".", ms=4, color=COLORS[other], alpha=0.6)
        ax.set(xlabel=f"RMSE of {LABELS[other]} [rad]", xlim=(0, top), ylim=(0, top), aspect="equal")
        ax.locator_params(nbins=5)
        ax.set(title=f"Bingham better in {100 * np.mean(x < y):.1f} % of {x.size} runs")
        ax.title.set_fontsize(9)
    axes[0].set(ylabel="RMSE of Bingham filter [rad]")
    return figure


def _divergence(result: StudyResult) -> Figure:
    figure, ax = new_figure(5.0, 3.2)
    ax.loglog(-result.curves["divergence/z1"], result.curves["divergence/kl"], color=COLORS["bingham"])
    ax.set(xlabel="concentration $-z_1$", ylabel="KL(Bingham ‖ Gaussian) [nat]")
    return figure
