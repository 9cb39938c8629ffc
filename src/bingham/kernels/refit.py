"""The Bingham distribution of a second moment, and the powers of a progressive likelihood, one at a time."""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.linalg import diagonalize, diagonalize_4, orthonormalize_4
from bingham.kernels.newton import newton

__all__ = ["fraction", "refit"]


@compiled()
def refit(moment, m, minimum):
    """Return (z, M, log F, ω, smallest eigenvalue) with this second moment (d, d), eigenvalues ≥ `minimum`.

    m (d, d) is a frame by columns near the eigenvectors, in which small eigenvalues keep their digits. log F is NaN if
    the moment holds a NaN.
    """
    d = moment.shape[0]
    frame = np.ascontiguousarray(m.T)
    b = frame @ moment @ m
    w, z = np.empty(d), np.empty(d)
    if d == 4:
        diagonalize_4(b, w, frame)
        orthonormalize_4(frame)
    else:
        diagonalize(b, w, frame)
    smallest = w[0]
    total = 0.0
    for i in range(d):
        w[i] = max(w[i], minimum)
        total += w[i]
    for i in range(d):
        w[i] /= total
    log_f, evaluations = newton(w, z)
    return z, np.ascontiguousarray(frame.T), log_f if evaluations > 0 else math.nan, w, smallest


@compiled()
def _share(weights, log_likelihood, top, power):
    """(Σ w r)²/Σ w r² with r = exp(power·(log-likelihood − top)), in (0, 1]: the share of effective samples."""
    first = second = 0.0
    for i in range(weights.size):
        r = math.exp(power * (log_likelihood[i] - top))
        first += weights[i] * r
        second += weights[i] * r * r
    return first * first / second


@compiled()
def fraction(weights, log_likelihood, minimum, remaining):
    """Return the largest power ≤ remaining whose effective share is `minimum` of what a vanishing power leaves.

    weights (m,) with sum 1; log_likelihood (m,), −∞ allowed but not everywhere.
    """
    top = -math.inf
    bottom = math.inf
    alive = 0.0
    for i in range(weights.size):
        top = max(top, log_likelihood[i])
        if log_likelihood[i] > -math.inf:
            bottom = min(bottom, log_likelihood[i])
            alive += weights[i]
    target = minimum * alive
    if top == bottom or _share(weights, log_likelihood, top, remaining) >= target:
        return remaining
    # Weights between 1 and e^{−low (top − bottom)} hardly differ, which bounds the root from below.
    high = remaining
    low = min(1e-3 / (top - bottom), 0.5 * remaining)
    while high > 1.02 * low:
        middle = math.sqrt(low * high)
        if _share(weights, log_likelihood, top, middle) >= target:
            low = middle
        else:
            high = middle
    return low
