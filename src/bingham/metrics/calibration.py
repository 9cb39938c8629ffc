"""Errors on the sphere, and whether the uncertainty that filters state is right."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import erf, gammainc

from bingham.distributions.bingham import Bingham
from bingham.distributions.normalizer import log_normalizer
from bingham.errors import InvalidArgumentError

__all__ = [
    "angle_probability",
    "chi_square_probability",
    "coverage",
    "geodesic_error",
    "normal_probability",
    "normalized_error",
    "root_mean_square",
    "uniformity_statistic",
]

FloatArray = NDArray[np.float64]

NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)


def geodesic_error(estimate: ArrayLike, truth: ArrayLike, *, axial: bool = True) -> FloatArray:
    """Return the angle on the sphere between unit vectors (..., d), in rad.

    Parameters
    ----------
    estimate, truth : (..., d) array_like
        Unit vectors; they broadcast.
    axial : bool
        True takes x and −x for the same: min(∠, π − ∠) ≤ π/2 (Kurz et al. 2014, eq. 67). For quaternions the angle of
        the rotation between them is twice that.

    Examples
    --------
    >>> geodesic_error([1.0, 0.0], [-1.0, 0.0]), geodesic_error([1.0, 0.0], [-1.0, 0.0], axial=False)
    (np.float64(0.0), np.float64(3.141592653589793))
    """
    a, b = np.asarray(estimate, dtype=np.float64), np.asarray(truth, dtype=np.float64)
    # 2 atan2(|a − b|, |a + b|) keeps its accuracy at 0 and π, where arccos loses half of the digits.
    apart, together = np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)
    if axial:
        apart, together = np.minimum(apart, together), np.maximum(apart, together)
    return 2.0 * np.arctan2(apart, together)


def root_mean_square(x: ArrayLike, axis: int = -1) -> FloatArray:
    """Return √(mean x²) along an axis (Kurz et al. 2014, eq. 66)."""
    return np.sqrt(np.mean(np.square(np.asarray(x, dtype=np.float64)), axis=axis))


def angle_probability(law: Bingham, truth: ArrayLike) -> FloatArray:
    """Return P(angle(x, ±mode) ≤ angle(truth, ±mode)) (...), x ~ law: the probability integral transform of the angle.

    Uniform on [0, 1] over many truths if the law is right. With t = arccos |xᵀ mode| its density is
    2 sin^{d−2}t F_{d−1}(z_rest sin²t)/F(z).

    Parameters
    ----------
    law : Bingham
        A law or a batch (...).
    truth : (..., d) array_like
        Unit vectors, broadcast against the batch.
    """
    angle = geodesic_error(law.mode, truth)
    shape, d = angle.shape, law.dim
    angle = np.atleast_1d(angle).ravel()
    z = np.broadcast_to(law.z, (*shape, d)).reshape(-1, d)
    log_f = np.broadcast_to(law.log_normalizer, shape).ravel()
    # Panels from the mode outwards, the first as wide as the narrowest axis, each next one twice as far out.
    total, left = np.zeros(angle.size), np.zeros(angle.size)
    width = 2.0 / np.sqrt(1.0 - 2.0 * z[:, 0])
    todo = np.flatnonzero(angle > 0.0)
    while todo.size:
        start = left[todo]
        half = 0.5 * (np.minimum(angle[todo], start + np.maximum(width[todo], start)) - start)
        sine = np.sin(start[:, None] + half[:, None] * (NODES + 1.0))
        rest = sine[..., None] ** 2 * z[todo, None, :-1]
        log_rest = log_normalizer(rest) if d > 2 else np.log(2.0) + rest[..., 0]
        density = 2.0 * sine ** (d - 2) * np.exp(log_rest - log_f[todo, None])
        total[todo] += half * np.sum(WEIGHTS * density, axis=-1)
        left[todo] = start + 2.0 * half
        # Beyond e^{-40} along the widest axis nothing is left; rounding may keep `left` below `angle` for ever.
        todo = todo[(left[todo] < angle[todo] * (1.0 - 1e-14)) & (-z[todo, -2] * np.sin(left[todo]) ** 2 < 40.0)]
    return np.clip(total, 0.0, 1.0).reshape(shape)


def normal_probability(error: ArrayLike, variance: ArrayLike) -> FloatArray:
    """Return P(|e| ≤ |error|) (...), e ~ N(0, variance)."""
    return erf(np.abs(np.asarray(error)) / np.sqrt(2.0 * np.asarray(variance, dtype=np.float64)))


def normalized_error(estimate: ArrayLike, covariance: ArrayLike, truth: ArrayLike) -> FloatArray:
    """Return eᵀ C⁻¹ e (...) of a Gaussian estimate of a unit vector, e and C in the tangent space of the estimate.

    χ² with d − 1 degrees of freedom if the filter is right (normalised estimation error squared).

    Parameters
    ----------
    estimate : (..., d) array_like
        Unit vectors.
    covariance : (..., d, d) array_like
        Of the vector's components.
    truth : (..., d) array_like
        Unit vectors; the sign is chosen to suit.
    """
    m, x = np.asarray(estimate, dtype=np.float64), np.asarray(truth, dtype=np.float64)
    d = m.shape[-1]
    along = np.sum(m * x, axis=-1, keepdims=True)
    x = np.where(along < 0.0, -x, x)
    tangent = x - np.abs(along) * m
    # Logarithm map: the direction of the tangent part with the length of the angle.
    length = np.linalg.norm(tangent, axis=-1, keepdims=True)
    angle = np.arctan2(length, np.abs(along))
    e = tangent * np.divide(angle, length, out=np.ones_like(length), where=length > 0.0)
    basis = np.linalg.svd(m[..., None, :])[2][..., 1:, :]
    c = basis @ np.asarray(covariance, dtype=np.float64) @ np.swapaxes(basis, -1, -2)
    f = np.einsum("...ij,...j->...i", basis, e)
    if not np.all(np.isfinite(c)):
        raise InvalidArgumentError("covariance", f"finite matrices (..., {d}, {d})", "NaN or infinity")
    return np.sum(f * np.linalg.solve(c, f[..., None])[..., 0], axis=-1)


def chi_square_probability(statistic: ArrayLike, degrees: int) -> FloatArray:
    """Return P(χ² ≤ statistic) (...) with the given degrees of freedom."""
    return gammainc(0.5 * degrees, 0.5 * np.asarray(statistic, dtype=np.float64))


def coverage(probability: ArrayLike, level: float = 0.95, axis: int | None = None) -> Any:
    """Return the share of truths inside the credible set of the given level: mean(probability ≤ level).

    ``probability`` comes from `angle_probability`, `normal_probability` or `chi_square_probability`.
    """
    if not 0.0 < level < 1.0:
        raise InvalidArgumentError("level", "a probability in (0, 1)", level)
    return np.mean(np.asarray(probability) <= level, axis=axis)


def uniformity_statistic(probability: ArrayLike) -> float:
    """Return Kolmogorov's distance sup |empirical − uniform| of probabilities: 0 for perfect calibration."""
    p = np.sort(np.asarray(probability, dtype=np.float64).ravel())
    n = p.size
    if n == 0:
        raise InvalidArgumentError("probability", "at least one value", "none")
    rank = np.arange(1, n + 1)
    return float(np.maximum(rank / n - p, p - (rank - 1) / n).max())
