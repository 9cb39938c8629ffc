"""How far estimates are from the truth, as angles and in units of the uncertainty that they state."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError
from bingham.validation import unit_or_missing, unit_rows

__all__ = ["geodesic_error", "known", "nees", "root_mean_square"]

FloatArray = NDArray[np.float64]


def known(x: ArrayLike, name: str) -> FloatArray:
    """Return x as float64; a summary of nothing, or of values with NaN among them, is rejected."""
    a = np.asarray(x, dtype=np.float64)
    if a.size == 0:
        raise InvalidArgumentError(name, "at least one value", "none")
    if missing := int(np.count_nonzero(np.isnan(a))):
        hint = f"leave out what belongs to unknown truths: {name}[~np.isnan({name})]"
        raise InvalidArgumentError(name, "values without NaN", f"NaN in {missing} of {a.size}", hint)
    return a


def geodesic_error(estimate: ArrayLike, truth: ArrayLike, *, axial: bool = True) -> FloatArray:
    """Return the angle on the sphere between unit vectors (..., d), in rad.

    Parameters
    ----------
    estimate, truth : (..., d) array_like
        Unit vectors; they broadcast. A row of NaN is unknown and gives NaN.
    axial : bool
        True takes x and −x for the same: min(∠, π − ∠) ≤ π/2 (Kurz et al. 2014, eq. 67). For quaternions the angle of
        the rotation between them is twice that.

    Raises
    ------
    InvalidArgumentError
        If the shapes do not fit together, or a row has not unit length.

    Examples
    --------
    >>> geodesic_error([1.0, 0.0], [-1.0, 0.0]), geodesic_error([1.0, 0.0], [-1.0, 0.0], axial=False)
    (np.float64(0.0), np.float64(3.141592653589793))
    """
    shape = np.shape(estimate)
    a = unit_or_missing(estimate, shape[-1] if shape else 0, "estimate")
    b = unit_or_missing(truth, a.shape[-1], "truth")
    _check_broadcast(a, b)
    # 2 atan2(|a − b|, |a + b|) keeps its accuracy at 0 and π, where arccos loses half of the digits.
    apart, together = np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)
    if axial:
        apart, together = np.minimum(apart, together), np.maximum(apart, together)
    return 2.0 * np.arctan2(apart, together)


def root_mean_square(x: ArrayLike, axis: int = -1) -> FloatArray:
    """Return √(mean x²) along an axis (Kurz et al. 2014, eq. 66); NaN among the values is rejected."""
    return np.sqrt(np.mean(np.square(known(x, "x")), axis=axis))


def nees(estimate: ArrayLike, covariance: ArrayLike, truth: ArrayLike) -> FloatArray:
    """Return eᵀ C⁻¹ e (...) of a Gaussian estimate of a unit vector, e and C in the tangent space of the estimate.

    χ² with d − 1 degrees of freedom if the filter is right (normalised estimation error squared).

    Parameters
    ----------
    estimate : (..., d) array_like
        Unit vectors.
    covariance : (..., d, d) array_like
        Of the vector's components, positive definite across the estimate.
    truth : (..., d) array_like
        Unit vectors; the sign is chosen to suit. A row of NaN is unknown and gives NaN.

    Raises
    ------
    InvalidArgumentError
        If an estimate or a covariance is not finite, a row has not unit length, or the shapes do not fit together.

    Examples
    --------
    >>> round(float(nees([1.0, 0.0], [[0.0, 0.0], [0.0, 0.01]], [np.cos(0.2), np.sin(0.2)])), 6)
    4.0
    """
    shape = np.shape(estimate)
    m = unit_rows(estimate, shape[-1] if shape else 0, "estimate")
    d = m.shape[-1]
    x = unit_or_missing(truth, d, "truth")
    c = np.asarray(covariance, dtype=np.float64)
    _check_broadcast(m, x)
    if c.shape[-2:] != (d, d):
        raise InvalidArgumentError("covariance", f"shape (..., {d}, {d})", c.shape)
    if not np.all(np.isfinite(c)):
        raise InvalidArgumentError("covariance", f"finite matrices (..., {d}, {d})", "NaN or infinity")
    along = np.sum(m * x, axis=-1, keepdims=True)
    x = np.where(along < 0.0, -x, x)
    tangent = x - np.abs(along) * m
    # Logarithm map: the direction of the tangent part with the length of the angle.
    length = np.linalg.norm(tangent, axis=-1, keepdims=True)
    angle = np.arctan2(length, np.abs(along))
    e = tangent * np.divide(angle, length, out=np.ones_like(length), where=length > 0.0)
    basis = np.linalg.svd(m[..., None, :])[2][..., 1:, :]
    f = np.einsum("...ij,...j->...i", basis, e)
    try:
        root = np.linalg.cholesky(basis @ c @ np.swapaxes(basis, -1, -2))
    except np.linalg.LinAlgError:
        hint = "a state without uncertainty has no normalised error"
        raise InvalidArgumentError("covariance", "positive definite across the estimate", "not so", hint) from None
    return np.sum(np.linalg.solve(root, f[..., None])[..., 0] ** 2, axis=-1)


def _check_broadcast(estimate: FloatArray, truth: FloatArray) -> None:
    try:
        np.broadcast_shapes(estimate.shape, truth.shape)
    except ValueError:
        raise InvalidArgumentError(
            "truth", f"a shape that broadcasts with the estimates' {estimate.shape}", truth.shape
        ) from None
