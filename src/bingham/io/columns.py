"""Which columns of a text file mean what: units stand in the names, in a row below them or in options.

======================  =============================  ====================================================
quantity                columns                        units: ``gx_deg_s``, ``gx [deg/s]``, ``gx (deg/s)``
======================  =============================  ====================================================
time                    ``t`` (``time``,               ``s`` (default), ``ms``, ``us``, ``ns``
                        ``timestamp``)
gyroscope               ``gx gy gz``                   ``rad_s`` (default), ``deg_s``
accelerometer           ``ax ay az``                   ``m_s2`` (default), ``g`` (9.80665 m/s²), ``mg``
magnetometer            ``mx my mz``                   any one
orientation             ``qw qx qy qz`` or ``ux uy``   none; the reference where there is a gyroscope
true orientation        ``ref_qw`` … or ``ref_ux`` …   none
position                ``px py pz``                   ``m``
samples that count      ``score`` (0 or 1)             none
======================  =============================  ====================================================

Usual synonyms of an inertial sensor's columns are understood too, unless the file has orientations: ``gyro_x``,
``GyrX``, ``Gyroscope X (deg/s)``, ``angular_velocity.x``, ``wx``; ``acc_x``, ``accel_x``, ``xacc``; ``mag_x``. Case
does not matter. What the caller names wins over everything the file says.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io.checks import note
from bingham.io.units import UNITS, bracketed, factor_of, spelled

__all__ = ["COLUMNS", "QUANTITY", "Found", "checked_units", "group", "understand"]

COLUMNS = {
    "time": ["t"],
    "gyroscope": ["gx", "gy", "gz"],
    "accelerometer": ["ax", "ay", "az"],
    "magnetometer": ["mx", "my", "mz"],
    "orientation": ["qw", "qx", "qy", "qz"],
    "axis": ["ux", "uy"],
    "truth": ["ref_qw", "ref_qx", "ref_qy", "ref_qz"],
    "true axis": ["ref_ux", "ref_uy"],
    "position": ["px", "py", "pz"],
    "score": ["score"],
}
QUANTITY = {column: quantity for quantity, columns in COLUMNS.items() for column in columns}
SENSORS = ("gyroscope", "accelerometer", "magnetometer")
ALIASES = {"time": "t", "timestamp": "t"}
# Other names of a time, used where none of the above is there.
TIMES = re.compile(
    r"(?:time_?stamp|date_?time|date|elapsed(?:_time)?|time_elapsed|seconds(?:_elapsed)?|secs|sec|sample_time(?:_fine)?|"
    r"(?:unix|epoch|sensor|system|utc|gps)_?(?:time|stamp|timestamp)?|time_since_start|epoc)(?:_(?P<unit>s|ms|us|ns))?"
)
SENSOR = (
    r"(?P<sensor>g|gyro|gyr|gyros|gyroscope|w|omega|angular_velocity|angular_rate|ang_vel|rotation_rate"
    r"|a|acc|accel|accelerometer|acceleration|specific_force"
    r"|m|mag|magn|magnet|magnetometer|magnetic_field)"
)
# Other usual names of an inertial sensor's columns, words joined by underscores.
SYNONYM = re.compile(
    rf"{SENSOR}(?:_(?:cal|calibrated|data|axis))?_?(?P<axis>[xyz])(?:_axis)?(?:_(?P<unit>\w+))?"
    r"|(?P<first>[xyz])_?(?:axis_)?(?P<last>gyro|gyr|gyroscope|acc|accel|accelerometer|mag|magnetometer)(?:_(?P<of>\w+))?"
)
QUATERNION = re.compile(r"(?:q|quat|quaternion|orientation|rotation|attitude)_?(?P<axis>[wxyz])")
LETTER = {"g": "g", "w": "g", "o": "g", "r": "g", "m": "m", "s": "a"}
# Columns of a written track that a recording has no use for.
TRACK_COLUMN = re.compile(
    r"cov_[xyz]{2}|z\d+|log_evidence|accepted|reason|(?:bias|heading|inclination|roll|pitch|yaw).*"
)


class Found(NamedTuple):
    """Columns that mean something: known name → number of the column and factor to SI.

    ``told`` holds the quantities whose units the file or the caller names.
    """

    column: dict[str, int]
    factor: dict[str, float]
    told: set[str]

    def add(self, name: str, column: int, factor: float | None) -> None:
        """Add a column; a factor of None says that nobody told the unit."""
        self.column[name], self.factor[name] = column, 1.0 if factor is None else factor
        if factor is not None:
            self.told.add(QUANTITY[name])


def checked_units(units: Mapping[str, str]) -> dict[str, float]:
    """Return the factors of the units that a caller names.

    Raises
    ------
    InvalidArgumentError
        If a quantity or its unit is unknown.
    """
    factors: dict[str, float] = {}
    for quantity, unit in units.items():
        factor = factor_of(unit, quantity)
        if factor is None:
            expected = f"one of {', '.join(UNITS.get(quantity, UNITS))}"
            hint = "a number before it is a step, as 100us or 1/4096g" if quantity in UNITS else ""
            raise InvalidArgumentError("units", expected, repr(unit if quantity in UNITS else quantity), hint)
        factors[quantity] = factor
    return factors


def understand(
    path: Path,
    place: str,
    own: Sequence[str],
    columns: Mapping[str, str],
    units: Mapping[str, str],
    below: Sequence[str] = (),
) -> Found:
    """Find the columns of known meaning among a file's own names.

    Parameters
    ----------
    path, place : Path, str
        File, and line of the names, for messages.
    own : sequence of str
        The file's names.
    columns, units : mapping of str to str
        What the caller names: known name → the file's own; quantity → unit. They win over what the file says.
    below : sequence of str
        Units that stand in a row below the names.
    """
    asked = checked_units(units)
    found = Found({}, {}, set(asked))
    for name, theirs in columns.items():
        if name not in QUANTITY or theirs not in own:
            hint = f"file has: {', '.join(own)}"
            known = f"a known name ({' '.join(QUANTITY)})" if name not in QUANTITY else "a column of the file"
            raise InvalidArgumentError("columns", known, f"{name!r}: {theirs!r}", hint)
        column = list(own).index(theirs)
        quantity = QUANTITY[name]
        unit = bracketed(theirs)[1] or (below[column] if below else None)
        factor = asked.get(quantity)
        if factor is None and unit:
            factor = factor_of(unit, quantity)
        found.add(name, column, factor)
    by_user = set(found.column.values())
    meanings = _meanings([(k, theirs) for k, theirs in enumerate(own) if k not in by_user], found)
    for column, name, unit in meanings:
        quantity = QUANTITY[name]
        if name in columns:
            continue
        if name in found.column:
            first = own[found.column[name]]
            hint = f"choose one by columns={{'{name}': ...}}"
            raise RecordingError(path, place, f"columns {first!r} and {own[column]!r} both mean {name}", hint)
        unit = unit or (below[column] if below else None)
        found.add(name, column, _factor(path, place, own[column], quantity, unit, asked))
    unknown = [
        theirs
        for k, theirs in enumerate(own)
        if theirs and k not in found.column.values() and not TRACK_COLUMN.fullmatch(theirs.lower())
    ]
    if unknown:
        shown = ", ".join(unknown[:8]) + (f" and {len(unknown) - 8} more" if len(unknown) > 8 else "")
        note(f"{path}: {place}: unknown columns left out: {shown}; known: {' '.join(QUANTITY)}")
    return found


def _factor(
    path: Path, place: str, theirs: str, quantity: str, unit: str | None, asked: Mapping[str, float]
) -> float | None:
    """Return a column's factor to SI, None if neither the file nor the caller tells its unit."""
    known = UNITS.get(quantity, {})
    says = factor_of(unit, quantity) if unit else None
    wanted = asked.get(quantity)
    if wanted is not None:
        if says is not None and abs(says - wanted) > 1e-9 * wanted:
            note(f"{path}: {place}: column {theirs!r} says {unit}; taken as the option says")
        return wanted
    if unit and says is None and spelled(unit) not in ("no_units", "", "-", "1", "none", "unitless"):
        raise RecordingError(path, place, f"unknown unit of column {theirs!r}", f"known: {' '.join(known) or 'none'}")
    return says


