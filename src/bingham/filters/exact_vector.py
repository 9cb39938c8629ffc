"""Exact posterior of an orientation given a measurement that depends on one rotated vector only, in milliseconds."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import i0e, i1e

from bingham.distributions.bingham import Bingham
from bingham.errors import ConvergenceError, InvalidArgumentError
from bingham.filters.exact import ExactPosterior
from bingham.rotations import compose

__all__ = ["exact_vector_posterior"]

FloatArray = NDArray[np.float64]

# Polar distances at which panels of the rule end; they halve towards the centre to resolve narrow likelihoods.
PANELS = math.pi * np.array([0.0, *(0.5 ** np.arange(7.0, -1.0, -1.0))])
START = 6
MAX_ORDER = 48


@lru_cache(maxsize=16)
def _legendre(order: int) -> tuple[FloatArray, FloatArray]:
    x, w = np.polynomial.legendre.leggauss(order)
    return np.asarray(x, dtype=np.float64), np.asarray(w, dtype=np.float64)


def _turn_to(directions: FloatArray, reference: FloatArray) -> FloatArray:
    """Return quaternions (k, 4) that turn the unit vector reference (3,) to the unit vectors (k, 3)."""
    q = np.empty((len(directions), 4))
    q[:, 0] = 1.0 + directions @ reference
    q[:, 1:] = np.cross(reference, directions)
    # Half turns: any axis across the reference.
    opposite = q[:, 0] < 1e-12
    if opposite.any():
        across = np.cross(reference, np.eye(3)[int(np.argmin(np.abs(reference)))])
        q[opposite] = [0.0, *across]
    return q / np.linalg.norm(q, axis=1)[:, None]


def exact_vector_posterior(
    prior: Bingham,
    reference: ArrayLike,
    log_likelihood: Callable[[FloatArray], FloatArray],
    center: ArrayLike,
    *,
    tolerance: float = 1e-6,
) -> ExactPosterior:
    """Return moment and evidence of f(q | z) ∝ exp(log_likelihood(q ⊗ reference ⊗ q*)) f(q), q ~ `prior`, d = 4.

    With q = q_r ⊗ exp(ψ reference/2), q_r any rotation of the reference to r, the integral over ψ is a Bingham
    normaliser on a circle (a Bessel function), so that only r ∈ S² is left to quadrature: polar panels about
    `center`, refined until two rules agree. dq = dr dψ/8, ψ over 4π.

    Parameters
    ----------
    prior : Bingham
        A single distribution.
    reference : (3,) array_like
        Unit vector that is rotated.
    log_likelihood : callable
        Unit vectors r (m, 3) → log f(z | r) (m,).
    center : (3,) array_like
        Where the likelihood is largest, roughly; panels are finest there.
    tolerance : float
        Largest difference of a moment's entry between the last two rules.

    Raises
    ------
    ConvergenceError
        If the finest rule does not reach the tolerance (a narrow prior away from `center`).
    """
    if prior.z.shape != (4,):
        raise InvalidArgumentError("prior", "a single distribution of dimension 4", repr(prior))
    n0, c = np.asarray(reference, dtype=np.float64), np.asarray(center, dtype=np.float64)
    c = c / np.linalg.norm(c)
    e = np.cross(c, np.eye(3)[int(np.argmin(np.abs(c)))])
    e /= np.linalg.norm(e)
    frame = np.stack([e, np.cross(c, e), c])
    before: tuple[FloatArray, float] | None = None
    evaluations, order = 0, START
    while order <= MAX_ORDER:
        x, w = _legendre(order)
        middle, half = 0.5 * (PANELS[1:] + PANELS[:-1]), 0.5 * np.diff(PANELS)
        polar, polar_weights = (middle[:, None] + half[:, None] * x).ravel(), (half[:, None] * w).ravel()
        around = 2.0 * math.pi / (4 * order) * np.arange(4 * order)
        sine = np.sin(polar)
        height = np.repeat(np.cos(polar)[:, None], len(around), axis=1)
        local = np.stack([np.outer(sine, np.cos(around)), np.outer(sine, np.sin(around)), height], axis=-1)
        r = np.asarray(local.reshape(-1, 3) @ frame, dtype=np.float64)
        measure = np.repeat(polar_weights * sine * (2.0 * math.pi / len(around)), len(around))
        evaluations += len(r)
        moment, log_evidence = _integrate(prior, n0, r, measure, np.asarray(log_likelihood(r), dtype=np.float64))
        if before is not None and np.abs(moment - before[0]).max() <= tolerance:
            return ExactPosterior(moment, log_evidence, evaluations)
        before = moment, log_evidence
        order = order * 3 // 2
    raise ConvergenceError("exact_vector_posterior: rules do not agree", before, "use exact_posterior")


def _integrate(
    prior: Bingham, n0: FloatArray, r: FloatArray, measure: FloatArray, values: FloatArray
) -> tuple[FloatArray, float]:
    """Return the moment and the log-evidence over directions r (k, 3) with their surface elements (k,)."""
    a = _turn_to(r, n0)
    b = compose(a, np.concatenate([[0.0], n0]))
    # On the circle q = cos(ψ/2) a + sin(ψ/2) b the prior is exp(p + s cos ψ + t sin ψ).
    left, right = a @ prior.matrix, b @ prior.matrix
    aa, ab, bb = (left * a).sum(axis=1), (left * b).sum(axis=1), (right * b).sum(axis=1)
    p, s, t = 0.5 * (aa + bb), 0.5 * (aa - bb), ab
    length = np.hypot(s, t)
    exponent = values + p + length
    top = exponent.max()
    # ∫ over ψ ∈ [0, 4π) of exp(length cos(ψ − ψ₀)) = 4π I₀(length).
    density = measure * np.exp(exponent - top) * i0e(length)
    total = float(density.sum())
    ratio = np.divide(i1e(length), i0e(length) * length, out=np.full_like(length, 0.5), where=length > 1e-12)
    cosine, sine = ratio * s, ratio * t  # E[cos ψ], E[sin ψ]
    density /= total
    half = 0.5 * density
    moment = (a.T * (half * (1.0 + cosine))) @ a + (b.T * (half * (1.0 - cosine))) @ b
    mixed = (a.T * (half * sine)) @ b
    moment += mixed + mixed.T
    return moment, top + math.log(0.5 * math.pi * total) - float(prior.log_normalizer)
