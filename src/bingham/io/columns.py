"""Which columns of a CSV mean what: units stand in the names or in options and are never guessed.

======================  =============================  ====================================================
quantity                columns                        units: ``gx_deg_s``, ``gx [deg/s]``, ``gx (deg/s)``
======================  =============================  ====================================================
time                    ``t`` (``time``,               ``s`` (default), ``ms``, ``us``, ``ns``
                        ``timestamp``)
gyroscope               ``gx gy gz``                   ``rad_s`` (default), ``deg_s``
accelerometer           ``ax ay az``                   ``m_s2`` (default), ``g`` (9.80665 m/s²)
magnetometer            ``mx my mz``                   any one
orientation             ``qw qx qy qz`` or ``ux uy``   none; the reference where there is a gyroscope
true orientation        ``ref_qw`` … or ``ref_ux`` …   none
position                ``px py pz``                   ``m``
samples that count      ``score`` (0 or 1)             none
======================  =============================  ====================================================

Usual synonyms of an inertial sensor's columns are understood too, unless the file has orientations: ``gyro_x``,
``gyr_x``, ``gyroscope x``, ``wx``, ``omega_x``; ``acc_x``, ``accel_x``, ``accelerometer x``; ``mag_x``,
``magnetometer x``. Case does not matter, lines that start with ``#`` are comments, an empty cell means no sample.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io.checks import note
from bingham.io.units import UNITS, bracketed, spelled

__all__ = ["COLUMNS", "group", "understand"]

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
ALIASES = {"time": "t", "timestamp": "t"}
# Other usual names of an inertial sensor's columns, spaces read as underscores.
SYNONYM = re.compile(
    r"(?P<sensor>g|gyro|gyr|gyroscope|w|omega|a|acc|accel|accelerometer|m|mag|magnetometer)_?(?P<axis>[xyz])(?:_(?P<unit>\w+))?"
)
# Columns of a written track that a recording has no use for.
TRACK_COLUMN = re.compile(r"cov_[xyz]{2}|z\d+|log_evidence|accepted|reason")


def understand(
    path: Path, place: str, own: list[str], columns: Mapping[str, str], units: Mapping[str, str]
) -> tuple[dict[str, str], dict[str, float]]:
    """Map known column names to the file's own names and to the factors that give SI units."""
    asked = {quantity: spelled(unit) for quantity, unit in units.items()}
    for quantity, unit in asked.items():
        if unit not in UNITS.get(quantity, {}):
            expected = f"one of {', '.join(UNITS.get(quantity, UNITS))}"
            raise InvalidArgumentError("units", expected, repr(units[quantity] if quantity in UNITS else quantity))
    for name, theirs in columns.items():
        if name not in QUANTITY or theirs not in own:
            got = f"{name!r}: {theirs!r}"
            raise InvalidArgumentError("columns", "a known name and a column of the file", got, f"file has: {own}")
    meanings = _meanings(own, {theirs: name for name, theirs in columns.items()})
    found: dict[str, str] = {}
    factors: dict[str, float] = {}
    for theirs, name, unit in meanings:
        if name in found:
            raise RecordingError(path, place, f"columns {found[name]!r} and {theirs!r} both mean {name}", "drop one")
        quantity = QUANTITY[name]
        known = UNITS.get(quantity, {})
        wanted = asked.get(quantity)
        if unit is not None and wanted is not None and unit != wanted:
            raise RecordingError(path, place, f"column {theirs!r} says {unit}, the option {wanted}", "drop the option")
        unit = unit or wanted
        if unit is not None and unit not in known:
            raise RecordingError(
                path, place, f"unknown unit of column {theirs!r}", f"known: {' '.join(known) or 'none'}"
            )
        found[name], factors[name] = theirs, 1.0 if unit is None else known[unit]
    unknown = [theirs for theirs in own if theirs not in found.values() and not TRACK_COLUMN.fullmatch(theirs.lower())]
    if unknown:
        note(f"{path}: {place}: unknown columns left out: {', '.join(unknown)}; known: {' '.join(QUANTITY)}")
    return found, factors


