"""Products, compositions, reduction, entropy bounds and peaks of Bingham mixtures."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from bingham.distributions.bingham import Bingham
from bingham.distributions.mixture_density import MixtureDensity, log_area
from bingham.errors import InvalidArgumentError

__all__ = ["compose_mixtures", "entropy_bounds", "multiply", "peaks", "reduce"]

FloatArray = NDArray[np.float64]
M = TypeVar("M", bound=MixtureDensity)

PEAK_STEPS = 200
# Peaks closer than this angle, in rad, are one.
PEAK_DISTANCE = 1e-4


def multiply(p: M, q: M) -> tuple[M, float]:
    """Return the normalised product of two mixtures and log ∫ p(x) q(x) dx, nothing pruned.

    Component (i, j) has matrix Aᵢ + Bⱼ and weight ∝ αᵢ βⱼ F(Aᵢ + Bⱼ) / (F(Aᵢ) F(Bⱼ)); a background leaves the other
    factor as it is, times 1/area.
    """
    if p.dim != q.dim:
        raise InvalidArgumentError("other", f"a distribution of dimension {p.dim}", q.dim)
    d, area = p.dim, log_area(p.dim)
    pairs = Bingham.from_matrix((p.components.matrix[:, None] + q.components.matrix[None]).reshape(-1, d, d))
    # `from_matrix` drops the largest eigenvalue of the sum, which belongs to log F(A + B).
    a = (p.components.matrix[:, None] + q.components.matrix[None]).reshape(-1, d, d)
    top = np.einsum("ni,nij,nj->n", pairs.mode, a, pairs.mode)
    with np.errstate(divide="ignore"):
        log_p = np.log(p.weights) - p.components.log_normalizer
        log_q = np.log(q.weights) - q.components.log_normalizer
        log_w = (log_p[:, None] + log_q[None]).ravel() + pairs.log_normalizer + top
        z, frames, logs = [pairs.z], [pairs.M], [log_w]
        if q.background > 0.0:
            z.append(p.components.z)
            frames.append(p.components.M)
            logs.append(np.log(p.weights * q.background) - area)
        if p.background > 0.0:
            z.append(q.components.z)
            frames.append(q.components.M)
            logs.append(np.log(q.weights * p.background) - area)
        log_uniform = np.log(p.background * q.background) - area
    log_w = np.concatenate(logs)
    evidence = float(np.asarray(logsumexp(np.append(log_w, log_uniform))))
    distributions = Bingham.from_spectrum(np.concatenate(z), np.concatenate(frames))
    weights, background = np.exp(log_w - evidence), float(np.exp(log_uniform - evidence))
    return replace(p, weights=weights, components=distributions, background=background), evidence


def compose_mixtures(p: M, q: M) -> M:
    """Return the mixture of pᵢ ⊕ qⱼ with weights αᵢ βⱼ; whatever meets a background is uniform."""
    if p.dim != q.dim:
        raise InvalidArgumentError("other", f"a distribution of dimension {p.dim}", q.dim)
    distributions = [p.components[i].compose(q.components[j]) for i in range(p.size) for j in range(q.size)]
    batch = Bingham.from_spectrum(
        np.stack([distribution.z for distribution in distributions]),
        np.stack([distribution.M for distribution in distributions]),
    )
    background = p.background + q.background - p.background * q.background
    return replace(p, weights=np.outer(p.weights, q.weights).ravel(), components=batch, background=background)


def entropy_bounds(distributions: Bingham, weights: FloatArray) -> tuple[float, float]:
    """Return the lower and the upper bound of `BinghamMixture.entropy_bounds`."""
    from bingham.distributions.normalizer import log_normalizer

    keep = weights > 0.0
    distributions, weights = distributions[keep], weights[keep]
    log_f = distributions.log_normalizer
    values = np.linalg.eigvalsh(distributions.matrix[:, None] + distributions.matrix[None])
    overlap = log_normalizer(values) - log_f[:, None] - log_f[None]
    lower = -float(np.sum(weights * np.asarray(logsumexp(overlap + np.log(weights), axis=1))))
    return lower, float(np.sum(weights * (distributions.entropy() - np.log(weights))))


def _merge_cost(weights: FloatArray, moments: FloatArray, entropies: FloatArray, i: Any, j: Any) -> tuple[Any, Bingham]:
    total = weights[i] + weights[j]
    share = np.asarray(weights[i] / total)[..., None, None]
    merged = Bingham.from_moment(share * moments[i] + (1.0 - share) * moments[j])
    return total * merged.entropy() - weights[i] * entropies[i] - weights[j] * entropies[j], merged


def reduce(mixture: M, size: int, limit: float) -> M:
    """Return the mixture with pairs merged down to `size` components or while a merge costs less than `limit`."""
    if size < 1:
        raise InvalidArgumentError("size", "at least one component", size)
    if mixture.size <= size:
        return mixture
    keep = mixture.weights > 0.0
    weights, distributions = np.array(mixture.weights[keep]), mixture.components[keep]
    z, frames, moments, entropies = (
        np.array(distributions.z),
        np.array(distributions.M),
        distributions.moment(),
        np.array(distributions.entropy()),
    )
    n = len(weights)
    cost = np.full((n, n), np.inf)
    i, j = np.triu_indices(n, 1)
    if len(i):
        cost[i, j] = _merge_cost(weights, moments, entropies, i, j)[0]
    alive = list(range(n))
    while len(alive) > size:
        a, b = np.unravel_index(int(np.argmin(cost)), cost.shape)
        if not cost[a, b] < limit and limit < np.inf:
            break
        a, b = int(a), int(b)
        merged = _merge_cost(weights, moments, entropies, a, b)[1]
        weights[a] += weights[b]
        z[a], frames[a], moments[a], entropies[a] = merged.z, merged.M, merged.moment(), merged.entropy()
        alive.remove(b)
        cost[b, :] = cost[:, b] = np.inf
        others = np.array([k for k in alive if k != a], dtype=np.int64)
        if len(others):
            low, high = np.minimum(others, a), np.maximum(others, a)
            cost[low, high] = _merge_cost(weights, moments, entropies, low, high)[0]
    batch = Bingham.from_spectrum(np.ascontiguousarray(z[alive]), np.ascontiguousarray(frames[alive]))
    return replace(mixture, weights=weights[alive], components=batch)


def peaks(mixture: MixtureDensity) -> tuple[FloatArray, FloatArray]:
    """Return axes (P, d) and log-densities (P,) of the local maxima reached from the components' modes."""
    x = np.array(mixture.components.mode)
    matrices = mixture.components.matrix
    for _ in range(PEAK_STEPS):
        r = mixture.predict_proba(x)[:, :-1]
        new = np.linalg.eigh(np.einsum("nk,kij->nij", r, matrices))[1][..., -1]
        moved = float(np.max(1.0 - np.abs(np.sum(new * x, axis=1))))
        x = new
        if moved < 1e-15:
            break
    height = np.asarray(mixture.logpdf(x))
    order = np.argsort(-height, kind="stable")
    kept: list[int] = []
    for k in order:
        if all(abs(float(x[k] @ x[m])) < np.cos(PEAK_DISTANCE) for m in kept):
            kept.append(int(k))
    return x[kept], height[kept]
