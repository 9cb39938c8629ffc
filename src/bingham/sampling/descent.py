"""Moment correction by Riemannian steepest descent, as published."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.errors import ConvergenceError

__all__ = ["Descent", "moment_residual", "steepest_descent"]

FloatArray = NDArray[np.float64]

MAX_STEPS = 20_000
# Squared Frobenius norm of the moment error at which the plain descent ends.
RESIDUAL = 1e-20
# Gradient norm at which the penalised descent ends: its minimum has a residual of its own.
STATIONARY = 1e-9


class Descent(NamedTuple):
    """Corrected ``points`` (m, d), their ``residual`` E and the ``steps`` taken."""

    points: FloatArray
    residual: float
    steps: int


def moment_residual(points: FloatArray, moment: FloatArray) -> float:
    """Return E = ‖Σ x xᵀ/m − S‖²_F of points (m, d) (Li et al. 2019, eq. 13)."""
    error = points.T @ points / len(points) - moment
    return float(np.sum(error * error))


def steepest_descent(points: FloatArray, moment: FloatArray, *, penalty: float = 0.0) -> Descent:
    """Minimise ‖Σ x xᵀ/m − S‖²_F + λ/m Σ (1 − xᵀ x₀) over unit vectors x (m, d), starting at x₀ = points.

    Steps follow the tangential gradient with Barzilai & Borwein's length, halved until the objective falls (Armijo),
    and return to the sphere by normalisation.

    Parameters
    ----------
    points : (m, d) ndarray
        Unit vectors.
    moment : (d, d) ndarray
        S, trace 1.
    penalty : float
        λ; above 0 the residual does not vanish.

    Raises
    ------
    ConvergenceError
        If the plain descent does not reach E = 1e-20, or the penalised one a gradient of 1e-9.

    References
    ----------
    Li, Frisch, Noack & Hanebeck, ECC 2019, eq. 13 and the penalised form below it.
    """
    m = len(points)
    x = points

    def objective(y: FloatArray) -> tuple[float, float, FloatArray]:
        error = y.T @ y / m - moment
        residual = float(np.sum(error * error))
        slope = 4.0 / m * (y @ error) - penalty / m * points
        slope -= np.einsum("ij,ij->i", slope, y)[:, None] * y
        return residual + penalty * float(1.0 - np.einsum("ij,ij->", y, points) / m), residual, slope

    value, residual, slope = objective(x)
    length = 0.25 * m
    for step in range(MAX_STEPS):
        square = float(np.sum(slope * slope))
        if residual <= RESIDUAL if penalty == 0.0 else m * square <= STATIONARY**2:
            return Descent(x, residual, step)
        for _ in range(60):
            y = x - length * slope
            y /= np.linalg.norm(y, axis=1)[:, None]
            new_value, new_residual, new_slope = objective(y)
            if new_value <= value - 1e-4 * length * square:
                break
            length *= 0.5
        else:
            break
        moved, rotated = y - x, new_slope - slope
        curvature = float(np.sum(moved * rotated))
        length = float(np.sum(moved * moved)) / curvature if curvature > 0.0 else 2.0 * length
        x, value, residual, slope = y, new_value, new_residual, new_slope
    raise ConvergenceError(
        f"steepest descent: residual {residual:.3g} after {MAX_STEPS} steps or none left that descends", x
    )
