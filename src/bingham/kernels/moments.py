"""Inverse of the moment map: concentrations z with ∇ log F(z) = ω, by Newton's method.

z·ω − log F(z) is concave, so the solution is unique up to the additive constant fixed by max z = 0. Newton runs on
v with zᵢ = 1/(2 v_d) − 1/(2 vᵢ), where d marks the largest moment: at high concentration ωᵢ ≈ vᵢ and near uniform
ω is linear in v, so v is almost the answer in both limits. The start is the second-order saddlepoint relation
vᵢ ∝ ωᵢ / (1 + 2(ωᵢ S₃/S₂² − ωᵢ²/S₂)), S_k = Σ ωᵏ; three evaluations reach rounding error over all spectra.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.normalizer import derivatives_2, scalars_4
from bingham.kernels.rule import log_normalizer_derivatives

__all__ = ["MAX_EVALUATIONS", "concentrations", "concentrations_2", "concentrations_4"]

# Three suffice in practice; more than this many means that ω is no moment of a Bingham distribution.
MAX_EVALUATIONS = 20
# Newton converges quadratically: a residual below this leaves an error at rounding level after the last correction.
TOLERANCE = 1e-6


@compiled()
def _start(w, v):
    """Write the saddlepoint start v (d,) for moments w (d,) and return the index of the largest moment."""
    d = w.size
    s2 = s3 = 0.0
    last = 0
    for i in range(d):
        s2 += w[i] * w[i]
        s3 += w[i] * w[i] * w[i]
        if w[i] > w[last]:
            last = i
    total = 0.0
    for i in range(d):
        v[i] = w[i] / (1.0 + 2.0 * (w[i] * s3 / (s2 * s2) - w[i] * w[i] / s2))
        total += v[i]
    for i in range(d):
        v[i] /= total
    return last


@compiled(inline=True)
def _move(v, step):
    """Newton step in v that stays positive."""
    return v + step if step > -0.9 * v else 0.1 * v


@compiled()
def concentrations_4(w, z):
    """Solve ∇ log F(z) = w for d = 4; w (4,) with its largest entry last, Σw = 1; z (4,) out with z[3] = 0.

    Returns (log F, evaluations); evaluations is negative if the tolerance was not reached.
    """
    # `_start` in scalars: a loop would be vectorised or not, and round otherwise, by where w and z lie in memory.
    w0, w1, w2, w3 = w[0], w[1], w[2], w[3]
    s2 = w0 * w0 + w1 * w1 + w2 * w2 + w3 * w3
    s3 = w0 * w0 * w0 + w1 * w1 * w1 + w2 * w2 * w2 + w3 * w3 * w3
    a, b = 2.0 * s3 / (s2 * s2), 2.0 / s2
    v0 = w0 / (1.0 + w0 * (a - b * w0))
    v1 = w1 / (1.0 + w1 * (a - b * w1))
    v2 = w2 / (1.0 + w2 * (a - b * w2))
    vd = w3 / (1.0 + w3 * (a - b * w3))
    total = v0 + v1 + v2 + vd
    v0, v1, v2, vd = v0 / total, v1 / total, v2 / total, vd / total
    top = 0.5 / vd
    z[3] = 0.0
    for evaluation in range(1, MAX_EVALUATIONS + 1):
        z0, z1, z2 = top - 0.5 / v0, top - 0.5 / v1, top - 0.5 / v2
        f, g0, g1, g2, _, h00, h01, h02, h11, h12, h22 = scalars_4(z0, z1, z2)
        r0, r1, r2 = w0 - g0, w1 - g1, w2 - g2
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
        if abs(r0) < TOLERANCE * w0 and abs(r1) < TOLERANCE * w1 and abs(r2) < TOLERANCE * w2:
            # The last correction is applied to z itself; log F follows from its gradient and Hessian to second order.
            z[0], z[1], z[2] = z0 + d0, z1 + d1, z2 + d2
            return math.log(f) + g0 * d0 + g1 * d1 + g2 * d2 + 0.5 * (r0 * d0 + r1 * d1 + r2 * d2), evaluation
        v0 = _move(v0, 2.0 * v0 * v0 * d0)
        v1 = _move(v1, 2.0 * v1 * v1 * d1)
        v2 = _move(v2, 2.0 * v2 * v2 * d2)
    return math.nan, -MAX_EVALUATIONS


@compiled()
def concentrations_2(w1):
    """Solve ω₁(z₁) = w1 ≤ ½ for d = 2; return (z₁, log F, evaluations), evaluations negative if not converged."""
    s2 = w1 * w1 + (1.0 - w1) * (1.0 - w1)
    s3 = w1 * w1 * w1 + (1.0 - w1) * (1.0 - w1) * (1.0 - w1)
    v1 = w1 / (1.0 + 2.0 * (w1 * s3 / (s2 * s2) - w1 * w1 / s2))
    vd = (1.0 - w1) / (1.0 + 2.0 * ((1.0 - w1) * s3 / (s2 * s2) - (1.0 - w1) * (1.0 - w1) / s2))
    v1, vd = v1 / (v1 + vd), vd / (v1 + vd)
    for evaluation in range(1, MAX_EVALUATIONS + 1):
        z1 = min(0.5 / vd - 0.5 / v1, 0.0)
        log_f, g, h = derivatives_2(z1)
        residual = w1 - g
        step = residual / h
        if abs(residual) < TOLERANCE * w1:
            return min(z1 + step, 0.0), log_f + g * step + 0.5 * residual * step, evaluation
        v1 = _move(v1, 2.0 * v1 * v1 * step)
    return math.nan, math.nan, -MAX_EVALUATIONS


@compiled()
def concentrations(w, z, gradient, hessian):
    """Solve ∇ log F(z) = w for any d; see `concentrations_4`."""
    d = w.size
    v = np.empty(d)
    last = _start(w, v)
    free = np.empty(d - 1, dtype=np.int64)
    k = 0
    for i in range(d):
        if i != last:
            free[k] = i
            k += 1
    a = np.empty((d - 1, d - 1))
    r = np.empty(d - 1)
    for evaluation in range(1, MAX_EVALUATIONS + 1):
        for i in range(d):
            z[i] = 0.5 / v[last] - 0.5 / v[i]
        log_f = log_normalizer_derivatives(z, gradient, hessian)
        worst = 0.0
        for i in range(d - 1):
            # Rows and columns scaled by √H_ii: the spectrum of H spans the square of that of ω.
            p = free[i]
            r[i] = (w[p] - gradient[p]) / math.sqrt(hessian[p, p])
            worst = max(worst, abs(w[p] - gradient[p]) / w[p])
            for j in range(d - 1):
                q = free[j]
                a[i, j] = hessian[p, q] / math.sqrt(hessian[p, p] * hessian[q, q])
        step = np.linalg.solve(a, r)
        change = 0.0
        for i in range(d - 1):
            p = free[i]
            step[i] /= math.sqrt(hessian[p, p])
            change += (gradient[p] + 0.5 * (w[p] - gradient[p])) * step[i]
        if worst < TOLERANCE:
            for i in range(d - 1):
                z[free[i]] += step[i]
            return log_f + change, evaluation
        for i in range(d - 1):
            p = free[i]
            v[p] = _move(v[p], 2.0 * v[p] * v[p] * step[i])
    return math.nan, -MAX_EVALUATIONS
