"""The Fisher–Bingham distribution of directions: Bingham's with a linear term."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.sibling import weighted_sample
from bingham.distributions.von_mises_fisher import VonMisesFisher
from bingham.errors import ConvergenceError, InvalidArgumentError
from bingham.kernels.linear_term import log_normalizer_linear, moments_linear
from bingham.notebook import Pictured
from bingham.validation import as_generator, as_numbers, integer, unit_rows

__all__ = ["FisherBingham", "sample_linear"]

FloatArray = NDArray[np.float64]

MAX_STEPS = 200
TOLERANCE = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class FisherBingham(Pictured):
    """Distribution f(x) = exp(xᵀAx + bᵀx)/C(A, b) of directions x on S^{d−1}.

    Parameters
    ----------
    matrix : (d, d) array_like
        A, symmetric; kept with its largest eigenvalue 0, as A + cI is the same distribution.
    linear : (d,) array_like
        b.

    Examples
    --------
    >>> p = FisherBingham(np.diag([-8.0, -2.0, 0.0]), [0.0, 0.0, 1.0])
    >>> x = [0.0, 0.6, 0.8]
    >>> round(float(p.logpdf(x) - p.logpdf([0.0, 0.6, -0.8])), 12)
    1.6

    References
    ----------
    Mardia & Jupp (2000), sec. 9.3.3; Kume & Wood, Biometrika 92 (2005) 465. The normaliser is
    ``bingham.kernels.linear_term``.
    """

    matrix: FloatArray
    linear: FloatArray

    def __post_init__(self) -> None:
        a, b = as_numbers(self.matrix, "matrix"), as_numbers(self.linear, "linear")
        if b.ndim != 1 or b.size < 2 or not np.all(np.isfinite(b)):
            raise InvalidArgumentError("linear", "a finite vector (d,), d ≥ 2", b)
        size = max(1.0, float(np.abs(a).max(initial=0.0)))
        if a.shape != (b.size, b.size) or not np.all(np.abs(a - a.T) <= 1e-8 * size):
            raise InvalidArgumentError("matrix", f"a finite symmetric matrix ({b.size}, {b.size})", a)
        a = 0.5 * (a + a.T)
        object.__setattr__(self, "matrix", a - np.linalg.eigvalsh(a)[-1] * np.eye(b.size))
        object.__setattr__(self, "linear", b)

    @classmethod
    def fit(cls, x: ArrayLike, weights: ArrayLike | None = None) -> Self:
        """Return the distribution of greatest likelihood for unit vectors (n, d).

        An exponential family with the statistics x and x xᵀ: the log-likelihood is concave, and Newton's method with
        their exact covariance climbs it from the better of the Bingham and the von Mises–Fisher fit.
        """
        sample, w = weighted_sample(x, weights)
        d = sample.shape[1]
        mean, moment = w @ sample, (sample.T * w) @ sample
        axial = Bingham.fit(sample, w)
        fisher = VonMisesFisher.fit(sample, w)
        starts = [(np.array(axial.matrix), np.zeros(d)), (np.zeros((d, d)), fisher.kappa * fisher.mean)]
        values = [_likelihood(a, b, mean, moment) for a, b in starts]
        best = int(np.argmax(values))
        (a, b), value = starts[best], values[best]
        i, j = np.triu_indices(d)
        for _ in range(MAX_STEPS):
            z, frame = np.linalg.eigh(a)
            found = moments_linear(z, frame.T @ b)
            second = frame.T @ moment @ frame - found.moment
            gradient = np.concatenate([frame.T @ mean - found.mean, second[i, j]])
            # The statistics are bound by tr x xᵀ = 1: the covariance has one direction without variance, A + cI.
            scale = 1.0 / np.sqrt(np.maximum(np.diag(found.covariance), 1e-300))
            values_h, vectors = np.linalg.eigh(found.covariance * scale[:, None] * scale)
            along = vectors.T @ (scale * gradient)
            kept = values_h > 1e-12 * values_h[-1]
            step = scale * (vectors[:, kept] @ (along[kept] / values_h[kept]))
            decrement = float(gradient @ step)
            if decrement <= TOLERANCE:
                return cls(a, b)
            change_b = frame @ step[:d]
            upper = np.zeros((d, d))
            upper[i, j] = 0.5 * step[d:]
            change_a = frame @ (upper + upper.T) @ frame.T
            size = 1.0
            while size > 1e-12:
                new = _likelihood(a + size * change_a, b + size * change_b, mean, moment)
                if new >= value + 1e-4 * size * decrement or (decrement < 1e-8 and new >= value - 1e-13 * abs(value)):
                    break
                size *= 0.5
            else:
                return cls(a, b)  # rounding is reached
            a, b, value = a + size * change_a, b + size * change_b, new
        raise ConvergenceError("Fisher–Bingham: Newton's method did not settle", (a, b))

    @property
    def dim(self) -> int:
        """Ambient dimension d."""
        return self.linear.size

    @property
    def parameter_count(self) -> int:
        """Free parameters: d(d + 1)/2 − 1 + d."""
        return self.dim * (self.dim + 1) // 2 - 1 + self.dim

    @property
    def log_normalizer(self) -> float:
        """Log C(A, b)."""
        z, frame = np.linalg.eigh(self.matrix)
        return log_normalizer_linear(z, frame.T @ self.linear)

    def mean(self) -> FloatArray:
        """Return E[x] (d,)."""
        z, frame = np.linalg.eigh(self.matrix)
        return frame @ moments_linear(z, frame.T @ self.linear).mean

    def moment(self) -> FloatArray:
        """Return E[x xᵀ] (d, d)."""
        z, frame = np.linalg.eigh(self.matrix)
        return frame @ moments_linear(z, frame.T @ self.linear).moment @ frame.T

    def logpdf(self, x: ArrayLike) -> Any:
        """Return log f(x) (...) of unit vectors (..., d)."""
        a = unit_rows(x, self.dim, "x")
        return (np.einsum("...i,ij,...j->...", a, self.matrix, a) + a @ self.linear - self.log_normalizer)[()]

    def pdf(self, x: ArrayLike) -> Any:
        """Return f(x) (...)."""
        return np.exp(self.logpdf(x))

    def rvs(self, size: int, *, rng: Any = None) -> FloatArray:
        """Return exact, independent samples (size, d)."""
        return sample_linear(self.matrix, self.linear, integer(size, "size", 0), as_generator(rng))


def sample_linear(a: FloatArray, b: FloatArray, size: int, rng: np.random.Generator) -> FloatArray:
    """Return samples (size, d) of the density ∝ exp(xᵀAx + bᵀx), by rejection from a Bingham distribution.

    With κ = ‖b‖, t = bᵀx/κ: log cosh(κ√u) is concave in u, so cosh(κt) ≤ cosh(κ) exp(c(t² − 1)), c = κ tanh(κ)/2. An
    axis is drawn with A + c b bᵀ/κ², kept with the ratio of both sides, and given the sign that suits b with the
    probability 1/(1 + e^{−2κt}). More than half of the axes are kept.
    """
    kappa = float(np.linalg.norm(b))
    if kappa == 0.0:
        return Bingham.from_matrix(a).rvs(size, rng=rng)
    m = b / kappa
    c = 0.5 * kappa * math.tanh(kappa)
    envelope = Bingham.from_matrix(a + c * np.outer(m, m))
    log_cosh = float(np.logaddexp(kappa, -kappa))
    parts: list[FloatArray] = [np.empty((0, b.size))]
    left = size
    while left > 0:
        x = envelope.rvs(int(1.3 * left) + 20, rng=rng)
        t = np.abs(x @ m)
        keep = rng.standard_exponential(len(x)) > log_cosh - np.logaddexp(kappa * t, -kappa * t) - c * (1.0 - t * t)
        x, t = x[keep][:left], t[keep][:left]
        towards = np.where(rng.random(len(x)) * (1.0 + np.exp(-2.0 * kappa * t)) < 1.0, 1.0, -1.0)
        parts.append(x * (towards * np.where(x @ m < 0.0, -1.0, 1.0))[:, None])
        left -= len(x)
    return np.concatenate(parts)


def _likelihood(a: FloatArray, b: FloatArray, mean: FloatArray, moment: FloatArray) -> float:
    """Return the mean log-likelihood bᵀE[x] + tr(A E[xxᵀ]) − log C."""
    z, frame = np.linalg.eigh(a)
    return float(b @ mean + np.sum(a * moment)) - log_normalizer_linear(z, frame.T @ b)
