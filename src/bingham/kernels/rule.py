"""The rule that suits each dimension: unrolled 8 nodes for d = 4, 8 nodes to `RULE_DIMENSION`, a parabola beyond."""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.contour import CROSSING, DECAY, NODES
from bingham.kernels.normalizer import CI, CR, RULE_DIMENSION, SI, SR, derivatives, derivatives_4

__all__ = ["log_normalizer_derivatives", "parabola", "saddlepoint"]

RULE_NODES, RULE_WEIGHTS = SR + 1j * SI, CR + 1j * CI


@compiled()
def saddlepoint(z):
    """Positive root s of Σ ½/(s − zᵢ) = 1 for max z = 0: where the contour of a high dimension should cross."""
    d = z.size
    s = 0.5
    for _ in range(100):
        f, g = -1.0, 0.0
        for i in range(d):
            t = 0.5 / (s - z[i])
            f += t
            g += t / (s - z[i])
        # Newton on 1/Σ, which is concave and increasing: from the left of the root it never crosses it.
        step = f * (f + 1.0) / g
        s += step
        if abs(step) <= 1e-6 * s:
            break
    return s


@compiled()
def parabola(z, nodes, weights):
    """Write the contour of `kernels.contour` for z (d,), max 0, as nodes and weights (n,) for `derivatives`.

    Returns the shift: F = 2 π^{d/2} e^{shift} Σₖ Im[weightsₖ ∏ᵢ (shift + nodesₖ − zᵢ)^{−1/2}].
    """
    mu = max(saddlepoint(z), CROSSING)
    low, high = 0.0, 2.5 * DECAY / mu
    for _ in range(10):
        middle = 0.5 * (low + high)
        decay = mu * middle
        for i in range(z.size):
            a, b = mu * (1.0 - middle) - z[i], mu - z[i]
            decay += 0.25 * math.log((a * a + 4.0 * mu * mu * middle) / (b * b))
        if decay < DECAY:
            low = middle
        else:
            high = middle
    n = nodes.size
    h = math.sqrt(high) / n
    for k in range(n):
        w = complex(1.0, (k + 0.5) * h)
        s = mu * w * w
        # `derivatives` wants s − shift, and divides its factors by 1 + shift − zᵢ: shift = μ − 1.
        nodes[k] = s - mu + 1.0
        weights[k] = 2.0 * mu * h / math.pi * 1j * w * np.exp(nodes[k])
    return mu - 1.0


@compiled()
def log_normalizer_derivatives(z, gradient, hessian):
    """Return log F for z (d,) with max z = 0; write ω = ∇ log F (d,) and the Hessian of log F (d, d)."""
    d = z.size
    if d == 4:
        return math.log(derivatives_4(z, gradient, hessian))
    if d <= RULE_DIMENSION:
        return derivatives(z, RULE_NODES, RULE_WEIGHTS, 0.0, gradient, hessian)
    nodes, weights = np.empty(NODES, dtype=np.complex128), np.empty(NODES, dtype=np.complex128)
    shift = parabola(z, nodes, weights)
    return derivatives(z, nodes, weights, shift, gradient, hessian)
