"""The angular central Gaussian distribution: directions of a centred normal vector."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaln

from bingham.distributions.sibling import weighted_sample
from bingham.errors import ConvergenceError, InvalidArgumentError
from bingham.notebook import Pictured
from bingham.validation import as_generator, as_numbers, integer, unit_rows

__all__ = ["AngularCentralGaussian"]

FloatArray = NDArray[np.float64]

MAX_STEPS = 2000
TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class AngularCentralGaussian(Pictured):
    """Distribution of y/‖y‖, y ~ N(0, Λ): f(x) = Γ(d/2)/(2π^{d/2}) |Λ|^{−1/2} (xᵀΛ⁻¹x)^{−d/2}.

    Parameters
    ----------
    shape : (d, d) array_like
        Λ, symmetric and positive definite; kept with trace d, as its scale means nothing.

    Examples
    --------
    >>> p = AngularCentralGaussian(np.diag([1.0, 1.0, 4.0]))
    >>> float(p.pdf([0.0, 0.0, 1.0]).round(4)) == round(1 / (4 * np.pi) / 2 * 8, 4)
    True

    References
    ----------
    Tyler, Biometrika 74 (1987) 579; Mardia & Jupp (2000), sec. 9.4.4.
    """

    shape: FloatArray

    def __post_init__(self) -> None:
        a = as_numbers(self.shape, "shape")
        if a.ndim != 2 or a.shape[0] != a.shape[1] or not np.allclose(a, a.T, rtol=1e-8, atol=0.0):
            raise InvalidArgumentError("shape", "a symmetric matrix (d, d)", a)
        values = np.linalg.eigvalsh(a)
        if not values[0] > 0.0:
            raise InvalidArgumentError("shape", "a positive definite matrix", f"smallest eigenvalue {values[0]:.3g}")
        object.__setattr__(self, "shape", 0.5 * (a + a.T) * (len(a) / values.sum()))

    @classmethod
    def fit(cls, x: ArrayLike, weights: ArrayLike | None = None) -> Self:
        """Return the distribution of greatest likelihood: Tyler's (1987) fixed point Λ = d Σ wₙ xₙxₙᵀ/(xₙᵀΛ⁻¹xₙ).

        It exists if no subspace of dimension k holds the share k/d of the axes or more.
        """
        a, w = weighted_sample(x, weights)
        d = a.shape[1]
        moment = (a.T * w) @ a
        if not np.linalg.eigvalsh(moment)[0] > d * np.finfo(np.float64).eps:
            raise InvalidArgumentError("x", "axes that span the space", "a sample on a smaller sphere", "add samples")
        shape = d * moment
        for _ in range(MAX_STEPS):
            root = np.linalg.cholesky(shape)
            y = np.linalg.solve(root, a.T)
            # In the frame of the last Λ the fixed point is the identity; the distance from it measures the error.
            y *= np.sqrt(d * w / np.sum(y * y, axis=0))
            step = y @ y.T
            shape = root @ step @ root.T
            shape *= d / np.trace(shape)
            if np.abs(step - np.eye(d) * np.trace(step) / d).max() < TOLERANCE:
                return cls(shape)
        raise ConvergenceError(
            "angular central Gaussian: Tyler's iteration did not settle", shape, "many axes lie in one plane or line"
        )

    @property
    def dim(self) -> int:
        """Ambient dimension d."""
        return len(self.shape)

    @property
    def parameter_count(self) -> int:
        """Free parameters: d(d + 1)/2 − 1."""
        return self.dim * (self.dim + 1) // 2 - 1

    def logpdf(self, x: ArrayLike) -> Any:
        """Return log f(x) (...) of unit vectors (..., d)."""
        d = self.dim
        root = np.linalg.cholesky(self.shape)
        y = np.linalg.solve(root, unit_rows(x, d, "x")[..., None])[..., 0]
        log_area = math.log(2.0) + 0.5 * d * math.log(math.pi) - float(gammaln(0.5 * d))
        return -log_area - np.log(np.diag(root)).sum() - 0.5 * d * np.log(np.sum(y * y, axis=-1))[()]

    def pdf(self, x: ArrayLike) -> Any:
        """Return f(x) (...)."""
        return np.exp(self.logpdf(x))

    def rvs(self, size: int, *, rng: Any = None) -> FloatArray:
        """Return exact, independent samples (size, d)."""
        y = as_generator(rng).standard_normal((integer(size, "size", 0), self.dim)) @ np.linalg.cholesky(self.shape).T
        return y / np.linalg.norm(y, axis=1, keepdims=True)
