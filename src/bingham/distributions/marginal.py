"""Likelihood of the concentrations alone: the principal axes, unknown too, are integrated out.

With ω the eigenvalues of the sample moment of n axes, and O over all rotations with equal weight,

    L(z) = exp(−n log F(z)) ∫ exp(n tr(diag(z) O diag(ω) Oᵀ)) dO.

The integral is exp(n z·ω) times one factor for each pair of axes, a quarter turn of one towards the other:
e^{−x} I₀(x), x = n (zⱼ − zᵢ)(ωⱼ − ωᵢ)/2. That is exact for d = 2, and for any d it is right where axes are far apart
(x large: Laplace's method, after Anderson 1965 for Wishart eigenvalues) and where they are equal (x = 0). In the limit
of narrow distributions it is the restricted likelihood of a normal sample, with n − 1 in the place of n. Its maximum
takes back most of the bias of maximum likelihood, which spreads the eigenvalues of a small sample apart.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import i0e, i1e

from bingham.distributions.normalizer import log_normalizer_derivatives
from bingham.errors import ConvergenceError

__all__ = ["marginal_fit", "marginal_log_likelihood", "marginal_maximum"]

FloatArray = NDArray[np.float64]

MAX_STEPS = 200
# A step is good enough when Newton's decrement, twice the gain of log-likelihood still to be had, is below this.
TOLERANCE = 1e-10
SMALLEST_GAIN = 1e-8


def marginal_log_likelihood(z: FloatArray, w: FloatArray, n: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return log L (...), its gradient (..., d) and Hessian (..., d, d) at ascending z (..., d).

    w (..., d) are the ascending moments of n (...) axes.
    """
    count = np.asarray(n, dtype=np.float64)
    log_f, gradient, hessian = log_normalizer_derivatives(z)
    d = z.shape[-1]
    i, j = np.triu_indices(d, 1)
    rate = 0.5 * count[..., None] * (w[..., j] - w[..., i])
    x = rate * (z[..., j] - z[..., i])
    value = count * (np.sum(z * w, axis=-1) - log_f) + np.sum(np.log(i0e(x)), axis=-1)
    ratio = i1e(x) / i0e(x)
    with np.errstate(divide="ignore", invalid="ignore"):
        bend = np.where(np.abs(x) > 1e-5, 1.0 - ratio / x - ratio**2, 0.5) * rate**2
    slope = (ratio - 1.0) * rate
    first, second = count[..., None] * (w - gradient), -count[..., None, None] * hessian
    for k, (a, b) in enumerate(zip(i, j, strict=True)):
        first[..., b] += slope[..., k]
        first[..., a] -= slope[..., k]
        for row, column, sign in ((a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)):
            second[..., row, column] += sign * bend[..., k]
    return value, first, second


def marginal_maximum(
    w: FloatArray, n: ArrayLike, start: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the ascending z (R, d) that maximises log L within low ≤ z ≤ high (R, d), and log L (R,).

    Bounds are ascending too; equal ones fix an entry. Newton's method, projected on the box, kept in order and damped,
    on all rows at once.

    Raises
    ------
    ConvergenceError
        If a row does not settle.
    """
    z = np.clip(start, low, high)
    count = np.broadcast_to(np.asarray(n, dtype=np.float64), z.shape[:1])
    best, gradient, hessian = marginal_log_likelihood(z, w, count)
    active = np.arange(len(z))
    for _ in range(MAX_STEPS):
        if active.size == 0:
            return z, best
        step, decrement = _newton_step(z[active], gradient[active], hessian[active], low[active], high[active])
        running = decrement > TOLERANCE * (1.0 + np.abs(best[active]) * 1e-4)
        active, step = active[running], step[running]
        size = np.ones(active.size)
        left = np.arange(active.size)
        before = best[active]
        for _ in range(40):
            rows = active[left]
            if rows.size == 0:
                break
            trial = np.clip(z[rows] + size[left, None] * step[left], low[rows], high[rows])
            # Entries that passed each other meet halfway.
            above, below = np.maximum.accumulate(trial, axis=-1), np.minimum.accumulate(trial[:, ::-1], axis=-1)
            trial = 0.5 * (above + below[:, ::-1])
            value, first, second = marginal_log_likelihood(trial, w[rows], count[rows])
            good = value >= best[rows]
            done = rows[good]
            z[done], best[done], gradient[done], hessian[done] = trial[good], value[good], first[good], second[good]
            left = left[~good]
            size[left] *= 0.25
        # Where no step gains any more, rounding is reached.
        active = active[best[active] - before > SMALLEST_GAIN]
    raise ConvergenceError(f"marginal likelihood: no maximum found for moments {w[active[0]]}", z[active[0]])


def _newton_step(
    z: FloatArray, gradient: FloatArray, hessian: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return an ascending step (R, d) that keeps within the bounds and in order, and its gain to first order (R,)."""
    d = z.shape[-1]
    blocked = (high <= low) | ((z <= low) & (gradient < 0.0)) | ((z >= high) & (gradient > 0.0))
    g = np.where(blocked, 0.0, gradient)
    free = ~blocked[:, 1:] & ~blocked[:, :-1]
    # Equal entries that would rather change places move as one: P averages over them.
    tied = free & (np.diff(z, axis=-1) <= 1e-9 * (1.0 - z[:, :-1])) & (g[:, :-1] > g[:, 1:])
    label = np.concatenate([np.zeros((len(z), 1), dtype=np.int64), np.cumsum(~tied, axis=-1)], axis=-1)
    same = (label[:, :, None] == label[:, None, :]).astype(np.float64)
    P = same / same.sum(axis=-1, keepdims=True)
    bend = -hessian
    bend[blocked] = 0.0
    np.swapaxes(bend, -1, -2)[blocked] = 0.0
    g = np.einsum("rij,rj->ri", P, g)
    diagonal = np.einsum("rij,rj->ri", P, np.abs(np.einsum("rii->ri", bend)))
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    bend = P @ (bend * scale[:, :, None] * scale[:, None, :]) @ P + (np.eye(d) - P)
    bend += np.einsum("ri,ij->rij", blocked.astype(np.float64), np.eye(d))
    values, vectors = np.linalg.eigh(bend)
    # Not concave everywhere: bent up, a direction is followed uphill as if it were bent down.
    values = np.maximum(np.abs(values), 1e-6)
    along = np.einsum("rij,ri->rj", vectors, scale * g) / values
    step = scale * np.einsum("rij,rj->ri", vectors, along)
    # A relative trust region, as Newton on z overshoots where the distribution is much wider than the start.
    reach = np.maximum(0.5 * np.abs(z), 1.0)
    step = step / np.maximum(1.0, np.max(np.abs(step) / reach, axis=-1))[:, None]
    return step, np.sum(g * step, axis=-1)


def marginal_fit(w: FloatArray, n: ArrayLike, start: FloatArray) -> tuple[FloatArray, Any]:
    """Return the ascending z (..., d), z_d = 0, that maximises log L for ascending moments w (..., d), and log L (...).

    `start` (..., d) are concentrations to start from, those of maximum likelihood.
    """
    shape, d = w.shape[:-1], w.shape[-1]
    rows, z = w.reshape(-1, d), np.array(start.reshape(-1, d))
    count = np.broadcast_to(np.asarray(n, dtype=np.float64), shape).reshape(-1)
    high = np.zeros_like(z)
    low = np.full_like(z, -np.inf)
    low[:, -1] = 0.0
    z, value = marginal_maximum(rows, count, z, low, high)
    return z.reshape(w.shape), value.reshape(shape)[()]
