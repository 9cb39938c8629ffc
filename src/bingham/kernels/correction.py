"""Correction of unit vectors on the sphere so that their second moment is a given diagonal matrix.

In whitened coordinates v = W^{-1/2} x, W = diag(w) ascending, the target is Σ v vᵀ/m = I. An upper triangular E moves
every point by v ← v + E v, back on the sphere; to first order the moment C changes by

    E C + C Eᵀ − 2/m Σ v vᵀ (vᵀ W E v),

which is linear in E: Newton's method solves for the E that cancels C − I. Triangular, E adds to a coordinate
multiples of wider ones only. (A symmetric E would also move the mode's coordinate by the narrow ones, which the way
back on the sphere undoes: the two cancel at high concentration, and points without symmetry could not be centred.)
Whitening makes it independent of the concentration.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.linalg import solve

__all__ = ["correct_moments"]

MAX_STEPS = 60
# Residual in units of the moments themselves at which rounding ends the descent.
FLOOR = 5e-15
# Largest entry of E: keeps the linearisation meaningful.
LARGEST_STEP = 0.5


@compiled()
def _residual(v, c):
    """Write the moment of v (m, d) to c (d, d); return max |c − I|."""
    m, d = v.shape
    c[:] = 0.0
    for i in range(m):
        for k in range(d):
            t = v[i, k]
            for l in range(k + 1):
                c[k, l] += t * v[i, l]
    worst = 0.0
    for k in range(d):
        for l in range(k + 1):
            c[k, l] /= m
            c[l, k] = c[k, l]
            worst = max(worst, abs(c[k, l] - (1.0 if k == l else 0.0)))
    return worst


@compiled()
def _move(v, w, e, out):
    """Write (v + E v), returned to Σ w v² = 1, to out."""
    m, d = v.shape
    for i in range(m):
        norm = 0.0
        for k in range(d):
            t = v[i, k]
            for l in range(k, d):
                t += e[k, l] * v[i, l]
            out[i, k] = t
            norm += w[k] * t * t
        norm = 1.0 / math.sqrt(norm)
        for k in range(d):
            out[i, k] *= norm


@compiled()
def correct_moments(points, w):
    """Move unit points (m, d), in place, until Σ x xᵀ/m = diag(w); return (max |C − I|, Newton steps).

    w (d,) positive, sum 1. C is the moment in units of w, so the residual is relative, however small an entry of w.
    """
    m, d = points.shape
    p = d * (d + 1) // 2
    root = np.sqrt(w)
    v = points / root
    trial = np.empty_like(v)
    c, e, halved = np.empty((d, d)), np.zeros((d, d)), np.empty((d, d))
    a, b, product = np.empty((p, p)), np.empty(p), np.empty(p)
    residual = _residual(v, c)
    step = 0
    while step < MAX_STEPS and residual > FLOOR:
        step += 1
        a[:] = 0.0
        for i in range(m):
            q = 0
            for k in range(d):
                for l in range(k + 1):
                    product[q] = v[i, k] * v[i, l]
                    q += 1
            for r in range(p):
                t = product[r]
                for s in range(r + 1):
                    a[r, s] += t * product[s]
        for r in range(p):
            for s in range(r):
                a[s, r] = a[r, s]
        # a holds Σ v v v v; column (k, l) of the linear map takes −2/m times it, weighed by vᵀ W E v, E_{lk} = 1.
        q = 0
        for k in range(d):
            for l in range(k + 1):
                t = -2.0 / m * w[l]
                for r in range(p):
                    a[r, q] *= t
                q += 1
        r = 0
        for k in range(d):
            for l in range(k + 1):
                b[r] = (1.0 if k == l else 0.0) - c[k, l]
                q = 0
                for i in range(d):
                    for j in range(i + 1):
                        # (E C + C Eᵀ)_{kl} for the unit E with entry (j, i).
                        t = 0.0
                        if j == k:
                            t += c[i, l]
                        if j == l:
                            t += c[i, k]
                        a[r, q] += t
                        # E = I moves nothing: fix its multiple, the trace, at zero.
                        if k == l and i == j:
                            a[r, q] += 1.0
                        q += 1
                r += 1
        if not solve(a, b):
            break
        q = 0
        largest = 0.0
        for k in range(d):
            for l in range(k + 1):
                e[l, k] = b[q]
                largest = max(largest, abs(b[q]))
                q += 1
        share = 1.0 if largest <= LARGEST_STEP else LARGEST_STEP / largest
        better = False
        now = residual
        for _ in range(20):
            for k in range(d):
                for l in range(d):
                    halved[k, l] = share * e[k, l]
            _move(v, w, halved, trial)
            now = _residual(trial, c)
            if now < residual:
                better = True
                break
            share *= 0.5
        if not better:
            break
        v, trial = trial, v
        residual = now
    for i in range(m):
        for k in range(d):
            points[i, k] = v[i, k] * root[k]
    return residual, step
