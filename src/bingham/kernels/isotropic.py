"""Isotropic fit, z = (−c, …, −c, 0), of samples on S^{d−1}, d ≤ 4, in one call: moment, mode, c and log F.

On this family the 8-node rule of `kernels.rule` has one variable: with u = s + c and p = (d − 1)/2,
F/(2 π^{d/2}) = Σ Im[c̃ u^{−p}], its derivative by −c is p Σ Im[c̃ u^{−p−1}], the next p (p + 1) Σ Im[c̃ u^{−p−2}],
where c̃ = cₖ sₖ^{−1/2} carries the axis of the mode.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.linalg import diagonalize, diagonalize_4
from bingham.kernels.numpy_rule import LOG_FRONT, NODES, SI, SR, WEIGHTS

__all__ = ["fit_isotropic_one", "fit_isotropic_rows"]

MAX_STEPS = 60
# Squares of lengths further from 1 than this are left to the caller, which says which row it is.
UNIT_SQUARE = 1.9e-6
# Weights of the sums above, and of the mode's own moment, ½ Σ Im[c̃ u^{−p}/s].
FRONT, MODE = WEIGHTS * NODES**-0.5, 0.5 * WEIGHTS * NODES**-1.5
FRONT_R, FRONT_I = np.ascontiguousarray(FRONT.real), np.ascontiguousarray(FRONT.imag)
MODE_R, MODE_I = np.ascontiguousarray(MODE.real), np.ascontiguousarray(MODE.imag)


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
def _sums(c, d, terms):
    """Return F/(2 π^{d/2}), ω = E[1 − (mᵀx)²] and −∂ω/∂c for z = (−c, …, −c, 0); terms (32,) is scratch."""
    for k in range(8):
        a, b = SR[k] + c, SI[k]
        n = 1.0 / (a * a + b * b)
        # v = 1/u lies below the real axis, and so does its principal root r.
        vr, vi = a * n, -b * n
        t = math.sqrt(0.5 * (math.sqrt(n) + abs(vr)))
        o = -0.5 * vi / t
        rr, ri = (t, -o) if vr >= 0.0 else (o, -t)
        tr, ti = (rr, ri) if d != 3 else (vr, vi)
        if d == 4:
            tr, ti = rr * vr - ri * vi, rr * vi + ri * vr
        terms[24 + k] = MODE_R[k] * ti + MODE_I[k] * tr
        tr, ti = FRONT_R[k] * tr - FRONT_I[k] * ti, FRONT_R[k] * ti + FRONT_I[k] * tr
        terms[k] = ti
        tr, ti = tr * vr - ti * vi, tr * vi + ti * vr
        terms[8 + k] = ti
        terms[16 + k] = tr * vi + ti * vr
    for j in range(0, 32, 8):
        even = (terms[j] + terms[j + 4]) + (terms[j + 2] + terms[j + 6])
        terms[j] = even + ((terms[j + 1] + terms[j + 5]) + (terms[j + 3] + terms[j + 7]))
    p = 0.5 * (d - 1)
    f, across = terms[0], p * terms[8]
    # Both moments sum to 1; dividing by the sum removes the common part of the quadrature error.
    across /= across + terms[24]
    return f, across, p * (p + 1.0) * terms[16] / f - across * across


@compiled()
def _concentration(spread, d, terms):
    """Return (c, log F) with E[1 − (mᵀx)²] = spread, by Newton's method on logarithms; c is NaN if it fails."""
    top = 1.0 - spread
    # Lower bound of Sra & Karp (2013), the middle of a few: exact at both ends.
    c = max((0.5 * d * top - 0.5) / (top * spread) * (1.0 + spread / (0.5 * (d - 1))), 0.0)
    for _ in range(MAX_STEPS):
        f, across, slope = _sums(c, d, terms)
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
def _fit_one(x, weights, b, z, rows, terms):
    """Fit one sample x (n, d): write z (d,) and the axes by rows; return (log F, spread). b (d, d) is scratch."""
    d = x.shape[1]
    if d == 2:
        b[0, 0], b[0, 1], b[1, 1], wrong, total = _moments_2(x, weights)
    elif d == 3:
        b[0, 0], b[0, 1], b[0, 2], b[1, 1], b[1, 2], b[2, 2], wrong, total = _moments_3(x, weights)
    else:
        (b[0, 0], b[0, 1], b[0, 2], b[0, 3], b[1, 1], b[1, 2], b[1, 3], b[2, 2], b[2, 3], b[3, 3], wrong,
         total) = _moments_4(x, weights)  # fmt: skip
    rows[:] = 0.0
    trace = 0.0
    for i in range(d):
        rows[i, i] = 1.0
        trace += b[i, i]
    if wrong or not 0.0 < total < math.inf:
        return math.nan, math.nan
    if d == 4:
        diagonalize_4(b, z, rows)
    else:
        diagonalize(b, z, rows)
    spread = 0.0
    for i in range(d - 1):
        spread += max(z[i], 0.0)
    spread = min(spread / trace, 1.0 - 1.0 / d)
    c, log_f = _concentration(spread, d, terms) if spread > 0.0 else (math.nan, math.nan)
    for i in range(d - 1):
        z[i] = -c
    z[d - 1] = 0.0
    return log_f, spread


@compiled()
def fit_isotropic_one(x, weights):
    """Return (z, M, log F, spread) of the isotropic maximum-likelihood fit to unit rows x (n, d), d = 2, 3 or 4.

    weights (n,), or none for equal ones. What needs words is left to the caller, with spread NaN: rows that are no unit
    vectors, and weights without a positive sum. So are a spread of rounding size and a c that is NaN.
    """
    d = x.shape[1]
    z, rows = np.empty(d), np.empty((d, d))
    log_f, spread = _fit_one(x, weights, np.zeros((d, d)), z, rows, np.empty(32))
    return z, rows.T.copy(), log_f, spread


@compiled()
def fit_isotropic_rows(x, weights):
    """Return what `fit_isotropic_one` does, each (m, …), for samples x (m, n, d); weights (m, n), or (0, 0)."""
    m, d = x.shape[0], x.shape[2]
    z, frames, log_f, spread = np.empty((m, d)), np.empty((m, d, d)), np.empty(m), np.empty(m)
    b, rows, terms, none = np.zeros((d, d)), np.empty((d, d)), np.empty(32), np.empty(0)
    for k in range(m):
        log_f[k], spread[k] = _fit_one(x[k], weights[k] if weights.size else none, b, z[k], rows, terms)
        for i in range(d):
            for j in range(d):
                frames[k, i, j] = rows[j, i]
    return z, frames, log_f, spread
