"""A track as a log for the Rerun viewer: the body in 3-D and its uncertainty over time."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bingham.atomic import replaced
from bingham.errors import MissingExtraError
from bingham.validation import as_numbers

__all__ = ["write_rerun"]

COLOURS = [[213, 94, 0], [0, 158, 115], [0, 114, 178]]


def write_rerun(path: str | Path, time: ArrayLike, modes: ArrayLike, covariance: ArrayLike, *, title: str) -> None:
    """Write a ``.rrd`` file: transforms of ``world/body``, standard deviations of heading and inclination in degrees.

    Parameters
    ----------
    path : str or Path
        The file.
    time : (T,) array_like
        Seconds; on the timeline ``time`` they begin at 0.
    modes : (T, 4) array_like
        Orientations (w, x, y, z), body to world; rows of NaN are left out.
    covariance : (T, 3, 3) array_like
        Of the rotation error in world axes, the third one vertical, rad².
    title : str
        Name of the recording.

    Raises
    ------
    MissingExtraError
        If rerun-sdk is not installed.
    """
    try:
        rr: Any = import_module("rerun")
    except ImportError:
        raise MissingExtraError("rerun-sdk", "rerun", "writing a log for Rerun") from None
    t, q, c = as_numbers(time, "time"), as_numbers(modes, "modes"), as_numbers(covariance, "covariance")
    known = np.isfinite(q).all(axis=1)
    t, q, c = t[known] - t[0], q[known], c[known]
    deviations = {
        "heading": np.degrees(np.sqrt(c[:, 2, 2])),
        "inclination": np.degrees(np.sqrt(c[:, 0, 0] + c[:, 1, 1])),
    }
    with replaced(path) as new:
        stream = rr.RecordingStream(title)
        stream.save(str(new))
        stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        stream.log("world/body", rr.Boxes3D(half_sizes=[[0.5, 0.31, 0.09]]), static=True)
        stream.log("world/body/axes", rr.Arrows3D(vectors=np.eye(3), colors=COLOURS), static=True)
        when = rr.TimeColumn("time", duration=t)
        turned = rr.Transform3D.columns(quaternion=q[:, [1, 2, 3, 0]])
        stream.send_columns("world/body", indexes=[when], columns=turned)
        for name, value in deviations.items():
            stream.send_columns(f"deviation_deg/{name}", indexes=[when], columns=rr.Scalars.columns(scalars=value))
        stream.disconnect()
