"""TUM trajectories: ``time tx ty tz qx qy qz qw``, seconds and metres, scalar last, ``#`` starts a comment.

Format: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from bingham.atomic import replaced
from bingham.io.checks import build, normalised
from bingham.io.text import TextTable, numbered_lines
from bingham.recording import OrientationRecording

__all__ = ["read_tum", "write_tum"]

COLUMNS = ["time", "tx", "ty", "tz", "qx", "qy", "qz", "qw"]
WXYZ = ["qw", "qx", "qy", "qz"]


def read_tum(path: str | Path) -> OrientationRecording:
    """Read a trajectory.

    Parameters
    ----------
    path : str or Path
        Text file of eight columns.

    Returns
    -------
    OrientationRecording
        With `position`; quaternions scalar first.

    Warns
    -----
    RecordingWarning
        If rounded quaternions were normalised (norm off by 1e-6 to 1e-3), naming the largest deviation.

    Raises
    ------
    RecordingError
        If the file is not such a trajectory, naming the line.
    """
    body = [(k, line) for k, line in numbered_lines(path) if not line.lstrip().startswith("#")]
    table = TextTable.parse(path, COLUMNS, body, None)
    columns = {"time": ["time"], "position": COLUMNS[1:4], "orientation": WXYZ}

    def place(field: str, index: int) -> str:
        return table.place(columns[field], index)

    orientation = normalised(table.path, "orientation", table.as_numbers(WXYZ), place)
    position = table.as_numbers(columns["position"])
    time = table.as_numbers(["time"])[:, 0]
    return build(OrientationRecording, table.path, place, time=time, orientation=orientation, position=position)


def write_tum(path: str | Path, *, time: ArrayLike, orientation: ArrayLike, position: ArrayLike | None = None) -> None:
    """Write a trajectory, whole or not at all.

    Parameters
    ----------
    path : str or Path
        File to write or replace.
    time : array_like, shape (N,)
        Seconds, strictly increasing.
    orientation : array_like, shape (N, 4)
        Unit quaternions (w, x, y, z); the file has them scalar last.
    position : array_like, shape (N, 3), optional
        Metres; zeros without it, because the format has no other way to leave it out.
    """
    recording = OrientationRecording("trajectory", time, orientation, position)  # type: ignore[arg-type]
    xyz = np.zeros((recording.size, 3)) if recording.position is None else recording.position
    wxyz = recording.orientation
    rows = np.column_stack([recording.time, xyz, wxyz[:, 1:], wxyz[:, :1]])
    with replaced(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write("# time_s tx ty tz qx qy qz qw (m; Hamilton, body to world)\n")
        if recording.position is None:
            file.write("# no positions: tx ty tz are zero\n")
        file.writelines(" ".join(map(repr, row)) + "\n" for row in rows.tolist())
