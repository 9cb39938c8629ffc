"""Expectation-maximisation for Bingham mixtures with a uniform background."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.bounded import bounded_concentrations
from bingham.distributions.mixture_density import MixtureDensity, log_area
from bingham.notebook import Tabled

__all__ = ["EMResult", "distributions_of_moments", "expectation_maximization"]

FloatArray = NDArray[np.float64]
M = TypeVar("M", bound=MixtureDensity)


@dataclass(frozen=True, slots=True)
class EMResult(Tabled, Generic[M]):
    """What a run of expectation-maximisation reached.

    Parameters
    ----------
    mixture : MixtureDensity
        The last one.
    log_likelihood : float
        Σ wₙ log f(xₙ) of that mixture.
    trace : ndarray, shape (iterations + 1,)
        Log-likelihood of the start and after every iteration; it never decreases beyond rounding.
    converged : bool
        Whether the last gain was below the tolerance.
    starved : bool
        Whether a component fell below the minimum number of points; the run stopped there.
    """

    mixture: M
    log_likelihood: float
    trace: FloatArray
    converged: bool
    starved: bool


def distributions_of_moments(moments: FloatArray, rows: FloatArray, max_concentration: float) -> Bingham:
    """Return the distributions (K,) most likely for moments (K, d, d; upper triangles) in the frames rows (K, d, d).

    Jacobi's method in the frame of the last distributions keeps the relative accuracy of small eigenvalues.
    """
    from bingham.kernels.linalg import diagonalize

    values, frames = np.empty(moments.shape[:-1]), np.array(rows)
    for k in range(len(moments)):
        diagonalize(np.array(moments[k]), values[k], frames[k])
    values = np.maximum(values, 0.0)
    values /= values.sum(axis=-1, keepdims=True)
    z, log_f = bounded_concentrations(values, max_concentration)
    return Bingham.from_spectrum(z, np.ascontiguousarray(np.swapaxes(frames, -1, -2)), log_f)


def expectation_maximization(
    x: FloatArray,
    start: M,
    *,
    weights: FloatArray | None = None,
    tolerance: float = 1e-8,
    max_iterations: int = 1000,
    max_concentration: float = 1e6,
    min_points: float = 0.0,
    progress: Callable[[int, float], None] | None = None,
) -> EMResult[M]:
    """Climb the likelihood from `start`; the number of components and whether there is a background stay.

    E step: rₙₖ = αₖ fₖ(xₙ) / f(xₙ). M step: αₖ = Σ wₙ rₙₖ / Σ wₙ, and Aₖ the maximum-likelihood distribution of the
    moment Σ wₙ rₙₖ xₙ xₙᵀ / Σ wₙ rₙₖ with no concentration above `max_concentration`.

    Parameters
    ----------
    x : (n, d) ndarray
        Unit rows, float64, contiguous.
    start : MixtureDensity
        Where to start, and the class of what is found; its concentrations are cut at the ceiling.
    weights : (n,) ndarray, optional
        Non-negative counts.
    tolerance : float
        Gain of log-likelihood a sample below which the run has converged.
    max_iterations : int
        Steps at most.
    max_concentration : float
        Ceiling of |z|.
    min_points : float
        Stop, `starved`, when Σ wₙ rₙₖ of a component falls below this.
    progress : callable, optional
        Called with the iteration and its log-likelihood.
    """
    from bingham.kernels.mixture import CHUNK, expectation, expectation_rows

    d, size = start.dim, start.size
    counts = np.ones(len(x)) if weights is None else np.ascontiguousarray(weights, dtype=np.float64)
    total = float(counts.sum())
    masses, moments = np.empty(size), np.empty((size, d, d))
    area = log_area(d)
    # A few chunks are not worth waking threads for.
    e_step = expectation_rows if len(x) <= 8 * CHUNK else expectation

    def step(mixture: M) -> float:
        with np.errstate(divide="ignore"):
            offsets = np.log(mixture.weights) - mixture.components.log_normalizer
        floor = math.log(mixture.background) - area if mixture.background > 0.0 else -math.inf
        masses[:] = 0.0
        moments[:] = 0.0
        return e_step(x, counts, rows, mixture.components.z, offsets, floor, masses, moments)

    mixture = start
    if np.any(start.components.z < -max_concentration):
        z = np.maximum(start.components.z, -max_concentration)
        mixture = replace(start, components=Bingham.from_spectrum(z, np.array(start.components.M)))
    rows = np.ascontiguousarray(np.swapaxes(mixture.components.M, -1, -2))
    trace = [step(mixture)]
    converged = starved = False
    for iteration in range(1, max_iterations + 1):
        if np.any(masses < min_points) or np.any(masses <= 0.0):
            starved = True
            break
        background = max(0.0, 1.0 - float(masses.sum()) / total) if mixture.background > 0.0 else 0.0
        distributions = distributions_of_moments(moments / masses[:, None, None], rows, max_concentration)
        alpha = masses * ((1.0 - background) / masses.sum())
        mixture = replace(mixture, weights=alpha, components=distributions, background=background)
        rows = np.ascontiguousarray(np.swapaxes(distributions.M, -1, -2))
        trace.append(step(mixture))
        if progress is not None:
            progress(iteration, trace[-1])
        if trace[-1] - trace[-2] <= tolerance * total:
            converged = True
            break
    return EMResult(mixture, trace[-1], np.array(trace), converged, starved)
