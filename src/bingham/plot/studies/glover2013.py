"""Figures of the synthetic comparison with quaternion EKFs (Table 1) and of the composition errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bingham.plot.studies.style import COLORS, LABELS, new_figure
from bingham.studies.glover2013 import TABLE
from bingham.studies.glover2013_runs import OBSERVED
from bingham.studies.study import StudyResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]


def draw(result: StudyResult) -> dict[str, Figure]:
    """Return the figures ``runs`` (Fig. 2), ``signals``, ``cells`` (Table 1) and ``composition``."""
    return {
        "runs": _runs(result),
        "signals": _signals(result),
        "cells": _cells(result),
        "composition": _composition(result),
    }


def _runs(result: StudyResult) -> Figure:
    figure, axes = new_figure(9.0, 7.0, 5, len(OBSERVED), sharex=True)
    for k, z in enumerate(OBSERVED):
        curves = {name: result.curves[f"run/{k}/{name}"] for name in ("truth", "measured", "modes", "low", "high")}
        step = np.arange(1, len(curves["truth"]) + 1)
        for i, component in enumerate("wxyz"):
            ax = axes[i, k]
            ax.plot(step, curves["measured"][:, i], ".", ms=2, color="0.6", label="measured")
            ax.fill_between(step, curves["low"][:, i], curves["high"][:, i], color=COLORS["bingham"], alpha=0.25, lw=0,
                            label="90 % of the filter's distribution")  # fmt: skip
            ax.plot(step, curves["truth"][:, i], color="black", lw=1.4, label="true")
            ax.plot(step, curves["modes"][:, i], color=COLORS["bingham"], lw=1.0, label="filtered")
            ax.set(ylim=(-1.05, 1.05))
            if k == 0:
                ax.set_ylabel(component)
        error, bound = (np.degrees(result.curves[f"run/{k}/{name}"]) for name in ("error", "bound"))
        axes[4, k].plot(step, error, color="black", lw=1.0)
        axes[4, k].fill_between(step, 0.0, bound, color=COLORS["bingham"], alpha=0.25, lw=0)
        axes[4, k].set(xlabel="step", ylim=(0.0, None))
        axes[0, k].set_title("observation noise " + ", ".join(f"{x:g}" for x in z), fontsize=9)
    axes[4, 0].set_ylabel("error [°]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=8, frameon=False)
    return figure


def _signals(result: StudyResult) -> Figure:
    figure, axes = new_figure(7.4, 3.8, 1, 2, sharey=True)
    x = np.degrees(result.curves["error/bingham"])
    for ax, other in zip(axes, ("ekf_fixed", "ekf_fair"), strict=True):
        y = np.degrees(result.curves[f"error/{other}"])
        ax.loglog(y, x, ".", ms=4, color=COLORS[other], alpha=0.6)
        ends = [0.95 * min(x.min(), y.min()), 1.05 * max(x.max(), y.max())]
        ax.loglog(ends, ends, color="black", lw=0.8)
        ax.set(
            xlabel=f"mean error, {LABELS[other]} [°]", title=f"Bingham better in {np.sum(x < y)} of {x.size} signals"
        )
        ax.title.set_fontsize(9)
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter("{x:g}")
    axes[0].set(ylabel="mean error, Bingham filter [°]")
    return figure


def _cells(result: StudyResult) -> Figure:
    rows = [r for r in result.table if r.metric == "improvement_percent" and r.case.endswith("against ekf_fixed")]
    figure, ax = new_figure(7.4, 4.0)
    place = np.arange(len(rows))
    for against, shift in (("ekf_fixed", -0.2), ("ekf_padded", 0.0), ("ekf_fair", 0.2)):
        cells = [r for r in result.table if r.metric == "improvement_percent" and r.case.endswith(f"against {against}")]
        value, stderr = [r.value for r in cells], [r.stderr or 0.0 for r in cells]
        ax.errorbar(value, place + shift, xerr=stderr, fmt="o", ms=5, color=COLORS[against], label=LABELS[against])
    published, spread = np.array(list(TABLE.values())).T
    ax.errorbar(published, place + 0.35, xerr=spread, fmt="k|", ms=9, mew=2, label="published ±")
    ax.set(yticks=place, xlabel="mean error below that of the EKF [%]")
    ax.set_yticklabels([r.case.removesuffix(", against ekf_fixed") for r in rows], fontsize=8)
    ax.invert_yaxis()
    ax.set_xscale("symlog", linthresh=1.0)
    ax.xaxis.set_major_formatter("{x:g}")
    ax.set_xlim(-0.2, 100.0)
    figure.legend(loc="outside upper center", ncols=4, fontsize=8, frameon=False)
    return figure


def _composition(result: StudyResult) -> Figure:
    rows = [r for r in result.table if r.metric == "kl" and r.case.startswith("composition, process")]
    values = result.curves["composition/kl"]
    figure, ax = new_figure(7.0, 3.6)
    place = np.arange(len(rows))
    for y, kl in zip(place, values, strict=True):
        ax.semilogx(np.maximum(kl, 1e-8), np.full(kl.size, y), ".", ms=3, color=COLORS["bingham"], alpha=0.4)
    ax.semilogx(values.mean(axis=1), place, "o", color="black", ms=5, label="mean of a signal")
    ax.axvline(0.0012, color="black", ls="--", lw=0.8, label="published mean and largest")
    ax.axvline(0.0197, color="black", ls="--", lw=0.8)
    ax.set(yticks=place, xlabel="KL(matched ‖ true) of the composition [nat]", xlim=(1e-6, 0.05))
    ax.set_yticklabels([r.case.removeprefix("composition, ") for r in rows], fontsize=8)
    ax.legend(fontsize=8, frameon=False, loc="upper left")
    return figure
