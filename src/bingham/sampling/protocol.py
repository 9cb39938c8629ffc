"""What every sampler of the package offers."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution
from bingham.errors import InvalidArgumentError

__all__ = ["Sampler", "WeightedPoints", "with_antipodes"]

FloatArray = NDArray[np.float64]


class WeightedPoints(NamedTuple):
    """Unit vectors ``points`` (m, d) and their ``weights`` (m,), non-negative with sum 1."""

    points: FloatArray
    weights: FloatArray


@runtime_checkable
class Sampler(Protocol):
    """Represent a distribution by weighted unit vectors: Σ wⱼ g(xⱼ) ≈ E[g(x)] for functions g with g(−x) = g(x)."""

    def sample(self, distribution: Bingham) -> WeightedPoints:
        """Return points (m, d), one of each pair ±x, and weights (m,)."""
        ...


def with_antipodes(sample: WeightedPoints) -> WeightedPoints:
    """Return the sample with −x beside every x, at half weight: Σ w x = 0, and no even moment changes."""
    return WeightedPoints(np.concatenate([sample.points, -sample.points]), np.tile(0.5 * sample.weights, 2))


def single(distribution: Bingham) -> Bingham:
    """Reject a batch of distributions: samplers take one at a time."""
    check_distribution(distribution, "distribution")
    if distribution.shape:
        raise InvalidArgumentError("distribution", "a single distribution", f"a batch of shape {distribution.shape}",
                                   "sample its members one by one")  # fmt: skip
    return distribution
