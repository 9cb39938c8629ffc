"""TUM trajectories: ``time tx ty tz qx qy qz qw``, seconds and metres, scalar last, ``#`` starts a comment.

Format: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from bingham.atomic import replaced
from bingham.errors import RecordingError
from bingham.io.assemble import orientation_recording
from bingham.io.checks import normalised
from bingham.io.layout import COMMENTS, NUMBER, Layout
from bingham.io.registry import Format
from bingham.io.table import read_table
from bingham.io.text import opened_text
from bingham.recording import OrientationRecording

__all__ = ["read_tum", "write_tum"]

COLUMNS = ["time", "tx", "ty", "tz", "qx", "qy", "qz", "qw"]
AT = {"time": [0], "position": [1, 2, 3], "orientation": [7, 4, 5, 6]}  # scalar last in the file


def read_tum(path: str | Path, *, regularise: bool = False) -> OrientationRecording:
    """Read a trajectory.

    Parameters
    ----------
    path : str or Path
        Text file of eight columns.
    regularise : bool
        Put times on a straight line between pauses: for samples taken regularly and stamped on arrival.

    Returns
    -------
    OrientationRecording
        With `position`; quaternions scalar first.

    Warns
    -----
    RecordingWarning
        If quaternions were normalised whose rounding is more than a tenth of their scatter in time (`checks.jitter`).

    Raises
    ------
    RecordingError
        If the file is not such a trajectory, naming the line.
    """
    text = opened_text(path)
    first = next((k for k, line in text.head if not line.lstrip().startswith(COMMENTS)), 0)
    if not first:
        raise RecordingError(text.path, "", "no rows of numbers", "record or copy it again")
    layout = Layout(None, ".", COLUMNS, [], 0, first, len(COLUMNS))
    table = read_table(text, layout, range(len(COLUMNS)))

    def place(field: str, index: int) -> str:
        return table.place(AT[field], index)

    rows = {
        "time": table.columns[0],
        "position": table.matrix(AT["position"], [1.0] * 3),
        "orientation": normalised(text.path, "orientation", table.matrix(AT["orientation"], [1.0] * 4), place),
    }
    return orientation_recording(text.path, place, rows, regularise=regularise)


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


def _is_tum(head: list[str]) -> bool:
    body = next((line for line in head if not line.lstrip().startswith(COMMENTS)), "")
    cells = body.split()
    return len(cells) == 8 and all(NUMBER.fullmatch(cell) and "," not in cell for cell in cells)


FORMAT = Format(
    name="tum",
    title="TUM",
    expects="``t x y z qx qy qz qw``, seconds, scalar *last*",
    functions=("read_tum", "write_tum"),
    read=read_tum,
    text=_is_tum,
    last=1,
)
