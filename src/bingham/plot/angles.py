"""The angles of a track over time in one pair of axes: what ``track.plot()`` draws."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bingham.errors import InvalidArgumentError
from bingham.plot.style import AXIS_COLOURS, legend_above, new_figure, unbroken

if TYPE_CHECKING:
    from bingham.filters.track import Track

__all__ = ["plot_angles"]


def plot_angles(track: Track[Any], ax: Any = None) -> Any:
    """Draw yaw, pitch and roll of rotations, or the angle of axes in the plane, in degrees.

    Parameters
    ----------
    track : Track
        A single sequence, d = 2 or 4; without times the rows are counted.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure unless given.

    Returns
    -------
    matplotlib.axes.Axes
        Its ``figure`` can be saved.
    """
    d = track.modes.shape[-1]
    if track.modes.ndim != 2 or d not in (2, 4):
        raise InvalidArgumentError("track", "a single sequence of dimension 2 or 4", f"modes {track.modes.shape}")
    if ax is None:
        ax = new_figure(8.0, 3.5).add_subplot()
    t = np.arange(len(track)) if track.time is None else track.time
    if d == 4:
        angles = track.as_euler("ZYX", degrees=True)
        names, colours, jump = ("yaw", "pitch", "roll"), AXIS_COLOURS[::-1], 180.0
    else:
        angles = np.degrees(np.arctan2(track.modes[:, 1], track.modes[:, 0]))[:, None]
        angles = angles - 180.0 * np.floor((angles + 90.0) / 180.0)  # an axis has no sign
        names, colours, jump = ("angle of the axis",), AXIS_COLOURS[2:], 90.0
    for k, name in enumerate(names):
        ax.plot(t, unbroken(angles[:, k], jump), color=colours[k], lw=0.9, label=name)
    if track.rejected.any():
        rejected = t[track.rejected]
        ax.plot(rejected, np.zeros(len(rejected)), "|", color="0.4", ms=8, label="rejected")
    ax.set(xlabel="row" if track.time is None else "time [s]", ylabel="angle [°]")
    legend_above(ax)
    return ax