def _meanings(own: list[tuple[int, str]], found: Found) -> list[tuple[int, str, str | None]]:
    """Return the file's columns that mean something, with known names and units.

    Synonyms count where their quantity has no column by its known name, and never make an inertial recording of one
    of orientations.
    """
    meanings: list[tuple[int, str, str | None]] = []
    synonyms: list[tuple[int, str, str | None]] = []
    times: list[tuple[int, str, str | None]] = []
    for k, theirs in own:
        if (meaning := _split(theirs)) is not None:
            meanings.append((k, *meaning))
        elif synonym := _synonym(theirs):
            synonyms.append((k, *synonym))
        elif time := TIMES.fullmatch(joined(bracketed(theirs)[0])):
            times.append((k, "t", bracketed(theirs)[1] or time["unit"]))
    clocks = [k for k, name, _ in meanings if name == "t"]
    if len(clocks) > 1:  # "T" beside a time is a temperature
        names = dict(own)
        meanings = [m for m in meanings if not (m[1] == "t" and bracketed(names[m[0]])[0] == "T")]
    there = {QUANTITY[name] for _, name, _ in meanings} | {QUANTITY[name] for name in found.column}
    synonyms = [(k, name, unit) for k, name, unit in synonyms if QUANTITY[name] not in there]
    if "time" not in there:
        meanings += times[:1]
    inertial = "gyroscope" in there
    if not inertial and not there & {"orientation", "axis"}:
        inertial = any(QUANTITY[name] in SENSORS for _, name, _ in synonyms)
    # Quaternions by other names beside a gyroscope are what a device made of it, no reference.
    return meanings + [s for s in synonyms if inertial != (QUANTITY[s[1]] == "orientation")]


def joined(text: str) -> str:
    """Return a name in lower case, its words joined by underscores: "GyrX", "gyr.x", "Gyr X" as "gyr_x"."""
    text = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", text)
    text = re.sub(r"\[(\d+)\]", r"_\1", text)
    return re.sub(r"[\s./:\-_]+", "_", text).strip("_").lower()


