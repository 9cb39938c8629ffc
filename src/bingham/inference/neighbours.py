"""A concentration's likelihood ratio where others are near.

The signed root R of the profile of one concentration zₖ (`bingham.distributions.marginal`) tends to a standard normal
variable for large samples whose concentrations are far apart. Two corrections hold for small samples and for
concentrations that nearly agree.

**Skewness.** R has the mean −γ/(6√n) to first order, γ the skewness of the sufficient statistic xₖ² at the tested
concentrations; it is taken back. In the limit of narrow distributions that is the signed root of a gamma law.

**Repulsion.** Sample eigenvalues repel each other, and their order is known; R is neither centred nor of unit variance
where the gap to a neighbour, in standard deviations of the difference of two eigenvalues over √2,

    g² = n (zⱼ₊₁ − zⱼ)(ωⱼ₊₁ − ωⱼ)/2,

is below 3. How far depends on the true gaps, which no sample tells. `LIMITS` hold R as functions of the sample's gaps,
such that it stays within them with a probability near 0.95 whatever the true gaps are: least deviation, between 0.928
and 0.968, over 72 sets of gaps of two and three concentrations in the limit of narrow distributions, for 10, 16, 40 and
infinitely many axes (``benchmarks/neighbours.py`` checks them and finds such ones).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.marginal import marginal_maximum
from bingham.distributions.normalizer import log_normalizer_derivatives

__all__ = ["KNOTS", "LIMITS", "NORMAL", "cells", "gaps", "limits", "pivot", "profile_root"]

FloatArray = NDArray[np.float64]

NORMAL = 1.959963984540054
# The 95 % point of R over NORMAL for two equal concentrations, one of them known: the exact law for narrow ones.
ONE_SIDED = 0.80
KNOTS = np.array([0.0, 1.0, 2.0, 3.0, 4.5])
# By the place of the concentration among those but the mode's: limits of R above zero (an interval's lower end)
# and below. Rows are the gap to its neighbour, columns the next one's beyond; between two neighbours rows are the gap
# to the steeper one, columns to the flatter one.
LIMITS: dict[str, FloatArray] = {
    "steepest": np.array(
        [
            [
                (0.78, 0.74, 1.19, 0.81, 0.79),
                (2.49, 2.54, 2.34, 2.18, 2.31),
                (2.51, 2.05, 1.92, 2.12, 2.13),
                (2.32, 1.95, 1.81, 1.92, 1.96),
                (2.22, 2.14, 2.05, 2.01, 1.96),
            ],
            [
                (2.50, 2.12, 1.70, 1.99, 2.50),
                (2.50, 2.06, 1.32, 1.92, 2.29),
                (2.42, 1.94, 1.69, 1.96, 1.75),
                (2.29, 2.12, 1.81, 1.76, 1.82),
                (1.86, 1.99, 1.97, 2.01, 1.96),
            ],
        ]
    ),
    "between": np.array(
        [
            [
                (0.75, 0.73, 2.24, 2.51, 2.50),
                (1.89, 2.56, 2.52, 2.33, 2.38),
                (1.02, 2.53, 2.06, 1.51, 1.91),
                (0.66, 2.00, 1.97, 1.44, 2.05),
                (0.64, 1.93, 2.11, 1.67, 1.96),
            ],
            [
                (0.72, 0.78, 2.05, 0.67, 0.67),
                (0.71, 2.51, 2.57, 1.99, 2.27),
                (1.70, 2.40, 2.31, 2.35, 2.42),
                (1.71, 1.60, 1.96, 2.16, 2.07),
                (2.36, 2.03, 1.83, 1.96, 1.96),
            ],
        ]
    ),
    "flattest": np.array(
        [
            [
                (2.51, 2.52, 2.51, 2.52, 2.52),
                (2.50, 2.48, 2.52, 2.52, 2.52),
                (1.83, 0.83, 2.01, 1.66, 1.61),
                (1.53, 1.68, 1.79, 1.67, 1.75),
                (1.49, 1.91, 1.90, 1.89, 1.96),
            ],
            [
                (2.51, 2.53, 1.43, 0.78, 0.77),
                (2.53, 2.56, 2.29, 2.25, 2.34),
                (2.48, 2.22, 2.08, 2.21, 2.13),
                (2.30, 2.03, 1.96, 2.02, 1.96),
                (2.20, 2.13, 2.05, 1.99, 1.96),
            ],
        ]
    ),
}


def gaps(z: FloatArray, w: FloatArray, n: int) -> FloatArray:
    """Return g (R, d − 2), the gaps between the concentrations z (R, d) but the mode's; w (R, d) are their moments."""
    return np.sqrt(np.maximum(0.5 * n * np.diff(z[:, :-1], axis=-1) * np.diff(w[:, :-1], axis=-1), 0.0))


