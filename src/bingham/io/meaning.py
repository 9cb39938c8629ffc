"""What the columns of one text file mean: by what the caller names, by its logger's preset, or by their names alone."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io.columns import (
    COLUMNS,
    EVERY,
    QUANTITY,
    SENSORS,
    Found,
    add_parts,
    checked_units,
    lone_quaternion,
    sensor_columns,
    understand,
)
from bingham.io.layout import Layout, without_copies
from bingham.io.presets import Preset, find_preset
from bingham.io.presets.preset import Told
from bingham.io.text import TextFile
from bingham.io.units import UNITS, bracketed, factor_of, spelled
from bingham.io.words import joined

__all__ = ["Meaning", "meaning_of", "named", "sensor_of_name"]

WORDS = {
    "gyroscope": r"gyro\w*|gyr|angular_?velocity|rotation_?rate|angvel|omega",
    "accelerometer": r"total_?acceleration|accelerometer(?:_?uncalibrated)?|accel|acc|acceleration",
    "magnetometer": r"magnetometer\w*|magnetic_?field|mag",
}
NO_ACCELEROMETER = re.compile(r"linear|user|gravity_?less|free_?acc", re.IGNORECASE)
LABELS = ("sensor", "sensor_type", "sensor_name", "type", "kind", "name", "source", "stream", "msg", "message")
BARE = {"x": r"(?:axis_?)?x(?:_?axis)?", "y": r"(?:axis_?)?y(?:_?axis)?", "z": r"(?:axis_?)?z(?:_?axis)?"}


class Meaning(NamedTuple):
    """What was found out about a file before it is read.

    ``found``: its columns of known meaning. ``preset``: its logger, if known. ``rate``: what its preamble says, Hz.
    ``counter``: a column that counts samples. ``bare``: columns x, y, z of a sensor that their numbers must tell, or
    the words in column ``label``, a row for each sensor. ``asked``: factors of the units that the caller names.
    """

    found: Found
    preset: Preset | None
    rate: float | None
    counter: int | None
    bare: list[int]
    asked: dict[str, float]
    label: int | None


def named(text: TextFile, layout: Layout, columns: Mapping[str, str] | Sequence[str] | None) -> Layout:
    """Return the layout with names: the file's own, or those that a caller lists for a file without.

    Raises
    ------
    RecordingError
        If there are none, or not as many as columns.
    """
    path = text.path
    if columns is not None and not isinstance(columns, Mapping):
        names = [str(name).strip() for name in columns]
        if len(names) != layout.width:
            place = f"line {layout.first}"
            problem = f"{layout.width} columns, and {len(names)} names for them"
            raise RecordingError(path, place, problem, EVERY)
        return replace(layout, names=["" if name in ("-", "_") else name for name in names])
    if layout.names:
        return without_copies(text, layout)
    problem = f"holds numbers and no names of its {layout.width} columns"
    raise RecordingError(path, f"line {layout.first}", problem, EVERY)


def meaning_of(
    path: Path,
    layout: Layout,
    columns: Mapping[str, str],
    units: Mapping[str, str],
) -> Meaning:
    """Find out what the columns of a file mean.

    Parameters
    ----------
    path, layout : Path, Layout
        The file and its table, with names.
    columns, units : mapping of str to str
        What the caller names; it wins over preset and file.
    """
    preset = find_preset(layout.names, layout.preamble)
    place = f"line {layout.header}" if layout.header else "columns"
    if preset is None:
        bare = _bare(layout.names)
        known = {**columns} if bare is None else {**_named_by_sensor(path, layout, bare, units), **columns}
        found = understand(path, place, layout.names, known, units, layout.units)
        sensors = {QUANTITY[name] for name in found.column} - {"time", "score"}
        bare = bare if bare and not sensors else []
        return Meaning(found, None, None, None, bare, checked_units(units), _label(layout.names) if bare else None)
    told = preset.preamble(layout.preamble) if preset.preamble else Told({}, None)
    asked = checked_units(units)
    found = Found({}, {}, set(asked), {})
    user = understand(path, place, [n if n in columns.values() else "" for n in layout.names], columns, units)
    for name, column in user.column.items():
        unit = bracketed(layout.names[column])[1]
        known_unit = None if unit else {**preset.units, **told.units}.get(QUANTITY[name])
        factor = (
            user.factor[name]
            if QUANTITY[name] in user.told or not known_unit
            else factor_of(known_unit, QUANTITY[name])
        )
        found.add(name, column, factor)
    by_user = {QUANTITY[name] for name in columns}
    bare = []
    wanted = ["time", *SENSORS, "position", "sensor", "estimate"]
    for quantity in wanted:
        at = preset.find(layout.names, quantity)
        if not at or (quantity == "time" and "t" in columns):
            continue
        if quantity == "sensor":
            if any(QUANTITY[name] in SENSORS for name in found.column):
                continue
            kind = _sensor(path, _unit(layout, at[0]), told)
            if kind is None:
                bare = at
                continue
            quantity = kind
        if quantity == "estimate":
            if any(QUANTITY[name] in SENSORS for name in found.column) or "orientation" in by_user or bare:
                continue
            quantity = "orientation"
        for name, column in zip(COLUMNS[quantity], at, strict=True):
            if name in columns:
                continue
            unit = _unit(layout, column) or told.units.get(quantity) or preset.units.get(quantity)
            factor = asked.get(quantity)
            if factor is None and unit:
                factor = factor_of(unit, quantity)
                if factor is None:
                    problem = f"unknown unit of column {layout.names[column]!r}"
                    raise RecordingError(path, place, problem, f"known: {' '.join(UNITS[quantity])}")
            found.add(name, column, factor if factor is None else factor * preset.signs.get(quantity, 1.0))
    # Columns by usual names that the preset does not know. Accelerometers by other names may have gravity taken off.
    for sensor in ("gyroscope", "magnetometer"):
        there = {QUANTITY[name] for name in found.column}
        if sensor in there or bare or not there & set(SENSORS):
            continue
        for name, (column, unit) in sensor_columns(layout.names, sensor).items():
            factor = asked.get(sensor)
            found.add(name, column, factor_of(unit, sensor) if factor is None and unit else factor)
    add_parts(path, place, layout.names, found, asked, layout.units)
    counter = preset.find(layout.names, "counter")
    if counter and (told.rate or "time" not in {QUANTITY[n] for n in found.column}) and "t" not in columns:
        return Meaning(found, preset, told.rate, counter[0], bare, asked, None)
    return Meaning(found, preset, told.rate, None, bare, asked, None)


def sensor_of_name(path: Path) -> str | None:
    """Return the sensor that a file's name tells, None if it tells none, or one that a filter has no use for."""
    text = joined(path.stem)
    if NO_ACCELEROMETER.search(text):
        return None
    for sensor, words in WORDS.items():
        if re.search(rf"(?:^|_)(?:{words})(?:_|$)", text):
            return sensor
    return None


