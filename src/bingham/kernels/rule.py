"""The rule that suits each dimension: unrolled 8 nodes for d = 4, 8 nodes to `RULE_DIMENSION`, Talbot beyond."""

from __future__ import annotations

import math

from bingham.kernels.compile import compiled
from bingham.kernels.contour import TALBOT_NODES, TALBOT_WEIGHTS
from bingham.kernels.normalizer import CI, CR, RULE_DIMENSION, SI, SR, derivatives, derivatives_4

__all__ = ["log_normalizer_derivatives", "saddlepoint"]

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
def log_normalizer_derivatives(z, gradient, hessian):
    """Return log F for z (d,) with max z = 0; write ω = ∇ log F (d,) and the Hessian of log F (d, d)."""
    d = z.size
    if d == 4:
        return math.log(derivatives_4(z, gradient, hessian))
    if d <= RULE_DIMENSION:
        return derivatives(z, RULE_NODES, RULE_WEIGHTS, 0.0, gradient, hessian)
    return derivatives(z, TALBOT_NODES, TALBOT_WEIGHTS, saddlepoint(z), gradient, hessian)
