"""Point sets that stand for a Bingham distribution: deterministic ones and random ones, behind one protocol."""

from bingham.sampling.gaussian_lcd import standard_normal_points
from bingham.sampling.protocol import Sampler, WeightedPoints, with_antipodes
from bingham.sampling.random import RandomSampling
from bingham.sampling.riemannian import RiemannianSampling
from bingham.sampling.unscented import Unscented

__all__ = [
    "RandomSampling",
    "RiemannianSampling",
    "Sampler",
    "Unscented",
    "WeightedPoints",
    "standard_normal_points",
    "with_antipodes",
]
