"""Several sensors of one filter: their measurements side by side in a row, and the update with all of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.filters.gate import Gate
from bingham.filters.protocol import UpdateInfo
from bingham.models.sensors import Sensor, condition
from bingham.validation import as_array, as_numbers, is_missing, missing_rows

__all__ = ["columns", "rows_of", "update_all"]

FloatArray = NDArray[np.float64]


def columns(sensors: Sequence[Sensor]) -> list[slice]:
    """Return the columns of each sensor in a row of measurements."""
    sizes = [getattr(sensor, "size", None) for sensor in sensors]
    for sensor, size in zip(sensors, sizes, strict=True):
        if not isinstance(size, int) or size < 1:
            raise InvalidArgumentError(
                "measurement_noise", "sensors with a size, the numbers in a measurement, in a list",
                f"a {type(sensor).__name__} with size {size}", "give its class the attribute size",
            )  # fmt: skip
    ends = [0, *np.cumsum(np.array(sizes, dtype=int)).tolist()]
    return [slice(a, b) for a, b in pairwise(ends)]


def _joined(sensors: Sequence[Sensor], z: Any, name: str) -> FloatArray:
    """Return the measurements (..., N) of all sensors side by side, from such an array or from one for each."""
    parts = columns(sensors)
    if not isinstance(z, tuple):
        a = as_numbers(z, name)
        if a.shape[-1:] != (parts[-1].stop,):
            sizes = " + ".join(str(p.stop - p.start) for p in parts)
            raise InvalidArgumentError(
                name, f"{sizes} = {parts[-1].stop} columns for {len(parts)} sensors", f"shape {a.shape}",
                "or a tuple with one array for each sensor",
            )  # fmt: skip
        return a
    if len(z) != len(parts):
        raise InvalidArgumentError(name, f"one array for each of {len(parts)} sensors", f"a tuple of {len(z)}")
    given = [None if x is None else as_numbers(x, f"{name}[{i}]") for i, x in enumerate(z)]
    rows = next((a.shape[:-1] for a in given if a is not None), ())
    arrays = [np.full((*rows, p.stop - p.start), np.nan) if a is None else a for a, p in zip(given, parts, strict=True)]
    for i, (a, part) in enumerate(zip(arrays, parts, strict=True)):
        if a.shape != (*rows, part.stop - part.start):
            expected = f"shape {(*rows, part.stop - part.start)}, for {type(sensors[i]).__name__}"
            raise InvalidArgumentError(f"{name}[{i}]", expected, f"shape {a.shape}")
    return np.concatenate(arrays, axis=-1)


def rows_of(sensors: Sequence[Sensor], measurements: Any) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the rows (..., T, N) of measurements of all sensors and where none has one (..., T)."""
    a = _joined(sensors, measurements, "measurements")
    missing = [missing_rows(a[..., part], "measurements") for part in columns(sensors)]
    return a, np.logical_and.reduce(missing)


def update_all(state: Bingham, sensors: Sequence[Sensor], gate: Gate | None, z: Any) -> tuple[Bingham, UpdateInfo]:
    """Return the posterior given what each sensor measured, one after the other, and what the updates say."""
    row = _joined(sensors, tuple(as_array(x) for x in z) if isinstance(z, tuple) else as_array(z), "z")
    count = len(sensors)
    nis, thresholds = np.full(count, np.nan), np.full(count, math.inf)
    decisions, reasons, log_evidence = [-1] * count, [], 0.0
    for s, (sensor, part) in enumerate(zip(sensors, columns(sensors), strict=True)):
        if is_missing(row[part]):
            continue
        posterior, top, log_noise, rank = condition(state, sensor, row[part])
        log_evidence += float(posterior.log_normalizer + top - state.log_normalizer - log_noise)
        thresholds[s] = math.inf if gate is None else gate.threshold(rank)
        nis[s] = -2.0 * top
        decisions[s] = int(nis[s] <= thresholds[s])
        if decisions[s]:
            state = posterior
        else:
            reasons.append(f"sensor {s + 1}: NIS {nis[s]:.4g} above {thresholds[s]:.4g}")
    missing = all(d == -1 for d in decisions)
    reason = "missing" if missing else "; ".join(reasons)
    return state, UpdateInfo(log_evidence, nis, thresholds, not reason, reason, tuple(decisions))
