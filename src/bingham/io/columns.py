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

from bingham.errors import InvalidArgumentError, RecordingError, Setting
from bingham.io.checks import note
from bingham.io.units import UNITS, bracketed, factor_of, spelled
from bingham.io.words import TIME_WORDS, WORDS, joined, letter_of

__all__ = [
    "COLUMNS",
    "QUANTITY",
    "Found",
    "add_parts",
    "checked_units",
    "group",
    "lone_quaternion",
    "sensor_columns",
    "understand",
]

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
EVERY = (
    "name every one in the order of the file, - for one to leave out: ",
    Setting("columns", ["t", "ax", "-"]),
)
# Other names of a time, used where none of the above is there.
TIMES = re.compile(
    r"(?:time_?stamp|date_?time|date|elapsed(?:_time)?|time_elapsed|seconds(?:_elapsed)?|secs|sec|sample_time(?:_fine)?|"
    rf"{TIME_WORDS}|"
    r"(?:unix|epoch|sensor|system|utc|gps)_?(?:time|stamp|timestamp)?|time_since_start|epoc)(?:_(?P<unit>s|ms|us|ns))?"
)
SENSOR = f"(?P<sensor>{'|'.join(WORDS.values())})"
# Other usual names of an inertial sensor's columns, words joined by underscores.
SYNONYM = re.compile(
    rf"(?:imu_)?{SENSOR}(?:_(?:cal|calibrated|data|axis))?_?(?P<axis>[xyz])(?:_axis)?(?:_(?P<unit>\w+))?"
    r"|(?P<first>[xyz])_?(?:axis_)?(?P<last>gyro|gyr|gyroscope|acc|accel|accelerometer|mag|magnetometer)(?:_(?P<of>\w+))?"
)
QUATERNION = re.compile(r"(?:q|quat|quaternion|orientation|rotation|attitude)_?(?P<axis>[wxyzsijk])")
PART = re.compile(
    r"(?:(?:device_)?motion_)?(?:(?P<kind>user|linear)_acc(?:eleration|el)?|gravity|grav)_?(?P<axis>[xyz])"
)
COMPONENT = {"s": "w", "i": "x", "j": "y", "k": "z"}
# Four numbers that do not say where the scalar is.
NUMBERED = re.compile(r"(?:q|quat|quaternion|orientation|rotation|attitude|element)_?(?P<number>[0-4])")
# Four columns of these names are a quaternion, three are of something else.
LONE = re.compile(r"(?P<axis>[wxyz])(?:_element)?")
# Columns of a written track that a recording has no use for.
TRACK_COLUMN = re.compile(
    r"cov_[xyz]{2}|z\d+|log_evidence|accepted|reason|(?:bias|heading|inclination|roll|pitch|yaw).*"
)


class Found(NamedTuple):
    """Columns that mean something: known name → number of the column and factor to SI.

    ``told`` holds the quantities whose units the file or the caller names; ``added`` a further column and its factor,
    to be added to the column of that name: gravity, which some loggers part from what an accelerometer measures.
    """

    column: dict[str, int]
    factor: dict[str, float]
    told: set[str]
    added: dict[str, tuple[int, float]]

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
    found = Found({}, {}, set(asked), {})
    for name, theirs in columns.items():
        if name not in QUANTITY or theirs not in own:
            hint = f"file has: {', '.join(own)}"
            known = f"a known name ({' '.join(QUANTITY)})" if name not in QUANTITY else "a column of the file"
            raise InvalidArgumentError("columns", known, f"{name!r}: {theirs!r}", hint)
        column = list(own).index(theirs)
        quantity = QUANTITY[name]
        unit = bracketed(theirs)[1] or (below[column] if below else None)
        if quantity == "time" and (ending := re.search(r"_(s|ms|us|ns)$", joined(theirs))):
            unit = unit or ending[1]
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
            hint = EVERY if first == own[column] else ("choose one by ", Setting("columns", {name: "NAME"}))
            raise RecordingError(path, place, f"columns {first!r} and {own[column]!r} both mean {name}", hint)
        unit = unit or (below[column] if below else None)
        found.add(name, column, _factor(path, place, own[column], quantity, unit, asked))
    add_parts(path, place, own, found, asked, below)
    taken = {*found.column.values(), *(k for k, _ in found.added.values())}
    unknown = [
        theirs
        for k, theirs in enumerate(own)
        if theirs and k not in taken and not TRACK_COLUMN.fullmatch(theirs.lower())
    ]
    if unknown:
        shown = ", ".join(unknown[:8]) + (f" and {len(unknown) - 8} more" if len(unknown) > 8 else "")
        note(path, f"{place}: unknown columns left out: {shown}; known: {' '.join(QUANTITY)}")
    return found


