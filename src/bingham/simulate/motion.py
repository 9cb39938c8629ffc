"""The truth that simulated sensors watch, and when they do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bingham.errors import InvalidArgumentError

__all__ = ["Motion", "phases", "sample_times"]


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """True motion of a body at sample times.

    Parameters
    ----------
    name : str
        What kind of motion it is.
    time : ndarray, shape (N,)
        Seconds.
    orientation : ndarray, shape (N, 4)
        Quaternions (w, x, y, z), body to world (ENU).
    angular_velocity : ndarray, shape (N, 3)
        Instantaneous, body frame, rad/s.
    moving : ndarray of bool, shape (N,)
        False in the rest phases.
    """

    name: str
    time: NDArray[np.float64]
    orientation: NDArray[np.float64]
    angular_velocity: NDArray[np.float64]
    moving: NDArray[np.bool_]


def sample_times(
    duration_s: float, rate_hz: float, jitter: float, drop_probability: float, rng: np.random.Generator | int | None
) -> NDArray[np.float64]:
    """Times k / rate from 0 to the duration, displaced by up to `jitter` intervals, some dropped; the ends stay."""
    for name, value in (("duration_s", duration_s), ("rate_hz", rate_hz)):
        if not 0 < value < np.inf:
            raise InvalidArgumentError(name, "a positive number", value)
    if duration_s * rate_hz < 1:
        raise InvalidArgumentError("duration_s", f"at least one interval, {1 / rate_hz:g} s", duration_s)
    if not 0 <= jitter < 0.5:
        raise InvalidArgumentError("jitter", "0 ≤ jitter < 0.5", jitter)
    if not 0 <= drop_probability < 1:
        raise InvalidArgumentError("drop_probability", "0 ≤ probability < 1", drop_probability)
    rng = np.random.default_rng(rng)
    time = np.arange(int(np.floor(duration_s * rate_hz * (1 + 1e-12))) + 1) / rate_hz
    inner = time[1:-1] + rng.uniform(-jitter, jitter, max(len(time) - 2, 0)) / rate_hz
    kept = inner[rng.random(len(inner)) >= drop_probability]
    return np.concatenate([time[:1], kept, time[1:][-1:]])


def phases(
    time: NDArray[np.float64], duration_s: float, rest_s: float
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Samples of the motion between the rests, and the time since it began."""
    if not 0 <= 2 * rest_s < duration_s:
        raise InvalidArgumentError(
            "rest_s", f"at least 0 and less than half of the duration, {duration_s / 2:g} s", rest_s
        )
    end = duration_s - rest_s
    return (time >= rest_s) & (time <= end), np.clip(time, rest_s, end) - rest_s
