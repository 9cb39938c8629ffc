"""What a table of text holds: its columns found, read and given their meaning, sensors at their times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError, Setting
from bingham.io.angles import angle_kind
from bingham.io.assemble import Stream
from bingham.io.checks import HEAD, Place, check_seconds, normalised, note, repaired
from bingham.io.columns import SENSORS, check_complete, group
from bingham.io.counts import reject_counts, sensor_of_numbers
from bingham.io.dates import is_date, seconds_of_dates
from bingham.io.layout import Layout, find_layout, split_cells
from bingham.io.meaning import Meaning, check_rate, meaning_of, named, sensor_of_name
from bingham.io.table import Table, read_table
from bingham.io.text import TextFile, opened_text
from bingham.io.units import UNITS
from bingham.io.written import Written, decoded, rotation_angles

__all__ = ["Plan", "Samples", "like_spreadsheet", "plan_of", "present", "read_samples", "samples_of"]

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


class Plan(NamedTuple):
    """What will be read of a table, and what it means.

    ``groups``: fields and the known names of their columns. ``clock``: column of the time, if there is one, which is
    ``dated`` if it holds dates; ``counter``: one that counts samples at a rate.
    """

    text: TextFile
    layout: Layout
    meaning: Meaning
    groups: dict[str, list[str]]
    rate: float | None
    written: Written | None
    clock: int | None
    counter: int | None
    dated: bool

    @property
    def timing(self) -> list[int]:
        """Columns that tell times."""
        if self.rate is not None and self.counter is None:
            return []
        return [k for k in (self.clock, self.counter) if k is not None]

    @property
    def words(self) -> list[int]:
        """Columns of text."""
        label = self.meaning.label
        return [k for k in self.timing if self.dated and k == self.clock] + ([] if label is None else [label])

    @property
    def fields(self) -> dict[str, list[int]]:
        """Columns of each field that is measured in numbers."""
        column = self.meaning.found.column
        return {field: [column[name] for name in names] for field, names in self.groups.items() if field != "time"}

    @property
    def numbers(self) -> list[int]:
        """Columns of numbers."""
        found = [k for columns in self.fields.values() for k in columns] + self.meaning.bare
        found += [k for k, _ in self.meaning.found.added.values()]
        found += self.written.columns if self.written is not None else []
        return list(dict.fromkeys([*found, *(k for k in self.timing if k not in self.words)]))

    def values(self, table: Table) -> dict[str, FloatArray]:
        """Return the fields of some rows in SI units."""
        factor, added = self.meaning.found.factor, self.meaning.found.added
        values = {
            field: table.matrix(columns, [factor[name] for name in self.groups[field]])
            for field, columns in self.fields.items()
        }
        if added:
            parts = [added[name] for name in self.groups["accelerometer"]]
            values["accelerometer"] = values["accelerometer"] + table.matrix(*zip(*parts, strict=True))
        return values

    def place(self, table: Table) -> Place:
        """Return what names the rows of a field."""
        column = self.meaning.found.column

        def place(field: str, index: int) -> str:
            names = self.groups.get(field, [])
            at = [column[name] for name in names] if names and field != "time" else self.timing[:1]
            if field == "orientation" and self.written is not None:
                at = list(self.written.columns)
            return table.place(at or self.meaning.bare or [0], index)

        return place


def plan_of(
    path: str | Path,
    *,
    columns: Mapping[str, str] | Sequence[str] | None = None,
    units: Mapping[str, str] | None = None,
    rate: float | None = None,
    angles: str | None = None,
    alone: bool = True,
) -> Plan:
    """Look at a table; `alone` wants a gyroscope or orientations in it, not one sensor of several files."""
    check_rate(rate)
    kind = None if angles is None else angle_kind(angles)
    text = opened_text(path)
    layout = named(text, find_layout(text), columns)
    meaning = meaning_of(text.path, layout, columns if isinstance(columns, Mapping) else {}, units or {})
    place = f"line {layout.header}" if layout.header else "columns"
    groups = group(text.path, place, meaning.found.column, layout.names)
    written = None
    if not groups.keys() & {"gyroscope", "orientation"} and not meaning.bare:
        written = rotation_angles(layout.names, kind)
    sensors = [name for name in SENSORS if name in groups]
    if sensors and "gyroscope" not in groups and (written is not None or "orientation" in groups):
        if not alone:  # a file of one sensor beside others
            groups.pop("orientation", None)
            written = None
        elif kind is not None or (isinstance(columns, Mapping) and "qw" in columns):
            for name in sensors:
                del groups[name]
            note(text.path, f"{place}: {' and '.join(sensors)} left out: without a gyroscope they cannot be filtered")
    if kind is not None and written is None:
        problem = f"no columns of {' '.join(kind.columns)} in place of a gyroscope or quaternion"
        raise RecordingError(text.path, place, problem, f"the file has: {', '.join(layout.names)}")
    timed = rate is not None or meaning.counter is not None
    known = groups | ({"time": ["t"]} if timed else {}) | ({"orientation": []} if written else {})
    if meaning.bare:
        known["gyroscope"] = []  # or another sensor
    orientation = (", or ", Setting("angles", written.kind.name), ", for its orientations alone") if written else ()
    check_complete(text.path, place, known, layout.names, alone=alone, instead=orientation)
    clock = meaning.found.column.get("t")
    counter = meaning.counter if rate is None or clock is None else clock
    dated = clock is not None and counter != clock and _is_dated(text, layout, clock)
    return Plan(text, layout, meaning, groups, rate, written, clock, counter, dated)


def read_samples(path: str | Path, **options: Any) -> Samples:
    """Read a table; options as for `plan_of`."""
    plan = plan_of(path, **options)
    return samples_of(plan)


def samples_of(plan: Plan) -> Samples:
    """Read what is planned."""
    meaning, path = plan.meaning, plan.text.path
    table = read_table(plan.text, plan.layout, plan.numbers, words=plan.words, together=list(plan.fields.values()))
    place = plan.place(table)
    values = plan.values(table)
    if meaning.bare:
        for kind, samples in _of_bare(path, table, meaning).items():
            values[kind] = samples * meaning.asked.get(kind, 1.0)
            plan.groups[kind] = ["x", "y", "z"]
        meaning.found.column.update(zip(("x", "y", "z"), meaning.bare, strict=True))
    reject_counts(path, values, meaning.found)
    told = meaning.found.told
    if (
        "gyroscope" in values
        and "gyroscope" not in told
        and meaning.found.factor.get("ax") == UNITS["accelerometer"]["g"]
    ):
        said = "gyroscope: unit untold, taken for rad/s; loggers that write g mostly write degrees/s: "
        note(path, said, Setting("units", {"gyroscope": "deg_s"}), ", or rad_s")
    if plan.written is not None:
        values["orientation"] = decoded(table, plan.written)
    time = _times(plan, table, place, "gyroscope" in values)
    return _samples(path, place, time, values, meaning)


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
    there = {name: present(v) for name, v in sensors.items()}
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
    if base is not None and not base.all() and not interleaved:
        repaired(path, f"{np.count_nonzero(~base)} of {len(base)} rows hold no sample, left out")
    whole = base is None or bool(base.all())
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


def present(values: FloatArray) -> NDArray[np.bool_]:
    """Return which rows hold anything."""
    if np.isfinite(values.sum()):
        return np.ones(len(values), dtype=np.bool_)
    return np.asarray(~np.isnan(values).all(axis=1))


def _is_dated(text: TextFile, layout: Layout, column: int) -> bool:
    line = next(line for number, line in text.head if number == layout.first)
    cells = split_cells(line, layout.separator)
    return column < len(cells) and is_date(cells[column])


def _times(plan: Plan, table: Table, place: Place, inertial: bool) -> FloatArray:
    """Return seconds: of a rate, of a counter at a rate, of dates, or of a column of numbers."""
    path, meaning, counter = plan.text.path, plan.meaning, plan.counter
    rate = plan.rate or meaning.rate
    if counter is not None:
        if rate is None:
            hint = ("give the sampling rate: ", Setting("rate"))
            raise RecordingError(path, "", "counts samples and names no time", hint)
        return _of_counter(path, table.columns[counter], rate)
    if rate is not None and ("t" not in meaning.found.column or meaning.found.column["t"] not in table.columns):
        return np.arange(len(table)) / rate
    column = meaning.found.column["t"]
    if plan.dated:
        seconds = seconds_of_dates(table.columns[column])
        if isinstance(seconds, int):
            cell = table.columns[column][seconds][:40]
            raise RecordingError(path, place("time", seconds), f"{cell!r} is no date", "correct the cell")
        return seconds
    time = table.columns[column] * meaning.found.factor["t"]
    if "time" not in meaning.found.told and like_spreadsheet(time):
        note(path, f"time: {time[0]:.4f} and so on, days of a spreadsheet; taken as such")
        return (time - 25_569.0) * 86_400.0
    check_seconds(path, place, time, inertial=inertial)
    return time


def like_spreadsheet(time: FloatArray) -> bool:
    """Whether times are days of a spreadsheet."""
    low, high = SPREADSHEET_DAYS
    return (
        len(time) > 2 and low < time[0] < high and bool(0.0 < float(np.median(np.diff(time[:HEAD]))) < SPREADSHEET_STEP)
    )


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
