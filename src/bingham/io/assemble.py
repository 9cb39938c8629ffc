"""From samples of sensors, each at its own times, to one recording: the last step of every reader.

Clocks are put right, rows of zeros are no samples, and what is not measured at a gyroscope time is carried to the
nearest one: a vector that is fixed in the world for half a step moves in the body against the measured rate.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError
from bingham.io.checks import Place, build, build_of_units, note, repaired
from bingham.io.clock import mended_clock
from bingham.recording import ImuRecording, OrientationRecording

__all__ = [
    "Stream",
    "carried",
    "check_measurable",
    "inertial_recording",
    "orientation_recording",
    "say_zero_rows",
    "say_zero_samples",
    "zero_rows",
]

FloatArray = NDArray[np.float64]

MEASURABLE = 1e12  # in any unit that files have; beyond it a number is no measurement


class Stream(NamedTuple):
    """Samples (N, k) of a sensor at its times (N,), s; sensors that share an array of times share rows."""

    time: FloatArray
    values: FloatArray


def inertial_recording(
    path: Path,
    place: Place,
    streams: Mapping[str, Stream],
    rows: Mapping[str, NDArray[Any]] | None = None,
    *,
    regularise: bool = False,
    units: bool = True,
    **about: Any,
) -> ImuRecording:
    """Make a recording of a gyroscope and what was measured beside it.

    Parameters
    ----------
    path, place : Path, callable
        For messages; ``place(sensor, k)`` names row k of a sensor's stream.
    streams : mapping of str to Stream
        "gyroscope", and perhaps "accelerometer" and "magnetometer".
    rows : mapping of str to ndarray, optional
        What else has a row for each gyroscope sample: reference, score.
    regularise : bool
        See `mended_clock`.
    units : bool
        Whether the caller's reader takes units, for hints.
    **about
        Further fields of the recording.
    """
    gyroscope = streams["gyroscope"]
    for name, stream in streams.items():
        check_measurable(path, place, name, stream.values)
    aligned = {name: s.values for name, s in streams.items() if s.time is gyroscope.time} | dict(rows or {})
    own = {name: s for name, s in streams.items() if s.time is not gyroscope.time}
    time = gyroscope.time
    index: NDArray[np.intp] | None = None
    if (samples := _samples(path, aligned)) is not None:
        index, time = samples, time[samples]
    mended = mended_clock(path, _through(place, index), time, regularise=regularise)
    time = mended.time
    if mended.rows is not None:
        index = mended.rows if index is None else index[mended.rows]
    if index is not None:
        aligned = {name: values[index] for name, values in aligned.items()}
    for name, stream in own.items():
        aligned[name] = _beside(path, place, name, stream, time, aligned["gyroscope"], regularise)
    for name in ("accelerometer", "magnetometer"):
        if name in aligned:
            aligned |= _without_zeros(path, name, aligned[name])
    fields = {name: values for name, values in aligned.items() if values is not None}
    for values in (time, *fields.values()):
        values.setflags(write=False)  # so the recording need not copy them
    return build_of_units(ImuRecording, path, _through(place, index), {**about, "time": time, **fields}, units=units)


def orientation_recording(
    path: Path, place: Place, rows: Mapping[str, NDArray[Any]], *, regularise: bool = False, **about: Any
) -> OrientationRecording:
    """Make a recording of orientations; `rows` are its fields, "time" among them."""
    mended = mended_clock(path, place, rows["time"], regularise=regularise)
    index = mended.rows
    fields = {field: values if index is None else values[index] for field, values in rows.items() if field != "time"}
    return build(OrientationRecording, path, _through(place, index), time=mended.time, **fields, **about)


def carried(time: FloatArray, gyroscope: FloatArray, stamp: FloatArray, samples: FloatArray) -> tuple[FloatArray, int]:
    """Put samples (K, 3) at the nearest of the gyroscope times (N,); return rows (N, 3) and how many found none.

    v(t) = exp(−ω (t − s)) v(s) for a vector that is fixed in the world, with the rate ω nearest to its stamp s. A
    sample more than one usual step away is left out; of two that share the nearest time the closer one stays.
    """
    rows = np.full((len(time), samples.shape[1]), np.nan)
    if not len(stamp):
        return rows, 0
    reach = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    after = np.clip(np.searchsorted(time, stamp), 1, len(time) - 1) if len(time) > 1 else np.zeros(len(stamp), np.intp)
    before = np.maximum(after - 1, 0)
    nearest = np.where(np.abs(time[before] - stamp) <= np.abs(time[after] - stamp), before, after)
    ahead = time[nearest] - stamp
    near = np.abs(ahead) <= reach
    order = np.argsort(-np.abs(ahead[near]), kind="stable")  # the closest is written last and so stays
    target = nearest[near][order]
    rows[target] = _rotated(samples[near][order], -gyroscope[target] * ahead[near][order, None])
    return rows, len(stamp) - len(np.unique(target))


def _rotated(v: FloatArray, r: FloatArray) -> FloatArray:
    """Return vectors (K, 3) rotated by rotation vectors (K, 3): Rodrigues' formula."""
    angle = np.linalg.norm(r, axis=1, keepdims=True)
    if not angle.any():
        return v
    half = np.sinc(0.5 * angle / np.pi)
    turn = np.cross(r, v)
    return v + np.sinc(angle / np.pi) * turn + 0.5 * half**2 * np.cross(r, turn)


