"""Distance between a Dirac mixture and the standard normal by localized cumulative distributions, with gradient.

With the kernel exp(−|x−r|²/(2b²)) both cumulative distributions are Gaussian in r, and the inner integral of

    D = ∫₀^B b^{1−n} ∫ (F̂(r, b) − F(r, b))² dr db
      = π^{n/2} [D₁ − 2·2^{n/2}/m Σᵢ D₂(|xᵢ|²) + 1/m² Σᵢⱼ D₃(|xᵢ − xⱼ|²)]

is closed (Hanebeck, Huber & Klumpp 2009; Gilitschenski & Hanebeck 2013), with

    D₁ = ∫ b^{n+1} (1+b²)^{−n/2} db,   D₂(r) = ∫ b^{n+1} (1+2b²)^{−n/2} exp(−r/(2(1+2b²))) db,
    D₃(s) = ∫ b exp(−s/(4b²)) db = ½B² e^{−u} − (s/8) E₁(u),   u = s/(4B²),   D₃'(s) = −E₁(u)/8.

D₁ and D₂ keep their integral over b: one Gauss–Legendre rule, whose nodes the caller chooses.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled

__all__ = ["exponential_integral", "lcd_distance"]

EULER = 0.5772156649015329


# −Ein(−u)-series of E₁(u) + γ + ln u = Σ cₖ uᵏ, cₖ = −(−1)ᵏ/(k·k!) (Abramowitz & Stegun 5.1.11), highest power first.
SERIES = np.array([-((-1.0) ** k) / (k * math.factorial(k)) for k in range(18, 0, -1)])


@compiled(fast=True)
def exponential_integral(u):
    """Return E₁(u) = ∫_u^∞ e^{−t}/t dt for u > 0, to 1e-14 relative."""
    if u <= 1.0:
        total = 0.0
        for k in range(SERIES.size):
            total = total * u + SERIES[k]
        return total * u - EULER - math.log(u)
    # Continued fraction 5.1.22, evaluated forward (Lentz).
    b = u + 1.0
    c = 1e300
    d = 1.0 / b
    h = d
    for i in range(1, 200):
        a = -float(i * i)
        b += 2.0
        d = 1.0 / (a * d + b)
        c = b + a / c
        h *= c * d
        if abs(c * d - 1.0) < 1e-16:
            break
    return h * math.exp(-u)


@compiled(fast=True)
def _among(squared, reach):
    """D₃(s) and D₃'(s) for s = |x − y|²; at 0 the slope, infinite but always times x − y = 0, is given as 0."""
    half = 0.5 * reach * reach
    if squared == 0.0:
        return half, 0.0
    u = squared / (4.0 * reach * reach)
    e = exponential_integral(u)
    return half * math.exp(-u) - 0.125 * squared * e, -0.125 * e


@compiled(fast=True)
def lcd_distance(points, symmetric, middle, reach, first, nodes, weights, gradient):
    """Return D of equally weighted points and write its gradient with respect to `points` (p, n).

    The set is `points`, their negatives if `symmetric`, and `middle` points at 0. reach is B; first is D₁; nodes and
    weights (K,) give D₂(r) = Σ weights·exp(−nodes·r), nodes = 1/(2(1+2b²)).
    """
    p, n = points.shape
    copies = 2 if symmetric else 1
    m = copies * p + middle
    gradient[:] = 0.0
    # Sums over all points (D₂) and over all unordered pairs of two points (D₃).
    to_normal = among = 0.0
    factor = 2.0 * 2.0 ** (0.5 * n) / m
    pair = 1.0 / (m * m)
    for q in range(nodes.size):
        to_normal += middle * weights[q]
    among += 0.5 * middle * (middle - 1) * 0.5 * reach * reach
    minus, plus = np.empty(n), np.empty(n)
    for i in range(p):
        r = 0.0
        for k in range(n):
            r += points[i, k] * points[i, k]
        slope = 0.0
        for q in range(nodes.size):
            t = copies * weights[q] * math.exp(-nodes[q] * r)
            to_normal += t
            slope -= nodes[q] * t
        slope *= -factor
        if middle > 0:
            value, derivative = _among(r, reach)
            among += copies * middle * value
            slope += 2.0 * pair * copies * middle * derivative
        if symmetric:
            value, derivative = _among(4.0 * r, reach)
            among += value
            slope += 8.0 * pair * derivative
        for k in range(n):
            gradient[i, k] += 2.0 * slope * points[i, k]
        for j in range(i):
            s = t = 0.0
            for k in range(n):
                minus[k] = points[i, k] - points[j, k]
                plus[k] = points[i, k] + points[j, k]
                s += minus[k] * minus[k]
                t += plus[k] * plus[k]
            value, derivative = _among(s, reach)
            among += copies * value
            derivative *= 4.0 * copies * pair
            for k in range(n):
                gradient[i, k] += derivative * minus[k]
                gradient[j, k] -= derivative * minus[k]
            if symmetric:
                value, derivative = _among(t, reach)
                among += copies * value
                derivative *= 4.0 * copies * pair
                for k in range(n):
                    gradient[i, k] += derivative * plus[k]
                    gradient[j, k] += derivative * plus[k]
    volume = math.pi ** (0.5 * n)
    for i in range(p):
        for k in range(n):
            gradient[i, k] *= volume
    return volume * (first - factor * to_normal + pair * (2.0 * among + m * 0.5 * reach * reach))
