"""Optimal equally weighted point sets of the standard normal (localized cumulative distributions)."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import ConvergenceError, InvalidArgumentError
from bingham.sampling.cache import cached_array

__all__ = ["distance", "standard_normal_points"]

FloatArray = NDArray[np.float64]

# Largest kernel width B of the distance; wide enough for every scale of a standard normal.
REACH = 10.0
# Nodes of the rule over b: its integrand is analytic in y with √2 b = sinh y, so this is exact to rounding.
RULE_SIZE = 64
# Relative fall of D in a step of the descent at which it ends.
FLAT = 1e-8
# Changes when the same (n, m) would give other points.
VERSION = 1


@lru_cache(maxsize=16)
def _rule(n: int) -> tuple[float, FloatArray, FloatArray]:
    """Return D₁ and the nodes and weights of D₂ (see ``kernels.lcd``)."""
    x, w = (np.asarray(a, dtype=np.float64) for a in np.polynomial.legendre.leggauss(RULE_SIZE))

    def on(end: float) -> tuple[FloatArray, FloatArray]:
        return 0.5 * end * (x + 1.0), 0.5 * end * w

    y, v = on(math.asinh(REACH))
    first = float(np.sum(v * np.sinh(y) ** (n + 1) * np.cosh(y) ** (1 - n)))
    y, v = on(math.asinh(math.sqrt(2.0) * REACH))
    b = np.sinh(y) / math.sqrt(2.0)
    weights = v * np.cosh(y) / math.sqrt(2.0) * b ** (n + 1) * np.cosh(y) ** (-n)
    return first, 0.5 / np.cosh(y) ** 2, weights


def distance(points: FloatArray, *, symmetric: bool = False, middle: int = 0) -> tuple[float, FloatArray]:
    """Return the modified Cramér–von Mises distance D of equally weighted points to N(0, I) and ∂D/∂points (p, n).

    D = ∫₀^B b^{1−n} ∫ (F̂(r, b) − F(r, b))² dr db with B = 10 (Li et al. 2019, eq. 6). The set consists of `points`
    (p, n), their negatives if `symmetric`, and `middle` points at 0.
    """
    from bingham.kernels.lcd import lcd_distance

    rows = np.ascontiguousarray(points, dtype=np.float64)
    gradient = np.empty_like(rows)
    return float(lcd_distance(rows, symmetric, middle, REACH, *_rule(rows.shape[1]), gradient)), gradient


def _whiten(free: FloatArray, share: float) -> tuple[FloatArray, FloatArray]:
    """Return points·L⁻ᵀ and L⁻¹ with L Lᵀ = share · Σ x xᵀ."""
    inverse = np.asarray(np.linalg.inv(np.linalg.cholesky(share * (free.T @ free))), dtype=np.float64)
    return free @ inverse.T, inverse


def _start(n: int, count: int) -> FloatArray:
    """Return standard normal quantiles (count, n) of an additive recurrence, evenly spread (Roberts' sequence)."""
    from scipy.special import ndtri

    ratio = 2.0
    for _ in range(60):
        ratio = (1.0 + ratio) ** (1.0 / (n + 1))
    steps = ratio ** -np.arange(1.0, n + 1)
    u = (0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0
    return ndtri(u)


def _optimize(n: int, m: int, symmetric: bool) -> FloatArray:
    """Minimise D over point sets with mean 0 and moment I by L-BFGS.

    The constraint is eliminated: D is taken of the whitened points, and since whitening undoes every linear map, the
    gradient at y is that at the whitened x, less its part that changes the moment, times L⁻¹.
    """
    from scipy.optimize import minimize

    count = m // 2 if symmetric else m
    share = 2.0 / m if symmetric else 1.0 / m
    middle = m % 2 if symmetric else 0

    def constrained(flat: FloatArray) -> tuple[FloatArray, FloatArray]:
        y = flat.reshape(count, n)
        return _whiten(y if symmetric else y - y.mean(axis=0), share)

    def objective(flat: FloatArray) -> tuple[float, FloatArray]:
        x, inverse = constrained(flat)
        value, slope = distance(x, symmetric=symmetric, middle=middle)
        mixed = share * (x.T @ slope)
        slope = (slope - x @ (0.5 * (mixed + mixed.T))) @ inverse
        return value, (slope if symmetric else slope - slope.mean(axis=0)).ravel()

    start = _start(n, m)
    if symmetric:
        # One of each pair: the half-space of positive first coordinate, evenly filled.
        start = start[np.argsort(-start[:, 0], kind="stable")][:count]
    options = {"maxiter": 2000, "maxfun": 3000, "ftol": FLAT, "gtol": 0.0, "maxcor": 30}
    result: Any = minimize(objective, start.ravel(), jac=True, method="L-BFGS-B", options=options)
    if not np.isfinite(result.fun):
        raise ConvergenceError(f"point set of n = {n}, m = {m}: {result.message}", result.x)
    x = constrained(result.x)[0]
    return np.concatenate([x, np.zeros((middle, n)), -x]) if symmetric else x


def _has_unit_moment(points: FloatArray, m: int, n: int) -> bool:
    return points.shape == (m, n) and bool(np.abs(points.T @ points / m - np.eye(n)).max() < 1e-12)


@lru_cache(maxsize=64)
def standard_normal_points(n: int, m: int, *, symmetric: bool = True) -> FloatArray:
    """Return m points (m, n) with Σx = 0 and Σ x xᵀ/m = I of minimum distance D to the standard normal.

    Computed once for each (n, m) and kept on disk (``BINGHAM_CACHE`` names the folder). The array is read-only.

    Parameters
    ----------
    n, m : int
        Dimension and number of points; m ≥ 2n when symmetric, else m ≥ n + 1.
    symmetric : bool
        Whether −x is a point when x is; an odd m then has a point at 0.

    Raises
    ------
    InvalidArgumentError
        If m is too small for a unit moment.

    References
    ----------
    Hanebeck, Huber & Klumpp, CDC 2009; Gilitschenski & Hanebeck, ACC 2013 (distance, constraint).
    """
    minimum = 2 * n if symmetric else n + 1
    if n < 1 or m < minimum:
        raise InvalidArgumentError("m", f"at least {minimum} points in dimension {n}", m)
    kind = "symmetric" if symmetric else "free"
    points = cached_array(f"normal-{kind}-{n}-{m}-v{VERSION}", lambda: _optimize(n, m, symmetric),
                          lambda a: _has_unit_moment(a, m, n))  # fmt: skip
    points.flags.writeable = False
    return points