def _meanings(own: list[str], renamed: Mapping[str, str]) -> list[tuple[str, str, str | None]]:
    """Return the file's columns that mean something, with known names and units.

    Synonyms count where their quantity has no column by its known name, and never make an inertial recording of one
    of orientations.
    """
    meanings: list[tuple[str, str, str | None]] = []
    synonyms: list[tuple[str, str, str | None]] = []
    for theirs in own:
        if theirs in renamed:
            name = renamed[theirs]
            meanings.append((theirs, name, bracketed(theirs)[1] if QUANTITY[name] in UNITS else None))
        elif (meaning := _split(theirs))[0] in QUANTITY:
            meanings.append((theirs, *meaning))
        elif synonym := _synonym(theirs):
            synonyms.append((theirs, *synonym))
    there = {QUANTITY[name] for _, name, _ in meanings}
    synonyms = [(theirs, name, unit) for theirs, name, unit in synonyms if QUANTITY[name] not in there]
    inertial = "gyroscope" in there
    if not inertial and not there & {"orientation", "axis"}:
        inertial = any(QUANTITY[name] == "gyroscope" for _, name, _ in synonyms)
    return meanings + synonyms if inertial else meanings


def _split(theirs: str) -> tuple[str, str | None]:
    """Split ``gx [deg/s]`` or ``gx_deg_s`` into ``("gx", "deg_s")``."""
    text, unit = bracketed(theirs.lower())
    if unit is not None:
        return ALIASES.get(text, text), unit
    candidates = [*QUANTITY, *ALIASES]
    for name in sorted(candidates, key=len, reverse=True):
        canonical = ALIASES.get(name, name)
        if text == name:
            return canonical, None
        unit = spelled(text[len(name) + 1 :])
        if text.startswith(f"{name}_") and unit in UNITS.get(QUANTITY[canonical], {}):
            return canonical, unit
    return text, None


def _synonym(theirs: str) -> tuple[str, str | None] | None:
    """Return the meaning of a name like ``gyro_x``, ``Accel X (g)`` or ``wx_deg_s``, None if it is no such name."""
    text, unit = bracketed(theirs.lower())
    found = SYNONYM.fullmatch(re.sub(r"[\s.-]+", "_", text))
    if found is None:
        return None
    name = found["sensor"][0].replace("w", "g").replace("o", "g") + found["axis"]
    if found["unit"] is None:
        return name, unit
    suffix = spelled(found["unit"])
    return (name, suffix) if unit is None and suffix in UNITS[QUANTITY[name]] else None


def group(path: Path, place: str, found: Mapping[str, str], own: list[str]) -> dict[str, list[str]]:
    """Gather columns into the fields of a recording; every quantity must be complete."""
    has = f"the file has: {', '.join(own)}"
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
    if "time" not in groups:
        _reject_strange_unit(path, place, own, COLUMNS["time"])
        raise RecordingError(
            path, place, "names no column t", f"add the time in seconds or name it in columns={{'t': ...}}; {has}"
        )
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
    elif "orientation" not in groups:
        _reject_strange_unit(path, place, own, COLUMNS["gyroscope"])
        hint = f"name the columns so, or each by columns={{'gx': ...}}; {has}"
        raise RecordingError(path, place, "neither gx gy gz nor qw qx qy qz", hint)
    else:
        for sensor in ("accelerometer", "magnetometer"):
            if sensor in groups:
                raise RecordingError(path, place, f"{sensor} without gx gy gz", "add the gyroscope or drop it")
    return groups


def _reject_strange_unit(path: Path, place: str, own: list[str], names: list[str]) -> None:
    """Raise an error if one of the missing columns is there with a suffix that is no unit, as ``gx_furlong``."""
    for theirs in own:
        text = re.sub(r"[\s.-]+", "_", theirs.lower())
        sensor, time = SYNONYM.fullmatch(text), re.fullmatch(r"(t|time|timestamp)_\w+", text)
        name = (
            "t" if time else sensor["sensor"][0].replace("w", "g").replace("o", "g") + sensor["axis"] if sensor else ""
        )
        if name in names and (time or (sensor and sensor["unit"])):
            known = " ".join(UNITS[QUANTITY[name]])
            raise RecordingError(path, place, f"unknown unit of column {theirs!r}", f"known: {known}")
