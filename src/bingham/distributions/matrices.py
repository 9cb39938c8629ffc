"""log F(A), E[xxᵀ] and their derivatives straight from matrices A (n, d, d), for callers that differentiate by A."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.normalizer import log_normalizer_derivatives
from bingham.errors import InvalidArgumentError
from bingham.kernels.eigen_lanes import diagonalize_lanes_4
from bingham.kernels.frames import combine_rows, combine_rows_4, curvature_rows, likelihood_rows
from bingham.kernels.threads import by_rows

__all__ = ["Spectrum", "matrix_curvature", "matrix_likelihood", "matrix_log_normalizer", "matrix_spectrum"]

FloatArray = NDArray[np.float64]


class Spectrum(NamedTuple):
    """Eigenvalues (n, d), in no order, and eigenvectors by rows (n, d, d)."""

    values: FloatArray
    frames: FloatArray


def matrix_spectrum(matrices: FloatArray) -> Spectrum:
    """Return the spectrum of the symmetric parts of matrices (n, d, d)."""
    # A sum is finite only if all entries are; it overflows where they are beyond use anyway.
    if not np.isfinite(matrices.sum()):
        raise InvalidArgumentError("A", "finite entries", float(np.abs(matrices).max()))
    n, d = matrices.shape[:2]
    if d != 4:
        values, columns = np.linalg.eigh(0.5 * (matrices + np.swapaxes(matrices, -1, -2)))
        return Spectrum(values, np.ascontiguousarray(np.swapaxes(columns, -1, -2)))
    values, frames = np.empty((n, 4)), np.empty((n, 4, 4))
    by_rows(diagonalize_lanes_4, matrices, values, frames, row_us=0.1)
    return Spectrum(values, frames)


def matrix_log_normalizer(matrices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return log F(A) (n,) and its gradient by A, the second moment E[yyᵀ] (n, d, d)."""
    spectrum = matrix_spectrum(matrices)
    log_f, w, _ = log_normalizer_derivatives(spectrum.values)
    moment = np.empty(matrices.shape)
    (combine_rows_4 if matrices.shape[-1] == 4 else combine_rows)(w, spectrum.frames, moment)
    return log_f, moment


def matrix_likelihood(matrices: FloatArray, x: FloatArray, tolerance: float) -> tuple[FloatArray, FloatArray]:
    """Return log F(A) − uᵀAu (n,), u = x/|x|, and its gradient by A, E[yyᵀ] − uuᵀ (n, d, d)."""
    values, gradients = matrix_log_normalizer(matrices)
    wrong: Any = likelihood_rows(matrices, x, tolerance, values, gradients)
    if wrong >= 0:
        raise InvalidArgumentError("x", "unit vectors", f"length {float(np.linalg.norm(x[wrong])):.9g} in row {wrong}")
    return values, gradients


def matrix_curvature(matrices: FloatArray, directions: FloatArray) -> FloatArray:
    """Return the derivative of E[yyᵀ] (n, d, d) along the symmetric parts of directions (n, d, d)."""
    spectrum = matrix_spectrum(matrices)
    _, w, hessian = log_normalizer_derivatives(spectrum.values)
    out = np.empty(matrices.shape)
    curvature_rows(spectrum.frames, w, hessian, directions, out)
    return out
