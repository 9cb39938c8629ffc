"""Whole sequences through the compiled loops of `kernels.step`: checks, time steps, batches."""

from __future__ import annotations

from typing import Literal, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.filters.gate import Gate
from bingham.filters.track import Track
from bingham.kernels import step
from bingham.kernels.threads import by_rows
from bingham.models.motion import ControlledRotation, Diffusion, Gyroscope, MotionModel, RandomWalk, diffusion_weight
from bingham.models.sensors import OrientationSensor
from bingham.recording import as_seconds
from bingham.rotations import from_rotation_vector
from bingham.validation import as_numbers, unit_or_missing

__all__ = ["run_conjugate", "sequence_steps", "time_steps"]

FloatArray = NDArray[np.float64]


def time_steps(times: ArrayLike, start_time: float | None, count: int) -> FloatArray:
    """Return the seconds (T,) before each of ``count`` times, the first counted from start_time."""
    t = as_seconds(times, "times")
    if t.shape != (count,):
        raise InvalidArgumentError("times", f"shape ({count},), one for each measurement", t.shape)
    steps = np.diff(t, prepend=t[:1] if start_time is None else start_time)
    wrong = np.flatnonzero(~np.isfinite(t) | ~(steps > 0.0))
    wrong = wrong[(wrong > 0) | ~(steps[wrong] == 0.0)]
    if wrong.size:
        i = int(wrong[0])
        raise InvalidArgumentError(
            "times",
            "strictly increasing seconds, from start_time on",
            f"{float(t[i])!r} at row {i}",
            "sort the rows and drop repeated ones",
        )
    return steps


def sequence_steps(motion: MotionModel, times: ArrayLike | None, start_time: float | None, length: int) -> FloatArray:
    """Return the seconds (T,) before each measurement, ones without times; reject times that the motion cannot use."""
    if times is None:
        if isinstance(motion, (Diffusion, Gyroscope)):
            raise InvalidArgumentError("times", "seconds of each measurement, for motion in continuous time", None)
        return np.ones(length)
    steps = time_steps(times, start_time, length)
    if isinstance(motion, RandomWalk) and length > 2 and np.ptp(steps[1:]) > 1e-3 * steps[-1]:
        raise InvalidArgumentError(
            "times",
            "regular times for a noise given once per step",
            "irregular ones",
            "use models.motion.Diffusion or Gyroscope, which scale with time",
        )
    return steps


def _unit_or_missing(x: ArrayLike | Rotation, d: int, name: str) -> FloatArray:
    a = as_numbers(x, name)
    if a.ndim not in (2, 3) or a.shape[-1] != d:
        raise InvalidArgumentError(name, f"shape (T, {d}) or (B, T, {d})", a.shape)
    return unit_or_missing(a, d, name)