def _unit(layout: Layout, column: int) -> str | None:
    """Return the unit that a column's name or the row below tells."""
    name = layout.names[column]
    inside = bracketed(name)[1] or (layout.units[column] if layout.units else None)
    if (inside and spelled(inside) in ("no_units", "", "-")) or (inside and inside.lower().startswith("yyyy")):
        return None
    if inside:
        return inside
    suffix = re.fullmatch(r"time_?(us|ms|ns)", joined(name))
    return suffix[1] if suffix else None


def _sensor(path: Path, unit: str | None, told: Told) -> str | None:
    """Return the quantity of columns x, y, z: by their unit, the file's name, or what the preamble scales."""
    if unit:
        fitting = [q for q in SENSORS if factor_of(unit, q) is not None]
        if len(fitting) == 1:
            return fitting[0]
        by_name = sensor_of_name(path)
        return by_name if by_name in fitting else (fitting[0] if fitting else None)
    return sensor_of_name(path)


def _bare(names: Sequence[str]) -> list[int] | None:
    """Return the columns called x, y and z and nothing else, None if there are none."""
    plain = [joined(bracketed(name)[0]) for name in names]
    if lone_quaternion(names):
        return None
    found = [[k for k, name in enumerate(plain) if re.fullmatch(pattern, name)] for pattern in BARE.values()]
    return [k[0] for k in found] if all(len(k) == 1 for k in found) else None


def _label(names: Sequence[str]) -> int | None:
    """Return the column whose words say which sensor a row is of."""
    return next((k for k, name in enumerate(names) if joined(name) in LABELS), None)


def _named_by_sensor(path: Path, layout: Layout, bare: list[int], units: Mapping[str, str]) -> dict[str, str]:
    kind = None if _label(layout.names) is not None else _sensor(path, _unit(layout, bare[0]), Told({}, None))
    if kind is None and _label(layout.names) is None:
        named_units = [q for q in SENSORS if q in units]
        kind = named_units[0] if len(named_units) == 1 else None
    if kind is None:
        return {}
    return {name: layout.names[k] for name, k in zip(COLUMNS[kind], bare, strict=True)}


def check_rate(rate: float | None) -> None:
    """Raise an error for a rate that is none."""
    if rate is not None and not 0.0 < rate < 1e7:
        raise InvalidArgumentError("rate", "a sampling rate in Hz", rate)
