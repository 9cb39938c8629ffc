"""What a Bingham mixture is: weights, components, background and their density, for all that makes mixtures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaln, logsumexp

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.validation import as_numbers, check_kind, check_number, unit_rows

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["MixtureDensity", "log_area"]

FloatArray = NDArray[np.float64]


def log_area(d: int) -> float:
    """Return the logarithm of the surface area 2 π^{d/2} / Γ(d/2) of S^{d−1}."""
    return math.log(2.0) + 0.5 * d * math.log(math.pi) - float(gammaln(0.5 * d))


@dataclass(frozen=True, slots=True, eq=False)
class MixtureDensity:
    """Weights αₖ (K,), components fₖ, a batch (K,), and background α₀ of `BinghamMixture`, checked, with the density.

    Algorithms take and return this; `BinghamMixture`, which has them as methods, is one.
    """

    weights: FloatArray
    components: Bingham
    background: float = 0.0

    def __post_init__(self) -> None:
        check_kind(self.components, Bingham, "components", "one batch of distributions: Bingham(z (K, d), M (K, d, d))")
        check_number(self.background, "background", "a number in [0, 1]", minimum=0.0)
        w = as_numbers(self.weights, "weights")
        if len(self.components.shape) != 1 or w.shape != self.components.shape:
            raise InvalidArgumentError("weights", f"one for each component, shape {self.components.shape}", w.shape,
                                       "components is one batch: Bingham(z (K, d), M (K, d, d))")  # fmt: skip
        total = float(w.sum()) + self.background
        if not (np.all(w >= 0.0) and self.background >= 0.0 and abs(total - 1.0) <= 1e-8):
            raise InvalidArgumentError("weights", "not negative, with sum 1 including the background",
                                       f"{w} and background {self.background}", "divide by their sum")  # fmt: skip
        w /= total
        w.flags.writeable = False
        object.__setattr__(self, "weights", w)
        object.__setattr__(self, "background", float(self.background) / total)

    @property
    def dim(self) -> int:
        """Ambient dimension d."""
        return self.components.dim

    @property
    def size(self) -> int:
        """Number of components K, the background not counted."""
        return self.weights.size

    @property
    def parameter_count(self) -> int:
        """Free parameters: d(d+1)/2 − 1 for each component and the weights."""
        d = self.dim
        return self.size * (d * (d + 1) // 2 - 1) + self.size - 1 + (self.background > 0.0)

    # Density

    def log_joint(self, x: ArrayLike | Rotation) -> FloatArray:
        """Return log αₖ fₖ(x) (n, K+1) for rows x (n, d); the last column is the background, −inf without one."""
        from bingham.kernels.mixture import log_joint

        a = np.ascontiguousarray(unit_rows(x, self.dim, "x"))
        rows = a.reshape(-1, self.dim)
        out = np.empty((len(rows), self.size + 1))
        frames = np.ascontiguousarray(np.swapaxes(self.components.M, -1, -2))
        with np.errstate(divide="ignore"):
            offsets = np.log(self.weights) - self.components.log_normalizer
            out[:, -1] = np.log(self.background) - log_area(self.dim)
        log_joint(rows, frames, self.components.z, offsets, out[:, :-1])
        return out.reshape(*a.shape[:-1], self.size + 1)

    def logpdf(self, x: ArrayLike | Rotation) -> Any:
        """Return log f(x) (...) for unit vectors x (..., d)."""
        return logsumexp(self.log_joint(x), axis=-1)

    def pdf(self, x: ArrayLike | Rotation) -> Any:
        """Return f(x) (...) for unit vectors x (..., d)."""
        return np.exp(self.logpdf(x))

    def predict_proba(self, x: ArrayLike | Rotation) -> FloatArray:
        """Return the probability (..., K+1) of each component for rows x (..., d); the last is the background's."""
        joint = self.log_joint(x)
        joint -= np.asarray(logsumexp(joint, axis=-1, keepdims=True))
        return np.exp(joint, out=joint)

    def predict(self, x: ArrayLike | Rotation) -> NDArray[np.int64]:
        """Return the index (...) of the most probable component for rows x (..., d), −1 for the background."""
        label = np.argmax(self.log_joint(x), axis=-1)
        return np.where(label == self.size, -1, label)

    def score(self, x: ArrayLike | Rotation) -> float:
        """Return the mean log-likelihood of rows x (n, d)."""
        return float(np.mean(self.logpdf(x)))

    def bic(self, x: ArrayLike | Rotation, weights: ArrayLike | None = None) -> float:
        """Return Schwarz's criterion −2 log L + p log n; less is better."""
        value, n = self._log_likelihood(x, weights)
        return -2.0 * value + self.parameter_count * math.log(n)

    def aic(self, x: ArrayLike | Rotation, weights: ArrayLike | None = None) -> float:
        """Return Akaike's criterion −2 log L + 2 p; less is better."""
        return -2.0 * self._log_likelihood(x, weights)[0] + 2.0 * self.parameter_count

    def _log_likelihood(self, x: ArrayLike | Rotation, weights: ArrayLike | None) -> tuple[float, float]:
        values = np.asarray(self.logpdf(x))
        w = np.ones(values.shape) if weights is None else np.asarray(weights, dtype=np.float64)
        return float(np.sum(w * values)), float(w.sum())

    def distributions(self) -> tuple[Bingham, FloatArray]:
        """Return all distributions as one batch with their weights; a background is the last one, with z = 0."""
        if self.background == 0.0:
            return self.components, self.weights
        d = self.dim
        z = np.concatenate([self.components.z, np.zeros((1, d))])
        frames = np.concatenate([self.components.M, np.eye(d)[None]])
        return Bingham.from_spectrum(z, frames), np.append(self.weights, self.background)
