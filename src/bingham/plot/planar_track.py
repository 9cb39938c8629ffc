"""A track of axes in the plane: angle over time with its credible band, and the error."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.plot.style import (
    AXIS_COLOURS,
    INK,
    OVERLAY,
    PALE,
    draw_band,
    fit_angles,
    legend_above,
    new_figure,
    shade_unscored,
    since_start,
    stride,
    unbroken,
)

__all__ = ["plot_planar_track"]

FloatArray = NDArray[np.float64]

MAX_POINTS = 500  # credible angles are quadratures, one by one


def plot_planar_track(
    time: FloatArray,
    distributions: Bingham,
    *,
    truth: FloatArray | None = None,
    scored: NDArray[np.bool_] | None = None,
    measured: FloatArray | None = None,
    title: str = "",
) -> Any:
    """Draw a track of axes in the plane, angles in (−90°, 90°].

    Parameters
    ----------
    time : (T,) ndarray
        Seconds; drawn since the first one.
    distributions : Bingham
        Of the axes, d = 2, a batch (T,).
    truth : (T, 2) ndarray, optional
        True axes, NaN where unknown.
    scored : (T,) ndarray of bool, optional
        Samples whose errors count; the others are shaded.
    measured : (T, 2) ndarray, optional
        What the filter was given, for comparison.
    title : str
        Heading.

    Returns
    -------
    matplotlib.figure.Figure
        Save it with ``savefig``.
    """
    kept = stride(len(time), MAX_POINTS)
    seconds, label = since_start(time)
    t, distributions = seconds[kept], distributions[kept]
    band = np.degrees(distributions.credible_angle(0.95))
    figure = new_figure(9.0, 4.0 if truth is None else 6.0)
    panels = figure.subplots(1 if truth is None else 2, 1, sharex=True, squeeze=False)[:, 0]
    if measured is not None:
        panels[0].plot(t, _angle(measured[kept]), ".", color=PALE, ms=3, label="measured")
    line = unbroken(_angle(distributions.mode), 90.0)
    panels[0].plot(t, line, color=AXIS_COLOURS[2], lw=1.0, label="estimate")
    draw_band(panels[0], t, line, band, AXIS_COLOURS[2])
    panels[0].fill_between([], [], [], color=AXIS_COLOURS[2], alpha=0.2, lw=0, label="95 % band")
    panels[0].set_ylabel("axis [°]")
    fit_angles(panels[0], 180.0, line, band=np.stack([line - band, line + band], axis=1))
    if truth is not None:
        panels[0].plot(t, unbroken(_angle(truth[kept]), 90.0), color=INK, lw=0.7, ls=":", label="truth")
        off = _wrapped(_angle(distributions.mode) - _angle(truth[kept]))
        # The band lies above the error, whose restless line would hide it.
        panels[1].fill_between(t, -band, band, color=OVERLAY, alpha=0.4, lw=0, zorder=3, label="95 % band")
        panels[1].plot(t, off, color=AXIS_COLOURS[2], lw=0.7, label="error")
        panels[1].set_ylabel("error [°]")
        if scored is not None:
            shade_unscored(panels[1], t, scored[kept])
    for axes in panels:
        legend_above(axes)
    panels[-1].set(xlabel=label, xlim=(t[0], t[-1]))
    figure.suptitle(title, fontsize=11)
    return figure


def _angle(x: FloatArray) -> FloatArray:
    return _wrapped(np.degrees(np.arctan2(x[:, 1], x[:, 0])))


def _wrapped(angle_deg: FloatArray) -> FloatArray:
    """Return the angle of the same axis in [−90°, 90°)."""
    return (angle_deg + 90.0) % 180.0 - 90.0