def limits(k: int, g: FloatArray) -> FloatArray:
    """Return the limits (2, R) of R for the k-th concentration among gaps g (R, d − 2), above and below zero."""
    last = g.shape[-1]
    if last == 0:
        return np.full((2, len(g)), NORMAL)
    far = np.full(len(g), np.inf)
    if 0 < k < last:
        return _between(LIMITS["between"], g[:, k - 1], g[:, k])
    if k == 0:
        return _between(LIMITS["steepest"], g[:, 0], g[:, 1] if last > 1 else far)
    return _between(LIMITS["flattest"], g[:, -1], g[:, -2] if last > 1 else far)


def _between(table: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """Return `table` (2, 5, 5) at gaps a, b (R,): linear in each between the knots, constant beyond."""
    i, s = cells(a)
    j, t = cells(b)
    lower = (1.0 - t) * table[:, i, j] + t * table[:, i, j + 1]
    upper = (1.0 - t) * table[:, i + 1, j] + t * table[:, i + 1, j + 1]
    return (1.0 - s) * lower + s * upper


def cells(gap: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the knots (R,) below gaps (R,) by their index, and how far on they are to the next, 0 to 1."""
    clipped = np.minimum(gap, KNOTS[-1])
    i = np.clip(np.searchsorted(KNOTS, clipped, side="right") - 1, 0, len(KNOTS) - 2)
    return i, (clipped - KNOTS[i]) / (KNOTS[i + 1] - KNOTS[i])


def profile_root(
    k: int, c: FloatArray, z: FloatArray, w: FloatArray, n: int, best: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return R (R,) of zₖ = c (R,), positive where the estimate is above c, and the z (R, d) fitted under it.

    z (R, d) maximises the marginal likelihood of moments w (R, d) of n axes, whose logarithm is `best` (R,) there.
    """
    low, high = np.full_like(z, -np.inf), np.zeros_like(z)
    high[:, :k] = c[:, None]
    low[:, k:] = c[:, None]
    high[:, k] = c
    low[:, -1] = 0.0
    fitted, value = marginal_maximum(w, n, z, low, high)
    return np.sqrt(np.maximum(2.0 * (best - value), 0.0)) * np.sign(z[:, k] - c), fitted


def pivot(
    k: int, c: FloatArray, z: FloatArray, w: FloatArray, n: int, best: FloatArray, bounds: FloatArray
) -> FloatArray:
    """Return t (R,), about standard normal where c (R,) is the true zₖ; it falls as c rises.

    `bounds` (2, R) are the sample's `limits`, other arguments as for `profile_root`.
    """
    root, fitted = profile_root(k, c, z, w, n, best)
    moments, covariance = log_normalizer_derivatives(fitted)[1:]
    # γ from the cumulants of xₖ², the derivatives of log F along zₖ; the third by differences of the second.
    step = np.zeros_like(z)
    step[:, k] = 1e-3 * (1.0 - c)
    upper, lower = (log_normalizer_derivatives(fitted + side * step)[2][:, k, k] for side in (1.0, -1.0))
    third = (upper - lower) / (2.0 * step[:, k])
    root = root + third / covariance[:, k, k] ** 1.5 / (6.0 * np.sqrt(n))
    above, below = bounds
    if k == z.shape[-1] - 2:
        # So near to the mode's 0 no sample has R above its limit, and all the error may be below.
        gap = np.sqrt(np.maximum(-0.5 * n * c * (moments[:, -1] - moments[:, k]), 0.0))
        below = below * (ONE_SIDED + (1.0 - ONE_SIDED) * np.clip(gap - 0.6, 0.0, 1.0))
    return root * NORMAL / np.where(root > 0.0, above, below)
