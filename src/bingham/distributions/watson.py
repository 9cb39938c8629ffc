"""Watson's distribution of axes: a Bingham distribution with rotational symmetry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.normalizer import log_normalizer, solve_moments
from bingham.distributions.sibling import weighted_sample
from bingham.errors import InvalidArgumentError
from bingham.notebook import Pictured
from bingham.validation import check_number, unit_row, unit_rows

__all__ = ["Watson"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Watson(Pictured):
    """Distribution f(x) = exp(κ (mᵀx)²)/F of axes x on S^{d−1}.

    A cluster about m for κ > 0, a girdle across it for κ < 0.

    Parameters
    ----------
    axis : (d,) array_like
        Unit vector m.
    kappa : float
        Concentration κ.

    Examples
    --------
    >>> p = Watson([0.0, 0.0, 1.0], 5.0)
    >>> q = p.to_bingham()
    >>> bool(np.isclose(p.logpdf([0.6, 0.0, 0.8]), q.logpdf([0.6, 0.0, 0.8])))
    True

    References
    ----------
    Watson, Geophys. Suppl. Mon. Not. R. Astr. Soc. 7 (1965); Mardia & Jupp (2000), sec. 9.4.2.
    """

    axis: FloatArray
    kappa: float

    def __post_init__(self) -> None:
        check_number(self.kappa, "kappa", "a finite number")
        object.__setattr__(self, "axis", unit_row(self.axis, np.size(self.axis), "axis"))

    @classmethod
    def fit(cls, x: ArrayLike, weights: ArrayLike | None = None) -> Self:
        """Return the distribution of greatest likelihood for unit vectors (n, d): the better of cluster and girdle."""
        a, w = weighted_sample(x, weights)
        d = a.shape[1]
        values, axes = np.linalg.eigh((a.T * w) @ a)
        along = values[[-1, 0]] / values.sum()
        if not np.all((along > 0.0) & (along < 1.0)):
            raise InvalidArgumentError("x", "axes that scatter along and across their mean", "axes on a smaller sphere")
        rest = np.repeat(((1.0 - along) / (d - 1))[:, None], d - 1, axis=1)
        moments = np.concatenate([rest, along[:, None]], axis=1)
        z, log_f, _ = solve_moments(moments)
        best = int(np.argmax(np.sum(z * moments, axis=1) - log_f))
        return cls(axes[:, -1 if best == 0 else 0], float(z[best, -1] - z[best, 0]))

    @property
    def dim(self) -> int:
        """Ambient dimension d."""
        return self.axis.size

    @property
    def parameter_count(self) -> int:
        """Free parameters: d."""
        return self.dim

    def to_bingham(self) -> Bingham:
        """Return the same distribution as a `Bingham`."""
        return Bingham.from_matrix(self.kappa * np.outer(self.axis, self.axis))

    def logpdf(self, x: ArrayLike) -> Any:
        """Return log f(x) (...) of unit vectors (..., d)."""
        z = np.zeros(self.dim)
        z[-1] = self.kappa
        return (self.kappa * (unit_rows(x, self.dim, "x") @ self.axis) ** 2 - log_normalizer(z))[()]

    def pdf(self, x: ArrayLike) -> Any:
        """Return f(x) (...)."""
        return np.exp(self.logpdf(x))

    def rvs(self, size: int, *, rng: Any = None) -> FloatArray:
        """Return exact, independent samples (size, d)."""
        return self.to_bingham().rvs(size, rng=rng)
