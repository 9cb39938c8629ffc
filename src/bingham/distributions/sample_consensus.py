"""Bingham mixtures by sample consensus, after BMM-SAC (Glover, Bradski & Rusu 2011; Glover 2012)."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.em import distributions_of_moments, expectation_maximization
from bingham.distributions.mixture_density import MixtureDensity, log_area
from bingham.distributions.starts import seed_axes, start_from_axes

__all__ = ["sample_consensus"]

FloatArray = NDArray[np.float64]
M = TypeVar("M", bound=MixtureDensity)

# Rows on which proposals are compared; the best one is refined on all.
COMPARED = 2000
REFINEMENTS = 3
SPLIT_STEPS = 30
POLISH_STEPS = 30


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


def _better_than_uniform(x: FloatArray, counts: FloatArray, distribution: Bingham, mass: float, trials: int) -> bool:
    """Whether the points that are left have a lower BIC with the distribution, as much as it has inliers, than without.

    The best of many proposals explains some points of nothing by chance: that counts as log(trials) nats more.
    """
    n, d = float(counts.sum()), x.shape[1]
    share = min(mass / n, 1.0 - 1e-9)
    gain = _gains(x, distribution, -log_area(d))[:, 0]
    better = float(counts @ np.logaddexp(np.log1p(-share), np.log(share) + gain))
    parameters = d * (d + 1) // 2
    return better > parameters * np.log(n) + np.log(trials)


def _split(
    x: FloatArray,
    counts: FloatArray,
    found: list[Bingham],
    members: list[NDArray[np.int64]],
    max_components: int,
    min_points: float,
    max_concentration: float,
    rng: np.random.Generator,
) -> tuple[list[Bingham], list[float]]:
    """Return the distributions and masses after splitting in two each one whose inliers are two clusters by BIC.

    A girdle that covers two clusters may win the consensus over either of them.
    """
    parameters = x.shape[1] * (x.shape[1] + 1) // 2
    todo = list(zip(found, members, strict=True))
    kept: list[Bingham] = []
    masses: list[float] = []
    while todo:
        distribution, rows = todo.pop()
        some, mass = np.ascontiguousarray(x[rows]), counts[rows]
        whole = float(mass @ _gains(some, distribution, 0.0)[:, 0])
        if len(kept) + len(todo) + 2 <= max_components and mass.sum() >= 2.0 * min_points:
            start = start_from_axes(MixtureDensity, some, mass, seed_axes(some, mass, 2, rng), background=False)
            pair = expectation_maximization(some, start, weights=mass, max_iterations=SPLIT_STEPS,
                                            max_concentration=max_concentration, min_points=min_points)  # fmt: skip
            # Inliers are cut where the density ends, which alone makes two distributions a little better than one.
            if not pair.starved and pair.log_likelihood - whole > parameters * np.log(mass.sum()) + 0.1 * mass.sum():
                label = pair.mixture.predict(some)
                todo += [(pair.mixture.components[[k]], rows[label == k]) for k in range(2)]
                continue
        kept.append(distribution)
        masses.append(float(mass.sum()))
    order = np.argsort(-np.array(masses), kind="stable")
    return [kept[i] for i in order], [masses[i] for i in order]


def sample_consensus(
    kind: type[M],
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
) -> M:
    """Peel components off the data one by one; return a mixture of class ``kind``.

    Distributions are proposed from d random rows each; points where a distribution exceeds `min_density` are its
    inliers. The distribution of greatest Σ log(f / min_density) over its inliers is refitted to them, and they leave
    the data. It stops when no distribution has `min_points` inliers or `max_components` are found. What is left over
    is background.

    Parameters
    ----------
    kind : type
        `MixtureDensity`, or a class derived from it.
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
    members: list[NDArray[np.int64]] = []
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
        if mass < min_points or not _better_than_uniform(x[left], counts[left], distribution, mass, trials):
            break
        found.append(distribution)
        masses.append(mass)
        members.append(inliers)
        left = np.setdiff1d(left, inliers, assume_unique=True)
    found, masses = _split(x, counts, found, members, max_components, min_points, max_concentration, rng)
    rest = float(counts[left].sum()) if background else 0.0
    total = sum(masses) + rest
    if not found:
        empty = Bingham.from_spectrum(np.zeros((0, d)), np.zeros((0, d, d)))
        return kind(np.zeros(0), empty, 1.0)
    batch = Bingham.from_spectrum(
        np.concatenate([distribution.z for distribution in found]),
        np.concatenate([distribution.M for distribution in found]),
    )
    mixture = kind(np.array(masses) / total, batch, rest / total)
    return _without_remnants(x, counts, mixture, max_concentration)


def _without_remnants(x: FloatArray, counts: FloatArray, mixture: M, max_concentration: float) -> M:
    """Return the mixture after some steps of expectation-maximisation, without the components that BIC can spare.

    What is peeled off is cut where the density ends: its rim stays and may be found once more.
    """

    def climbed(start: M) -> tuple[M, float]:
        run = expectation_maximization(x, start, weights=counts, max_iterations=POLISH_STEPS,
                                       max_concentration=max_concentration)  # fmt: skip
        bic = run.mixture.parameter_count * np.log(counts.sum()) - 2.0 * run.log_likelihood
        return run.mixture, float(np.inf if run.starved else bic)

    best, bic = climbed(mixture)
    if not np.isfinite(bic):
        return mixture
    while best.size > 1:
        keep = np.arange(best.size) != int(np.argmin(best.weights))
        total = float(best.weights[keep].sum()) + best.background
        trial, trial_bic = climbed(
            replace(
                best,
                weights=best.weights[keep] / total,
                components=best.components[keep],
                background=best.background / total,
            )
        )
        if trial_bic > bic:
            break
        best, bic = trial, trial_bic
    return best
