"""Random starts for mixtures: k-means++ seeds on axes, then a few rounds of axial k-means."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.em import distributions_of_moments
from bingham.distributions.mixture_density import MixtureDensity

__all__ = ["seed_axes", "start_from_axes"]

FloatArray = NDArray[np.float64]
M = TypeVar("M", bound=MixtureDensity)

ROUNDS = 5
# A start is never sharper than this; a cluster of few points would otherwise begin as a spike.
START_CONCENTRATION = 1e3
START_BACKGROUND = 0.1


def seed_axes(
    x: FloatArray, counts: FloatArray, size: int, rng: np.random.Generator, known: FloatArray | None = None
) -> FloatArray:
    """Return seeds (size, d) among the rows of x, each far from the others with high probability.

    A row is drawn with probability ∝ counts · min sin² of its angle to the seeds so far; of a few such draws the one
    that
    lowers the sum most is kept (greedy k-means++, Arthur & Vassilvitskii 2007, with sin² for axes). `known` (m, d) are
    seeds given beforehand, kept first.
    """
    tries = 2 + int(np.log(size))
    distance = np.ones(len(x))
    seeds: list[FloatArray] = []
    for axis in () if known is None else known[:size]:
        distance = np.minimum(distance, 1.0 - (x @ axis) ** 2)
        seeds.append(axis)
    while len(seeds) < size:
        mass = counts * np.maximum(distance, 0.0)
        total = mass.sum()
        p = mass / total if total > 0.0 else counts / counts.sum()
        picks = rng.choice(len(x), size=tries if seeds else 1, p=p)
        trial = np.minimum(distance[:, None], 1.0 - (x @ x[picks].T) ** 2)
        best = int(np.argmin(counts @ trial))
        distance = trial[:, best]
        seeds.append(x[picks[best]])
    return np.array(seeds)


def start_from_axes(kind: type[M], x: FloatArray, counts: FloatArray, axes: FloatArray, *, background: bool) -> M:
    """Return the mixture, of class ``kind``, of the clusters that axial k-means finds from `axes` (K, d)."""
    size, d = axes.shape
    moments = np.empty((size, d, d))
    shares = np.empty(size)
    for _ in range(ROUNDS):
        label = np.argmax((x @ axes.T) ** 2, axis=1)
        for k in range(size):
            members = label == k
            shares[k] = counts[members].sum()
            rows = x[members]
            # One part of the seed's own axis keeps an empty cluster where it is.
            moments[k] = (rows * counts[members, None]).T @ rows + np.outer(axes[k], axes[k])
            moments[k] /= shares[k] + 1.0
        axes = np.linalg.eigh(moments)[1][..., -1]
    distributions = distributions_of_moments(moments, np.broadcast_to(np.eye(d), moments.shape), START_CONCENTRATION)
    alpha = shares + 1.0
    share = START_BACKGROUND if background else 0.0
    return kind(alpha * ((1.0 - share) / alpha.sum()), distributions, share)
