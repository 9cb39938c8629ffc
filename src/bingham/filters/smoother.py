"""Smoothing for the Bingham filter: every distribution given the whole sequence, or given a few samples more.

The distribution of x_t given all measurements is the filtered distribution times the backward prediction, the
distribution of x_t given only the later measurements; Binghams multiply by adding their matrices. The backward
prediction is the same filter run over the reversed sequence with inverted motion from a uniform distribution, less the
likelihood of z_t itself.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.filters.first_order import BinghamFilter
from bingham.filters.sensor_list import columns
from bingham.filters.track import ACCEPTED, BinghamTrack
from bingham.models.diffusion import Diffusion, Gyroscope
from bingham.models.motion import MotionModel, RandomWalk
from bingham.models.sensors import OrientationSensor, VectorSensor, davenport_matrix
from bingham.rotations import compose, conjugate
from bingham.validation import as_numbers, check_kind, integer

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["smooth_fixed_interval", "smooth_fixed_lag"]

FloatArray = NDArray[np.float64]

ORDER = "the filter comes first, then the prior and the measurements"


def smooth_fixed_interval(
    bingham_filter: BinghamFilter,
    prior: Bingham,
    measurements: ArrayLike | Rotation | tuple[ArrayLike, ...],
    *,
    controls: ArrayLike | None = None,
    times: ArrayLike | None = None,
    start_time: float | None = None,
) -> BinghamTrack:
    """Return the distributions of every x_t given all measurements.

    Parameters
    ----------
    bingham_filter : BinghamFilter
        With orientation or vector sensors and a motion model of this package.
    prior : Bingham
        The distribution before the first prediction.
    measurements : (T, d) or (T, 3) array_like
        As the sensor takes them; NaN where missing. What the filter's gate rejects is not used on the way back either.
    controls, times, start_time : optional
        As in `BinghamFilter.run`.

    Returns
    -------
    Track
        Smoothed distributions; log-evidence, NIS and decision are those of the filter.

    Raises
    ------
    InvalidArgumentError
        If the filter cannot run over a sequence, or its noise depends on direction while there are controls.

    Examples
    --------
    >>> import numpy as np
    >>> from bingham import Bingham, BinghamFilter
    >>> noise = Bingham([-50.0, 0.0], np.eye(2)[:, ::-1])
    >>> f = BinghamFilter(noise, noise)
    >>> z = np.tile([1.0, 0.0], (5, 1))
    >>> filtered, smoothed = f.run(Bingham.uniform(2), z), smooth_fixed_interval(f, Bingham.uniform(2), z)
    >>> bool(smoothed.concentrations[0, 0] < filtered.concentrations[0, 0])
    True
    >>> bool(np.isclose(smoothed.concentrations[-1, 0], filtered.concentrations[-1, 0]))
    True
    """
    check_kind(bingham_filter, BinghamFilter, "bingham_filter", ORDER)
    forward = bingham_filter.run(prior, measurements, controls=controls, times=times, start_time=start_time)
    used, turns, seconds = _used(bingham_filter, forward, measurements, controls, times)
    back = _reversed(bingham_filter)
    likelihoods = _likelihoods(back, used)
    message = back.run(
        Bingham.uniform(back.motion.dim),
        used[::-1],
        controls=None if turns is None else _reversed_controls(back, turns),
        times=None if seconds is None else -seconds[::-1],
    )
    matrices = forward.matrices + message.matrices[::-1] - likelihoods
    return _track(forward, matrices)


def smooth_fixed_lag(
    bingham_filter: BinghamFilter,
    prior: Bingham,
    measurements: ArrayLike | Rotation | tuple[ArrayLike, ...],
    lag: int,
    *,
    controls: ArrayLike | None = None,
    times: ArrayLike | None = None,
    start_time: float | None = None,
) -> BinghamTrack:
    """Return the distributions of every x_t given the measurements up to t + lag; see `smooth_fixed_interval`.

    Parameters
    ----------
    lag : int
        Samples to wait for; 0 is the filter itself.
    """
    integer(lag, "lag", 0)
    check_kind(bingham_filter, BinghamFilter, "bingham_filter", ORDER)
    forward = bingham_filter.run(prior, measurements, controls=controls, times=times, start_time=start_time)
    used, turns, seconds = _used(bingham_filter, forward, measurements, controls, times)
    back = _reversed(bingham_filter)
    uniform = Bingham.uniform(back.motion.dim)
    matrices = forward.matrices.copy()
    for t in range(len(used) - 1 if lag else 0):
        window = slice(t, min(t + lag, len(used) - 1) + 1)
        later = used[window].copy()
        later[0] = np.nan  # z_t is in the filtered distribution already
        message = back.run(
            uniform,
            later[::-1],
            controls=None if turns is None else _reversed_controls(back, turns[window]),
            times=None if seconds is None else -seconds[window][::-1],
            keep="last",
        )
        matrices[t] += message.matrices[0]
    return _track(forward, matrices)


def _used(
    bingham_filter: BinghamFilter, forward: BinghamTrack, measurements: Any, controls: Any, times: Any
) -> tuple[FloatArray, FloatArray | None, FloatArray | None]:
    """Return what the filter used: measurements (NaN where it rejected), controls, times."""
    motion = bingham_filter.motion
    used, _ = bingham_filter._measurements(measurements)
    if used.ndim != 2:
        raise InvalidArgumentError("measurements", "one sequence, shape (T, d)", used.shape, "smooth one by one")
    decision = forward.decision.reshape(len(used), -1)
    for s, part in enumerate(_columns(bingham_filter, used)):
        used[decision[:, s] != ACCEPTED, part] = np.nan
    turns = None if controls is None else as_numbers(controls, "controls")
    if turns is not None and not _isotropic(motion):
        raise InvalidArgumentError(
            "bingham_filter",
            "isotropic process noise about the identity where there are controls",
            repr(motion),
            "use Diffusion or Gyroscope with one number for all axes",
        )
    return used, turns, None if times is None else np.asarray(times, dtype=np.float64)


def _isotropic(motion: MotionModel) -> bool:
    """Whether control and noise of a step may change places."""
    if isinstance(motion, RandomWalk):
        z = motion.noise.z
        return bool(np.ptp(z[:-1]) == 0.0 and abs(motion.noise.mode[0]) >= 1.0 - 1e-12)
    return not isinstance(motion, (Diffusion, Gyroscope)) or isinstance(motion.random_walk, float)


def _columns(bingham_filter: BinghamFilter, used: FloatArray) -> list[slice]:
    return columns(bingham_filter.sensors) if bingham_filter.in_list else [slice(0, used.shape[1])]


def _reversed(bingham_filter: BinghamFilter) -> BinghamFilter:
    """Return the filter for the reversed sequence: x = x' ⊕ w*, and nothing is rejected twice."""
    motion, sensors = bingham_filter.motion, bingham_filter.sensors
    if isinstance(motion, RandomWalk):
        motion = replace(motion, noise=motion.noise.inverse())
    return BinghamFilter(motion, sensors if bingham_filter.in_list else sensors[0])


