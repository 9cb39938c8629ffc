"""Isotropic fit, z = (−c, …, −c, 0), of samples on S^{d−1}, d ≤ 4, in one call: moment, mode, c and log F."""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.linalg import diagonalize
from bingham.kernels.numpy_rule import LOG_FRONT
from bingham.kernels.rule import WEIGHTS_I, WEIGHTS_R, sums_4

__all__ = ["fit_isotropic_rows"]

MAX_STEPS = 60
# Squares of lengths further from 1 than this are left to the caller, which says which row it is.
UNIT_SQUARE = 1.9e-6


@compiled(fast=True)
def _moments_2(x, weights):
    """Return Σ w x₁², Σ w x₁x₂, Σ w x₂², how many rows are no unit vectors, and Σ w; no weights stand for ones."""
    aa = ab = bb = total = 0.0
    wrong = 0
    for n in range(x.shape[0]):
        a, b = x[n, 0], x[n, 1]
        square = a * a + b * b
        w = 1.0 if weights.size == 0 else weights[n]
        wrong += not abs(square - 1.0) <= UNIT_SQUARE
        total += w
        w /= square
        aa += w * a * a
        ab += w * a * b
        bb += w * b * b
    return aa, ab, bb, wrong, total


@compiled(fast=True)
def _moments_3(x, weights):
    """Return the six sums of `_moments_2` for d = 3, upper triangle by rows, then as there."""
    aa = ab = ac = bb = bc = cc = total = 0.0
    wrong = 0
    for n in range(x.shape[0]):
        a, b, c = x[n, 0], x[n, 1], x[n, 2]
        square = a * a + b * b + c * c
        w = 1.0 if weights.size == 0 else weights[n]
        wrong += not abs(square - 1.0) <= UNIT_SQUARE
        total += w
        w /= square
        aa += w * a * a
        ab += w * a * b
        ac += w * a * c
        bb += w * b * b
        bc += w * b * c
        cc += w * c * c
    return aa, ab, ac, bb, bc, cc, wrong, total


@compiled(fast=True)
def _moments_4(x, weights):
    """Return the ten sums of `_moments_2` for d = 4, upper triangle by rows, then as there."""
    aa = ab = ac = ad = bb = bc = bd = cc = cd = dd = total = 0.0
    wrong = 0
    for n in range(x.shape[0]):
        a, b, c, d = x[n, 0], x[n, 1], x[n, 2], x[n, 3]
        square = a * a + b * b + c * c + d * d
        w = 1.0 if weights.size == 0 else weights[n]
        wrong += not abs(square - 1.0) <= UNIT_SQUARE
        total += w
        w /= square
        aa += w * a * a
        ab += w * a * b
        ac += w * a * c
        ad += w * a * d
        bb += w * b * b
        bc += w * b * c
        bd += w * b * d
        cc += w * c * c
        cd += w * c * d
        dd += w * d * d
    return aa, ab, ac, ad, bb, bc, bd, cc, cd, dd, wrong, total


@compiled()
def _concentration(spread, d, terms):
    """Return (c, log F) with E[1 − (mᵀx)²] = spread, by Newton's method on logarithms; c is NaN if it fails."""
    top = 1.0 - spread
    # Lower bound of Sra & Karp (2013), the middle of a few: exact at both ends.
    c = max((0.5 * d * top - 0.5) / (top * spread) * (1.0 + spread / (0.5 * (d - 1))), 0.0)
    cr, ci = WEIGHTS_R[d - 2], WEIGHTS_I[d - 2]
    for _ in range(MAX_STEPS):
        z1, z2 = (-c if d > 2 else 0.0), (-c if d > 3 else 0.0)
        f, across, g1, g2, _, slope, h01, h02, h11, h12, h22 = sums_4(-c, z1, z2, d, cr, ci, terms)
        if d > 2:
            across, slope = across + g1, slope + h11 + 2.0 * h01
        if d > 3:
            across, slope = across + g2, slope + h22 + 2.0 * (h02 + h12)
        if c <= 1e-8:
            return c, math.log(f) + LOG_FRONT[d - 2]
        # d log(spread)/d log c = −slope c/spread.
        step = max(-1.0, min(1.0, math.log(across / spread) * across / (slope * c)))
        if abs(step) < 1e-9 + 4e-16 / (slope * c):
            # The last step, so small that its square is below rounding; log F follows to second order.
            change = c * math.expm1(step)
            return c + change, math.log(f) + LOG_FRONT[d - 2] - across * change + 0.5 * slope * change * change
        c *= math.exp(step)
    return math.nan, math.nan


@compiled()
def fit_isotropic_rows(x, weights):
    """Return (z, M, log F, spread) of the isotropic maximum-likelihood fit to unit rows x (n, d), d = 2, 3 or 4.

    weights (n,), or none for equal ones. What needs words is left to the caller, with spread NaN: rows that are no unit
    vectors, and weights without a positive sum. A spread of rounding size and a c that is NaN are the caller's, too.
    """
    d = x.shape[1]
    b = np.zeros((d, d))
    if d == 2:
        b[0, 0], b[0, 1], b[1, 1], wrong, total = _moments_2(x, weights)
    elif d == 3:
        b[0, 0], b[0, 1], b[0, 2], b[1, 1], b[1, 2], b[2, 2], wrong, total = _moments_3(x, weights)
    else:
        (b[0, 0], b[0, 1], b[0, 2], b[0, 3], b[1, 1], b[1, 2], b[1, 3], b[2, 2], b[2, 3], b[3, 3], wrong,
         total) = _moments_4(x, weights)  # fmt: skip
    z, frame = np.empty(d), np.eye(d)
    if wrong or not 0.0 < total < math.inf:
        return z, frame, math.nan, math.nan
    trace = 0.0
    for i in range(d):
        trace += b[i, i]
    diagonalize(b, z, frame)
    spread = 0.0
    for i in range(d - 1):
        spread += max(z[i], 0.0)
    spread = min(spread / trace, 1.0 - 1.0 / d)
    c, log_f = _concentration(spread, d, np.empty(88)) if spread > 0.0 else (math.nan, math.nan)
    for i in range(d - 1):
        z[i] = -c
    z[d - 1] = 0.0
    return z, frame.T.copy(), log_f, spread
