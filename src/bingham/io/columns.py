"""Which columns of a CSV mean what: units stand in the names or in options and are never guessed.

======================  =============================  ====================================================
quantity                columns                        units (suffix ``gx_deg_s`` or bracket ``gx [deg/s]``)
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

Case does not matter, lines that start with ``#`` are comments, an empty cell means no sample.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path

from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io.checks import note

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
UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "gyroscope": {"rad_s": 1.0, "deg_s": math.pi / 180},
    "accelerometer": {"m_s2": 1.0, "g": 9.80665},
    "magnetometer": {"ut": 1.0, "nt": 1.0, "mt": 1.0, "t": 1.0, "gauss": 1.0, "mgauss": 1.0},
    "position": {"m": 1.0, "mm": 1e-3},
}
# Columns of a written track that a recording has no use for.
TRACK_COLUMN = re.compile(r"cov_[xyz]{2}|z\d+|log_evidence|accepted|reason")


def understand(
    path: Path, place: str, own: list[str], columns: Mapping[str, str], units: Mapping[str, str]
) -> tuple[dict[str, str], dict[str, float]]:
    """Map known column names to the file's own names and to the factors that give SI units."""
    for quantity, unit in units.items():
        if unit not in UNITS.get(quantity, {}):
            expected = f"one of {', '.join(UNITS.get(quantity, UNITS))}"
            raise InvalidArgumentError("units", expected, repr(unit if quantity in UNITS else quantity))
    for name, theirs in columns.items():
        if name not in QUANTITY or theirs not in own:
            got = f"{name!r}: {theirs!r}"
            raise InvalidArgumentError("columns", "a known name and a column of the file", got, f"file has: {own}")
    renamed = {theirs: name for name, theirs in columns.items()}
    found: dict[str, str] = {}
    factors: dict[str, float] = {}
    unknown: list[str] = []
    for theirs in own:
        name, unit = (renamed[theirs], None) if theirs in renamed else _split(theirs)
        if name not in QUANTITY:
            if not TRACK_COLUMN.fullmatch(name):
                unknown.append(theirs)
            continue
        if name in found:
            raise RecordingError(path, place, f"columns {found[name]!r} and {theirs!r} both mean {name}", "drop one")
        quantity = QUANTITY[name]
        asked = units.get(quantity)
        if unit is not None and asked is not None and unit != asked:
            raise RecordingError(path, place, f"column {theirs!r} says {unit}, the option {asked}", "drop the option")
        unit = unit or asked
        known = UNITS.get(quantity, {})
        if unit is not None and unit not in known:
            raise RecordingError(
                path, place, f"unknown unit of column {theirs!r}", f"known: {' '.join(known) or 'none'}"
            )
        found[name], factors[name] = theirs, 1.0 if unit is None else known[unit]
    if unknown:
        note(f"{path}: {place}: unknown columns left out: {', '.join(unknown)}; known: {' '.join(QUANTITY)}")
    return found, factors


def _split(theirs: str) -> tuple[str, str | None]:
    """Split ``gx [deg/s]`` or ``gx_deg_s`` into ``("gx", "deg_s")``."""
    text = theirs.lower()
    bracket = re.fullmatch(r"(.*?)\s*[\[(]\s*(.*?)\s*[\])]", text)
    if bracket:
        name, unit = bracket.groups()
        unit = re.sub(r"[µμ]", "u", unit).replace("²", "2").replace("^", "").replace("°", "deg").replace("/", "_")
        return ALIASES.get(name, name), unit
    candidates = [*QUANTITY, *ALIASES]
    for name in sorted(candidates, key=len, reverse=True):
        canonical = ALIASES.get(name, name)
        if text == name:
            return canonical, None
        if text.startswith(f"{name}_") and text[len(name) + 1 :] in UNITS.get(QUANTITY[canonical], {}):
            return canonical, text[len(name) + 1 :]
    return text, None


def group(path: Path, place: str, found: Mapping[str, str]) -> dict[str, list[str]]:
    """Gather columns into the fields of a recording; every quantity must be complete."""
    groups: dict[str, list[str]] = {}
    for quantity, names in COLUMNS.items():
        present = [c for c in names if c in found]
        if present and present != names:
            missing = " ".join(c for c in names if c not in found)
            raise RecordingError(
                path, place, f"no column {missing} for the {quantity}", "add it or name it in columns="
            )
        if present:
            groups[quantity] = names
    if "time" not in groups:
        raise RecordingError(
            path, place, "names no column t", "add the time in seconds or name it in columns={'t': ...}"
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
        raise RecordingError(path, place, "neither gx gy gz nor qw qx qy qz", "name the columns so or use columns=")
    else:
        for sensor in ("accelerometer", "magnetometer"):
            if sensor in groups:
                raise RecordingError(path, place, f"{sensor} without gx gy gz", "add the gyroscope or drop it")
    return groups