def _through(place: Place, index: NDArray[np.intp] | None) -> Place:
    """Name rows as they stood in the file before some were left out."""
    return place if index is None else lambda field, k: place(field, int(index[k]))


def check_measurable(path: Path, place: Place, name: str, values: FloatArray) -> None:
    """Raise an error for numbers that no sensor measures."""
    if values.size and not -MEASURABLE <= values.min() <= values.max() <= MEASURABLE:  # NaN: looked at one by one
        with np.errstate(invalid="ignore"):
            beyond = (np.abs(values) > MEASURABLE).any(axis=1)
        if beyond.any():
            k = int(np.argmax(beyond))
            worst = float(np.nanmax(np.abs(values[k])))
            raise RecordingError(path, place(name, k), f"{worst:.3g} is no measurement", "remove or correct the row")


def _samples(path: Path, aligned: Mapping[str, FloatArray]) -> NDArray[np.intp] | None:
    """Return the rows that are not zero in gyroscope and accelerometer at once, None if all are samples."""
    empty = zero_rows(aligned["gyroscope"], aligned.get("accelerometer"))
    if empty is None:
        return None
    if empty.all():
        raise RecordingError(path, "", "nothing but zeros in gyroscope and accelerometer", "record it again")
    say_zero_rows(path, int(np.count_nonzero(empty)), len(empty))
    return np.flatnonzero(~empty)


def zero_rows(*sensors: FloatArray | None) -> NDArray[np.bool_] | None:
    """Return which rows are zero in all of some sensors, which are no samples; None if none is, or a sensor absent."""
    first = sensors[0]
    if first is None or any(rows is None for rows in sensors) or not (zero := first[:, 0] == 0.0).any():
        return None
    at = np.flatnonzero(zero)
    for rows in sensors:
        at = at[(rows[at] == 0.0).all(axis=1)]  # type: ignore[index]
    if not len(at):
        return None
    empty = np.zeros(len(first), dtype=np.bool_)
    empty[at] = True
    return empty


def say_zero_rows(path: Path, count: int, size: int) -> None:
    """Say how many rows are no samples of gyroscope and accelerometer."""
    repaired(path, f"{count} of {size} rows are zero in gyroscope and accelerometer: no samples, left out")


def say_zero_samples(path: Path, name: str, count: int, size: int) -> None:
    """Say how many rows are no samples of a sensor beside the gyroscope."""
    repaired(path, f"{name}: {count} of {size} rows are zero: no samples")


def _without_zeros(path: Path, name: str, values: FloatArray) -> dict[str, Any]:
    """Take rows of zeros of an accelerometer or magnetometer for missing ones; a sensor of nothing else for absent."""
    empty = zero_rows(values)
    if empty is None:
        return {}
    if empty.all():
        note(path, f"{name}: nothing but zeros; left out")
        return {name: None}
    say_zero_samples(path, name, int(np.count_nonzero(empty)), len(empty))
    return {name: np.where(empty[:, None], np.nan, values)}


def _beside(
    path: Path, place: Place, name: str, stream: Stream, time: FloatArray, rate: FloatArray, regularise: bool
) -> FloatArray:
    """Put a sensor with a clock of its own beside the gyroscope."""
    bad = ~np.isfinite(stream.values).all(axis=1) | ~np.isfinite(stream.time)
    if bad.any():
        problem = "expected finite numbers, or none in the whole row"
        raise RecordingError(path, place(name, int(np.argmax(bad))), problem, "remove the row or complete it")

    def where(field: str, k: int) -> str:
        return place(name, k)

    own = mended_clock(path, where, stream.time, what=f"the {name}", regularise=regularise)
    values = stream.values if own.rows is None else stream.values[own.rows]
    if len(own.time) > 1 and not (np.diff(own.time) > 0).all():
        k = int(np.argmax(np.diff(own.time) <= 0)) + 1
        raise RecordingError(path, place(name, k), f"times of the {name} do not increase", "sort by time")
    rows, left = carried(time, rate, own.time, values)
    if left:
        note(path, f"{left} of {len(values)} samples of the {name} left out: no gyroscope time of their own")
    if left == len(values):
        hint = "check that the times have the same zero and unit"
        raise RecordingError(path, "", f"no sample of the {name} is near one of the gyroscope", hint)
    return rows
