"""Map from standard normal points to the Bingham distribution on the hemisphere, coordinate by coordinate.

With y₁ = sin θ₁, y₂ = cos θ₁ sin θ₂, …, y_d = cos θ₁ ⋯ cos θ_{d−1} ≥ 0 in the principal axes, the density of θᵢ given
those before it is, on a sphere of k = d − i + 1 ambient dimensions and with ρ = cos θ₁ ⋯ cos θ_{i−1},

    g(θ) ∝ cos^{k−2}θ · F_{k−1}(ρ² cos²θ · (z_{i+1}, …, z_d)) · exp(ρ² zᵢ sin²θ),

because the rest of a Bingham vector, given one coordinate, is Bingham on the smaller sphere. θᵢ is the quantile of
Φ(sᵢ). The map (Rosenblatt 1952) is odd in s up to the sign of the axis, is the Gaussian scaling at high concentration
and keeps volume for the uniform distribution: nothing is singular.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.numpy_rule import CI, CR, SI, SR

__all__ = ["transport"]

# Intervals of a half-range table; g is linear between nodes, its integral exact for that. The error moves a point by
# less than 1e-3 of the spread, which the moment correction absorbs.
INTERVALS = 32
# Half-width of a table in standard deviations of the Gaussian bound exp(z θ²): the mass beyond is below 1e-8.
WIDTH = 6.0


@compiled()
def _bessel(x):
    """I₀(x) e^{−x} for x ≥ 0, to 2e-7 relative (Abramowitz & Stegun 9.8.1–9.8.2)."""
    if x < 3.75:
        t = (x / 3.75) ** 2
        value = 1.0 + t * (
            3.5156229 + t * (3.0899424 + t * (1.2067492 + t * (0.2659732 + t * (0.0360768 + t * 0.0045813))))
        )
        return value * math.exp(-x)
    t = 3.75 / x
    value = 0.39894228 + t * (0.01328592 + t * (0.00225319 + t * (-0.00157565 + t * (0.00916281 + t * (
        -0.02057706 + t * (0.02635537 + t * (-0.01647633 + t * 0.00392377)))))))  # fmt: skip
    return value / math.sqrt(x)


@compiled()
def _normalizer(z, first, scale):
    """F of the concentrations scale·z[first:], up to a factor that depends on their number only."""
    count = z.size - first
    if count == 1:
        return 1.0
    if count == 2:
        return _bessel(-0.5 * scale * z[first])
    total = 0.0
    for k in range(SR.size):
        s = complex(SR[k], SI[k])
        term = complex(CR[k], CI[k])
        for i in range(first, z.size):
            term /= np.sqrt(s - scale * z[i])
        total += term.imag
    return total


@compiled()
def _tabulate(z, axis, scale, density, total):
    """Fill density and its integral from 0 (INTERVALS + 1,) for the angle of `axis`; return the step."""
    rest = z.size - axis - 1
    concentration = -scale * z[axis]
    end = 0.5 * math.pi
    if concentration * end * end > 0.5 * WIDTH * WIDTH:
        # exp(−c sin²θ) with sin θ ≥ 2θ/π is bounded by the Gaussian of this width.
        end = min(end, WIDTH / math.sqrt(2.0 * concentration) * (1.0 + 0.5 * WIDTH * WIDTH / concentration))
    step = end / INTERVALS
    for j in range(INTERVALS + 1):
        sine, cosine = math.sin(j * step), math.cos(j * step)
        value = math.exp(-concentration * sine * sine)
        if rest > 1:
            value *= _normalizer(z, axis + 1, scale * cosine * cosine)
            for _ in range(rest - 1):
                value *= cosine
        density[j] = value
    total[0] = 0.0
    for j in range(INTERVALS):
        total[j + 1] = total[j] + 0.5 * step * (density[j] + density[j + 1])
    return step


@compiled()
def _quantile(density, total, step, share):
    """Angle at which the tabulated integral reaches the share of the whole."""
    target = share * total[INTERVALS]
    low, high = 0, INTERVALS
    while high - low > 1:
        middle = (low + high) // 2
        if total[middle] <= target:
            low = middle
        else:
            high = middle
    # density is a + (b − a) t on the interval: a t + (b − a) t²/2 = left/step, in the form without cancellation.
    a, b = density[low], density[low + 1]
    left = (target - total[low]) / step
    root = math.sqrt(max(a * a + 2.0 * (b - a) * left, 0.0))
    t = 2.0 * left / (a + root) if a + root > 0.0 else 0.0
    return (low + min(t, 1.0)) * step


@compiled()
def transport(normal, pairs, z, out):
    """Write unit vectors (m, d), last entry ≥ 0, for standard normal points (m, d−1) and z (d,) ascending, z[d−1] = 0.

    The last `pairs` rows of normal are the negatives of the first: only the signs of their images differ.
    """
    m, n = normal.shape
    density, total = np.empty(INTERVALS + 1), np.empty(INTERVALS + 1)
    first_density, first_total = np.empty(INTERVALS + 1), np.empty(INTERVALS + 1)
    first_step = _tabulate(z, 0, 1.0, first_density, first_total)
    for i in range(m - pairs):
        rho = 1.0
        for axis in range(n):
            s = normal[i, axis]
            share = math.erf(abs(s) / math.sqrt(2.0))
            if axis == 0:
                angle = _quantile(first_density, first_total, first_step, share)
            else:
                step = _tabulate(z, axis, rho * rho, density, total)
                angle = _quantile(density, total, step, share)
            out[i, axis] = math.copysign(rho * math.sin(angle), s)
            rho *= math.cos(angle)
        out[i, n] = rho
    for i in range(pairs):
        for axis in range(n):
            out[m - pairs + i, axis] = -out[i, axis]
        out[m - pairs + i, n] = out[i, n]
