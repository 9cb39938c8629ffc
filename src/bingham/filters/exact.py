"""Exact posteriors to judge sampled updates by: adaptive quadrature on the sphere, any likelihood, d ≤ 4."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import wraps
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution
from bingham.errors import ConvergenceError, InvalidArgumentError
from bingham.filters.user_functions import checked_log_likelihood

__all__ = ["ExactPosterior", "exact_posterior"]

FloatArray = NDArray[np.float64]

# Gauss–Legendre points along each edge of a box.
ORDER = 5
# Boxes along each angle to begin with: narrower ridges than their node distance would be missed.
INITIAL = {2: 64, 3: 16, 4: 8}
MAX_EVALUATIONS = 20_000_000


class ExactPosterior(NamedTuple):
    """Second ``moment`` (d, d) of f(x | z), ``log_evidence`` log ∫ f(z | x) f(x) dx, ``evaluations`` of f(z | x)."""

    moment: FloatArray
    log_evidence: float
    evaluations: int


def _points(angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return unit vectors (k, d), last entry ≥ 0, of angles (k, d−1) in [−π/2, π/2], and the surface element (k,)."""
    k, n = angles.shape
    x, rho, element = np.empty((k, n + 1)), np.ones(k), np.ones(k)
    for i in range(n):
        x[:, i] = rho * np.sin(angles[:, i])
        cosine = np.cos(angles[:, i])
        element *= cosine ** (n - 1 - i)
        rho = rho * cosine
    x[:, n] = rho
    return x, element


def exact_posterior(
    prior: Bingham,
    log_likelihood: Callable[[FloatArray], ArrayLike],
    *,
    tolerance: float = 1e-8,
) -> ExactPosterior:
    """Return moment and evidence of f(x | z) ∝ exp(log_likelihood(x)) f(x), x ~ `prior`, by adaptive quadrature.

    Half the sphere, in angles about the prior's axes, is cut into boxes; those whose tensor Gauss rule changes most
    when they are halved along every angle are halved on, until the changes sum to less than `tolerance` of the
    evidence.

    Parameters
    ----------
    prior : Bingham
        A single distribution, d ≤ 4.
    log_likelihood : callable
        points (m, d) → log f(z | x) (m,), the same for x and −x. Ridges of rotations narrower than
        about 0.05 rad are slow or missed; `exact_vector_posterior` serves vectors.
    tolerance : float
        Bound of the summed changes of the moment's entries and of the evidence, relative to the evidence.

    Raises
    ------
    ConvergenceError
        If 5e7 evaluations do not reach the tolerance.
    """
    check_distribution(prior, "prior")
    if prior.shape or prior.dim not in INITIAL:
        raise InvalidArgumentError("prior", "a single distribution of dimension 2, 3 or 4", repr(prior))
    n = prior.dim - 1
    nodes, weights = (np.asarray(a, dtype=np.float64) for a in np.polynomial.legendre.leggauss(ORDER))
    cell = np.stack(np.meshgrid(*[nodes] * n, indexing="ij"), axis=-1).reshape(-1, n)
    cell_weights = np.prod(np.stack(np.meshgrid(*[weights] * n, indexing="ij"), axis=-1).reshape(-1, n), axis=-1)
    upper = np.triu_indices(n + 1)
    evaluations = 0
    top = -math.inf
    function = wraps(log_likelihood)(lambda _, points: log_likelihood(points))

    def log_joint(x: FloatArray) -> FloatArray:
        nonlocal evaluations
        evaluations += len(x)
        values = checked_log_likelihood(function, None, x @ prior.M.T, np.ones(len(x)), "exact_posterior")
        return values + (x * x) @ prior.z - prior.log_normalizer

    def integrate(centers: FloatArray, half: float) -> FloatArray:
        """Return ∫ (1, x xᵀ) f f(z|·) e^{−top} over boxes (b, n): (b, 1 + d(d+1)/2)."""
        out = np.empty((len(centers), 1 + len(upper[0])))
        for first in range(0, len(centers), 2000):
            part = centers[first : first + 2000]
            x, element = _points((part[:, None, :] + half * cell).reshape(-1, n))
            density = np.exp(log_joint(x) - top) * element
            density = density.reshape(len(part), -1) * (cell_weights * half**n)
            products = (x[:, upper[0]] * x[:, upper[1]]).reshape(len(part), -1, len(upper[0]))
            out[first : first + 2000, 0] = density.sum(axis=1)
            out[first : first + 2000, 1:] = np.einsum("bk,bkj->bj", density, products)
        return out

    count = INITIAL[prior.dim]
    half = 0.5 * math.pi / count
    edges = -0.5 * math.pi + half * (2.0 * np.arange(count) + 1.0)
    centers = np.stack(np.meshgrid(*[edges] * n, indexing="ij"), axis=-1).reshape(-1, n).astype(np.float64)
    for first in range(0, len(centers), 2000):
        # Every box's own nodes: the largest value fixes the scale of all later exponentials.
        x, _ = _points((centers[first : first + 2000, None, :] + half * cell).reshape(-1, n))
        top = max(top, float(log_joint(x).max()))
    corners = np.stack(np.meshgrid(*[[-0.5, 0.5]] * n, indexing="ij"), axis=-1).reshape(-1, n)
    coarse = integrate(centers, half)
    settled = np.zeros(coarse.shape[1])
    while True:
        children = (centers[:, None, :] + half * corners).reshape(-1, n)
        fine = integrate(children, 0.5 * half).reshape(len(centers), len(corners), -1)
        finer = fine.sum(axis=1)
        # Both half spheres: the factor 2 cancels but in the evidence.
        total = settled + finer.sum(axis=0)
        change = np.abs(finer - coarse).max(axis=1)
        order = np.argsort(change)
        budget = 0.5 * tolerance * total[0]
        quiet = order[: int(np.searchsorted(np.cumsum(change[order]), budget))]
        if len(quiet) == len(centers):
            break
        if evaluations > MAX_EVALUATIONS:
            raise ConvergenceError(
                f"exact_posterior: {change.sum() / total[0]:.3g} left after {evaluations} evaluations", total
            )
        settled += finer[quiet].sum(axis=0)
        # What is dropped now may not be spent again.
        tolerance -= 2.0 * float(change[quiet].sum()) / total[0]
        keep = np.setdiff1d(np.arange(len(centers)), quiet)
        centers = children.reshape(len(change), len(corners), n)[keep].reshape(-1, n)
        coarse = fine[keep].reshape(-1, fine.shape[-1])
        half *= 0.5
    moment = np.empty((n + 1, n + 1))
    moment[upper] = moment[upper[::-1]] = total[1:] / total[0]
    return ExactPosterior(prior.M @ moment @ prior.M.T, math.log(2.0 * total[0]) + top, evaluations)
