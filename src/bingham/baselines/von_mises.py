"""First moment of the von Mises distribution and its inverse, to full relative precision at any width."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import i0e, i1e

__all__ = ["log_resultant", "von_mises_concentration"]

FloatArray = NDArray[np.float64]

# From here on series in 1/κ replace Bessel functions: eight terms leave 4e-17, while 1 − I₁/I₀ would lose 2κ ulp.
NARROW = 200.0
# 1 − A(κ) = Σ aₙ κ⁻ⁿ, n = 1 … 8: in A' = 1 − A/κ − A² it needs 2 aₙ = (n − 2) aₙ₋₁ + Σ aᵢ aₙ₋ᵢ.
DEFICIT = (1 / 2, 1 / 8, 1 / 8, 25 / 128, 13 / 32, 1073 / 1024, 103 / 32, 375733 / 32768)
# That series solved for κ = Σ cₙ (1 − A)ⁿ⁻¹, n = 0 … 7.
CONCENTRATION = (1 / 2, 1 / 4, 3 / 8, 15 / 16, 111 / 32, 1095 / 64, 13359 / 128, 192255 / 256)
# Quadratic convergence from an error of 1 % ends at rounding after four.
NEWTON_STEPS = 4


def log_resultant(kappa: ArrayLike) -> FloatArray:
    """Return log A(κ) (...), A(κ) = I₁(κ)/I₀(κ) the first moment of a von Mises distribution; −∞ for κ = 0."""
    k = np.asarray(kappa, dtype=np.float64)
    wide = np.minimum(k, NARROW)
    with np.errstate(divide="ignore"):
        log_a = np.log(i1e(wide) / i0e(wide))
    return np.where(k < NARROW, log_a, np.log1p(-_deficit(np.maximum(k, NARROW))))


def von_mises_concentration(log_length: ArrayLike) -> FloatArray:
    """Return κ (...) with log A(κ) = log_length (...) < 0.

    The logarithm keeps the digits of both A near 0 and 1 − A near 0, where A itself would round to 1.
    """
    log_a = np.asarray(log_length, dtype=np.float64)
    edge = float(_deficit(np.array(NARROW)))
    deficit = -np.expm1(log_a)
    narrow = np.minimum(deficit, edge)
    wide = _by_newton(np.minimum(np.exp(log_a), 1.0 - edge))
    return np.where(deficit > edge, wide, _polynomial(CONCENTRATION, narrow) / narrow)


def _deficit(kappa: FloatArray) -> FloatArray:
    return _polynomial(DEFICIT, 1.0 / kappa) / kappa


def _by_newton(resultant: FloatArray) -> FloatArray:
    """Return κ with A(κ) = resultant by Newton's method, A' = 1 − A/κ − A²."""
    # Good to 1 % everywhere: exact to first order at 0 and at 1.
    kappa = resultant * (2.0 - resultant * resultant) / (1.0 - resultant * resultant)
    for _ in range(NEWTON_STEPS):
        a = i1e(kappa) / i0e(kappa)
        slope = 1.0 - np.divide(a, kappa, out=np.full_like(kappa, 0.5), where=kappa > 0.0) - a * a
        kappa = np.maximum(kappa - (a - resultant) / slope, 0.0)
    return kappa


def _polynomial(coefficients: tuple[float, ...], x: FloatArray) -> FloatArray:
    """Return Σ coefficients[n] xⁿ (...)."""
    value = np.full_like(x, coefficients[-1])
    for c in coefficients[-2::-1]:
        value = value * x + c
    return value
