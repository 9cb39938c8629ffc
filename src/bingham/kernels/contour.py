"""The normaliser by a Talbot contour in plain array code: any dimension, any array library, differentiable.

F(z) = 2 π^{d/2} Σₖ Im[cₖ ∏ᵢ (sₖ − zᵢ)^{−1/2}] with the contour of Weideman (2006), θₖ = πk/N for odd k,

    sₖ = σ + N (0.5017 θ cot(0.6407 θ) − 0.6122 + 0.2645 i θ),    cₖ = (2/N) e^{sₖ} ds/dθ,

shifted to the saddlepoint σ for high dimensions, where it would otherwise cancel. Complex logarithms and exponentials
are all it needs, so one function serves NumPy, PyTorch, JAX and CuPy with their own differentiation. It is the oracle
of the compiled 8-node rule and takes its place above ``RULE_DIMENSION``.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

__all__ = ["TALBOT_NODES", "TALBOT_WEIGHTS", "log_normalizer_array", "talbot"]


def talbot(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and weights (count/2,) of the contour with ``count`` points; the other half is conjugate."""
    theta = math.pi * np.arange(1, count, 2) / count
    nodes = count * (0.5017 * theta / np.tan(0.6407 * theta) - 0.6122 + 0.2645j * theta)
    slope = 0.5017 / np.tan(0.6407 * theta) - 0.5017 * 0.6407 * theta / np.sin(0.6407 * theta) ** 2 + 0.2645j
    return nodes, 2.0 * np.exp(nodes) * slope


# 40 points reach rounding error for every dimension once the contour is shifted to the saddlepoint.
TALBOT_NODES, TALBOT_WEIGHTS = talbot(40)


def log_normalizer_array(z: Any) -> Any:
    """Return log F(z) for z (..., d) of any array library, max z free; differentiable where the library is.

    The shift of the contour is a constant for differentiation: F does not depend on it.
    """
    xp: Any
    if type(z).__module__.partition(".")[0] == "torch":
        import torch as xp  # pyright: ignore[reportMissingImports]

        top = xp.max(z, dim=-1, keepdim=True).values
        z = z - top
        nodes = xp.asarray(TALBOT_NODES, dtype=xp.complex128, device=z.device)
        weights = xp.asarray(TALBOT_WEIGHTS, dtype=xp.complex128, device=z.device)
        frozen = z.detach()
    else:
        xp = z.__array_namespace__() if hasattr(z, "__array_namespace__") else np
        z = xp.asarray(z)
        top = xp.max(z, axis=-1, keepdims=True)
        z = z - top
        nodes, weights = xp.asarray(TALBOT_NODES), xp.asarray(TALBOT_WEIGHTS)
        frozen = z
    d = z.shape[-1]
    shift = 0.5 + 0.0 * top
    for _ in range(40):
        t = 0.5 / (shift - frozen)
        f = xp.sum(t, -1)[..., None] - 1.0
        shift = shift + f * (f + 1.0) / xp.sum(t / (shift - frozen), -1)[..., None]
    if type(z).__module__.partition(".")[0] == "torch":
        shift = shift.detach()
    scale = 1.0 + shift - z
    # Each factor is divided by a real one of its own size, so that no product under- or overflows.
    s = nodes + shift
    logs = xp.log((s[..., :, None] - z[..., None, :]) / scale[..., None, :])
    terms = weights * xp.exp(-0.5 * xp.sum(logs, -1))
    f = xp.sum(xp.imag(terms), -1)
    log_f = xp.log(2.0 * f) + 0.5 * d * math.log(math.pi) - 0.5 * xp.sum(xp.log(scale), -1)
    return log_f + shift[..., 0] + top[..., 0]
