"""Angular rate of a turning body over time, with its uncertainty."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bingham.plot.style import AXIS_COLOURS, INK, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bingham.filters.spin import SpinTrack

__all__ = ["plot_spin"]


def plot_spin(track: SpinTrack) -> Figure:
    """Return a figure of the rate's components and of revolutions a second, each with two standard deviations."""
    t = track.time - track.time[0]
    turns = np.linalg.norm(track.rates, axis=1) / (2.0 * np.pi)
    axes_of = track.rates / np.maximum(2.0 * np.pi * turns, 1e-300)[:, None]
    covariance = track.covariances[:, 3:, 3:]
    deviation = np.sqrt(np.einsum("ni,nij,nj->n", axes_of, covariance, axes_of)) / (2.0 * np.pi)
    figure = new_figure(8.0, 5.0)
    axes = figure.subplots(2, 1, sharex=True)
    for i, name in enumerate("xyz"):
        _band(axes[0], t, track.rates[:, i], np.sqrt(covariance[:, i, i]), AXIS_COLOURS[i], name)
    _band(axes[1], t, turns, deviation, INK, None)
    axes[0].set_ylabel("rate, world [rad/s]")
    axes[0].legend(ncols=3, frameon=False, loc="upper right")
    axes[1].set(ylabel="revolutions a second", xlabel="time [s]", xlim=(0.0, float(t[-1])))
    # The first samples know little; what comes after sets the scale.
    settled = turns[min(len(turns) // 5, 20) :]
    low, high = float(settled.min()), float(settled.max())
    margin = max(0.1 * (high - low), 0.05 * max(high, 1e-9))
    axes[1].set_ylim(low - margin, high + margin)
    return figure


def _band(axes: Any, t: Any, value: Any, deviation: Any, color: str, label: str | None) -> None:
    axes.plot(t, value, color=color, lw=1.2, label=label)
    axes.fill_between(t, value - 2.0 * deviation, value + 2.0 * deviation, color=color, alpha=0.2, lw=0)
