"""Figures of the precessing body: the tip of its axis, true, measured and filtered (report Figs. 4, 5), and errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bingham.metrics import geodesic_error
from bingham.plot.studies.style import COLORS, LABELS, axes_of, new_figure
from bingham.rotations import rotate
from bingham.studies.study import Arrays, StudyResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]

NAMES = ("truth", "measured", "bingham")


def draw(result: StudyResult) -> dict[str, Figure]:
    """Return the figures ``axis`` and ``error``; with a recording ``recorded_axis`` and ``recorded_error`` too."""
    body = {name: result.curves[f"precession/{name}"] for name in NAMES}
    labels = ("y of the body's x axis", "z of the body's x axis")
    figures = {"axis": _axis({name: _tip(q)[:, 1:] for name, q in body.items()}, labels), "error": _error(body)}
    if "recorded/truth" in result.curves:
        recorded = {name: result.curves[f"recorded/{name}"] for name in NAMES}
        # A recorded motion may lie anywhere: the plane in which the tip moves most.
        centre = _tip(recorded["truth"]).mean(axis=0)
        plane = np.linalg.svd(_tip(recorded["truth"]) - centre, full_matrices=False)[2][:2].T
        labels = ("tip of the x axis: widest way", "narrower way")
        paths = {name: (_tip(q) - centre) @ plane for name, q in recorded.items()}
        figures["recorded_axis"] = _axis(paths, labels)
        figures["recorded_error"] = _error(recorded, result.curves["recorded/time"])
    return figures


def _tip(orientation: np.ndarray) -> np.ndarray:
    return rotate(orientation, [1.0, 0.0, 0.0])


def _axis(paths: Arrays, labels: tuple[str, str]) -> Figure:
    figure, axes = new_figure(9.0, 2.7, 1, 3, sharex=True, sharey=True)
    for ax, name in zip(axes_of(axes), NAMES, strict=True):
        ax.plot(*paths[name].T, ".", ms=1.5, color=COLORS[name])
        ax.set(xlabel=labels[0], aspect="equal")
        ax.set_title(LABELS[name], fontsize=10)
    axes[0].set(ylabel=labels[1])
    return figure


def _running_rms(error: np.ndarray) -> np.ndarray:
    """Return the root mean square of the tenth of n errors (n,) about each, fewer at the ends."""
    half = max(1, error.size // 20)
    total = np.concatenate([[0.0], np.cumsum(error**2)])
    k = np.arange(error.size)
    low, high = np.maximum(k - half, 0), np.minimum(k + half + 1, error.size)
    return np.sqrt((total[high] - total[low]) / (high - low))


def _error(curves: Arrays, time: np.ndarray | None = None) -> Figure:
    figure, ax = new_figure(6.4, 3.0)
    for name in ("measured", "bingham"):
        error = np.degrees(2.0 * geodesic_error(curves[name], curves["truth"]))
        abscissa = np.arange(1, error.size + 1) if time is None else time
        # Errors of single steps are points, which hide none of each other's curves: the root mean square about each.
        ax.plot(abscissa, error, ".", ms=3.0, mew=0.0, alpha=0.4, color=COLORS[name])
        ax.plot(abscissa, _running_rms(error), color=COLORS[name], lw=1.4, label=f"{LABELS[name]}, running RMS")
    ax.set(xlabel="time step" if time is None else "time [s]", ylabel="error [°]", ylim=(0.0, None))
    ax.legend(fontsize=8, frameon=False, ncols=2)
    return figure
