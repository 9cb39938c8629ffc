"""Likelihood ratio of a given principal axis, from the moment of a sample.

That a is a principal axis of A, whatever the others are, is A a ∝ a: d − 1 linear equations for the natural parameter
of an exponential family. Its likelihood ratio is therefore regular everywhere, also where concentrations are equal.
That it is the k-th one in order is not: inequalities are added. So both are asked apart, and the p-value is the smaller
of two, each weighted by its share of the error (Bonferroni).
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from bingham.distributions.normalizer import solve_moments
from bingham.errors import InvalidArgumentError

__all__ = ["axis_pvalue", "axis_ratios", "complement", "ordered_likelihood"]

FloatArray = NDArray[np.float64]

# Share of the error that the question of the order may take. Away from ties it is never used up: 5 % become 4.75 %.
ORDER_SHARE = 0.05
# Draws of the limit of the order's likelihood ratio, and how many of the largest end what they say of the tail.
DRAWS, TAIL = 20_000, 20


def axis_ratios(moment: FloatArray, n: int, axis: FloatArray, index: int = -1) -> tuple[Any, Any]:
    """Return the likelihood ratios (...) of "a is a principal axis" and of "if so, the k-th", for n axes of moment S.

    With ℓ(ω) = max_z (z·ω − log F(z)) they are 2n [ℓ(ω) − ℓ(ω′)] and 2n [ℓ(ω′) − ℓ(ω⁰)]: ω are the eigenvalues of
    S (..., d, d), ω′ are aᵀSa and the eigenvalues of S across a, ω⁰ the same put in the order in which the axis
    a (..., d) has the rank `index`.
    """
    d = axis.shape[-1]
    k = index % d
    across = complement(axis)
    rest = _eigenvalues(np.swapaxes(across, -1, -2) @ moment @ across)
    along = np.einsum("...i,...ij,...j->...", axis, moment, axis)
    shape = np.broadcast_shapes(rest.shape[:-1], along.shape)
    rest = np.broadcast_to(rest, (*shape, d - 1))
    pinned: FloatArray = np.concatenate(
        [rest[..., :k], np.broadcast_to(along, shape)[..., None], rest[..., k:]], axis=-1
    )
    free = ordered_likelihood(np.sort(pinned, axis=-1))
    order = 2.0 * n * (free - ordered_likelihood(_in_order(pinned, k)))
    return 2.0 * n * (ordered_likelihood(_eigenvalues(moment)) - free), np.maximum(order, 0.0)


def axis_pvalue(ratio: Any, order: Any, n: int, d: int) -> Any:
    """Return the p-value (...) of a principal axis from its two likelihood ratios.

    T² = (n − 1)(e^{Λ/n} − 1) of the first is Hotelling's, (n − p)/(p (n − 1)) T² ~ F(p, n − p), p = d − 1: exactly so
    in the limit of narrow distributions. The second is compared with its limit for a uniform distribution, where the
    order is least known, after division by Bartlett's n/(n − (p + 2)/2).
    """
    p = d - 1
    square = np.maximum((n - 1) * np.expm1(np.asarray(ratio) / n), 0.0)
    first = fdtrc(p, n - p, square * ((n - p) / (p * (n - 1))))
    second = np.ones(np.shape(order))
    doubtful = np.asarray(order) > 0.0
    if np.any(doubtful):
        scaled = np.asarray(order)[doubtful] * max(1.0 - (p + 2) / (2 * n), 0.0)
        second[doubtful] = _order_tail(scaled, d)
    return np.minimum(np.minimum(first / (1.0 - ORDER_SHARE), second / ORDER_SHARE), 1.0)[()]


def complement(axis: FloatArray) -> FloatArray:
    """Return d − 1 orthonormal columns (..., d, d − 1) across unit vectors (..., d)."""
    return np.linalg.svd(axis[..., None, :])[2][..., 1:, :].swapaxes(-1, -2)


def ordered_likelihood(w: FloatArray) -> Any:
    """Return ℓ(ω) (...) of moments (..., d)."""
    if np.any(w <= w.shape[-1] * np.finfo(np.float64).eps):
        raise InvalidArgumentError("x", "axes that span the space", "a sample on a smaller sphere", "add samples")
    w = w / w.sum(axis=-1, keepdims=True)
    z, log_f, _ = solve_moments(w)
    return np.sum(z * w, axis=-1) - log_f


def _eigenvalues(a: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.eigvalsh(a), dtype=np.float64)


def _in_order(w: FloatArray, k: int) -> FloatArray:
    """Return w (..., d), ascending but for entry k, with entry k and those on its wrong side tied at their mean.

    That is where the likelihood has its maximum among ascending moments (pooling of adjacent violators).
    """
    d = w.shape[-1]
    out = w.copy()
    for side in (-1, 1):
        reach = k if side < 0 else d - 1 - k
        if reach == 0:
            continue
        wrong = side * (w[..., k] - w[..., k + side]) > 0.0
        for size in range(1, reach + 1):
            a, b = (k - size, k) if side < 0 else (k, k + size)
            mean = w[..., a : b + 1].mean(axis=-1)
            beyond = a - 1 if side < 0 else b + 1
            done = np.ones_like(wrong) if not 0 <= beyond < d else side * (w[..., beyond] - mean) >= 0.0
            tied = wrong & done
            out[..., a : b + 1] = np.where(tied[..., None], mean[..., None], out[..., a : b + 1])
            wrong = wrong & ~done
    return out


def _order_tail(value: FloatArray, d: int) -> FloatArray:
    """Return P(likelihood ratio of the order > value) for uniform axes in large samples, value (N,)."""
    drawn = _order_draws(d)
    above = len(drawn) - np.searchsorted(drawn, value)
    # Beyond the largest draws as χ² falls.
    far = TAIL * np.exp(-0.5 * np.maximum(value - drawn[-TAIL], 0.0))
    return np.where(above >= TAIL, above, far) / len(drawn)


@cache
def _order_draws(d: int) -> FloatArray:
    """Return draws, ascending, of Σ (ω′ − ω⁰)², the moment of uniform axes being a symmetric Gaussian matrix.

    The axis is to be the last one, which asks for more than a rank in the middle.
    """
    g = np.random.default_rng(0).standard_normal((DRAWS, d, d))
    # Half the variance off the diagonal.
    g = np.where(np.eye(d) > 0.0, g, 0.5 * (g + np.swapaxes(g, -1, -2)))
    pinned = np.concatenate([_eigenvalues(g[:, 1:, 1:]), g[:, :1, 0]], axis=1)
    return np.sort(np.sum((pinned - _in_order(pinned, d - 1)) ** 2, axis=1))
