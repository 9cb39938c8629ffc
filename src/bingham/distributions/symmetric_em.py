"""Expectation-maximisation for orientations with crystal symmetry."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.bounded import bounded_concentrations
from bingham.rotations import compose

__all__ = ["SymmetricParts", "fit_symmetric"]

FloatArray = NDArray[np.float64]

LOG_AREA = math.log(2.0 * math.pi**2)
MAX_STEPS = 300
# Gain of log-likelihood per orientation at which a run has converged.
TOLERANCE = 1e-9
START_CONCENTRATION = 200.0
START_BACKGROUND = 0.1


class SymmetricParts(NamedTuple):
    """Weights (K,), components and background share of a fit, and its log-likelihood."""

    weights: FloatArray
    components: Bingham
    background: float
    log_likelihood: float


def fit_symmetric(
    q: FloatArray, group: FloatArray, size: int, counts: FloatArray, *, background: bool, restarts: int, ceiling: float,
    rng: np.random.Generator,
) -> SymmetricParts:  # fmt: skip
    """Return the best of several runs from random orientations of the sample (n, 4), far from each other.

    E step: r_{nkg} ∝ αₖ fₖ(qₙ ⊗ g)/G. M step: fₖ is the most likely distribution of the moment
    Σ r_{nkg} (qₙ⊗g)(qₙ⊗g)ᵀ / Σ r_{nkg}, and αₖ = Σ r_{nkg}/n.
    """
    y = compose(q[:, None, :], group)
    runs = [_climb(y, counts, _seeds(y, q, size, rng), background, ceiling) for _ in range(restarts)]
    return max(runs, key=lambda run: run.log_likelihood)


def _seeds(y: FloatArray, q: FloatArray, size: int, rng: np.random.Generator) -> FloatArray:
    """Return orientations (size, 4): the first at random, others with probability ∝ sin² of half the misorientation."""
    seeds = [q[rng.integers(len(q))]]
    while len(seeds) < size:
        near = np.max([np.max((y @ s) ** 2, axis=1) for s in seeds], axis=0)
        far = np.maximum(1.0 - near, 0.0)
        p = far / far.sum() if far.sum() > 0.0 else None
        seeds.append(q[rng.choice(len(q), p=p)])
    return np.array(seeds)


def _climb(y: FloatArray, counts: FloatArray, seeds: FloatArray, background: bool, ceiling: float) -> SymmetricParts:
    n, order, _ = y.shape
    size = len(seeds)
    start = min(START_CONCENTRATION, ceiling)
    components = Bingham.from_matrix(start * seeds[:, :, None] * seeds[:, None, :])
    share = START_BACKGROUND if background else 0.0
    weights = np.full(size, (1.0 - share) / size)
    total = float(counts.sum())
    flat = y.reshape(-1, 4)
    value = -math.inf
    for _ in range(MAX_STEPS):
        joint = np.empty((n, order, size))
        with np.errstate(divide="ignore"):
            for k in range(size):
                t = (flat @ components.M[k]) ** 2
                joint[..., k] = (t @ components.z[k]).reshape(n, order)
                joint[..., k] += np.log(weights[k] / order) - components.log_normalizer[k]
            floor = math.log(share) - LOG_AREA if share > 0.0 else -math.inf
        top = np.maximum(joint.max(axis=(1, 2)), floor)
        joint = np.exp(joint - top[:, None, None])
        mass = joint.sum(axis=(1, 2)) + np.exp(floor - top)
        last, value = value, float(counts @ (top + np.log(mass)))
        if value - last <= TOLERANCE * total:
            break
        joint *= (counts / mass)[:, None, None]
        held = joint.sum(axis=(0, 1))
        held = np.maximum(held, 1e-12)
        moments = np.empty((size, 4, 4))
        for k in range(size):
            moments[k] = (flat.T * joint[..., k].ravel()) @ flat / held[k]
        weights = held / total
        share = max(0.0, 1.0 - float(weights.sum())) if background else 0.0
        weights *= (1.0 - share) / weights.sum()
        components = _most_likely(moments, ceiling)
    return SymmetricParts(weights, components, share, value)


def _most_likely(moments: FloatArray, ceiling: float) -> Bingham:
    """Return the distributions (K,) of greatest likelihood under a ceiling of the concentrations."""
    from bingham.distributions.algebra import spectral

    w, frames = spectral(moments, "moments")
    w = np.maximum(w, 0.0)
    z, log_f = bounded_concentrations(w / w.sum(axis=-1, keepdims=True), ceiling)
    return Bingham.from_spectrum(z, frames, log_f)
