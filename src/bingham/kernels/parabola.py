"""The parabolic contour of `kernels.contour`, compiled: log F and its derivatives in any dimension."""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.contour import CROSSING, DECAY, NODES

__all__ = ["derivatives", "parabola"]


@compiled(fast=True)
def _saddlepoint(z):
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


@compiled(inner=True, fast=True)
def parabola(z, nodes, weights):
    """Write the contour of `kernels.contour` for z (d,), max 0, as nodes and weights (n,) for `derivatives`.

    Returns the shift: F = 2 π^{d/2} e^{shift} Σₖ Im[weightsₖ ∏ᵢ (shift + nodesₖ − zᵢ)^{−1/2}].
    """
    mu = max(_saddlepoint(z), CROSSING)
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


@compiled(fast=True)
def derivatives(z, gradient, hessian):
    """Return log F for any d; write ω = ∇ log F and the Hessian of log F.

    F = 2 π^{d/2} e^{shift} Σₖ Im[weightsₖ ∏ᵢ (shift + nodesₖ − zᵢ)^{−1/2}].  z (d,) with max z = 0 in; gradient (d,),
    hessian (d, d) out.
    """
    d = z.size
    nodes, weights = np.empty(NODES, dtype=np.complex128), np.empty(NODES, dtype=np.complex128)
    shift = parabola(z, nodes, weights)
    inverse = np.empty(d, dtype=np.complex128)
    gradient[:] = 0.0
    hessian[:] = 0.0
    f = 0.0
    scale = 0.0
    for i in range(d):
        scale += math.log(1.0 + shift - z[i])
    for k in range(nodes.size):
        s = nodes[k] + shift
        term = weights[k]
        for i in range(d):
            inverse[i] = 1.0 / (s - z[i])
            # The real factor keeps the product of order one for any d and z; `scale` returns it.
            term *= np.sqrt((1.0 + shift - z[i]) * inverse[i])
        f += term.imag
        for i in range(d):
            t = term * inverse[i]
            gradient[i] += t.imag
            for j in range(i, d):
                hessian[i, j] += t.real * inverse[j].imag + t.imag * inverse[j].real
    total = 0.0
    for i in range(d):
        total += gradient[i]
    for i in range(d):
        gradient[i] /= total
    for i in range(d):
        for j in range(i, d):
            hessian[i, j] = (0.75 if i == j else 0.25) * hessian[i, j] / f - gradient[i] * gradient[j]
            hessian[j, i] = hessian[i, j]
    # Rows sum to zero; at high concentration that of the largest z is small by cancellation: it follows from the rest.
    top = 0
    for i in range(d):
        if z[i] > z[top]:
            top = i
    hessian[top, top] = 0.0
    for i in range(d):
        if i != top:
            row = 0.0
            for j in range(d):
                if j != top:
                    row += hessian[i, j]
            hessian[i, top] = hessian[top, i] = -row
            hessian[top, top] += row
    return math.log(2.0 * f) + 0.5 * d * math.log(math.pi) + shift - 0.5 * scale
