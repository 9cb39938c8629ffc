"""Independent random samples, behind the protocol of the deterministic samplers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bingham.distributions.bingham import Bingham
from bingham.sampling.protocol import WeightedPoints, single
from bingham.validation import as_generator, integer

__all__ = ["RandomSampling"]


@dataclass(frozen=True)
class RandomSampling:
    """m exact, independent samples of equal weight; with it the sampled filter is a particle filter.

    Parameters
    ----------
    m : int
        Number of samples.
    rng : None, int or numpy.random.Generator
        Passed to ``numpy.random.default_rng`` once; every call of `sample` draws on.

    Examples
    --------
    >>> from bingham.distributions.bingham import Bingham
    >>> RandomSampling(5, rng=1).sample(Bingham.uniform(3)).points.shape
    (5, 3)
    """

    m: int
    rng: Any = None
    _generator: np.random.Generator = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        integer(self.m, "m", 1)
        object.__setattr__(self, "_generator", as_generator(self.rng))

    def sample(self, distribution: Bingham) -> WeightedPoints:
        """Return m samples (m, d) of weight 1/m."""
        points = single(distribution).rvs(self.m, rng=self._generator)
        return WeightedPoints(points, np.full(self.m, 1.0 / self.m))
