"""Plain double-precision ways to the Bingham normaliser from the literature: slower or coarser than the library's.

Tests hold the library against them and benchmarks time them beside it. Each function takes one spectrum z (d,), any
order, and returns (log F, ω) with ω = ∇ log F the moments. Accuracy, where the tests check it:

============== ===== ============================ ==================
function       d     range                        relative error
============== ===== ============================ ==================
bessel         2     |z| ≤ 100 (moments cancel)   1e-12
wood           4     |z| ≤ 1e6                    1e-11
series         any   max z − min z ≤ 1000         1e-12
saddlepoint    any   any                          5e-2 … 1e-3
============== ===== ============================ ==================
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import quad
from scipy.special import gammaln, ive

Result = tuple[float, NDArray[np.float64]]


def by_dimension_raising(z: ArrayLike, log_normalizer: Callable[[NDArray[np.float64]], float]) -> Result:
    """Moments from ∂F_d/∂zᵢ = F_{d+2}(z with zᵢ twice more)/(2π) (Kume & Wood 2007)."""
    x = np.asarray(z, dtype=float)
    log_f = log_normalizer(x)
    raised = [log_normalizer(np.append(x, [v, v])) for v in x]
    return log_f, np.exp(np.array(raised) - log_f) / (2 * math.pi)


def bessel(z: ArrayLike) -> Result:
    """d = 2: F = 2π I₀((z₁−z₂)/2) e^{(z₁+z₂)/2} and its derivatives (Kurz et al. 2014, eq. 77 to 79)."""
    z1, z2 = np.asarray(z, dtype=float)
    x = (z1 - z2) / 2
    i0, i1 = ive(0, x), ive(1, x)
    # the scaled I₀ lacks e^{|x|}, and |x| + (z₁+z₂)/2 = max z
    return math.log(2 * math.pi * i0) + max(z1, z2), np.array([i0 + i1, i0 - i1]) / (2 * i0)


def wood(z: ArrayLike) -> Result:
    """d = 4: F = 2π² ∫₀¹ B(t; z₁, z₂) B(1−t; z₃, z₄) dt, B(t; a, b) = e^{t(a+b)/2} I₀(t(a−b)/2) (Wood 1993).

    The sphere S³ is sliced into products of circles of squared radii t and 1 − t.
    """
    given = np.asarray(z, dtype=float)
    order = np.argsort(given)
    x = given[order] - given.max()
    width = 1 / max(1.0, -x[0])

    def slices(t: float, u: float, k: int) -> float:
        p, q = t * (x[1] - x[0]) / 2, u * (x[3] - x[2]) / 2
        if k < 0:
            left, right = ive(0, p), ive(0, q)
        elif k < 2:
            left, right = t / 2 * (ive(0, p) + (-1, 1)[k] * ive(1, p)), ive(0, q)
        else:
            left, right = ive(0, p), u / 2 * (ive(0, q) + (-1, 1)[k - 2] * ive(1, q))
        return left * right * math.exp(t * x[1] + u * x[3])

    # The integrand lives within a few `width` of t = 0 at high concentration.
    edges = np.unique(np.clip([0.0, *(width * 10.0 ** np.arange(-1, 13)), 1.0], 0, 1))

    def integral(k: int) -> float:
        pieces = pairwise(edges)
        return sum(quad(lambda t: slices(t, 1 - t, k), a, b, epsabs=0, epsrel=1e-13, limit=200)[0] for a, b in pieces)

    value = integral(-1)
    moments = np.empty(4)
    moments[order] = [integral(k) / value for k in range(4)]
    return math.log(2 * math.pi**2 * value) + given.max(), moments


def series(z: ArrayLike) -> Result:
    """Any d: Glover & Kaelbling 2013, eq. 8 (Kurz et al. 2014, eq. 9), shifted to positive terms, summed by degree.

    With λ = z − min z ≥ 0, F = 2 π^{d/2} e^{min z} Σₙ aₙ/Γ(n + d/2), where Σ aₙ xⁿ = ∏ (1 − λᵢ x)^{−1/2}; from its
    logarithm, n aₙ = ½ Σ_{k=1}^n p_k a_{n−k} with power sums p_k = Σᵢ λᵢᵏ.
    """
    return by_dimension_raising(z, _series)


def _series(z: NDArray[np.float64]) -> float:
    d, low = z.size, z.min()
    top = float(z.max() - low)
    constant = math.log(2) + d / 2 * math.log(math.pi) + low
    if top == 0:
        return constant - float(gammaln(d / 2))
    terms = int(top + 12 * math.sqrt(top) + 60)
    powers = np.cumprod(np.tile((z - low) / top, (terms, 1)), axis=0).sum(axis=1)
    a = np.ones(terms)
    for n in range(1, terms):
        a[n] = 0.5 / n * np.dot(powers[:n], a[n - 1 :: -1])
    n = np.arange(terms)
    logs = n * math.log(top) + np.log(a) - gammaln(n + d / 2)
    peak = logs.max()
    return constant + float(peak + np.log(np.exp(logs - peak).sum()))


def saddlepoint(z: ArrayLike) -> Result:
    """Any d: second-order saddlepoint approximation c₃ (Kume & Wood 2005), moments by their rule of 2007."""
    return by_dimension_raising(z, _saddlepoint)


def _saddlepoint(z: NDArray[np.float64]) -> float:
    d, top = z.size, z.max()
    x = z - top
    s = 0.5
    for _ in range(200):  # K'(s) = 1 by Newton on 1/K', concave and increasing: from the left it never overshoots
        inverse = 1 / (s - x)
        first = inverse.sum() / 2
        step = first * (first - 1) / ((inverse**2).sum() / 2)
        s += step
        if abs(step) < 1e-14 * s:
            break
    k2, k3, k4 = (math.factorial(j - 1) / 2 * float((1 / (s - x) ** j).sum()) for j in (2, 3, 4))
    correction = k4 / k2**2 / 8 - 5 * k3**2 / k2**3 / 24
    leading = (
        0.5 * math.log(2) + (d - 1) / 2 * math.log(math.pi) - 0.5 * math.log(k2) - 0.5 * float(np.log(s - x).sum())
    )
    return leading + s + correction + top