def add_parts(
    path: Path, place: str, own: Sequence[str], found: Found, asked: Mapping[str, float], below: Sequence[str] = ()
) -> None:
    """Take the sum of acceleration without gravity and gravity for the accelerometer where there is no other.

    iOS gives both in g and as acceleration of free fall, down at rest: the opposite of what an accelerometer measures.
    Beside an angular_velocity, linear_acceleration is that of ROS's ``sensor_msgs/Imu``, which has gravity in it.
    """
    if "ax" in found.column:
        return
    parts: dict[str, dict[str, int]] = {"user": {}, "linear": {}, "gravity": {}}
    for k, theirs in enumerate(own):
        if part := PART.fullmatch(joined(bracketed(theirs)[0])):
            parts[part["kind"] or "gravity"].setdefault(part["axis"], k)
    kind = next((kind for kind in ("user", "linear") if len(parts[kind]) == 3), None)
    if kind == "linear" and not parts["gravity"] and "gx" in found.column:
        if joined(own[found.column["gx"]]).startswith("angular_velocity"):
            for axis, k in parts[kind].items():
                unit = bracketed(own[k])[1] or (below[k] if below else None)
                found.add(f"a{axis}", k, _factor(path, place, own[k], "accelerometer", unit, asked))
            first = own[found.column["ax"]]
            note(path, f"{place}: {first!r} and so on taken for the accelerometer, with gravity as in sensor_msgs/Imu")
        return
    if kind is None or len(parts["gravity"]) != 3:
        return
    sign, usual = (-1.0, UNITS["accelerometer"]["g"]) if kind == "user" else (1.0, 1.0)

    def factor(k: int) -> float:
        unit = bracketed(own[k])[1] or (below[k] if below else None)
        says = _factor(path, place, own[k], "accelerometer", unit, asked)
        return sign * (usual if says is None else says)

    for axis in "xyz":
        column, gravity = parts[kind][axis], parts["gravity"][axis]
        found.add(f"a{axis}", column, factor(column))
        found.added[f"a{axis}"] = gravity, factor(gravity)
    flipped = ", with the sign of an accelerometer" if sign < 0 else ""
    x, g = own[found.column["ax"]], own[found.added["ax"][0]]
    note(path, f"{place}: accelerometer: the sum of {x!r} and {g!r}, and so on, taken{flipped}")


def _factor(
    path: Path, place: str, theirs: str, quantity: str, unit: str | None, asked: Mapping[str, float]
) -> float | None:
    """Return a column's factor to SI, None if neither the file nor the caller tells its unit."""
    known = UNITS.get(quantity, {})
    says = factor_of(unit, quantity) if unit else None
    wanted = asked.get(quantity)
    if wanted is not None:
        if says is not None and abs(says - wanted) > 1e-9 * wanted:
            note(path, f"{place}: column {theirs!r} says {unit}; taken as the option says")
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
    lone = lone_quaternion([theirs for _, theirs in own])
    for k, theirs in own:
        if (meaning := _split(theirs)) is not None:
            meanings.append((k, *meaning))
        elif synonym := _synonym(theirs):
            synonyms.append((k, *synonym))
        elif theirs in lone:
            synonyms.append((k, lone[theirs], None))
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
    if "gyroscope" not in there and there & {"orientation", "axis"}:
        return meanings
    if "gyroscope" in there or any(QUANTITY[name] == "gyroscope" for _, name, _ in synonyms):
        # Quaternions by other names beside a gyroscope are what a device made of it, no reference.
        return meanings + [s for s in synonyms if QUANTITY[s[1]] != "orientation"]
    return meanings + synonyms


def sensor_columns(names: Sequence[str], sensor: str) -> dict[str, tuple[int, str | None]]:
    """Return the columns of a sensor by their usual names, with their units; empty if it is not complete.

    Examples
    --------
    >>> sensor_columns(["Mag X (uT)", "Mag Y (uT)", "Mag Z (uT)"], "magnetometer")
    {'mx': (0, 'uT'), 'my': (1, 'uT'), 'mz': (2, 'uT')}
    """
    found: dict[str, tuple[int, str | None]] = {}
    for k, theirs in enumerate(names):
        if (synonym := _synonym(theirs)) is not None and QUANTITY[synonym[0]] == sensor:
            found.setdefault(synonym[0], (k, synonym[1]))
    return found if sorted(found) == COLUMNS[sensor] else {}


