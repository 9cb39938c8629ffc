"""What numbers tell about a sensor: raw counts of a converter are no rates and forces; x, y, z of an unnamed sensor."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError, Setting
from bingham.io.checks import note
from bingham.io.columns import Found
from bingham.io.layout import Layout
from bingham.io.words import joined

__all__ = ["reject_counts", "sensor_of_numbers"]

FloatArray = NDArray[np.float64]
GRAVITY = (4.0, 30.0)  # m/s², what a bodily accelerometer usually measures lies between
NEAR_GRAVITY, NEAR_ONE = (9.0, 10.8), (0.7, 1.4)
MANY_RAD = 100.0  # integers beyond it are no rates in rad/s
# Of a file's name: its columns x, y, z are of no sensor that is filtered.
OTHER = re.compile(
    r"(?:^|_)(?:euler\w*|quat\w*|orientation|attitude|gravity|linear\w*|heading|positions?|angles?)(?:_|$)"
)
DISTINCT = 10  # values that a converter's counts take on at least, noise and all
SOME = 2000  # rows that are looked at first
SCALES = {"accelerometer": "1/4096g", "gyroscope": "1/16.4deg_s"}


def reject_counts(path: Path, values: Mapping[str, FloatArray], found: Found) -> None:
    """Raise an error if gyroscope and accelerometer hold the integers of a converter, and nobody told their scale."""
    force, rate = values.get("accelerometer"), values.get("gyroscope")
    if force is not None and _integers(force, found.factor.get("ax", 1.0)):
        with np.errstate(over="ignore"):
            usual = float(np.nanmedian(np.linalg.norm(force, axis=1)))
        if not GRAVITY[0] < usual < GRAVITY[1]:
            raw = usual / found.factor.get("ax", 1.0)
            problem = f"integers, usually {raw:.4g} where gravity alone is 9.81 m/s²: raw counts"
            raise RecordingError(path, "accelerometer", problem, _hint(found))
    if rate is not None and "gyroscope" not in found.told and _integers(rate, found.factor.get("gx", 1.0)):
        largest = float(np.nanmax(np.abs(rate)))
        if largest > MANY_RAD:
            problem = f"integers up to {largest:.4g}, which are no rad/s: raw counts"
            raise RecordingError(path, "gyroscope", problem, _hint(found))


def _hint(found: Found) -> tuple[str, Setting]:
    """Return how to give the scales of those sensors whose units nobody told."""
    of = {sensor: scale for sensor, scale in SCALES.items() if sensor not in found.told}
    return "give the scales of the data sheet: ", Setting("units", of)


def sensor_of_numbers(path: Path, values: FloatArray, layout: Layout, columns: list[int]) -> str:
    """Return which sensor columns x, y, z without unit are of, with a warning that names how to say so."""
    with np.errstate(over="ignore"):
        norm = np.linalg.norm(values, axis=1)
    norm = norm[np.isfinite(norm)]
    if not norm.size:
        raise RecordingError(path, "", "no row with a finite x, y and z", "record or copy it again")
    usual, *steady = (float(np.quantile(norm, q)) for q in (0.5, 0.1, 0.9))
    x, y, z = (layout.names[k] for k in columns)
    if NEAR_ONE[0] < steady[0] <= steady[1] < NEAR_ONE[1]:
        hint = ("name them, as ", Setting("columns", {"gx": x, "gy": y, "gz": z}))
        raise RecordingError(path, f"columns {x} {y} {z}", "of which sensor?", hint)
    kind = "accelerometer" if NEAR_GRAVITY[0] < usual < NEAR_GRAVITY[1] else "gyroscope"
    stem = joined(path.stem)
    if kind == "gyroscope" and OTHER.search(stem):
        hint = ("of a gyroscope in spite of its name? ", Setting("columns", {"gx": x, "gy": y, "gz": z}))
        raise RecordingError(path, f"columns {x} {y} {z}", "no rates, by the name of the file", hint)
    unit, names = ("m/s²", ("ax", "ay", "az")) if kind == "accelerometer" else ("rad/s", ("gx", "gy", "gz"))
    another = Setting("columns", dict(zip(names, (x, y, z), strict=True)))
    note(path, f"columns {x} {y} {z} of no named sensor taken for the {kind}'s, {unit}; name another by ", another)
    return kind


def _integers(values: FloatArray, factor: float) -> bool:
    """Whether all numbers are integers before a unit's factor, and of many values."""
    for rows in (values[:SOME], values):
        raw = rows[np.isfinite(rows)] / factor
        if np.unique(raw[:SOME]).size < DISTINCT or np.abs(raw - np.round(raw)).max() > 1e-6:
            return False
    return True
