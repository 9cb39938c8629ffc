"""Bingham distributions of orientations with crystal symmetry, and mixtures of them with a background."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import logsumexp

from bingham.distributions.bingham import Bingham
from bingham.distributions.crystal import symmetry_group
from bingham.errors import InvalidArgumentError
from bingham.notebook import Pictured
from bingham.rotations import as_quaternion, compose
from bingham.validation import as_generator, as_numbers, check_kind, integer

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["SymmetricBingham", "SymmetricMixture"]

FloatArray = NDArray[np.float64]

LOG_AREA = math.log(2.0 * math.pi**2)


@dataclass(frozen=True, slots=True, eq=False)
class SymmetricMixture(Pictured):
    """Density f(q) = Σₖ αₖ (1/G) Σ_g fₖ(q ⊗ g) + α₀/(2π²) of orientations: an orientation distribution function.

    Parameters
    ----------
    weights : (K,) array_like
        αₖ, not negative; with the background they sum to 1.
    components : Bingham
        A batch (K,) of distributions of quaternions, d = 4.
    group : str, Rotation or (G, 4) array_like
        Rotations of the crystal, as in `bingham.distributions.crystal.symmetry_group`.
    background : float
        α₀, the share of orientations spread evenly: outliers.
    """

    weights: FloatArray
    components: Bingham
    group: Any
    background: float = 0.0

    def __post_init__(self) -> None:
        check_kind(self.components, Bingham, "components")
        w = as_numbers(self.weights, "weights")
        if self.components.dim != 4 or self.components.shape != w.shape or w.ndim != 1:
            raise InvalidArgumentError("components", f"a batch of {w.size}, d = 4", f"{self.components!r}")
        total = float(w.sum()) + self.background
        if not (np.all(w >= 0.0) and self.background >= 0.0 and abs(total - 1.0) <= 1e-8):
            raise InvalidArgumentError("weights", "not negative, with sum 1 including the background", w)
        object.__setattr__(self, "weights", w / total)
        object.__setattr__(self, "group", symmetry_group(self.group))

    @classmethod
    def fit(
        cls,
        x: ArrayLike | Rotation,
        group: Any,
        components: int | Sequence[int] = 1,
        *,
        background: bool = True,
        weights: ArrayLike | None = None,
        restarts: int = 5,
        max_concentration: float = 1e6,
        rng: Any = None,
    ) -> Self:
        """Fit by expectation-maximisation, over components and equivalent orientations at once.

        Parameters
        ----------
        x : (n, 4) array_like or Rotation
            Orientations, scalar first, crystal to sample.
        group : str, Rotation or (G, 4) array_like
            Rotations of the crystal.
        components : int or sequence of int
            Number of orientations; of a sequence the one with the least `bic`.
        background : bool
            Whether to allow for outliers.
        weights : (n,) array_like, optional
            Non-negative counts.
        restarts : int
            Number of random starts.
        max_concentration : float
            Ceiling of |z|, as in `BinghamMixture.fit`.
        rng : None, int or numpy.random.Generator
            Passed to ``numpy.random.default_rng``.
        """
        from bingham.distributions.symmetric_em import fit_symmetric

        q = np.atleast_2d(as_quaternion(x, scalar_first=True))
        counts = np.ones(len(q)) if weights is None else as_numbers(weights, "weights")
        if counts.shape != (len(q),) or not (np.all(counts >= 0.0) and 0.0 < counts.sum() < np.inf):
            raise InvalidArgumentError("weights", f"{len(q)} non-negative numbers, not all zero", counts)
        g = symmetry_group(group)
        sizes = [components] if isinstance(components, int) else list(components)
        generator = as_generator(rng)
        fits: list[Self] = []
        for size in sizes:
            count = integer(size, "components", 1)
            if count * 4 > len(q):
                if fits:
                    break
                raise InvalidArgumentError("components", f"at most {len(q) // 4} for {len(q)} orientations", count)
            parts = fit_symmetric(q, g, count, counts, background=background, restarts=integer(restarts, "restarts", 1),
                                  ceiling=max_concentration, rng=generator)  # fmt: skip
            fits.append(cls(parts.weights, parts.components, g, parts.background))
        return min(fits, key=lambda f: f.bic(q, counts))

    @property
    def parameter_count(self) -> int:
        """Free parameters: 9 for each component and the weights."""
        return 9 * self.weights.size + self.weights.size - 1 + (self.background > 0.0)

    def log_joint(self, x: ArrayLike | Rotation) -> FloatArray:
        """Return log αₖ (1/G) Σ_g fₖ(x ⊗ g) (n, K + 1); the last column is the background."""
        q = np.atleast_2d(as_quaternion(x, scalar_first=True))
        y = compose(q[:, None, :], self.group)
        out = np.empty((len(q), self.weights.size + 1))
        with np.errstate(divide="ignore"):
            for k in range(self.weights.size):
                each = self.components[k].logpdf(y)
                out[:, k] = logsumexp(each, axis=1) + np.log(self.weights[k]) - math.log(len(self.group))
            out[:, -1] = np.log(self.background) - LOG_AREA
        return out

    def logpdf(self, x: ArrayLike | Rotation) -> Any:
        """Return log f (...) of unit quaternions (..., 4); equivalent ones have the same."""
        q = as_quaternion(x, scalar_first=True)
        return np.asarray(logsumexp(self.log_joint(q.reshape(-1, 4)), axis=1)).reshape(q.shape[:-1])[()]

    def pdf(self, x: ArrayLike | Rotation) -> Any:
        """Return f (...)."""
        return np.exp(self.logpdf(x))

    def predict(self, x: ArrayLike | Rotation) -> NDArray[np.int64]:
        """Return the most probable component (n,) of orientations (n, 4), −1 for the background."""
        label = np.argmax(self.log_joint(x), axis=1)
        return np.where(label == self.weights.size, -1, label)

    def predict_proba(self, x: ArrayLike | Rotation) -> FloatArray:
        """Return the probability (n, K + 1) of each component for orientations (n, 4); the last is the background's."""
        joint = self.log_joint(x)
        return np.exp(joint - np.asarray(logsumexp(joint, axis=1, keepdims=True)))

    def bic(self, x: ArrayLike | Rotation, weights: ArrayLike | None = None) -> float:
        """Return Schwarz's criterion −2 log L + p log n; less is better."""
        values = np.asarray(self.logpdf(x))
        w = np.ones(values.shape) if weights is None else as_numbers(weights, "weights")
        return float(-2.0 * np.sum(w * values) + self.parameter_count * math.log(w.sum()))

    def rvs(self, size: int, *, rng: Any = None) -> FloatArray:
        """Return independent orientations (size, 4), each by one of its equivalent quaternions at random."""
        generator = as_generator(rng)
        share = np.append(self.weights, self.background)
        label = generator.choice(share.size, integer(size, "size", 0), p=share)
        q = Bingham.uniform(4).rvs(size, rng=generator)
        for k in range(self.weights.size):
            q[label == k] = self.components[k].rvs(int(np.sum(label == k)), rng=generator)
        return compose(q, self.group[generator.integers(len(self.group), size=size)])

    def equivalent(self, x: ArrayLike | Rotation, component: int = 0) -> FloatArray:
        """Return of each orientation (n, 4) the equivalent q ⊗ g nearest to the mode of a component."""
        q = np.atleast_2d(as_quaternion(x, scalar_first=True))
        y = compose(q[:, None, :], self.group)
        along = y @ self.components[component].mode
        best = np.argmax(np.abs(along), axis=1)
        rows = np.arange(len(q))
        return y[rows, best] * np.where(along[rows, best] < 0.0, -1.0, 1.0)[:, None]