def lone_quaternion(names: Sequence[str]) -> dict[str, str]:
    """Return the meaning of columns called w, x, y, z and nothing else, empty if not all four are there.

    Examples
    --------
    >>> lone_quaternion(["Time (s)", "W", "X", "Y", "Z"])
    {'W': 'qw', 'X': 'qx', 'Y': 'qy', 'Z': 'qz'}
    """
    found = {theirs: f"q{axis['axis']}" for theirs in names if (axis := LONE.fullmatch(joined(theirs)))}
    return found if sorted(found.values()) == sorted(COLUMNS["orientation"]) else {}


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
        return f"q{COMPONENT.get(quaternion['axis'], quaternion['axis'])}", None
    found = SYNONYM.fullmatch(text)
    if found is None:
        return None
    name = letter_of(found["sensor"] or found["last"]) + (found["axis"] or found["first"])
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
            missing = [c for c in names if c not in found]
            hint = ("add it or name it: ", Setting("columns", dict.fromkeys(missing, "NAME")))
            raise RecordingError(path, place, f"no column {' '.join(missing)} for the {quantity}", hint)
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
            note(path, f"{place}: px py pz left out: a recording of an inertial sensor has no positions")
        groups |= {"reference": references[0]} if references else {}
    return groups


def check_complete(
    path: Path,
    place: str,
    groups: Mapping[str, list[str]],
    own: Sequence[str],
    *,
    alone: bool = True,
    instead: Sequence[str | Setting] = (),
) -> None:
    """Raise an error if there is nothing to be filtered, or no time; any sensor will do if the file is not `alone`.

    ``instead`` is how to have orientations that stand beside sensors without a gyroscope.
    """
    gyroscope, quaternion = (Setting("columns", {name: "NAME"}) for name in ("gx", "qw"))
    has = f"the file has: {', '.join(own)}"
    if "time" not in groups:
        _reject_strange_unit(path, place, own, COLUMNS["time"])
        time, rate = Setting("columns", {"t": "NAME"}), Setting("rate")
        hint = ("add the time in seconds, name it in ", time, " or give ", rate, f" in Hz; {has}")
        raise RecordingError(path, place, "names no column t", hint)
    if "gyroscope" in groups or (not alone and len(groups) > 1):
        return
    for sensor in ("accelerometer", "magnetometer"):
        if sensor in groups and (instead or groups.get("orientation") or "orientation" not in groups):
            orientations = (", or those of its orientations, to have these alone, by ", quaternion)
            way = instead or (orientations if groups.get("orientation") else ())
            hint = ("add the gyroscope or name its columns by ", gyroscope, *way, f"; {has}")
            raise RecordingError(path, place, f"{sensor} without gx gy gz", hint)
    if "orientation" not in groups:
        _reject_strange_unit(path, place, own, COLUMNS["gyroscope"])
        _reject_numbered(path, place, own)
        hint = ("name the columns so, or each by ", gyroscope, f"; {has}")
        raise RecordingError(path, place, "neither gx gy gz nor qw qx qy qz", hint)


def _reject_strange_unit(path: Path, place: str, own: Sequence[str], names: Sequence[str]) -> None:
    """Raise an error if one of the missing columns is there with a suffix that is no unit, as ``gx_furlong``."""
    for theirs in own:
        text = joined(theirs)
        sensor, time = SYNONYM.fullmatch(text), re.fullmatch(r"(t|time|timestamp)_\w+", text)
        word = (sensor["sensor"] or sensor["last"]) if sensor else ""
        axis = (sensor["axis"] or sensor["first"]) if sensor else ""
        name = "t" if time else letter_of(word) + axis
        if name in names and (time or (sensor and (sensor["unit"] or sensor["of"]))):
            known = " ".join(UNITS[QUANTITY[name]])
            raise RecordingError(path, place, f"unknown unit of column {theirs!r}", f"known: {known}")


def _reject_numbered(path: Path, place: str, own: Sequence[str]) -> None:
    """Raise an error for four numbered columns of a quaternion: of those from 0 and from 1 nobody knows the order."""
    names = [theirs for theirs in own if NUMBERED.fullmatch(joined(bracketed(theirs)[0]))]
    if len(names) != 4:
        return

    keys = COLUMNS["orientation"]
    first, last = (Setting("columns", dict(zip(keys, names[k:] + names[:k], strict=True))) for k in (0, 3))
    hint = (first, " if the scalar comes first, ", last, " if last")
    raise RecordingError(path, place, f"{' '.join(names)} do not say which is the scalar", hint)
