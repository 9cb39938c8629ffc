"""Moment correction by a Riemannian trust-region method, as published (Li et al. 2019, Fig. 5)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import ConvergenceError

__all__ = ["trust_region"]

FloatArray = NDArray[np.float64]


def trust_region(
    points: FloatArray, moment: FloatArray, penalty: float = 0.0, *, gradient_norm: float = 1e-9
) -> FloatArray:
    """Minimise the objective of `descent.steepest_descent` by a trust-region Newton method; return unit vectors (m, d).

    The objective of y/|y| is handed to SciPy's Newton method with conjugate gradients; products with its Hessian are
    differences of the gradient. Steps along y change nothing, so it moves on the spheres.
    """
    m, d = points.shape

    def parts(flat: FloatArray) -> tuple[float, FloatArray]:
        y = flat.reshape(m, d)
        length = np.linalg.norm(y, axis=1)[:, None]
        x = y / length
        error = x.T @ x / m - moment
        slope = 4.0 / m * (x @ error) - penalty / m * points
        slope -= np.sum(slope * x, axis=1)[:, None] * x
        return float(np.sum(error * error) + penalty * (1.0 - np.sum(x * points) / m)), (slope / length).ravel()

    def product(flat: FloatArray, direction: FloatArray) -> FloatArray:
        h = 1e-5 / max(float(np.linalg.norm(direction)), 1e-30)
        return (parts(flat + h * direction)[1] - parts(flat - h * direction)[1]) / (2.0 * h)

    from scipy.optimize import minimize

    options = {"gtol": gradient_norm, "maxiter": 2000}
    result: Any = minimize(parts, points.ravel(), jac=True, hessp=product, method="trust-ncg", options=options)
    y = result.x.reshape(m, d)
    if not np.isfinite(result.fun):
        raise ConvergenceError(f"trust region: {result.message}", y)
    return y / np.linalg.norm(y, axis=1)[:, None]
