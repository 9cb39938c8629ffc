"""Exact sampling of the Bingham distribution by rejection from an angular central Gaussian envelope.

With λᵢ = −zᵢ ≥ 0 the envelope is the distribution of y/|y|, y ~ N(0, diag(1 + 2λᵢ/b)⁻¹), b the root of Σ 1/(b + 2λᵢ) =
1 (Kent, Ganeiber & Mardia 2013). A proposal with u = Σ λᵢ xᵢ² is kept with probability
exp(−u + (d − b)/2) ((1 + 2u/b) b/d)^{d/2}; at least about half of them are, at every concentration in d ≤ 4.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled

__all__ = ["sample"]


@compiled(fast=True)
def _envelope_parameter(spread):
    """Root b of Σ 1/(b + 2λᵢ) = 1 by Newton on the concave reciprocal, from the left."""
    b = 1.0
    for _ in range(100):
        f, g = 0.0, 0.0
        for i in range(spread.size):
            t = 1.0 / (b + 2.0 * spread[i])
            f += t
            g += t * t
        step = f * (f - 1.0) / g
        b += step
        if abs(step) <= 1e-14 * b:
            break
    return b


@compiled(fast=True)
def sample(z, rows, rng, out):
    """Write samples of the density ∝ exp(Σ zᵢ (rows[i]ᵀ x)²) to out (n, d); z (d,) with max z = 0, rows (d, d)."""
    d = z.size
    spread = -z
    b = _envelope_parameter(spread)
    half = 0.5 * d
    log_bound = 0.5 * (d - b) + half * math.log(b / d)
    scale = 1.0 / np.sqrt(1.0 + 2.0 * spread / b)
    y = np.empty(d)
    filled = 0
    while filled < out.shape[0]:
        square = u = 0.0
        for i in range(d):
            y[i] = rng.standard_normal() * scale[i]
            square += y[i] * y[i]
            u += spread[i] * y[i] * y[i]
        u /= square
        if rng.standard_exponential() < u - half * math.log1p(2.0 * u / b) - log_bound:
            continue
        n = 1.0 / math.sqrt(square)
        for j in range(d):
            t = 0.0
            for i in range(d):
                t += y[i] * rows[i, j]
            out[filled, j] = t * n
        filled += 1