def _reversed_controls(back: BinghamFilter, turns: FloatArray) -> FloatArray:
    """Return the inverse rotation of the step after each row, last row first; none before the last row."""
    out = np.zeros_like(turns)
    if isinstance(back.motion, Gyroscope):
        out[1:] = -turns[:0:-1]
    else:
        out[:, 0] = 1.0
        out[1:] = conjugate(turns[:0:-1])
    return out


def _likelihoods(back: BinghamFilter, used: FloatArray) -> FloatArray:
    """Return the likelihood matrices L_t (T, d, d), 0 where nothing was used."""
    d = back.motion.dim
    out = np.zeros((len(used), d, d))
    for sensor, part in zip(back.sensors, _columns(back, used), strict=True):
        there = np.isfinite(used[:, part.start])
        z = used[there, part]
        if isinstance(sensor, OrientationSensor):
            axes = sensor.frame
            seen = (z / np.linalg.norm(z, axis=-1, keepdims=True))[:, None, :]
            n = compose(axes, seen) if sensor.left else compose(seen, axes)
            out[there] += np.einsum("tki,k,tkj->tij", n, sensor.noise.z, n)
        elif isinstance(sensor, VectorSensor):
            out[there] += sensor.concentration * davenport_matrix(
                sensor.reference, z / np.linalg.norm(z, axis=-1, keepdims=True)
            )
        else:
            raise InvalidArgumentError(
                "bingham_filter",
                "sensors whose likelihood does not depend on the prediction (orientations or vectors)",
                type(sensor).__name__,
                "the smoother weighs every measurement once, forwards and backwards alike",
            )
    return out


def _track(forward: BinghamTrack, matrices: FloatArray) -> BinghamTrack:
    distributions = Bingham.from_matrix(0.5 * (matrices + np.swapaxes(matrices, -1, -2)))
    modes = np.ascontiguousarray(distributions.M[..., -1])
    return replace(forward, modes=modes, states=distributions, final=distributions[-1])
