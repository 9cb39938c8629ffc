"""CSV with named columns; see `bingham.io.columns` for their names and units."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bingham.atomic import replaced
from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io.checks import build, build_of_units, normalised
from bingham.io.columns import COLUMNS, group, understand
from bingham.io.text import TextTable, numbered_lines
from bingham.recording import (
    LONG_GYROSCOPE_STEP,
    NEVER_SECONDS,
    ImuRecording,
    OrientationRecording,
    RowError,
    as_seconds,
)

__all__ = ["read_csv", "write_csv"]

# What `as_seconds` suspects times to be → the unit to state.
SUSPECTED = {"nano": "ns", "microseconds": "us", "milliseconds": "ms"}


def read_csv(
    path: str | Path,
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    earth_frame: str = "ENU",
) -> ImuRecording | OrientationRecording:
    """Read a recording from CSV (separator comma, semicolon or tab, whichever the header has).

    Parameters
    ----------
    path : str or Path
        File whose first line that is no comment names the columns.
    columns : mapping of str to str, optional
        From a name of the table in `bingham.io.columns` to the file's own, as in ``{"gx": "Gyro X"}``.
    units : mapping of str to str, optional
        Units of quantities whose column names tell none, as in ``{"gyroscope": "deg_s"}``.
    earth_frame : str
        World axes of the reference.

    Returns
    -------
    ImuRecording or OrientationRecording
        The former if there are gyroscope columns.

    Warns
    -----
    RecordingWarning
        If columns were left out because their names are unknown, quaternions normalised, or units are doubtful.

    Raises
    ------
    RecordingError
        If a column or value is missing or malformed, naming line and column.
    """
    lines = [(k, line) for k, line in numbered_lines(path) if not line.lstrip().startswith("#")]
    path = Path(path)
    if not lines:
        raise RecordingError(path, "", "only comments in it", "a line that names the columns is expected")
    first, header = lines[0]
    separator = next((s for s in "\t;" if s in header), ",")
    own = [cell.strip().strip('"') for cell in header.split(separator)]
    found, factors = understand(path, f"line {first}", own, columns or {}, units or {})
    groups = group(path, f"line {first}", found, own)
    table = TextTable.parse(path, own, lines[1:], separator)

    def place(field: str, index: int) -> str:
        return table.place([found[c] for c in groups[field]], index)

    values = {
        field: table.as_numbers([found[c] for c in names]) * [factors[c] for c in names]
        for field, names in groups.items()
    }
    fields: dict[str, NDArray[np.float64] | NDArray[np.bool_]] = dict(values)
    fields["time"] = values["time"][:, 0]
    try:
        as_seconds(fields["time"], longest_step=LONG_GYROSCOPE_STEP if "gyroscope" in values else None)
    except RowError as error:
        question = error.hint.partition("?")[0]
        unit = next((unit for word, unit in SUSPECTED.items() if word in question), "ns")
        hint = f"{question}? State the unit: units={{'time': '{unit}'}}" + ", or 'us'" * ("nano- or" in question)
        refuted = np.abs(fields["time"]) >= NEVER_SECONDS
        index = int(np.argmax(refuted)) if refuted.any() else error.index
        raise RecordingError(path, place("time", index), error.problem, hint) from None
    for field in ("orientation", "truth", "reference"):
        if field in values:
            fields[field] = normalised(path, field, values[field], place)
    if "score" in values:
        score = values["score"][:, 0]
        if (wrong := ~np.isin(score, (0, 1))).any():
            raise RecordingError(path, place("score", int(np.argmax(wrong))), "neither 0 nor 1", "correct the cell")
        fields["score"] = score == 1
    if "gyroscope" in fields:
        return build_of_units(ImuRecording, path, place, {"earth_frame": earth_frame, **fields})
    return build(OrientationRecording, path, place, **fields)


def write_csv(path: str | Path, recording: ImuRecording | OrientationRecording) -> None:
    """Write a recording as CSV, whole or not at all; `read_csv` gives back the same numbers.

    Parameters
    ----------
    path : str or Path
        File to write or replace.
    recording : ImuRecording or OrientationRecording
        A `truth` with a clock of its own has no place in a table and is rejected.
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
