"""Public normaliser, moments and their inverse, for batches (..., d) in any order of entries."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.libraries import elsewhere
from bingham.errors import AccuracyWarning, ConvergenceError, InvalidArgumentError
from bingham.kernels.numpy_rule import LARGEST, RULE_DIMENSION, log_normalizer_few, moments_few, newton_one
from bingham.kernels.threads import by_rows

__all__ = ["concentrations", "log_normalizer", "log_normalizer_derivatives", "moments", "solve_moments",
           "solve_spectrum"]  # fmt: skip

FloatArray = NDArray[np.float64]

# The contour loses digits slowly in high dimension; to here it is checked to 1e-10 against 40-digit references.
CHECKED_DIMENSION = 50
# Up to this many single values NumPy is as quick as compiled code, which takes a second to load and more to compile.
FEW = 16
# Moments must sum to one within this; the rest is rounding and is divided out.
SUM_TOLERANCE = 1e-8


def _rows(x: ArrayLike, name: str) -> FloatArray:
    a = np.asarray(x, dtype=np.float64)
    if a.ndim == 0 or a.shape[-1] < 2:
        raise InvalidArgumentError(name, "shape (..., d) with d >= 2", a.shape)
    if a.shape[-1] > CHECKED_DIMENSION:
        warnings.warn(
            f"{name}: dimension {a.shape[-1]} is beyond {CHECKED_DIMENSION}, to which the normaliser is "
            "checked; expect 1e-8 at d = 80 and 1e-6 at d = 100",
            AccuracyWarning,
            stacklevel=3,
        )
    return a


def _rejection(row: FloatArray) -> InvalidArgumentError:
    if not np.all(np.isfinite(row)):
        return InvalidArgumentError("z", "finite concentrations", row[~np.isfinite(row)][0])
    return InvalidArgumentError("z", f"concentrations that differ by at most {LARGEST:g}", row.min() - row.max())


def _are_few(z: FloatArray) -> bool:
    """Whether NumPy serves these concentrations; if so they are checked."""
    d = z.shape[-1]
    if d > RULE_DIMENSION or not 0 < z.size <= FEW * d:
        return False
    spans = z.max(axis=-1) - z.min(axis=-1)
    if not (spans <= LARGEST).all():
        raise _rejection(z[~(spans <= LARGEST)][0] if z.ndim > 1 else z)
    return True


def log_normalizer(z: Any) -> Any:
    """Return log F(z), F(z) = ∫ exp(Σ zᵢ xᵢ²) dx over the unit sphere S^{d−1} with its surface measure.

    Parameters
    ----------
    z : (..., d) array_like, or a tensor of PyTorch, JAX or CuPy
        Concentrations in any order; any common offset c adds c to the result. Tensors of other libraries give
        tensors of their precision, differentiable by that library: `bingham.torch`, `bingham.jax`.

    Returns
    -------
    (...) float or ndarray
        Relative error of F below 1e-12 for d ≤ 6 and 1e-10 for d ≤ 50, from uniform to −1e12.

    Raises
    ------
    InvalidArgumentError
        If z is not finite or d < 2.

    Warns
    -----
    AccuracyWarning
        If d > 50.

    Examples
    --------
    >>> import numpy as np
    >>> bool(np.isclose(np.exp(log_normalizer([0.0, 0.0, 0.0, 0.0])), 2 * np.pi**2))
    True
    """
    there = elsewhere(z, "log_normalizer")
    if there is not None:
        return there(z)
    a = _rows(z, "z")
    return log_normalizer_few(a)[()] if _are_few(a) else log_normalizer_derivatives(a)[0]


def log_normalizer_derivatives(z: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return log F (...), its gradient ω (..., d) and its Hessian (..., d, d) at z (..., d).

    ωᵢ = ∂ log F/∂zᵢ = E[xᵢ²] and ∂ωᵢ/∂zⱼ = Cov(xᵢ², xⱼ²) for x with density exp(Σ zᵢ xᵢ²)/F.
    """
    from bingham.kernels.rows import derivatives_lanes, derivatives_rows

    a = _rows(z, "z")
    rows = np.ascontiguousarray(a.reshape(-1, a.shape[-1]))
    n, d = rows.shape
    log_f, gradient, hessian = np.empty(n), np.empty((n, d)), np.empty((n, d, d))
    kernel = derivatives_lanes if d <= RULE_DIMENSION else derivatives_rows
    for start, found in by_rows(kernel, rows, log_f, gradient, hessian, row_us=0.1):
        if found >= 0:
            raise _rejection(rows[start + found])
    shape = a.shape[:-1]
    return log_f.reshape(shape)[()], gradient.reshape(a.shape), hessian.reshape(*a.shape, d)


