"""Inverse of the moment map: concentrations z with ∇ log F(z) = ω, by Newton's method.

z·ω − log F(z) is concave, so the solution is unique up to the additive constant fixed by max z = 0. Newton runs on
v with zᵢ = 1/(2 v_d) − 1/(2 vᵢ), where d marks the largest moment: at high concentration ωᵢ ≈ vᵢ and near uniform
ω is linear in v, so v is almost the answer in both limits. The start is the second-order saddlepoint relation
vᵢ ∝ ωᵢ / (1 + 2(ωᵢ S₃/S₂² − ωᵢ²/S₂)), S_k = Σ ωᵏ; three evaluations reach rounding error over all spectra.

Every function here wants ω ascending and gives z in the same order, exactly sorted, its last entry 0.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.linalg import solve
from bingham.kernels.numpy_rule import LOG_FRONT, MAX_EVALUATIONS, RULE_DIMENSION, TOLERANCE
from bingham.kernels.parabola import derivatives
from bingham.kernels.rule import WEIGHTS_I, WEIGHTS_R, moments_2, sums_4

__all__ = ["newton", "newton_2", "newton_4"]


@compiled()
def _start(w, v):
    """Write the saddlepoint start v (d,) for moments w (d,)."""
    s2 = s3 = total = 0.0
    for i in range(w.size):
        s2 += w[i] * w[i]
        s3 += w[i] * w[i] * w[i]
    s2 = 1.0 / s2
    s3 *= s2 * s2
    for i in range(w.size):
        v[i] = w[i] / (1.0 + 2.0 * w[i] * (s3 - w[i] * s2))
        total += v[i]
    total = 1.0 / total
    for i in range(w.size):
        v[i] *= total


@compiled(inline=True)
def _move(v, step):
    """Newton step in v that stays positive."""
    return v + step if step > -0.9 * v else 0.1 * v


@compiled(inner=True)
def newton_4(w, z, d, terms):
    """Solve ∇ log F(z) = w for d ≤ 4; w (4,) in, z (4,) out, for d < 4 with zeros in the places d − 1 … 2.

    terms (88,) is scratch. Returns (log F, evaluations); evaluations is negative if the tolerance was not reached.
    """
    _start(w, z)
    v0, v1, v2, vd = z[0], z[1], z[2], z[3]
    if d < 4:
        v2 = vd
    if d < 3:
        v1 = vd
    cr, ci = WEIGHTS_R[d - 2], WEIGHTS_I[d - 2]
    top = 0.5 / vd
    for evaluation in range(1, MAX_EVALUATIONS + 1):
        z0, z1, z2 = top - 0.5 / v0, top - 0.5 / v1, top - 0.5 / v2
        f, g0, g1, g2, _, h00, h01, h02, h11, h12, h22 = sums_4(z0, z1, z2, d, cr, ci, terms)
        r0, r1, r2 = w[0] - g0, w[1] - g1, w[2] - g2
        if d < 4:
            r2, h02, h12, h22 = 0.0, 0.0, 0.0, 1.0
        if d < 3:
            r1, h01, h11 = 0.0, 0.0, 1.0
        # H dz = r on the three free entries by LDLᵀ.
        a = 1.0 / h00
        b, c = h01 * a, h02 * a
        e = 1.0 / (h11 - b * h01)
        g = h12 - b * h02
        h = g * e
        y1 = r1 - b * r0
        y2 = r2 - c * r0 - h * y1
        d2 = y2 / (h22 - c * h02 - h * g)
        d1 = y1 * e - h * d2
        d0 = r0 * a - b * d1 - c * d2
        if abs(r0) <= TOLERANCE * w[0] and abs(r1) <= TOLERANCE * w[1] and abs(r2) <= TOLERANCE * w[2]:
            # The last correction is applied to z itself; log F follows from its gradient and Hessian to second order.
            # Rounding must not leave equal entries in the wrong order.
            z[3] = 0.0
            z[2] = min(z2 + d2, 0.0)
            z[1] = min(z1 + d1, z[2])
            z[0] = min(z0 + d0, z[1])
            change = g0 * d0 + g1 * d1 + g2 * d2 + 0.5 * (r0 * d0 + r1 * d1 + r2 * d2)
            return math.log(f) + LOG_FRONT[d - 2] + change, evaluation
        v0 = _move(v0, 2.0 * v0 * v0 * d0)
        v1 = _move(v1, 2.0 * v1 * v1 * d1)
        v2 = _move(v2, 2.0 * v2 * v2 * d2)
    return math.nan, -MAX_EVALUATIONS


@compiled(inner=True)
def newton_2(w1, terms):
    """Solve ω₁(z₁) = w1 ≤ ½ for d = 2; return (z₁, log F, evaluations), evaluations negative if not converged."""
    wd = 1.0 - w1
    s2, s3 = w1 * w1 + wd * wd, w1 * w1 * w1 + wd * wd * wd
    v1 = w1 / (1.0 + 2.0 * (w1 * s3 / (s2 * s2) - w1 * w1 / s2))
    vd = wd / (1.0 + 2.0 * (wd * s3 / (s2 * s2) - wd * wd / s2))
    v1, vd = v1 / (v1 + vd), vd / (v1 + vd)
    for evaluation in range(1, MAX_EVALUATIONS + 1):
        z1 = min(0.5 / vd - 0.5 / v1, 0.0)
        log_f, g, h = moments_2(z1, terms)
        residual = w1 - g
        step = residual / h
        if abs(residual) < TOLERANCE * w1:
            return min(z1 + step, 0.0), log_f + g * step + 0.5 * residual * step, evaluation
        v1 = _move(v1, 2.0 * v1 * v1 * step)
    return math.nan, math.nan, -MAX_EVALUATIONS


@compiled()
def newton(w, z):
    """Solve ∇ log F(z) = w in any dimension; w (d,) in, z (d,) out; returns as `newton_4`."""
    d = w.size
    if d <= RULE_DIMENSION:
        padded, solution = np.zeros(4), np.empty(4)
        for i in range(d):
            padded[i if i < d - 1 else 3] = w[i]
        log_f, evaluations = newton_4(padded, solution, d, np.empty(88))
        for i in range(d):
            z[i] = solution[i if i < d - 1 else 3]
        return log_f, evaluations
    v, r, scale = np.empty(d), np.empty(d - 1), np.empty(d - 1)
    gradient, hessian, a = np.empty(d), np.empty((d, d)), np.empty((d - 1, d - 1))
    _start(w, v)
    for evaluation in range(1, MAX_EVALUATIONS + 1):
        for i in range(d):
            z[i] = 0.5 / v[d - 1] - 0.5 / v[i]
        log_f = derivatives(z, gradient, hessian)
        worst = 0.0
        for i in range(d - 1):
            # Rows and columns scaled by √H_ii: the spectrum of H spans the square of that of ω.
            scale[i] = 1.0 / math.sqrt(hessian[i, i])
            r[i] = (w[i] - gradient[i]) * scale[i]
            worst = max(worst, abs(w[i] - gradient[i]) / w[i])
        for i in range(d - 1):
            for j in range(d - 1):
                a[i, j] = hessian[i, j] * scale[i] * scale[j]
        solve(a, r)
        if worst < TOLERANCE:
            for i in range(d - 2, -1, -1):
                step = r[i] * scale[i]
                log_f += (gradient[i] + 0.5 * (w[i] - gradient[i])) * step
                z[i] = min(z[i] + step, z[i + 1])
            return log_f, evaluation
        for i in range(d - 1):
            v[i] = _move(v[i], 2.0 * v[i] * v[i] * r[i] * scale[i])
    return math.nan, -MAX_EVALUATIONS