def _split(theirs: str) -> tuple[str, str | None] | None:
    """Split ``gx [deg/s]`` or ``gx_deg_s`` into ``("gx", "deg_s")``."""
    text, unit = bracketed(theirs.lower())
    candidates = [*QUANTITY, *ALIASES]
    for name in sorted(candidates, key=len, reverse=True):
        canonical = ALIASES.get(name, name)
        if text == name:
            if canonical == "t" and unit and factor_of(unit, "time") is None and re.fullmatch(r"[-+]\d{4}", unit):
                return None  # "timestamp (+0100)": a date beside another time
            return canonical, unit
        suffix = spelled(text[len(name) + 1 :])
        if unit is None and text.startswith(f"{name}_") and suffix in UNITS.get(QUANTITY[canonical], {}):
            return canonical, suffix
    return None


def _synonym(theirs: str) -> tuple[str, str | None] | None:
    """Return the meaning of a name like ``gyro_x``, ``Accel X (g)`` or ``wx_deg_s``, None if it is no such name."""
    text, unit = bracketed(theirs)
    text = joined(text)
    if quaternion := QUATERNION.fullmatch(text):
        return f"q{quaternion['axis']}", None
    found = SYNONYM.fullmatch(text)
    if found is None:
        return None
    word = found["sensor"] or found["last"]
    letter = "g" if word.startswith(("angular", "ang_")) else LETTER.get(word[0], word[0])
    name = letter + (found["axis"] or found["first"])
    tail = found["unit"] or found["of"]
    if tail is None:
        return name, unit
    suffix = spelled(tail, QUANTITY[name])
    return (name, suffix) if unit is None and suffix in UNITS[QUANTITY[name]] else None


def group(path: Path, place: str, found: Mapping[str, int], own: Sequence[str]) -> dict[str, list[str]]:
    """Gather columns into the fields of a recording; every quantity must be complete."""
    groups: dict[str, list[str]] = {}
    for quantity, names in COLUMNS.items():
        present = [c for c in names if c in found]
        if present and present != names:
            _reject_strange_unit(path, place, own, [c for c in names if c not in found])
            missing = " ".join(c for c in names if c not in found)
            raise RecordingError(
                path, place, f"no column {missing} for the {quantity}", "add it or name it in columns="
            )
        if present:
            groups[quantity] = names
    inertial = "gyroscope" in groups
    for field, planar in (("orientation", "axis"), ("truth", "true axis")):
        if planar in groups:
            if field in groups or inertial:
                raise RecordingError(path, place, f"{' '.join(COLUMNS[planar])} beside columns in space", "drop them")
            groups[field] = groups.pop(planar)
    if inertial:
        references = [groups.pop(field) for field in ("orientation", "truth") if field in groups]
        if len(references) > 1:
            raise RecordingError(path, place, "both qw and ref_qw beside a gyroscope", "keep one as the reference")
        if groups.pop("position", None):
            note(f"{path}: {place}: px py pz left out: a recording of an inertial sensor has no positions")
        groups |= {"reference": references[0]} if references else {}
    return groups


def check_complete(
    path: Path, place: str, groups: Mapping[str, list[str]], own: Sequence[str], *, alone: bool = True
) -> None:
    """Raise an error if there is nothing to be filtered, or no time; any sensor will do if the file is not `alone`."""
    has = f"the file has: {', '.join(own)}"
    if "time" not in groups:
        _reject_strange_unit(path, place, own, COLUMNS["time"])
        hint = f"add the time in seconds, name it in columns={{'t': ...}} or give rate= in Hz; {has}"
        raise RecordingError(path, place, "names no column t", hint)
    if "gyroscope" in groups or (not alone and len(groups) > 1):
        return
    for sensor in ("accelerometer", "magnetometer"):
        if sensor in groups:
            raise RecordingError(path, place, f"{sensor} without gx gy gz", f"add the gyroscope or drop it; {has}")
    if "orientation" not in groups:
        _reject_strange_unit(path, place, own, COLUMNS["gyroscope"])
        hint = f"name the columns so, or each by columns={{'gx': ...}}; {has}"
        raise RecordingError(path, place, "neither gx gy gz nor qw qx qy qz", hint)


def _reject_strange_unit(path: Path, place: str, own: Sequence[str], names: Sequence[str]) -> None:
    """Raise an error if one of the missing columns is there with a suffix that is no unit, as ``gx_furlong``."""
    for theirs in own:
        text = joined(theirs)
        sensor, time = SYNONYM.fullmatch(text), re.fullmatch(r"(t|time|timestamp)_\w+", text)
        word = (sensor["sensor"] or sensor["last"]) if sensor else ""
        axis = (sensor["axis"] or sensor["first"]) if sensor else ""
        name = "t" if time else LETTER.get(word[:1], word[:1]) + axis
        if name in names and (time or (sensor and (sensor["unit"] or sensor["of"]))):
            known = " ".join(UNITS[QUANTITY[name]])
            raise RecordingError(path, place, f"unknown unit of column {theirs!r}", f"known: {known}")
