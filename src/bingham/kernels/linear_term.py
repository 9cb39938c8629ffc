"""Normaliser of exp(Σ zᵢ xᵢ² + bᵢ xᵢ) on the sphere, and moments up to the fourth, along a contour.

Laplace transform in r = ‖x‖² with the linear term scaled by √r gives, as for b = 0,

    C(z, b) = 2 π^{d/2} (2πi)⁻¹ ∫ e^{φ(s)} ds,  φ(s) = s − ½ Σ log(s − zᵢ) + Σ bᵢ²/(4(s − zᵢ)).

With max z = 0 the contour is the parabola s = μ(1 + iu)², μ the saddlepoint φ'(μ) = 0; midpoint sums converge
geometrically along it. Under each node x is Gaussian with mean bᵢ/(2(s − zᵢ)) and variance 1/(2(s − zᵢ)), so moments
are those of Gaussians, averaged over the nodes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["LinearMoments", "log_normalizer_linear", "moments_linear"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating]

NODES = 64
# The integrand ends where it has fallen by e^{−DECAY}.
DECAY = 38.0
SHORTENED = np.geomspace(1.0 / 16.0, 1.0, 25)


class LinearMoments(NamedTuple):
    """log C, E[x] (d,), E[x xᵀ] (d, d), and the covariance (p, p) of the p = d + d(d + 1)/2 statistics.

    The statistics are x and the entries xᵢxⱼ, i ≤ j, in the order of ``numpy.triu_indices``.
    """

    log_normalizer: float
    mean: FloatArray
    moment: FloatArray
    covariance: FloatArray


def log_normalizer_linear(z: FloatArray, b: FloatArray) -> float:
    """Return log C(z, b) for z, b (d,), z in any order and offset."""
    return _nodes(z, b)[0]


def moments_linear(z: FloatArray, b: FloatArray) -> LinearMoments:
    """Return log C and the moments of x with density ∝ exp(Σ zᵢ xᵢ² + bᵢ xᵢ), z and b (d,)."""
    log_c, weight, shifted = _nodes(z, b)
    d = z.size
    variance = 0.5 / shifted
    mean = b * variance
    i, j = np.triu_indices(d)
    equal = (i == j).astype(np.float64)
    pair = mean[:, i] * mean[:, j] + equal * variance[:, i]
    first = (weight @ mean).real
    second = (weight @ pair).real
    # E[x_k x_i x_j] and E[x_i x_j x_k x_l], by the pairings of Gaussian moments.
    weighted = weight[:, None] * pair
    spread = weight[:, None] * variance
    share = spread.T @ mean  # Σ w vₖ mⱼ
    ki, kj = np.arange(d)[:, None] == i, np.arange(d)[:, None] == j
    third = (mean.T @ weighted + ki * share[:, j] + kj * share[:, i]).real
    fourth = weighted.T @ pair
    products = np.einsum("nk,ni,nj->kij", spread, mean, mean)  # Σ w vₖ mᵢ mⱼ
    both = (spread.T @ variance)[i, j]
    for a, rest, c, e in ((i, j, i, j), (i, j, j, i), (j, i, i, j), (j, i, j, i)):
        # a is paired with c, the others keep their means.
        fourth = fourth + (a[:, None] == c) * products[a[:, None], rest[:, None], e]
    for c, e in ((i, j), (j, i)):
        fourth = fourth + ((i[:, None] == c) & (j[:, None] == e)) * both[:, None]
    p = d + len(i)
    statistics = np.concatenate([first, second])
    covariance = np.empty((p, p))
    moment = np.zeros((d, d))
    moment[i, j] = moment[j, i] = second
    covariance[:d, :d] = moment
    covariance[:d, d:] = third
    covariance[d:, :d] = third.T
    covariance[d:, d:] = fourth.real
    covariance -= np.outer(statistics, statistics)
    return LinearMoments(log_c, first, moment, covariance)


def _nodes(z: FloatArray, b: FloatArray) -> tuple[float, ComplexArray, ComplexArray]:
    """Return log C, weights (n,) whose real parts sum to 1, and s − z (n, d) at the nodes."""
    top = float(z.max())
    z = z - top
    quarter = 0.25 * b * b
    mu = _saddlepoint(z, quarter)

    def exponent(s: ComplexArray) -> ComplexArray:
        shifted = s[:, None] - z
        return s - 0.5 * np.log(shifted).sum(axis=1) + (quarter / shifted).sum(axis=1)

    height = float(exponent(np.array([mu + 0j]))[0].real)
    # e^s alone falls that far by √(DECAY/μ); the other factors only shorten the way.
    trial = math.sqrt(DECAY / mu) * SHORTENED
    fallen = exponent(mu * (1.0 + 1j * trial) ** 2).real - height < -DECAY
    end = float(trial[int(np.argmax(fallen))]) if fallen.any() else float(trial[-1])
    u = end / NODES * (np.arange(NODES) + 0.5)
    s = mu * (1.0 + 1j * u) ** 2
    weight = np.exp(exponent(s) - height) * (1.0 + 1j * u)
    total = float(weight.sum().real)
    log_c = math.log(2.0 * total * mu * end / NODES) + 0.5 * (z.size - 2) * math.log(math.pi) + math.log(2.0)
    return log_c + height + top, weight / total, s[:, None] - z


def _saddlepoint(z: FloatArray, quarter: FloatArray) -> float:
    """Return the root s > 0 of ½ Σ 1/(s − zᵢ) + Σ bᵢ²/(4(s − zᵢ)²) = 1, max z = 0: the sum falls from ∞ to 0."""
    low, high = 0.0, 1.0 + 0.5 * z.size + float(np.sqrt(quarter.sum()))
    s = high
    for _ in range(200):
        t = 1.0 / (s - z)
        value = float(np.sum(t * (0.5 + quarter * t))) - 1.0
        if value > 0.0:
            low = s
        else:
            high = s
        slope = -float(np.sum(t * t * (0.5 + 2.0 * quarter * t)))
        new = s - value / slope
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - s) <= 1e-9 * s:
            return new
        s = new
    return s
