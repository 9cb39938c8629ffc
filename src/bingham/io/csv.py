"""Tables of text with named columns: what their columns mean is in `bingham.io.columns` and `bingham.io.presets`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.atomic import replaced
from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io.angles import angle_kind
from bingham.io.assemble import Stream, inertial_recording, orientation_recording
from bingham.io.checks import Place, check_seconds, normalised, note
from bingham.io.columns import COLUMNS, SENSORS, check_complete, group
from bingham.io.counts import reject_counts, sensor_of_numbers
from bingham.io.dates import is_date, seconds_of_dates
from bingham.io.layout import Layout, find_layout
from bingham.io.meaning import Meaning, check_rate, meaning_of, named, sensor_of_name
from bingham.io.registry import Format
from bingham.io.table import Table, read_table
from bingham.io.text import TextFile, opened_text
from bingham.io.written import Written, decoded, rotation_angles
from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["read_csv", "read_samples", "write_csv"]

FloatArray = NDArray[np.float64]
# Days since 1900 of spreadsheets, 1954 to 2119; steps of seconds would mean more than 100 kHz.
SPREADSHEET_DAYS, SPREADSHEET_STEP = (20_000.0, 80_000.0), 1e-5


class Samples(NamedTuple):
    """What a table holds: sensors at their times, and what has a row for each of the gyroscope's or of all rows.

    ``place(field, k)`` names row k of a field; ``earth_frame`` is that of the logger.
    """

    path: Path
    place: Place
    streams: dict[str, Stream]
    rows: dict[str, NDArray[Any]]
    earth_frame: str | None


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


def read_samples(
    path: str | Path,
    *,
    columns: Mapping[str, str] | Sequence[str] | None = None,
    units: Mapping[str, str] | None = None,
    rate: float | None = None,
    angles: str | None = None,
    alone: bool = True,
) -> Samples:
    """Read a table; `alone` wants a gyroscope or orientations in it, not one sensor of several files."""
    check_rate(rate)
    kind = None if angles is None else angle_kind(angles)
    text = opened_text(path)
    layout = named(text.path, find_layout(text), columns)
    meaning = meaning_of(text.path, layout, columns if isinstance(columns, Mapping) else {}, units or {})
    place = f"line {layout.header}" if layout.header else "columns"
    groups = group(text.path, place, meaning.found.column, layout.names)
    if meaning.bare and alone:
        groups["gyroscope"] = COLUMNS["gyroscope"]  # or another, which the numbers tell
    written = None
    if not groups.keys() & {"gyroscope", "orientation"} and not meaning.bare:
        written = rotation_angles(layout.names, kind)
    if kind is not None and written is None:
        problem = f"no columns of {' '.join(kind.columns)} in place of a gyroscope or quaternion"
        raise RecordingError(text.path, place, problem, f"the file has: {', '.join(layout.names)}")
    timed = rate is not None or meaning.counter is not None
    known = groups | ({"time": ["t"]} if timed else {}) | ({"orientation": []} if written else {})
    if meaning.bare:
        known["gyroscope"] = []  # or another sensor
    check_complete(text.path, place, known, layout.names, alone=alone)
    return _read(text, layout, meaning, groups, rate, written)


def _read(
    text: TextFile,
    layout: Layout,
    meaning: Meaning,
    groups: dict[str, list[str]],
    rate: float | None,
    written: Written | None,
) -> Samples:
    found = meaning.found
    if meaning.bare:
        groups.pop("gyroscope", None)
    clock = found.column.get("t")
    counter = meaning.counter if rate is None or clock is None else clock
    dated = clock is not None and counter != clock and _is_dated(text, layout, clock)
    numbers = [found.column[name] for field, names in groups.items() if field != "time" for name in names]
    numbers += meaning.bare
    if written is not None:
        numbers += [k for k in written.columns if k not in numbers]
    timing = [k for k in (clock, counter) if k is not None]
    if rate is not None and counter is None:
        timing = []
    words = [k for k in timing if dated and k == clock]
    if meaning.label is not None:
        words.append(meaning.label)
    table = read_table(text, layout, [*numbers, *(k for k in timing if k not in words)], words=words)

    def place(field: str, index: int) -> str:
        names = groups.get(field, [])
        at = [found.column[name] for name in names] if names and field != "time" else timing[:1]
        if field == "orientation" and written is not None:
            at = list(written.columns)
        return table.place(at or meaning.bare or [0], index)

    values = {
        field: table.matrix([found.column[c] for c in names], [found.factor[c] for c in names])
        for field, names in groups.items()
        if field != "time"
    }
    if meaning.bare:
        for kind, samples in _of_bare(text.path, table, meaning).items():
            values[kind] = samples * meaning.asked.get(kind, 1.0)
            groups[kind] = ["x", "y", "z"]
        found.column.update(zip(("x", "y", "z"), meaning.bare, strict=True))
    reject_counts(text.path, values, found)
    if written is not None:
        values["orientation"] = decoded(table, written)
    time = _times(text, table, meaning, rate, place, "gyroscope" in values, counter, dated)
    return _samples(text.path, place, time, values, meaning)


def _of_bare(path: Path, table: Table, meaning: Meaning) -> dict[str, FloatArray]:
    """Return the sensors that columns x, y, z are of: by a word in each row, NaN in those of others, or by numbers."""
    rows = table.matrix(meaning.bare, [1.0] * 3)
    if meaning.label is None:
        named_units = [sensor for sensor in SENSORS if sensor in meaning.asked]
        if len(named_units) == 1:
            return {named_units[0]: rows}
        return {sensor_of_numbers(path, rows, table.layout, meaning.bare): rows}
    words = np.array(table.columns[meaning.label])
    found: dict[str, FloatArray] = {}
    for word in np.unique(words)[:100].tolist():
        sensor = sensor_of_name(Path(f"{word}.csv")) if word else None
        if sensor is not None and sensor in found:
            where = f"column {table.layout.names[meaning.label]}"
            raise RecordingError(path, where, f"several words for the {sensor}", "leave one sensor's rows out")
        if sensor is not None:
            found[sensor] = np.where((words == word)[:, None], rows, np.nan)
    if "gyroscope" not in found:
        there = ", ".join(np.unique(words)[:8].tolist())
        raise RecordingError(
            path, f"column {table.layout.names[meaning.label]}", f"no gyroscope among {there}", "name it so"
        )
    return found


def _samples(path: Path, place: Place, time: FloatArray, values: dict[str, FloatArray], meaning: Meaning) -> Samples:
    """Split rows into the streams of sensors, and check what is not measured."""
    index: dict[str, NDArray[np.intp]] = {}
    streams: dict[str, Stream] = {}
    sensors = {name: values.pop(name) for name in SENSORS if name in values}
    there = {name: _present(v) for name, v in sensors.items()}
    base = there.get("gyroscope")
    rows: dict[str, NDArray[Any]] = dict(values)
    for field in ("orientation", "truth", "reference"):
        if field in rows:
            rows[field] = normalised(path, field, rows[field], place)
    if "score" in rows:
        score = rows["score"][:, 0]
        if (wrong := ~np.isin(score, (0, 1))).any():
            raise RecordingError(path, place("score", int(np.argmax(wrong))), "neither 0 nor 1", "correct the cell")
        rows["score"] = score == 1
    if base is None and not sensors:
        return Samples(path, place, {}, {"time": time, **rows}, meaning.preset and meaning.preset.earth_frame)
    interleaved = base is not None and any((mask & ~base).any() for mask in there.values())
    if base is not None and not base.all() and not interleaved and not base.any():
        raise RecordingError(path, place("gyroscope", 0), "no row holds the gyroscope", "name other columns")
    whole = base is None or (base.all() or not interleaved)
    common = time if whole else time[base]
    for name, samples in sensors.items():
        if whole and base is not None:
            streams[name] = Stream(time, samples)
        elif base is not None and not (there[name] & ~base).any():
            streams[name] = Stream(common, samples[base])
            index[name] = np.flatnonzero(base)
        else:
            at = np.flatnonzero(there[name])
            streams[name] = Stream(common if name == "gyroscope" else time[at], samples[at])
            index[name] = at
    if not whole and base is not None:
        rows = {field: v[base] for field, v in rows.items()}
        index["time"] = index["gyroscope"]

    def where(field: str, k: int) -> str:
        at = index.get(field, index.get("gyroscope"))
        return place(field, k if at is None else int(at[k]))

    return Samples(path, where, streams, rows, meaning.preset and meaning.preset.earth_frame)


def _present(values: FloatArray) -> NDArray[np.bool_]:
    """Return which rows hold anything."""
    if np.isfinite(values.sum()):
        return np.ones(len(values), dtype=np.bool_)
    return np.asarray(~np.isnan(values).all(axis=1))


def _is_dated(text: TextFile, layout: Layout, column: int) -> bool:
    from bingham.io.layout import split_cells

    line = next(line for number, line in text.head if number == layout.first)
    return is_date(split_cells(line, layout.separator)[column])


def _times(
    text: TextFile,
    table: Table,
    meaning: Meaning,
    rate: float | None,
    place: Place,
    inertial: bool,
    counter: int | None,
    dated: bool,
) -> FloatArray:
    """Return seconds: of a rate, of a counter at a rate, of dates, or of a column of numbers."""
    size = len(next(iter(table.columns.values())))
    rate = rate or meaning.rate
    if counter is not None:
        if rate is None:
            raise RecordingError(text.path, "", "counts samples and names no time", "give the sampling rate: rate=")
        return _of_counter(text.path, table.columns[counter], rate)
    if rate is not None and ("t" not in meaning.found.column or meaning.found.column["t"] not in table.columns):
        return np.arange(size) / rate
    column = meaning.found.column["t"]
    if dated:
        seconds = seconds_of_dates(table.columns[column])
        if isinstance(seconds, int):
            cell = table.columns[column][seconds][:40]
            raise RecordingError(text.path, place("time", seconds), f"{cell!r} is no date", "correct the cell")
        return seconds
    time = table.columns[column] * meaning.found.factor["t"]
    if "time" not in meaning.found.told:
        low, high = SPREADSHEET_DAYS
        if len(time) > 2 and low < time[0] < high and 0.0 < float(np.median(np.diff(time))) < SPREADSHEET_STEP:
            note(f"{text.path}: time: {time[0]:.4f} and so on, days of a spreadsheet; taken as such")
            return (time - 25_569.0) * 86_400.0
    check_seconds(text.path, place, time, inertial=inertial)
    return time


def _of_counter(path: Path, counts: FloatArray, rate: float) -> FloatArray:
    """Return times of numbered samples; a counter that overflows goes on."""
    steps = np.diff(counts)
    if not len(steps) or not np.isfinite(steps).all():
        return np.arange(len(counts)) / rate
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0
    wraps = steps < 0
    if wraps.any():
        size = next((2.0**bits for bits in (8, 16, 32) if counts.max() < 2.0**bits), 0.0)
        steps = np.where(wraps, steps + size, steps)
    if (np.abs(steps / usual - np.round(steps / usual)) > 0.01).any():
        return np.arange(len(counts)) / rate  # other packets share the counter
    return np.concatenate([[0.0], np.cumsum(np.round(steps / usual))]) / rate


def write_csv(path: str | Path, recording: ImuRecording | OrientationRecording) -> None:
    """Write a recording as CSV, atomically; `read_csv` gives back the same numbers.

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


FORMAT = Format(
    name="csv",
    title="text with named columns",
    expects="see `Columns of a text file`_; comma, semicolon, tab or white space; preambles, comments (``#``, ``//``), "
    "rows of units, dates and decimal commas; files of `Known loggers`_; files without names by ``columns=``",
    functions=("read_csv", "write_csv"),
    read=read_csv,
    text=lambda head: True,
)
