"""OpenSim storage files (``.sto``) of orientations: a quaternion of each sensor in a cell, scalar first.

Source: OpenSim documentation, "OpenSense: Kinematics with IMU Data": header lines up to ``endheader``, then a line of
names and tab-separated rows ``time  w,x,y,z …``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from bingham.errors import InvalidArgumentError, RecordingError, Setting
from bingham.io.assemble import orientation_recording
from bingham.io.checks import normalised
from bingham.io.layout import NUMBER, Layout
from bingham.io.registry import Format
from bingham.io.table import read_table
from bingham.io.text import opened_text
from bingham.recording import OrientationRecording

__all__ = ["FORMAT", "read_opensim"]


def read_opensim(
    path: str | Path, *, columns: Mapping[str, str] | None = None, regularise: bool = False
) -> OrientationRecording:
    """Read the orientation of one sensor.

    Parameters
    ----------
    path : str or Path
        ``.sto`` file of quaternions.
    columns : mapping of str to str, optional
        ``{"orientation": "torso_imu"}``: which sensor; needed only if there are several.
    regularise : bool
        Put times on a straight line between pauses.

    Raises
    ------
    RecordingError
        If the file holds no quaternions, or several sensors and none is chosen.
    """
    text = opened_text(path)
    end = next((k for k, (_, line) in enumerate(text.head) if line.strip().lower() == "endheader"), None)
    if end is None or len(text.head) < end + 3:
        raise RecordingError(text.path, "", "no endheader, names and rows of a storage file", "export it again")
    number, line = text.head[end + 1]
    names = line.strip().split("\t")
    sensors = [name for name in names[1:] if name]
    asked = dict(columns or {})
    chosen = asked.pop("orientation", None)
    if asked or (chosen is not None and chosen not in sensors):
        got = chosen if not asked else next(iter(asked))
        raise InvalidArgumentError("columns", f"orientation, and one of {' '.join(sensors)}", got)
    if chosen is None and len(sensors) != 1:
        hint = ("choose one by ", Setting("columns", {"orientation": "NAME"}))
        raise RecordingError(text.path, f"line {number}", f"several sensors: {' '.join(sensors)}", hint)
    column = names.index(chosen or sensors[0])
    layout = Layout("\t", ".", names, [], number, text.head[end + 2][0], len(names))
    table = read_table(text, layout, [0], words=[column])

    def place(field: str, index: int) -> str:
        return table.place([0 if field == "time" else column], index)

    cells = [cell.split(",") for cell in table.columns[column]]
    for k, cell in enumerate(cells):
        if len(cell) != 4 or not all(NUMBER.fullmatch(c.strip()) for c in cell):
            problem = f"{','.join(cell)[:40]!r} is no quaternion"
            raise RecordingError(text.path, place("orientation", k), problem, "w,x,y,z is expected")
    quaternions = np.array([[float(c) for c in cell] for cell in cells])
    rows = {"time": table.columns[0], "orientation": normalised(text.path, "orientation", quaternions, place)}
    return orientation_recording(text.path, place, rows, regularise=regularise)


FORMAT = Format(
    name="opensim",
    title="OpenSim .sto",
    expects="orientations of sensors as OpenSense reads them; one of several by ``columns={'orientation': …}``",
    functions=("read_opensim",),
    read=read_opensim,
    text=lambda head: any(line.strip().lower() == "endheader" for line in head[:50]),
)
