"""Bingham mixtures by sample consensus, after BMM-SAC (Glover, Bradski & Rusu 2011; Glover 2012)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.em import distributions_of_moments
from bingham.distributions.mixture import BinghamMixture, log_area

__all__ = ["sample_consensus"]

FloatArray = NDArray[np.float64]

# Rows on which proposals are compared; the best one is refined on all.
COMPARED = 2000
REFINEMENTS = 3


def _distributions(x: FloatArray, counts: FloatArray, max_concentration: float) -> Bingham:
    """Return the distributions (T,) of samples x (T, m, d) with counts (T, m)."""
    w = counts / counts.sum(axis=-1, keepdims=True)
    moments = np.einsum("tmi,tm,tmj->tij", x, w, x)
    d = x.shape[-1]
    return distributions_of_moments(moments, np.broadcast_to(np.eye(d), (len(x), d, d)), max_concentration)


def _gains(x: FloatArray, distributions: Bingham, level: float) -> FloatArray:
    """Return log f(x) − level (n, T)."""
    from bingham.kernels.mixture import log_joint

    out = np.empty((len(x), distributions.shape[0]))
    log_joint(
        x,
        np.ascontiguousarray(np.swapaxes(distributions.M, -1, -2)),
        distributions.z,
        -distributions.log_normalizer - level,
        out,
    )
    return out


def sample_consensus(
    x: FloatArray,
    max_components: int,
    *,
    rng: np.random.Generator,
    weights: FloatArray | None = None,
    min_points: float,
    min_density: float | None = None,
    trials: int = 100,
    max_concentration: float = 1e6,
    background: bool = True,
) -> BinghamMixture:
    """Peel components off the data one by one.

    Distributions are proposed from d random rows each; points where a distribution exceeds `min_density` are its
    inliers. The distribution of greatest Σ log(f / min_density) over its inliers is refitted to them, and they leave
    the data. It stops when no distribution has `min_points` inliers or `max_components` are found. What is left over
    is background.

    Parameters
    ----------
    x : (n, d) ndarray
        Unit rows, float64, contiguous.
    max_components : int
        Components at most.
    rng : numpy.random.Generator
        Source of the proposals.
    weights : (n,) ndarray, optional
        Non-negative counts.
    min_points : float
        Minimum sum of counts of a component's inliers.
    min_density : float, optional
        Density at which a point becomes an outlier; 1/area by default, that of the uniform distribution.
    trials : int
        Proposals a component.
    max_concentration : float
        Ceiling of |z|.
    background : bool
        Whether the rest becomes a uniform component; without one it is left out.
    """
    n, d = x.shape
    counts = np.ones(n) if weights is None else weights
    level = -log_area(d) if min_density is None else float(np.log(min_density))
    left = np.arange(n)
    found: list[Bingham] = []
    masses: list[float] = []
    while len(found) < max_components and len(left) >= d and counts[left].sum() >= min_points:
        p = counts[left] / counts[left].sum()
        picks = left[rng.choice(len(left), size=(trials, d), p=p)]
        distributions = _distributions(x[picks], np.ones(picks.shape), max_concentration)
        some = left if len(left) <= COMPARED else rng.choice(left, COMPARED, replace=False)
        score = counts[some] @ np.maximum(_gains(x[some], distributions, level), 0.0)
        distribution = distributions[np.array([int(np.argmax(score))])]
        inliers = left[_gains(x[left], distribution, level)[:, 0] > 0.0]
        for _ in range(REFINEMENTS):
            if counts[inliers].sum() < min_points:
                break
            distribution = _distributions(x[inliers][None], counts[inliers][None], max_concentration)
            inliers = left[_gains(x[left], distribution, level)[:, 0] > 0.0]
        mass = float(counts[inliers].sum())
        if mass < min_points:
            break
        found.append(distribution)
        masses.append(mass)
        left = np.setdiff1d(left, inliers, assume_unique=True)
    rest = float(counts[left].sum()) if background else 0.0
    total = sum(masses) + rest
    if not found:
        empty = Bingham.from_spectrum(np.zeros((0, d)), np.zeros((0, d, d)))
        return BinghamMixture(np.zeros(0), empty, 1.0)
    batch = Bingham.from_spectrum(
        np.concatenate([distribution.z for distribution in found]),
        np.concatenate([distribution.M for distribution in found]),
    )
    return BinghamMixture(np.array(masses) / total, batch, rest / total)