def moments(z: Any) -> Any:
    """Return ω (..., d), ωᵢ = E[xᵢ²] for x on S^{d−1} with density exp(Σ zᵢ xᵢ²)/F(z); Σω = 1.

    Parameters
    ----------
    z : (..., d) array_like, or a tensor of PyTorch, JAX or CuPy
        Concentrations in any order; a common offset changes nothing.

    Examples
    --------
    >>> moments([0.0, 0.0])
    array([0.5, 0.5])
    """
    there = elsewhere(z, "moments")
    if there is not None:
        return there(z)
    a = _rows(z, "z")
    return moments_few(a) if _are_few(a) else log_normalizer_derivatives(a)[1]


def concentrations(w: Any) -> Any:
    """Return the z (..., d) with moments(z) = w and max z = 0: the inverse of `moments`.

    Parameters
    ----------
    w : (..., d) array_like, or a tensor of PyTorch or JAX
        Second moments, positive, each row with sum 1, in any order.

    Returns
    -------
    (..., d) ndarray
        In the order of w.

    Raises
    ------
    InvalidArgumentError
        If an entry is not positive (a distribution on a smaller sphere has no finite concentrations) or a row does not
        sum to 1.
    ConvergenceError
        If Newton's method does not reach rounding error; never seen for valid moments.

    Examples
    --------
    >>> concentrations([0.25, 0.25, 0.25, 0.25]).round(12) + 0.0
    array([0., 0., 0., 0.])
    """
    there = elsewhere(w, "concentrations")
    return solve_moments(w)[0] if there is None else there(w)


def solve_moments(w: ArrayLike) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """Return concentrations z (..., d), log F(z) (...) and the evaluations (...) that Newton's method took."""
    a = _rows(w, "w")
    if not np.all(a > 0.0):
        bad = a[~(a > 0.0)].flat[0]
        raise InvalidArgumentError(
            "w",
            "positive second moments",
            bad,
            "a zero moment means a distribution on a smaller sphere: "
            "drop that axis, or add the variance that rounding or noise hides",
        )
    if np.any(a < 0.5 / LARGEST):
        smallest = a.min()
        raise InvalidArgumentError(
            "w",
            f"second moments of at least {0.5 / LARGEST:g}, to which concentrations of −{LARGEST:g} belong",
            smallest,
            "drop that axis, or add the variance that rounding or noise hides",
        )
    total = a.sum(axis=-1, keepdims=True)
    if not np.all(np.abs(total - 1.0) <= SUM_TOLERANCE):
        worst = total.flat[int(np.argmax(np.abs(total - 1.0)))]
        raise InvalidArgumentError(
            "w",
            f"rows with sum 1 within {SUM_TOLERANCE:g}",
            f"sum {worst!r}",
            "divide by the sum if they are unnormalised moments",
        )
    from bingham.kernels.rows import newton_rows, newton_rows_4

    d = a.shape[-1]
    rows = np.ascontiguousarray((a / total).reshape(-1, d))
    z, log_f, evaluations = np.empty_like(rows), np.empty(len(rows)), np.empty(len(rows), dtype=np.int64)
    by_rows(newton_rows_4 if d <= RULE_DIMENSION else newton_rows, rows, z, log_f, evaluations, row_us=0.4)
    if np.any(evaluations < 0):
        worst_row = int(np.argmin(evaluations))
        raise ConvergenceError(
            f"concentrations: Newton's method did not converge for w = {rows[worst_row]}", z[worst_row]
        )
    shape = a.shape[:-1]
    return z.reshape(a.shape), log_f.reshape(shape)[()], evaluations.reshape(shape)


def solve_spectrum(w: FloatArray) -> tuple[FloatArray, Any]:
    """Return z (..., d) and log F(z) (...) for checked moments w (..., d), ascending: z is sorted, its last entry 0."""
    if w.ndim == 1 and w.size <= RULE_DIMENSION:
        z, log_f, evaluations = newton_one(w)
        if evaluations > 0:
            return z, log_f
    return solve_moments(w)[:2]
