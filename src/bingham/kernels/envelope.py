"""Exact sampling of the Bingham law by rejection from an angular central Gaussian envelope.

With λᵢ = −zᵢ ≥ 0 the envelope is the law of y/|y|, y ~ N(0, diag(1 + 2λᵢ/b)⁻¹), b the root of Σ 1/(b + 2λᵢ) = 1
(Kent, Ganeiber & Mardia 2013). A proposal with u = Σ λᵢ xᵢ² is kept with probability
exp(−u + (d − b)/2) ((1 + 2u/b) b/d)^{d/2}; at least about half of them are, at every concentration in d ≤ 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["sample_diagonal"]

FloatArray = NDArray[np.float64]

# Proposals a round: they stay in the cache.
CHUNK = 1 << 15


def _envelope_parameter(spread: FloatArray) -> float:
    """Root b of Σ 1/(b + 2λᵢ) = 1 by Newton on the concave reciprocal, from the left."""
    b = 1.0
    for _ in range(100):
        t = 1.0 / (b + 2.0 * spread)
        total = float(t.sum())
        step = total * (total - 1.0) / float((t * t).sum())
        b += step
        if abs(step) <= 1e-14 * b:
            break
    return b


def sample_diagonal(z: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Return samples (count, d) of the density ∝ exp(Σ zᵢ xᵢ²), z (d,) with max z = 0."""
    d = z.size
    spread = -z
    b = _envelope_parameter(spread)
    # Columns are scaled in place: one pass over the proposals for each operation.
    scale = 1.0 / np.sqrt(1.0 + 2.0 * spread / b)
    log_bound = 0.5 * (d - b) + 0.5 * d * np.log(b / d)
    out = np.empty((count, d))
    filled = 0
    accepted_share = 0.5
    while filled < count:
        n = int(min(CHUNK, max(64, 1.1 * (count - filled) / accepted_share)))
        y = rng.standard_normal((n, d))
        y *= scale
        square = y * y
        norm2 = square.sum(axis=1)
        u = (square @ spread) / norm2
        keep = rng.standard_exponential(n) >= u - 0.5 * d * np.log1p(2.0 * u / b) - log_bound
        x = y[keep]
        x /= np.sqrt(norm2[keep])[:, None]
        take = min(len(x), count - filled)
        out[filled : filled + take] = x[:take]
        filled += take
        accepted_share = max(0.05, len(x) / n)
    return out
