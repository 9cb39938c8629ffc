"""The compiled loops behind `BinghamFilter.run`: models as the kernels take them, batches, tracks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.filters.gate import Gate
from bingham.filters.run import Rows
from bingham.filters.sensor_list import columns
from bingham.filters.track import BinghamTrack
from bingham.models.diffusion import Diffusion, Gyroscope, brownian_moments, diffusion_weight
from bingham.models.motion import ControlledRotation, MotionModel, RandomWalk
from bingham.models.sensors import HeadingSensor, OrientationSensor, Sensor, VectorSensor
from bingham.rotations import from_rotation_vector
from bingham.validation import unit_or_missing

__all__ = ["bingham_track", "has_loop", "run_compiled", "run_sequences", "sensor_table"]

FloatArray = NDArray[np.float64]

MOTIONS = (RandomWalk, ControlledRotation, Diffusion, Gyroscope)
SENSORS = (OrientationSensor, VectorSensor, HeadingSensor)


def has_loop(motion: MotionModel, sensors: Sequence[Sensor]) -> bool:
    """Whether a compiled loop knows these models; subclasses of users may differ from what it does."""
    kinds = {type(sensor) for sensor in sensors}
    if type(motion) not in MOTIONS or not kinds <= set(SENSORS):
        return False
    return motion.dim == 4 or (len(sensors) == 1 and kinds == {OrientationSensor})


def run_compiled(
    motion: Any, sensors: Sequence[Any], gate: Gate | None, prior: Bingham, rows: Rows, *, in_list: bool
) -> BinghamTrack:
    """Body of `BinghamFilter.run` for models of this package."""
    d = motion.dim
    y = _checked(sensors, rows.measurements, in_list)
    batched = y.ndim == 3
    if prior.dim != d or len(prior.shape) > 1 or (prior.shape and not batched):
        raise InvalidArgumentError(
            "prior",
            f"a distribution of dimension {d}" + (", single or one for each recording" if batched else ""),
            f"dimension {prior.dim}, batch {prior.shape}",
        )
    y = y if batched else y[None]
    count, length = y.shape[:2]
    if prior.shape and prior.shape != (count,):
        raise InvalidArgumentError("prior", f"a batch of {count}, one for each recording", prior.shape)
    controls = _controls(motion, rows, count, length)
    steps = np.ones(length) if rows.steps is None else rows.steps
    variances = None if isinstance(motion, RandomWalk) else motion.variances(steps)
    thresholds = [np.inf if gate is None else gate.threshold(_rank(sensor, d)) for sensor in sensors]
    # One compiled version serves all calls: every array writable and contiguous.
    z = np.array(np.broadcast_to(prior.z, (count, d)), order="C")
    frames = np.array(np.broadcast_to(np.swapaxes(prior.M, -1, -2), (count, d, d)), order="C")
    y = np.require(y, requirements=["C", "W"])
    kept = 1 if rows.keep == "last" else length
    table = sensor_table(sensors, thresholds, d)
    left = bool(getattr(motion, "left", False))
    shares = None if all(isinstance(sensor, OrientationSensor) for sensor in sensors) else np.ones(1)
    results = run_sequences(motion, variances, left, table, z, frames, controls, y, shares, kept)
    unusable = np.argwhere(results[4] < -1)
    if len(unusable):
        b, t, s = (int(i) for i in unusable[0])
        kind = type(sensors[s])
        expected = "a vector with a horizontal part" if kind is HeadingSensor else "a non-zero vector"
        hint = "a vertical field has no heading: blank the row (NaN)" if kind is HeadingSensor else ""
        part = columns(sensors)[s]
        raise InvalidArgumentError("measurements", expected, f"{y[b, t, part]} at row {t}", hint)
    limits = np.array(thresholds) if in_list else thresholds[0]
    time = None if rows.time is None else rows.time[rows.kept]
    return bingham_track(results, time, limits, batched=batched, in_list=in_list, states=rows.keep != "modes")


def bingham_track(
    results: Sequence[Any],
    time: FloatArray | None,
    threshold: Any,
    *,
    batched: bool,
    in_list: bool,
    states: bool = True,
    kind: type[BinghamTrack] = BinghamTrack,
    **more: Any,
) -> Any:
    """Return the track of what a loop kept: z, frames by columns, log-evidence, nis, decision, each (B, T, …)."""
    z, frames, evidence, nis, decision = (a if batched else a[0] for a in results)
    return kind(
        time=time,
        modes=np.ascontiguousarray(frames[..., -1]),
        log_evidence=evidence,
        nis=nis if in_list else nis[..., 0],
        decision=decision if in_list else decision[..., 0],
        final=Bingham.from_spectrum(z[..., -1, :].copy(), frames[..., -1, :, :].copy()),
        states=Bingham.from_spectrum(z, frames) if states else None,
        threshold=threshold,
        **more,
    )


def _checked(sensors: Sequence[Any], y: FloatArray, in_list: bool) -> FloatArray:
    """Return the rows with unit vectors where orientations are measured."""
    if not in_list and y.shape[-1] != sensors[0].size:
        n = sensors[0].size
        raise InvalidArgumentError("measurements", f"shape (T, {n}) or (B, T, {n})", y.shape)
    if y.ndim > 3:
        raise InvalidArgumentError("measurements", "shape (T, n) or (B, T, n)", y.shape)
    for sensor, part in zip(sensors, columns(sensors), strict=True):
        if isinstance(sensor, OrientationSensor):
            y[..., part] = unit_or_missing(y[..., part], sensor.size, "measurements")
        elif np.isinf(y[..., part]).any():
            row = int(np.argwhere(np.isinf(y[..., part]).any(axis=-1))[0][-1])
            raise InvalidArgumentError("measurements", "finite vectors, or NaN where missing", f"infinity at row {row}")
        else:
            # Only directions count; lengths whose squares are no numbers would make them vanish.
            largest = np.abs(y[..., part]).max(axis=-1, keepdims=True)
            y[..., part] /= np.where(largest > 0.0, largest, 1.0)
    return y


def _rank(sensor: Any, d: int) -> int:
    """Degrees of freedom of a measurement."""
    return d - 1 if isinstance(sensor, OrientationSensor) else 2 if isinstance(sensor, VectorSensor) else 1


def sensor_table(sensors: Sequence[Any], thresholds: Sequence[float], d: int = 4) -> Any:
    """Return the sensors of a filter of dimension d as ``kernels.sensors`` takes them."""
    from bingham.kernels import sensors as kernel

    count = len(sensors)
    table = kernel.Sensors(
        kind=np.array([SENSORS.index(type(sensor)) for sensor in sensors]),
        column=np.array([part.start for part in columns(sensors)]),
        threshold=np.array(thresholds),
        concentration=np.zeros(count),
        reference=np.zeros((count, 3)),
        noise_z=np.zeros((count, d)),
        noise_frame=np.zeros((count, d, d)),
        log_normalizer=np.zeros(count),
        left=np.array([bool(getattr(sensor, "left", False)) for sensor in sensors]),
    )
    for s, sensor in enumerate(sensors):
        if isinstance(sensor, OrientationSensor):
            table.noise_z[s], table.noise_frame[s] = sensor.noise.z, sensor.frame
            table.log_normalizer[s] = sensor.noise.log_normalizer
        else:
            r = np.asarray(sensor.reference)
            table.concentration[s] = sensor.concentration
            table.reference[s, : len(r)] = r / np.linalg.norm(r)
    return table


def run_sequences(
    motion: Any,
    variances: FloatArray | None,
    left: bool,
    sensors: Any,
    z: FloatArray,
    frames: FloatArray,
    controls: FloatArray,
    y: FloatArray,
    shares: FloatArray | None,
    kept: int,
) -> tuple[Any, ...]:
    """Return z, frames by columns, log-evidence, nis and decision of B sequences; z and frames hold the end states."""
    from bingham.kernels import sensors as kernel
    from bingham.kernels.threads import by_rows

    d = z.shape[-1]
    weights = np.empty(0)
    mode, tangents, rest = np.eye(d)[0], np.zeros((1, d - 1, d - 1)), np.ones(1)
    if variances is None:
        parts = motion.parts
        mode, tangents, rest = np.array(parts.mode), np.array(parts.tangent)[None], np.array([parts.weight])
    elif variances.ndim == 1:
        weights = diffusion_weight(variances, d)
    else:
        moments = brownian_moments(variances)
        tangents, rest = moments[..., None] * np.eye(3), 1.0 - moments.sum(axis=-1)
    count, sensor_count = len(z), len(sensors.kind)
    loop = kernel.run_sequences if d == 4 else kernel.run_2
    results = kernel.Kept(
        np.empty((count, kept, d)),
        np.empty((count, kept, d, d)),
        np.empty((count, kept)),
        np.empty((count, kept, sensor_count)),
        np.empty((count, kept, sensor_count), dtype=np.int8),
    )

    def run(z: FloatArray, frames: FloatArray, turns: FloatArray, y: FloatArray, *out: Any) -> None:
        moved = kernel.Motion(turns, left, weights, mode, tangents, rest, left)
        loop(z, frames, moved, y, sensors, shares, kernel.Kept(*out))

    by_rows(run, z, frames, controls, y, *results, row_us=(0.7 + 0.5 * sensor_count) * y.shape[1])
    return results


def _controls(motion: Any, rows: Rows, count: int, length: int) -> FloatArray:
    """Known rotations (B, T, d), or (B, 0, d) without any."""
    controls, d = rows.controls, motion.dim
    if controls is None:
        if isinstance(motion, (ControlledRotation, Gyroscope)):
            raise InvalidArgumentError("controls", f"one row for each measurement, for {type(motion).__name__}", None)
        return np.empty((count, 0, d))
    if isinstance(motion, Gyroscope):
        if controls.shape not in ((length, 3), (count, length, 3)):
            raise InvalidArgumentError("controls", f"angular rates ({length}, 3), rad/s", f"shape {controls.shape}")
        wrong = np.flatnonzero(~np.isfinite(controls).all(axis=-1).ravel())
        if wrong.size:
            i = int(wrong[0])
            got = f"{controls.reshape(-1, 3)[i]} at row {i % length}"
            raise InvalidArgumentError("controls", "finite angular rates, rad/s", got, "drop rows without one")
        assert rows.steps is not None
        rotations = from_rotation_vector(controls * rows.steps[:, None])
    else:
        if controls.ndim not in (2, 3) or controls.shape[-1] != d:
            raise InvalidArgumentError("controls", f"shape (T, {d}) or (B, T, {d})", controls.shape)
        rotations = unit_or_missing(controls, d, "controls")
        if np.isnan(rotations).any():
            raise InvalidArgumentError("controls", f"{length} known rotations without gaps", rotations.shape)
    return np.array(np.broadcast_to(rotations, (count, length, d)), order="C")
