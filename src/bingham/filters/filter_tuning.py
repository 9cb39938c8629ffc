"""Noises of a `BinghamFilter` from a sequence without ground truth, by maximum log-evidence."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from bingham.distributions.bingham import Bingham
from bingham.errors import ConvergenceError, InvalidArgumentError
from bingham.filters.first_order import BinghamFilter
from bingham.models.diffusion import Diffusion, Gyroscope
from bingham.models.motion import RandomWalk
from bingham.models.sensors import HeadingSensor, OrientationSensor, VectorSensor
from bingham.validation import check_kind

__all__ = ["FilterTuning", "tune_filter"]

FloatArray = NDArray[np.float64]

# Step of central differences in the logarithm of a scale; the evidence is smooth to some 1e-9 nats.
STEP = 1e-3
# Scales are searched this far from where the filter was, each way.
REACH = math.log(1e4)


@dataclass(frozen=True)
class FilterTuning:
    """Result of `tune_filter`.

    Attributes
    ----------
    filter : BinghamFilter
        With the noises of largest log-evidence.
    process_scale, measurement_scale : float
        What the standard deviations of the two noises were multiplied by.
    relative_error : dict
        Standard error of each scale as a fraction of it, from the curvature of the log-evidence; NaN where the
        sequence leaves it open.
    log_evidence, start_log_evidence : float
        At the maximum, and where the search began, nats.
    evaluations : int
        How often the sequence was filtered.
    """

    filter: BinghamFilter
    process_scale: float
    measurement_scale: float
    relative_error: dict[str, float]
    log_evidence: float
    start_log_evidence: float
    evaluations: int


def tune_filter(
    filter: BinghamFilter,
    prior: Bingham,
    measurements: ArrayLike | Rotation,
    *,
    controls: ArrayLike | Rotation | None = None,
    times: ArrayLike | None = None,
    start_time: float | None = None,
) -> FilterTuning:
    """Return the filter with both noises scaled so that the log-evidence of the measurements is largest.

    The shapes of the noises stay: standard deviations about all axes are multiplied by one number for the process and
    one for the measurements. L-BFGS on the logarithms of both, the gradient by central differences of the compiled run
    (four runs a gradient). A gate is left out of the search and put back: evidence of rejected measurements is no
    measure of noise. Networks, more parameters or noises that change take `bingham.torch.sequence_log_evidence`.

    Parameters
    ----------
    filter : BinghamFilter
        Where to begin; a factor of 30 off is near enough.
    prior, measurements, controls, times, start_time
        As in `BinghamFilter.run`; a batch of recordings counts as one.

    Raises
    ------
    InvalidArgumentError
        If a model has no noise that can be scaled.
    ConvergenceError
        If a scale runs beyond 1e4 either way, or the search does not settle; carries the scales reached.

    Examples
    --------
    >>> from bingham import Diffusion
    >>> axes = Bingham([-50.0, 0.0], np.eye(2)[:, ::-1]).rvs(500, rng=0)
    >>> start = BinghamFilter(Diffusion(0.01, dim=2), Bingham([-5.0, 0.0], np.eye(2)[:, ::-1]))
    >>> found = tune_filter(start, Bingham.uniform(2), axes, times=np.arange(500.0))
    >>> bool(abs(found.filter.measurement_noise.z[0] / -50.0 - 1.0) < 0.2)
    True
    """
    check_kind(filter, BinghamFilter, "filter")
    count = 0

    def evidence(logarithms: FloatArray) -> float:
        nonlocal count
        count += 1
        scaled = _scaled(filter, *np.exp(logarithms))
        track = scaled.run(prior, measurements, controls=controls, times=times, start_time=start_time)
        return float(np.nansum(track.log_evidence))

    def cost(logarithms: FloatArray) -> tuple[float, FloatArray]:
        e = STEP * np.eye(2)
        gradient = [(evidence(logarithms + d) - evidence(logarithms - d)) / (2.0 * STEP) for d in e]
        return -evidence(logarithms), -np.array(gradient)

    begin = evidence(np.zeros(2))
    bounds = [(-REACH, REACH)] * 2
    found: Any = minimize(cost, np.zeros(2), jac=True, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-12})
    x = np.asarray(found.x)
    scales = np.exp(x)
    if np.any(np.abs(x) >= REACH):
        name = ("process noise", "measurement noise")[int(np.argmax(np.abs(x)))]
        raise ConvergenceError(
            f"the evidence grows with the {name} scaled without end", scales, "the sequence does not tell it"
        )
    if not found.success:
        raise ConvergenceError(f"the search for noises did not settle: {found.message}", scales)
    tuned = replace(_scaled(filter, *scales), gate=filter.gate)
    errors: dict[str, float] = dict(zip(("process", "measurement"), _relative_errors(evidence, x), strict=True))
    return FilterTuning(tuned, float(scales[0]), float(scales[1]), errors, -float(found.fun), begin, count)


def _scaled(filter: BinghamFilter, process: float, measurement: float) -> BinghamFilter:
    """Return the filter with standard deviations scaled, without its gate."""
    return replace(
        filter,
        process_noise=_with_std(filter.process_noise, process, "process_noise"),
        measurement_noise=_with_std(filter.measurement_noise, measurement, "measurement_noise"),
        gate=None,
    )


def _with_std(model: Any, scale: float, name: str) -> Any:
    """Return a model of noise with its standard deviations times scale; concentrations go with their inverse square."""
    if isinstance(model, Bingham):
        return Bingham.from_spectrum(np.array(model.z) / scale**2, np.array(model.M))
    if isinstance(model, (RandomWalk, OrientationSensor)):
        return replace(model, noise=_with_std(model.noise, scale, name))
    if isinstance(model, (Diffusion, Gyroscope)):
        field = "random_walk" if isinstance(model, Diffusion) else "noise_density"
        value = getattr(model, field)
        return replace(model, **{field: tuple(scale * v for v in value) if isinstance(value, tuple) else scale * value})
    if isinstance(model, (VectorSensor, HeadingSensor)):
        return replace(model, concentration=model.concentration / scale**2)
    raise InvalidArgumentError(
        name,
        "a Bingham distribution, RandomWalk, Diffusion, Gyroscope, OrientationSensor, VectorSensor or HeadingSensor",
        f"a {type(model).__name__}",
    )


def _relative_errors(evidence: Any, x: FloatArray) -> list[float]:
    """Return the standard errors of both logarithms: inverse Hessian of −evidence, by central differences."""
    h = 0.02
    a, b = h * np.eye(2)
    middle = evidence(x)
    aa = evidence(x + a) - 2.0 * middle + evidence(x - a)
    bb = evidence(x + b) - 2.0 * middle + evidence(x - b)
    ab = 0.25 * (evidence(x + a + b) - evidence(x + a - b) - evidence(x - a + b) + evidence(x - a - b))
    variance = np.diagonal(np.linalg.pinv(-np.array([[aa, ab], [ab, bb]]) / h**2))
    return [math.sqrt(v) if v > 0.0 else math.nan for v in variance]
