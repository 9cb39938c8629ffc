"""Mixtures of Bingham distributions as immutable values."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaln, logsumexp

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.notebook import Pictured
from bingham.validation import as_generator, as_numbers, check_kind, check_number, unit_rows

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["BinghamMixture", "EntropyBounds", "Peaks", "log_area"]

FloatArray = NDArray[np.float64]


class EntropyBounds(NamedTuple):
    """Bounds in nats, lower ≤ −E[log f(x)] ≤ upper."""

    lower: float
    upper: float


class Peaks(NamedTuple):
    """Local maxima of a density: axes (P, d), heights (P,) of the log-density, highest first."""

    axes: FloatArray
    log_density: FloatArray


def log_area(d: int) -> float:
    """Return the logarithm of the surface area 2 π^{d/2} / Γ(d/2) of S^{d−1}."""
    return math.log(2.0) + 0.5 * d * math.log(math.pi) - float(gammaln(0.5 * d))


@dataclass(frozen=True, slots=True, eq=False)
class BinghamMixture(Pictured):
    """Distribution f(x) = Σₖ αₖ fₖ(x) + α₀ / area of Bingham distributions fₖ and a uniform background.

    Parameters
    ----------
    weights : (K,) array_like
        αₖ, not negative; together with the background they sum to 1 (within 1e-8; rounding is removed).
    components : Bingham
        A batch of shape (K,).
    background : float
        α₀, the share of the uniform distribution: outliers. 0 for none.

    Raises
    ------
    InvalidArgumentError
        If the weights are no probabilities or do not fit the batch.

    Examples
    --------
    >>> import numpy as np
    >>> distributions = Bingham([[-50.0, -50.0, 0.0]] * 2, [np.eye(3), np.eye(3)[:, ::-1]])
    >>> mixture = BinghamMixture([0.6, 0.3], distributions, 0.1)
    >>> mixture.predict([[0.0, 0.1, 0.995], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] / np.array([[1.00001249992], [1], [1]]))
    array([ 0,  1, -1])
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

    @classmethod
    def single(cls, distribution: Bingham) -> BinghamMixture:
        """Return the mixture of one component, the same distribution."""
        if distribution.shape:
            raise InvalidArgumentError(
                "distribution", "a single distribution", f"a batch of shape {distribution.shape}"
            )
        return cls(np.ones(1), Bingham.from_spectrum(np.array(distribution.z[None]), np.array(distribution.M[None])))

    @classmethod
    def fit(
        cls,
        x: ArrayLike | Rotation,
        components: int | Sequence[int],
        *,
        method: Literal["em", "sac"] = "em",
        weights: ArrayLike | None = None,
        background: bool = True,
        restarts: int = 10,
        max_concentration: float = 1e6,
        min_points: int | None = None,
        min_density: float | None = None,
        tolerance: float = 1e-7,
        rng: Any = None,
        progress: Callable[[int, BinghamMixture | None], None] | None = None,
    ) -> BinghamMixture:
        """Fit a mixture to unit vectors; signs of rows do not matter, not even to the last bit.

        Parameters
        ----------
        x : (n, d) array_like or Rotation
            Unit vectors (within 1e-6).
        components : int or sequence of int
            Number of components; of a sequence, such as ``range(1, 9)``, the number with the lowest `bic`. For "sac"
            the largest number to look for.
        method : {"em", "sac"}
            Expectation-maximisation (maximum likelihood), or sample consensus after Glover (2012), faster and rougher.
        weights : (n,) array_like, optional
            Non-negative counts of the samples.
        background : bool
            Whether to add a uniform component for outliers.
        restarts : int
            Number of random starts.
        max_concentration : float
            Ceiling of |z|: no component is narrower than √(1/(2 max_concentration)) rad. It bounds the likelihood of
            rounded or noise-free data, which would grow without end.
        min_points : int, optional
            Minimum number of points of a component; by default its number of parameters plus one, d(d+1)/2.
        min_density : float, optional
            For "sac": density a point must have to belong to a component; 1/area by default, the uniform
            distribution's. A higher one keeps it from covering two modes with one girdle.
        tolerance : float
            Gain of log-likelihood a sample and step, in nats, at which "em" has converged.
        rng : None, int or numpy.random.Generator
            Passed to ``numpy.random.default_rng``.
        progress : callable, optional
            Called by "em" with each number of components when it is done, and its mixture, None if it lost a component.

        Raises
        ------
        InvalidArgumentError
            If an argument does not satisfy its contract.
        ConvergenceError
            If not even one component is found; `reached` holds the last mixture.

        Warns
        -----
        AccuracyWarning
            If every start lost a component (fewer than `min_points`) for every number asked for: the mixture returned
            has fewer.
        """
        from bingham.distributions.selection import fit_mixture

        return fit_mixture(x, components, method=method, weights=weights, background=background, restarts=restarts,
                           max_concentration=max_concentration, min_points=min_points, min_density=min_density,
                           tolerance=tolerance, rng=rng, progress=progress)  # fmt: skip

    @property
    def dim(self) -> int:
        """Ambient dimension d."""
        return self.components.dim

    @property
    def size(self) -> int:
        """Number of components K, the background not counted."""
        return self.weights.size

    @property
    def mode(self) -> FloatArray:
        """Axis (d,) of the highest density."""
        return self.peaks().axes[0]

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

    def rvs(self, size: int, *, rng: Any = None) -> FloatArray:
        """Return exact, independent samples (size, d)."""
        generator = as_generator(rng)
        distributions, weights = self.distributions()
        counts = generator.multinomial(size, weights)
        parts = [distributions[k].rvs(int(count), rng=generator) for k, count in enumerate(counts)]
        return generator.permutation(np.concatenate(parts), axis=0)

    def distributions(self) -> tuple[Bingham, FloatArray]:
        """Return all distributions as one batch with their weights; a background is the last one, with z = 0."""
        if self.background == 0.0:
            return self.components, self.weights
        d = self.dim
        z = np.concatenate([self.components.z, np.zeros((1, d))])
        frames = np.concatenate([self.components.M, np.eye(d)[None]])
        return Bingham.from_spectrum(z, frames), np.append(self.weights, self.background)

    # Moments and shape

    def moment(self) -> FloatArray:
        """Return E[x xᵀ] (d, d)."""
        return np.einsum("k,kij->ij", self.weights, self.components.moment()) + self.background / self.dim * np.eye(
            self.dim
        )

    def entropy_bounds(self) -> EntropyBounds:
        """Return bounds of the entropy, which has no closed form.

        Above: Σ αₖ (Hₖ − log αₖ), the joint entropy with the label. Below, by Jensen: −Σᵢ αᵢ log Σⱼ αⱼ ∫ fᵢ fⱼ with
        ∫ fᵢ fⱼ = F(Aᵢ + Aⱼ) / (Fᵢ Fⱼ) (Huber et al. 2008 for Gaussian mixtures).
        """
        from bingham.distributions.mixture_algebra import entropy_bounds

        return EntropyBounds(*entropy_bounds(*self.distributions()))

    def peaks(self) -> Peaks:
        """Return the local maxima of the density reached from the modes of the components, highest first.

        Fixed points of x ← leading eigenvector of Σ rₖ(x) Aₖ, r the responsibilities; no step lowers the density.
        """
        from bingham.distributions.mixture_algebra import peaks

        return Peaks(*peaks(self))

    # Algebra

    def multiply(self, other: BinghamMixture | Bingham, *, min_weight: float = 1e-6) -> BinghamMixture:
        """Return the with density ∝ f(x) g(x): products of components, those below `min_weight` dropped."""
        from bingham.distributions.mixture_algebra import multiply

        product = multiply(self, _as_mixture(other))[0]
        return product.prune(min_weight)

    def compose(self, other: BinghamMixture | Bingham) -> BinghamMixture:
        """Return the mixture of all composed components (moment-matched, `Bingham.compose`); d = 2 or 4."""
        from bingham.distributions.mixture_algebra import compose_mixtures

        return compose_mixtures(self, _as_mixture(other))

    def rotate(
        self, *, left: ArrayLike | Rotation | None = None, right: ArrayLike | Rotation | None = None
    ) -> BinghamMixture:
        """Return the distribution of left ⊕ x ⊕ right for fixed unit left and right (d,); d = 2 or 4."""
        return BinghamMixture(self.weights, self.components.rotate(left=left, right=right), self.background)

    def inverse(self) -> BinghamMixture:
        """Return the distribution of x* (conjugate); d = 2 or 4."""
        return BinghamMixture(self.weights, self.components.inverse(), self.background)

    def prune(self, min_weight: float) -> BinghamMixture:
        """Drop components lighter than `min_weight`, always keeping the heaviest; the rest is scaled to sum 1."""
        keep = self.weights >= min_weight
        keep[np.argmax(self.weights)] = True
        total = float(self.weights[keep].sum()) + self.background
        return BinghamMixture(self.weights[keep] / total, self.components[keep], self.background / total)

    def reduce(self, size: int) -> BinghamMixture:
        """Merge pairs of components until `size` are left, always the pair that costs the least.

        The merged distribution has the weighted second moment of the pair, which makes it the closest Bingham
        distribution in KL; the cost
        (αᵢ + αⱼ) H(merged) − αᵢ Hᵢ − αⱼ Hⱼ bounds the KL divergence between the mixtures from above (after Runnalls
        2007).
        """
        from bingham.distributions.mixture_algebra import reduce

        return reduce(self, size, math.inf)

    def merge(self, cost: float) -> BinghamMixture:
        """Merge pairs of components, cheapest first, while a merge (see `reduce`) costs less than `cost` nats."""
        from bingham.distributions.mixture_algebra import reduce

        return reduce(self, 1, cost)


def _as_mixture(distribution: BinghamMixture | Bingham) -> BinghamMixture:
    return distribution if isinstance(distribution, BinghamMixture) else BinghamMixture.single(distribution)
