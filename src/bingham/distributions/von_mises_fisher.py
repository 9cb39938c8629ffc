"""The von Mises–Fisher distribution of directions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaln, ive

from bingham.distributions.sibling import weighted_sample
from bingham.errors import InvalidArgumentError
from bingham.notebook import Pictured
from bingham.validation import as_generator, check_number, integer, unit_row, unit_rows

__all__ = ["VonMisesFisher"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class VonMisesFisher(Pictured):
    """Distribution f(x) = exp(κ mᵀx) κ^{d/2−1}/((2π)^{d/2} I_{d/2−1}(κ)) of directions x on S^{d−1}.

    Parameters
    ----------
    mean : (d,) array_like
        Mean direction m, a unit vector.
    kappa : float
        Concentration κ ≥ 0.

    Examples
    --------
    >>> p = VonMisesFisher([0.0, 0.0, 1.0], 2.0)
    >>> bool(np.isclose(p.pdf([0, 0, 1]), 2 * np.exp(2) / (4 * np.pi * np.sinh(2))))
    True

    References
    ----------
    Mardia & Jupp (2000), sec. 9.3.2, 10.3.1.
    """

    mean: FloatArray
    kappa: float

    def __post_init__(self) -> None:
        check_number(self.kappa, "kappa", "a finite number ≥ 0", minimum=0.0)
        object.__setattr__(self, "mean", unit_row(self.mean, np.size(self.mean), "mean"))

    @classmethod
    def fit(cls, x: ArrayLike, weights: ArrayLike | None = None) -> Self:
        """Return the distribution of greatest likelihood: m along Σ wₙ xₙ, κ with I_{d/2}(κ)/I_{d/2−1}(κ) = R̄."""
        a, w = weighted_sample(x, weights)
        total = w @ a
        length = float(np.linalg.norm(total))
        if length >= 1.0 - 1e-14:
            raise InvalidArgumentError("x", "directions that scatter", "all alike", "their concentration has no bound")
        if length < 1e-14:
            return cls(np.eye(a.shape[1])[-1], 0.0)
        return cls(total / length, _kappa(length, a.shape[1]))

    @property
    def dim(self) -> int:
        """Ambient dimension d."""
        return self.mean.size

    @property
    def parameter_count(self) -> int:
        """Free parameters: d."""
        return self.dim

    def logpdf(self, x: ArrayLike) -> Any:
        """Return log f(x) (...) of unit vectors (..., d)."""
        d, k = self.dim, self.kappa
        if k < 1e-8:
            front = float(gammaln(0.5 * d)) - math.log(2.0) - 0.5 * d * math.log(math.pi)
        else:
            bessel = math.log(ive(0.5 * d - 1.0, k)) + k
            front = (0.5 * d - 1.0) * math.log(k) - 0.5 * d * math.log(2.0 * math.pi) - bessel
        return (k * (unit_rows(x, d, "x") @ self.mean) + front)[()]

    def pdf(self, x: ArrayLike) -> Any:
        """Return f(x) (...)."""
        return np.exp(self.logpdf(x))

    def rvs(self, size: int, *, rng: Any = None) -> FloatArray:
        """Return exact, independent samples (size, d), by Wood's (1994) rejection as SciPy does it."""
        from scipy.stats import vonmises_fisher

        generator, count = as_generator(rng), integer(size, "size", 0)
        if self.kappa == 0.0 or count == 0:
            y = generator.standard_normal((count, self.dim))
            return y / np.linalg.norm(y, axis=1, keepdims=True)
        frozen: Any = vonmises_fisher
        drawn = frozen(self.mean, self.kappa).rvs(count, random_state=generator)
        return np.reshape(drawn, (count, self.dim))


def _kappa(length: float, d: int) -> float:
    """Return κ with A(κ) = I_{d/2}(κ)/I_{d/2−1}(κ) = length, by Newton's method; A' = 1 − A² − (d − 1)A/κ."""
    k = length * (d - length**2) / (1.0 - length**2)  # Banerjee et al. 2005
    for _ in range(50):
        a = float(ive(0.5 * d, k) / ive(0.5 * d - 1.0, k))
        if not math.isfinite(a):
            return k  # beyond 1e9 the start is exact to rounding
        step = (length - a) / (1.0 - a * a - (d - 1) * a / k)
        k = max(k + step, 0.5 * k)
        if abs(step) <= 1e-12 * k:
            break
    return k
