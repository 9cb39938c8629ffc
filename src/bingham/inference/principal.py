"""Likelihood ratio of a given principal axis, from the moment of a sample."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtri

from bingham.distributions.normalizer import solve_moments
from bingham.errors import InvalidArgumentError

__all__ = ["axis_ratio", "complement", "ordered_likelihood", "ratio_limit"]

FloatArray = NDArray[np.float64]


def axis_ratio(moment: FloatArray, n: int, axis: FloatArray, index: int = -1) -> Any:
    """Return Λ (...) = 2n [ℓ(ω) − ℓ(ω⁰)], ℓ(ω) = max_z (z·ω − log F(z)), for a sample moment S (..., d, d) of n axes.

    ω are the eigenvalues of S; ω⁰ are aᵀSa and the eigenvalues of S across a, put in the order in which the axis
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
    return 2.0 * n * (ordered_likelihood(_eigenvalues(moment)) - ordered_likelihood(_in_order(pinned, k)))


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


def ratio_limit(level: float, n: int, p: int) -> float:
    """Return the Λ beyond which an axis is outside a region of the given level: T² = (n − 1)(e^{Λ/n} − 1), Hotelling's.

    (n − p)/(p (n − 1)) T² ~ F(p, n − p), exact in the limit of narrow distributions.
    """
    return float(n * np.log1p(p / (n - p) * fdtri(p, n - p, level)))


def _eigenvalues(a: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.eigvalsh(a), dtype=np.float64)


def _in_order(w: FloatArray, k: int) -> FloatArray:
    """Return w (..., d), ascending but for entry k, with entry k and those it should not pass tied at their mean.

    That is where the likelihood has its maximum among ascending moments (pooling of adjacent violators).
    """
    d = w.shape[-1]
    out = w.copy()
    pending = np.ones(w.shape[:-1], dtype=bool)
    # Pools [a, b] about k, smallest first; the first one that leaves the row in order is right.
    for size in range(1, d + 1):
        for a in range(max(0, k - size + 1), min(k, d - size) + 1):
            b = a + size
            if a < k and b > k + 1:
                continue  # entry k cannot be out of order on both sides
            mean = w[..., a:b].mean(axis=-1, keepdims=True)
            tied = np.concatenate([w[..., :a], np.repeat(mean, size, axis=-1), w[..., b:]], axis=-1)
            right = pending & np.all(np.diff(tied, axis=-1) >= 0.0, axis=-1)
            out = np.where(right[..., None], tied, out)
            pending = pending & ~right
    return out
