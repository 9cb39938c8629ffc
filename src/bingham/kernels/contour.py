"""The normaliser by a parabolic contour in plain array code: any dimension, any array library, differentiable.

F(z) = 2 π^{d/2} L⁻¹{∏ᵢ (s − zᵢ)^{−1/2}}(1) along the parabola through the saddlepoint μ of the integrand,

    s(u) = μ (1 + iu)²,    Σᵢ ½/(μ − zᵢ) = 1, but μ at least ``CROSSING``,

by the midpoint rule at uₖ = (k + ½) U/n. All singularities lie on (−∞, 0], which the parabola encloses, and the
integrand is largest at u = 0, so that nothing cancels at any d. U is where it has fallen by e^{−``DECAY``}. With 32
nodes F and moments have relative errors below 1e-13 for every d ≤ 50, from the rounding of log F alone; Talbot's
contour, which keeps its shape as d grows, has 1e-12 to 3e-10.

Complex logarithms and exponentials are all it needs, so one function serves NumPy, PyTorch, JAX and CuPy with their own
differentiation. It is the oracle of the compiled 8-node rule; `kernels.rule` compiles it for the dimensions above.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

__all__ = ["CROSSING", "DECAY", "NODES", "log_normalizer_array"]

NODES = 32
# Crossing the axis closer to the singularity would need more nodes; farther out, digits would cancel as e^μ.
CROSSING = 3.5
# e^{−37} is half a unit in the last place of a double.
DECAY = 37.0


def log_normalizer_array(z: Any) -> Any:
    """Return log F(z) for z (..., d) of any array library, max z free; differentiable where the library is.

    The contour is a constant for differentiation: F does not depend on it.
    """
    xp: Any
    if type(z).__module__.partition(".")[0] == "torch":
        import torch as xp  # pyright: ignore[reportMissingImports]

        top = xp.max(z, dim=-1, keepdim=True).values
        z = z - top
        u = (xp.arange(NODES, dtype=z.dtype, device=z.device) + 0.5) / NODES
        frozen = z.detach()
    else:
        xp = z.__array_namespace__() if hasattr(z, "__array_namespace__") else np
        z = xp.asarray(z)
        top = xp.max(z, axis=-1, keepdims=True)
        z = z - top
        u = (xp.arange(NODES) + 0.5) / NODES
        frozen = z
    d = z.shape[-1]
    mu = 0.5 + 0.0 * xp.sum(frozen, -1)[..., None]
    for _ in range(40):
        t = 0.5 / (mu - frozen)
        f = xp.sum(t, -1)[..., None] - 1.0
        mu = mu + f * (f + 1.0) / xp.sum(t / (mu - frozen), -1)[..., None]
    mu = xp.where(mu < CROSSING, CROSSING + 0.0 * mu, mu)
    # U by bisection on u² between 0 and more than enough for any spectrum.
    low, high = 0.0 * mu, 2.5 * DECAY / mu
    for _ in range(10):
        middle = 0.5 * (low + high)
        squared = (mu * (1.0 - middle) - frozen) ** 2 + 4.0 * mu**2 * middle
        decay = mu * middle + xp.sum(0.25 * xp.log(squared / (mu - frozen) ** 2), -1)[..., None]
        low, high = xp.where(decay < DECAY, middle, low), xp.where(decay < DECAY, high, middle)
    length = xp.sqrt(high)
    w = 1.0 + 1j * (u * length)
    s = mu * w**2
    # Each factor is divided by a real one of its own size, so that no product under- or overflows.
    logs = xp.log((s[..., :, None] - z[..., None, :]) / (mu - z)[..., None, :])
    f = xp.sum(xp.real(w * xp.exp(s - mu - 0.5 * xp.sum(logs, -1))), -1)
    front = xp.log(4.0 * (mu * length)[..., 0] / (NODES * math.pi)) + mu[..., 0] + top[..., 0]
    return xp.log(f) + front + 0.5 * d * math.log(math.pi) - 0.5 * xp.sum(xp.log(mu - z), -1)