@dataclass(frozen=True, slots=True, eq=False)
class SymmetricBingham(Pictured):
    """Density f(q) = (1/G) Σ_g f_B(q ⊗ g) of orientations known up to the rotations g of a group.

    Parameters
    ----------
    distribution : Bingham
        Of quaternions, d = 4.
    group : str, Rotation or (G, 4) array_like
        Rotations of the crystal, as in `bingham.distributions.crystal.symmetry_group`.

    Examples
    --------
    >>> p = SymmetricBingham(Bingham([-900.0, -800.0, -700.0, 0.0], np.eye(4)[:, ::-1]), "432")
    >>> quarter = [0.5**0.5, 0.0, 0.0, 0.5**0.5]
    >>> bool(np.isclose(p.logpdf(quarter), p.logpdf([1.0, 0.0, 0.0, 0.0])))
    True
    """

    distribution: Bingham
    group: Any

    def __post_init__(self) -> None:
        check_kind(self.distribution, Bingham, "distribution")
        if self.distribution.dim != 4 or self.distribution.shape:
            raise InvalidArgumentError("distribution", "a single one of rotations, d = 4", f"{self.distribution!r}")
        object.__setattr__(self, "group", symmetry_group(self.group))

    @classmethod
    def fit(
        cls, x: ArrayLike | Rotation, group: Any, weights: ArrayLike | None = None, *, rng: Any = None
    ) -> SymmetricBingham:
        """Fit to orientations (n, 4) by expectation-maximisation over their equivalents; see `SymmetricMixture.fit`."""
        fitted = SymmetricMixture.fit(x, group, background=False, weights=weights, rng=rng)
        return cls(fitted.components[0], fitted.group)

    @property
    def mixture(self) -> SymmetricMixture:
        """The same as a mixture of one component."""
        p = self.distribution
        return SymmetricMixture(np.ones(1), Bingham.from_spectrum(np.array(p.z[None]), np.array(p.M[None])), self.group)

    def logpdf(self, x: ArrayLike | Rotation) -> Any:
        """Return log f (...) of unit quaternions (..., 4), scalar first."""
        return self.mixture.logpdf(x)

    def pdf(self, x: ArrayLike | Rotation) -> Any:
        """Return f (...)."""
        return np.exp(self.logpdf(x))

    def rvs(self, size: int, *, rng: Any = None) -> FloatArray:
        """Return independent orientations (size, 4), each by one of its equivalent quaternions at random."""
        return self.mixture.rvs(size, rng=rng)

    def equivalent(self, x: ArrayLike | Rotation) -> FloatArray:
        """Return of each orientation (n, 4) the equivalent q ⊗ g nearest to the mode."""
        return self.mixture.equivalent(x)
