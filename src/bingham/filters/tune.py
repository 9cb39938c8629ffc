"""Noise densities of a sensor from a recording without ground truth, by maximum log-evidence."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from bingham.errors import ConvergenceError, InvalidArgumentError
from bingham.kernels.white_noise import white_noise_evidence
from bingham.recording import ImuRecording

__all__ = ["SensorNoise", "Tuning", "tune"]

FloatArray = NDArray[np.float64]

# Prior of the gyroscope's bias, rad/s: wide enough for an uncalibrated one.
BIAS_STD = math.radians(5.0)
# Mean of the first second is where the search takes up and north from.
START_S = 1.0
# A larger relative error than this says that the recording leaves the density open.
UNDETERMINED = 0.5
# White noise shows its full density from sample to sample; filtered sensors hide up to some half of it.
ABOVE_SCATTER = 4.0


@dataclass(frozen=True)
class SensorNoise:
    """White noise of an inertial sensor: parameters of `Gyroscope`, `simulate_imu`; for `VectorSensor` see `tune`.

    Parameters
    ----------
    gyroscope : float
        Density, rad/s/√Hz.
    accelerometer : float
        Density, m/s²/√Hz; on a recording in motion it includes the accelerations of the motion.
    magnetometer : float
        Standard deviation of a sample, in the recording's unit; unused without magnetometer.
    """

    gyroscope: float = 2e-4
    accelerometer: float = 5e-3
    magnetometer: float = 0.5

    def __post_init__(self) -> None:
        for name in ("gyroscope", "accelerometer", "magnetometer"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise InvalidArgumentError(name, "a positive number", value)


@dataclass(frozen=True)
class Tuning:
    """Result of `tune`.

    Attributes
    ----------
    noise : SensorNoise
        The densities of largest log-evidence.
    relative_error : dict
        Standard error of each as a fraction of it, from the curvature of the log-evidence.
    log_evidence : float
        Its maximum, nats.
    start_log_evidence : float
        Its value where the search began.
    evaluations : int
        How often the recording was filtered.
    scatter : dict
        What the samples' scatter in the quietest second would be as such a noise. Of the same size as `noise` where
        the noise is white; far below where motion or disturbances are in `noise`.
    """

    noise: SensorNoise
    relative_error: dict[str, float]
    log_evidence: float
    start_log_evidence: float
    evaluations: int
    scatter: dict[str, float]
    _evidence: Callable[[FloatArray], float]
    _names: tuple[str, ...]

    @property
    def doubts(self) -> dict[str, str]:
        """Why a density is not to be used, by name; empty where all describe the sensor."""
        found: dict[str, str] = {}
        for name, error in self.relative_error.items():
            ratio = getattr(self.noise, name) / self.scatter[name] if self.scatter[name] > 0.0 else math.inf
            if not error <= UNDETERMINED:
                found[name] = "not determined by this recording"
            elif ratio > ABOVE_SCATTER:
                found[name] = f"{ratio:.0f} times the scatter from sample to sample: motion or disturbances, not noise"
        return found

    def profile(self, name: str, factors: Any = None) -> Any:
        """Return values (n,) of one density and the log-evidence (n,) there, the others chosen best for each.

        Parameters
        ----------
        name : str
            Which density.
        factors : (n,) array_like, optional
            Multiples of the best value; 13 of them within 4 standard errors unless given.

        Raises
        ------
        InvalidArgumentError
            If `name` is no density that was tuned.
        """
        if name not in self._names:
            raise InvalidArgumentError("name", " or ".join(repr(n) for n in self._names), repr(name))
        k = self._names.index(name)
        best = np.log([getattr(self.noise, n) for n in self._names])
        errors = np.array([self.relative_error[n] for n in self._names])
        errors = np.clip(np.nan_to_num(errors, nan=1.0), 1e-3, 0.7)
        if factors is None:
            factors = np.exp(errors[k] * np.linspace(-4.0, 4.0, 13))
        values, levels = [], []
        for factor in np.asarray(factors, dtype=np.float64):
            fixed = best[k] + math.log(factor)
            rest = np.delete(best, k)
            simplex = _simplex(rest, np.delete(errors, k))
            if len(rest):
                found = minimize(
                    lambda r, v=fixed: -self._evidence(np.insert(r, k, v)), rest, method="Nelder-Mead",
                    options={"xatol": 0.1, "fatol": 0.02, "maxfev": 60, "initial_simplex": simplex},
                )  # fmt: skip
                level = -float(found.fun)
            else:
                level = self._evidence(np.array([fixed]))
            values.append(math.exp(fixed))
            levels.append(level)
        return np.array(values), np.array(levels)


def tune(
    recording: ImuRecording,
    *,
    start: SensorNoise | None = None,
    bias_walk: float = 3.5e-5,
    gravity: float = 9.81,
    progress: Callable[[int, float], None] | None = None,
) -> Tuning:
    """Find the noise densities under which the recording is most probable.

    The model is the plain one: constant gravity and field, white noise, gyroscope bias with a random walk. It is right
    for simulated recordings and for bodies that turn without being moved or disturbed. Elsewhere linear acceleration,
    scale errors and a bent field, which are not white, count as noise; a recording at rest leaves the gyroscope's
    density open. `Tuning.doubts` names the densities that suffer from either. Ground truth is not used.

    The densities are those of the white-noise models: ``Gyroscope(noise_density=gyroscope)``; of ``VectorSensor`` for
    the vertical, κ = dt (g/accelerometer)² with samples dt apart, and for the field F, κ = (|F|/magnetometer)²; and of
    `simulate_imu`. They are not `ImuFilter`'s ``gyroscope_noise`` and ``accelerometer_noise``: it models motion and
    scale errors by parameters of their own, and its defaults need no tuning.

    Parameters
    ----------
    recording : ImuRecording
        With accelerometer, beginning at rest or nearly so (1 s), then turning about changing axes. The quieter the
        gyroscope beside the other sensors, the longer it takes: see `Tuning.relative_error`.
    start : SensorNoise, optional
        Where to begin; a decade off is near enough.
    bias_walk : float
        Random walk of the gyroscope's bias, rad/s/√s, held fixed.
    gravity : float
        Local g, m/s².
    progress : callable, optional
        Called after every evaluation with their number and the best log-evidence so far.

    Returns
    -------
    Tuning

    Raises
    ------
    InvalidArgumentError
        If there is no accelerometer or the recording is shorter than 2 s.
    ConvergenceError
        If the search does not settle; carries the best densities reached.
    """
    start = SensorNoise() if start is None else start
    evidence, names = _evidence_of(recording, bias_walk, gravity)
    count = 0
    best = -math.inf

    def cost(logarithms: FloatArray) -> float:
        nonlocal count, best
        value = evidence(logarithms)
        count += 1
        best = max(best, value)
        if progress is not None:
            progress(count, best)
        return -value

    x = np.log([getattr(start, name) for name in names])
    begin = -cost(x)
    # Two rounds: the second starts afresh where the first has ended, so that a flattened simplex cannot stall.
    for size, tolerance in ((1.0, 0.02), (0.2, 2e-3)):
        found = minimize(
            cost, x, method="Nelder-Mead",
            options={"xatol": tolerance, "fatol": 0.05, "maxfev": 400, "initial_simplex": _simplex(x, size)},
        )  # fmt: skip
        x = found.x
    noise = replace(start, **{name: float(v) for name, v in zip(names, np.exp(x), strict=True)})
    if not found.success:
        raise ConvergenceError("the search for noise densities did not settle", noise, "start nearer to the truth")
    errors = _relative_errors(lambda y: -cost(y), x)
    relative = dict(zip(names, errors, strict=True))
    scatter = {name: _scatter(recording, name) for name in names}
    return Tuning(noise, relative, -float(found.fun), begin, count, scatter, evidence, names)


def _simplex(x: FloatArray, size: float | FloatArray) -> FloatArray:
    return np.concatenate([x[None], x + size * np.eye(len(x))])


def _scatter(recording: ImuRecording, name: str) -> float:
    """Return the smallest root mean square of second differences in a second, scaled to the unit of `SensorNoise`.

    White noise of variance s² has second differences of variance 6 s²; motion is smooth and has nearly none.
    """
    samples = np.asarray(getattr(recording, name))
    new = np.array(np.isfinite(samples[:, 0]))
    new[1:] &= (samples[1:] != samples[:-1]).any(axis=1)
    step = float(np.median(np.diff(recording.time[new])))
    squares = np.diff(samples[new], 2, axis=0) ** 2 / 6.0
    window = min(len(squares), max(3, round(1.0 / step)))
    count = len(squares) // window
    quietest = float(squares[: count * window].reshape(count, -1).mean(axis=1).min())
    return math.sqrt(quietest * (1.0 if name == "magnetometer" else step))


def _relative_errors(evidence: Callable[[FloatArray], float], x: FloatArray) -> list[float]:
    """Return the standard errors of log densities: inverse Hessian of −evidence, by central differences."""
    n, step = len(x), 0.05
    e = step * np.eye(n)
    middle = evidence(x)
    hessian = np.empty((n, n))
    for i in range(n):
        hessian[i, i] = (evidence(x + e[i]) - 2 * middle + evidence(x - e[i])) / step**2
        for j in range(i):
            mixed = evidence(x + e[i] + e[j]) - evidence(x + e[i] - e[j])
            mixed -= evidence(x - e[i] + e[j]) - evidence(x - e[i] - e[j])
            hessian[i, j] = hessian[j, i] = mixed / (4 * step**2)
    try:
        variance = np.diagonal(np.linalg.inv(-hessian))
    except np.linalg.LinAlgError:
        variance = np.full(n, np.nan)
    return [math.sqrt(v) if v > 0 else math.nan for v in variance]


def _evidence_of(
    recording: ImuRecording, bias_walk: float, gravity: float
) -> tuple[Callable[[FloatArray], float], tuple[str, ...]]:
    """Return the log-evidence as a function of the log densities, and their names."""
    force, field = recording.accelerometer, recording.magnetometer
    if force is None:
        raise InvalidArgumentError("recording", "an accelerometer", "none", "gravity tells the gyroscope's noise")
    if recording.duration_s < 2 * START_S:
        raise InvalidArgumentError("recording", f"at least {2 * START_S:g} s", f"{recording.duration_s:g} s")
    begin = recording.time <= recording.time[0] + START_S
    up = np.nanmean(force[begin], axis=0)
    up /= np.linalg.norm(up)
    names: tuple[str, ...] = ("gyroscope", "accelerometer")
    samples = np.empty((0, 3))
    seen = np.eye(3)[int(np.argmin(np.abs(up)))]
    if field is not None:
        names = (*names, "magnetometer")
        samples = np.array(field)
        repeated = np.zeros(len(samples), dtype=np.bool_)
        repeated[1:] = (samples[1:] == samples[:-1]).all(axis=1)
        samples[repeated] = np.nan
        seen = np.nanmean(field[begin], axis=0)
    east = np.cross(seen, up)
    east /= np.linalg.norm(east)
    axes = np.stack([east, np.cross(up, east), up])
    from scipy.spatial.transform import Rotation

    q = Rotation.from_matrix(axes).as_quat(scalar_first=True)
    strength = np.array([axes[1] @ seen, axes[2] @ seen])
    steps = np.diff(recording.time, prepend=recording.time[0])
    rate, acceleration = np.array(recording.gyroscope), np.array(force)

    def evidence(logarithms: FloatArray) -> float:
        noise = np.ones(3)
        noise[: len(logarithms)] = np.exp(np.clip(logarithms, -40.0, 20.0))
        return float(
            white_noise_evidence(steps, rate, acceleration, samples, q, strength, gravity, noise, bias_walk, BIAS_STD)
        )

    return evidence, names
