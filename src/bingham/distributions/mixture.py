"""Mixtures of Bingham distributions as immutable values."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.mixture_algebra import compose_mixtures, entropy_bounds, multiply, peaks, reduce
from bingham.distributions.mixture_density import MixtureDensity
from bingham.distributions.selection import fit_mixture
from bingham.errors import InvalidArgumentError
from bingham.notebook import Pictured
from bingham.validation import as_generator

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["BinghamMixture", "EntropyBounds", "Peaks"]

FloatArray = NDArray[np.float64]


class EntropyBounds(NamedTuple):
    """Bounds in nats, lower ≤ −E[log f(x)] ≤ upper."""

    lower: float
    upper: float


class Peaks(NamedTuple):
    """Local maxima of a density: axes (P, d), heights (P,) of the log-density, highest first."""

    axes: FloatArray
    log_density: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class BinghamMixture(MixtureDensity, Pictured):
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
            Number of components; of a sequence, such as ``range(1, 9)``, that of lowest `MixtureDensity.bic`. For "sac"
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
            If not even one component is found; ``reached`` holds the last mixture.

        Warns
        -----
        AccuracyWarning
            If every start lost a component (fewer than `min_points`) for every number asked for: the mixture returned
            has fewer.
        """
        return fit_mixture(cls, x, components, method=method, weights=weights, background=background, restarts=restarts,
                           max_concentration=max_concentration, min_points=min_points, min_density=min_density,
                           tolerance=tolerance, rng=rng, progress=progress)  # fmt: skip

    @property
    def mode(self) -> FloatArray:
        """Axis (d,) of the highest density."""
        return self.peaks().axes[0]

    def rvs(self, size: int, *, rng: Any = None) -> FloatArray:
        """Return exact, independent samples (size, d)."""
        generator = as_generator(rng)
        distributions, weights = self.distributions()
        counts = generator.multinomial(size, weights)
        parts = [distributions[k].rvs(int(count), rng=generator) for k, count in enumerate(counts)]
        return generator.permutation(np.concatenate(parts), axis=0)

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
        return EntropyBounds(*entropy_bounds(*self.distributions()))

    def peaks(self) -> Peaks:
        """Return the local maxima of the density reached from the modes of the components, highest first.

        Fixed points of x ← leading eigenvector of Σ rₖ(x) Aₖ, r the responsibilities; no step lowers the density.
        """
        return Peaks(*peaks(self))

    # Algebra

    def multiply(self, other: BinghamMixture | Bingham, *, min_weight: float = 1e-6) -> BinghamMixture:
        """Return the with density ∝ f(x) g(x): products of components, those below `min_weight` dropped."""
        product = multiply(self, _as_mixture(other))[0]
        return product.prune(min_weight)

    def compose(self, other: BinghamMixture | Bingham) -> BinghamMixture:
        """Return the mixture of all composed components (moment-matched, `Bingham.compose`); d = 2 or 4."""
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
        return reduce(self, size, math.inf)

    def merge(self, cost: float) -> BinghamMixture:
        """Merge pairs of components, cheapest first, while a merge (see `reduce`) costs less than `cost` nats."""
        return reduce(self, 1, cost)


def _as_mixture(distribution: BinghamMixture | Bingham) -> BinghamMixture:
    return distribution if isinstance(distribution, BinghamMixture) else BinghamMixture.single(distribution)