def run_conjugate(
    motion: RandomWalk | Diffusion | Gyroscope,
    sensor: OrientationSensor,
    gate: Gate | None,
    prior: Bingham,
    measurements: ArrayLike | Rotation,
    controls: ArrayLike | Rotation | None,
    times: ArrayLike | None,
    start_time: float | None,
    keep: Literal["all", "last"],
) -> Track:
    """Body of `BinghamFilter.run`."""
    d = motion.dim
    y = _unit_or_missing(measurements, d, "measurements")
    batched = y.ndim == 3
    if prior.dim != d or len(prior.shape) > 1 or (prior.shape and not batched):
        raise InvalidArgumentError(
            "prior",
            f"a distribution of dimension {d}" + (", single or one for each recording" if batched else ""),
            f"dimension {prior.dim}, batch {prior.shape}",
        )
    if not batched:
        y = y[None]
    count, length = y.shape[:2]
    if prior.shape and prior.shape != (count,):
        raise InvalidArgumentError("prior", f"a batch of {count}, one for each recording", prior.shape)

    steps = sequence_steps(motion, times, start_time, length)
    turns = _controls(motion, controls, steps, count, length, d)
    uniform_weights = np.empty(0)
    if isinstance(motion, (Diffusion, Gyroscope)):
        uniform_weights = diffusion_weight(motion.random_walk**2 * steps, d)

    z = np.array(np.broadcast_to(prior.z, (count, d)))
    frames = np.array(np.broadcast_to(np.swapaxes(prior.M, -1, -2), (count, d, d)))
    kept = length if keep == "all" else min(length, 1)
    out_z, out_frames = np.empty((count, kept, d)), np.empty((count, kept, d, d))
    evidence, nis = np.empty((count, kept)), np.empty((count, kept))
    decision = np.empty((count, kept), dtype=np.int8)
    threshold = np.inf if gate is None else gate.threshold(d - 1)
    noise = sensor.noise
    log_f = float(noise.log_normalizer)
    parts = motion.parts if isinstance(motion, RandomWalk) else None
    mode = np.eye(d)[0] if parts is None else parts.mode
    tangent = np.zeros((d - 1, d - 1)) if parts is None else parts.tangent
    results = (out_z, out_frames, evidence, nis, decision)
    if d == 4:
        left = isinstance(motion, RandomWalk) and motion.left
        if left != sensor.left and not (np.ptp(noise.z[:3]) == 0.0 and abs(noise.mode[0]) == 1.0):
            raise InvalidArgumentError(
                "noise_side",
                "process and measurement noise on the same side for run",
                "different sides",
                "call predict and update row by row",
            )
        weight = 1.0 if parts is None else parts.weight
        sensed = (np.array(noise.z), sensor.frame, log_f, threshold)

        def run(z: FloatArray, frames: FloatArray, turns: FloatArray, y: FloatArray, *out: FloatArray) -> None:
            step.run_many_4(z, frames, turns, uniform_weights, mode, tangent, weight, left, y, *sensed, *out)

    else:
        variance = float(tangent[0, 0])
        sensed_2 = (float(noise.z[0]), np.array(noise.mode), log_f, threshold)

        def run(z: FloatArray, frames: FloatArray, turns: FloatArray, y: FloatArray, *out: FloatArray) -> None:
            step.run_many_2(z, frames, turns, uniform_weights, mode, variance, y, *sensed_2, *out)

    by_rows(run, z, frames, turns, y, *results, row_us=(1.2 if d == 4 else 0.4) * length)
    time = None if times is None else np.array(times, dtype=np.float64)
    columns = np.ascontiguousarray(np.swapaxes(out_frames, -1, -2))
    first = slice(None) if batched else 0
    return Track(
        time if keep == "all" or time is None else time[-1:],
        out_z[first],
        columns[first],
        evidence[first],
        nis[first],
        decision[first],
        threshold=threshold,
    )


def _controls(
    motion: object, controls: ArrayLike | Rotation | None, steps: FloatArray, count: int, length: int, d: int
) -> FloatArray:
    """Known rotations (B, T, d), or (B, 0, d) without any."""
    if controls is None:
        if isinstance(motion, (ControlledRotation, Gyroscope)):
            raise InvalidArgumentError("controls", f"one row for each measurement, for {type(motion).__name__}", None)
        return np.empty((count, 0, d))
    if isinstance(motion, Gyroscope):
        rate = np.asarray(cast(ArrayLike, controls), dtype=np.float64)
        if rate.shape not in ((length, 3), (count, length, 3)):
            raise InvalidArgumentError("controls", f"angular rates ({length}, 3), rad/s", f"shape {rate.shape}")
        wrong = np.flatnonzero(~np.isfinite(rate).all(axis=-1).ravel())
        if wrong.size:
            i = int(wrong[0])
            raise InvalidArgumentError(
                "controls",
                "finite angular rates, rad/s",
                f"{rate.reshape(-1, 3)[i]} at row {i}",
                "drop rows without one",
            )
        turns = from_rotation_vector(rate * steps[:, None])
    else:
        turns = _unit_or_missing(controls, d, "controls")
        if turns.shape[-2] != length or np.isnan(turns).any():
            raise InvalidArgumentError("controls", f"{length} known rotations without gaps", turns.shape)
    return np.ascontiguousarray(np.broadcast_to(turns, (count, length, d)))
