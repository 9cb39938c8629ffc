"""Tables of text with named columns: what their columns mean is in `bingham.io.columns` and `bingham.io.presets`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.atomic import replaced
from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io.assemble import inertial_recording, orientation_recording
from bingham.io.columns import COLUMNS
from bingham.io.registry import Format
from bingham.io.samples import Samples, read_samples
from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["read_csv", "write_csv"]


def read_csv(
    path: str | Path,
    *,
    columns: Mapping[str, str] | Sequence[str] | None = None,
    units: Mapping[str, str] | None = None,
    rate: float | None = None,
    angles: str | None = None,
    regularise: bool = False,
    earth_frame: str | None = None,
) -> ImuRecording | OrientationRecording:
    """Read a recording from a table of text.

    Separators (comma, semicolon, tab, white space), preambles, comments (``#``, ``//``), a row of units, decimal commas
    and the tables of known loggers (`bingham.io.presets`) are recognised.

    Parameters
    ----------
    path : str or Path
        File.
    columns : mapping of str to str, or sequence of str, optional
        From a name of the table in `bingham.io.columns` to the file's own, as in ``{"gx": "Gyro X"}``; or, of a file
        without names, those of all its columns in order, "-" for one to leave out. It wins over what the file says.
    units : mapping of str to str, optional
        Units of quantities, as in ``{"gyroscope": "deg_s"}``; ``{"time": "100us"}`` and ``{"accelerometer":
        "1/4096g"}`` are steps of counters. They win over what the file says.
    rate : float, optional
        Sampling rate, Hz, of a file without times. A column that is named as ``t`` then counts samples.
    angles : str, optional
        Kind of the angles that hold the orientation, as "roll-pitch-yaw" or "euler-ZXZ", see `bingham.io.angles`; known
        by their names without it, where there is no gyroscope.
    regularise : bool
        Put times on a straight line between pauses: for samples taken regularly and stamped on arrival.
    earth_frame : str, optional
        World axes of the reference; ENU, or what the logger uses.

    Returns
    -------
    ImuRecording or OrientationRecording
        The former if there are gyroscope columns.

    Warns
    -----
    RepairWarning
        If time stamps were put right, or rows of zeros left out, with their number.
    RecordingWarning
        If columns were left out because their names are unknown, quaternions normalised, or units are doubtful.

    Raises
    ------
    RecordingError
        If a column or value is missing or malformed, naming line and column; if the samples are raw counts.
    """
    samples = read_samples(path, columns=columns, units=units, rate=rate, angles=angles)
    return recording_of(samples, regularise=regularise, earth_frame=earth_frame)


def recording_of(
    samples: Samples, *, regularise: bool = False, earth_frame: str | None = None, name: str | None = None
) -> ImuRecording | OrientationRecording:
    """Make a recording of what a table holds."""
    path, place, rows = samples.path, samples.place, samples.rows
    about: dict[str, Any] = {} if name is None else {"name": name}
    if "gyroscope" in samples.streams:
        frame = earth_frame or samples.earth_frame or "ENU"
        return inertial_recording(path, place, samples.streams, rows, regularise=regularise, earth_frame=frame, **about)
    if "orientation" not in rows:
        there = " ".join(samples.streams)
        raise RecordingError(path, "", f"{there} without a gyroscope", "give the gyroscope's file, too")
    return orientation_recording(path, place, rows, regularise=regularise, **about)


def write_csv(path: str | Path, recording: ImuRecording | OrientationRecording) -> None:
    """Write a recording as CSV, atomically; `read_csv` gives back the same numbers.

    Parameters
    ----------
    path : str or Path
        File to write or replace.
    recording : ImuRecording or OrientationRecording
        A ``truth`` with a clock of its own has no place in a table and is rejected.
    """
    groups: dict[str, tuple[list[str], NDArray[np.float64] | NDArray[np.bool_] | None]]
    if isinstance(recording, ImuRecording):
        if recording.truth is not None:
            raise InvalidArgumentError("recording", "one clock", "a truth on its own clock", "write an npz file")
        groups = {
            "gyroscope": ([f"{c}_rad_s" for c in COLUMNS["gyroscope"]], recording.gyroscope),
            "accelerometer": ([f"{c}_m_s2" for c in COLUMNS["accelerometer"]], recording.accelerometer),
            "magnetometer": (COLUMNS["magnetometer"], recording.magnetometer),
            "reference": (COLUMNS["truth"], recording.reference),
        }
        frame = f"body to earth ({recording.earth_frame})"
    else:
        planar = recording.dim == 2
        groups = {
            "orientation": (COLUMNS["axis" if planar else "orientation"], recording.orientation),
            "position": ([f"{c}_m" for c in COLUMNS["position"]], recording.position),
            "truth": (COLUMNS["true axis" if planar else "truth"], recording.truth),
        }
        frame = "body to world"
    present = [(names, values) for names, values in groups.values() if values is not None]
    header = ["t_s", *(name for names, _ in present for name in names)]
    rows = np.column_stack([recording.time, *(values for _, values in present)]).tolist()
    text = [",".join("" if value != value else repr(value) for value in row) for row in rows]  # NaN is an empty cell
    if recording.score is not None:
        header.append("score")
        text = [f"{line},{int(score)}" for line, score in zip(text, recording.score, strict=True)]
    with replaced(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"# quaternions: Hamilton, scalar first, {frame}; an empty cell means no sample\n")
        file.write(",".join(header) + "\n")
        file.writelines(line + "\n" for line in text)


FORMAT = Format(
    name="csv",
    title="text with named columns",
    expects="see `Columns of a text file`_; comma, semicolon, tab or white space; preambles, comments (``#``, ``//``), "
    "rows of units, dates and decimal commas; files of `Known loggers`_; files without names by ``columns=``",
    functions=("read_csv", "write_csv"),
    read=read_csv,
    text=lambda head: True,
    last=2,
)
