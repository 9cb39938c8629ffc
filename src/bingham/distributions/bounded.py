"""Maximum likelihood under a ceiling on the concentrations, for samples that a free fit would concentrate without end.

A few points, or noise-free or coarsely rounded data, lie on a smaller sphere: some second moments are zero, and the
likelihood grows without bound. Bounding zᵢ ≥ −ceiling says that no axis is known better than √(1/(2 ceiling)) rad. It
keeps the problem concave, so that an expectation-maximisation step still cannot lower the likelihood.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.normalizer import log_normalizer_derivatives, solve_moments
from bingham.errors import ConvergenceError

__all__ = ["bounded_concentrations"]

FloatArray = NDArray[np.float64]

MAX_STEPS = 100
TOLERANCE = 1e-11


def bounded_concentrations(w: FloatArray, ceiling: float) -> tuple[FloatArray, Any]:
    """Return the z (..., d) that maximises z·ω − log F(z) subject to −ceiling ≤ zᵢ ≤ 0 = z_d, and log F(z) (...).

    Parameters
    ----------
    w : (..., d) ndarray
        Second moments, ascending, not negative, each row with sum 1.
    ceiling : float
        Largest allowed |z|.

    Raises
    ------
    ConvergenceError
        If Newton's method on the free entries does not settle.
    """
    # ω = 1/(4 ceiling) belongs to |z| of about twice the ceiling: entries below it certainly end on the bound.
    d = w.shape[-1]
    moments = w.reshape(-1, d)
    clamped = np.maximum(moments, 0.25 / ceiling)
    z, log_f, _ = solve_moments(clamped / clamped.sum(axis=-1, keepdims=True))
    for k, row in enumerate(moments):
        if z[k, 0] < -ceiling or row[0] < 0.25 / ceiling:
            z[k], log_f[k] = _bounded_row(np.maximum(z[k], -ceiling), row, ceiling)
    return z.reshape(w.shape), log_f.reshape(w.shape[:-1])[()]


def _bounded_row(z: FloatArray, w: FloatArray, ceiling: float) -> tuple[FloatArray, float]:
    """Projected Newton for one row, from a start z within the bounds."""
    for _ in range(MAX_STEPS):
        log_f, gradient, hessian = log_normalizer_derivatives(z)
        residual = w - gradient
        # Entries on the bound stay there while the likelihood wants them beyond it.
        free = np.flatnonzero((z[:-1] > -ceiling) | (residual[:-1] > 0.0))
        if free.size == 0 or np.all(np.abs(residual[free]) <= TOLERANCE * np.maximum(w[free], gradient[free])):
            return z, float(log_f)
        scale = 1.0 / np.sqrt(np.diag(hessian)[free])
        step = scale * np.linalg.solve(hessian[np.ix_(free, free)] * np.outer(scale, scale), scale * residual[free])
        # A relative trust region: Newton on z overshoots where the distribution is much wider than the start.
        reach = np.maximum(0.5 * np.abs(z[free]), 1.0)
        new = np.array(z)
        new[free] = np.clip(z[free] + step / max(1.0, float(np.max(np.abs(step) / reach))), -ceiling, 0.0)
        if np.all(np.abs(new - z) <= 1e-14 * np.abs(z)):
            return z, float(log_f)
        z = new
    raise ConvergenceError(f"concentrations: no maximum found under the ceiling {ceiling:g} for moments {w}", z)
