"""Normaliser, its derivatives and their inverse over batches (n, d): one row after the other, or one to each lane.

For d ≤ 4 the sums of `rule.sums_4` are written so that the compiler vectorises over spectra instead of nodes: no sums
across lanes, no scalar tail. The rows of one flat work array, ``LANES`` entries each, hold z₀ z₁ z₂, F, ω and the
upper triangle of the Hessian; constant offsets within one array prove to the compiler that rows do not overlap.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.fma import fma
from bingham.kernels.linalg import diagonalize_4, orthonormalize_4
from bingham.kernels.newton import newton, newton_4
from bingham.kernels.numpy_rule import LARGEST, LOG_FRONT, SI, SR
from bingham.kernels.parabola import derivatives
from bingham.kernels.rule import WEIGHTS_I, WEIGHTS_R, node_4

__all__ = ["derivatives_lanes", "derivatives_rows", "diagonalize_rows_4", "newton_rows", "newton_rows_4"]

LANES = 16
ROWS = 14
# Offsets of the rows.
F, G0, G1, G2, G3 = 3 * LANES, 4 * LANES, 5 * LANES, 6 * LANES, 7 * LANES
H00, H01, H02, H11, H12, H22 = 8 * LANES, 9 * LANES, 10 * LANES, 11 * LANES, 12 * LANES, 13 * LANES


@compiled(fast=True)
def _block(w, d):
    """Fill all rows of w (ROWS·LANES,) but the first three: F, ω, upper 3×3 triangle of the Hessian of log F.

    Entries of the axes that d < 4 does not have are 0.
    """
    w[F:] = 0.0
    for k in range(SR.size):
        sr, si, cr, ci = SR[k], SI[k], WEIGHTS_R[d - 2, k], WEIGHTS_I[d - 2, k]
        for i in range(LANES):
            t, t0, t1, t2, t3, t00, t01, t02, t11, t12, t22 = node_4(
                sr, si, cr, ci, w[i], w[LANES + i], w[2 * LANES + i]
            )
            w[F + i] += t
            w[G0 + i] += t0
            w[G1 + i] += t1
            w[G2 + i] += t2
            w[G3 + i] += t3
            w[H00 + i] += t00
            w[H01 + i] += t01
            w[H02 + i] += t02
            w[H11 + i] += t11
            w[H12 + i] += t12
            w[H22 + i] += t22
    one, two = 1.0 if d > 2 else 0.0, 1.0 if d > 3 else 0.0
    for i in range(LANES):
        n = 1.0 / (w[G0 + i] + one * w[G1 + i] + two * w[G2 + i] + w[G3 + i])
        g0, g1, g2 = w[G0 + i] * n, w[G1 + i] * n * one, w[G2 + i] * n * two
        w[G0 + i], w[G1 + i], w[G2 + i], w[G3 + i] = g0, g1, g2, w[G3 + i] * n
        n = 0.25 / w[F + i]
        w[H00 + i] = fma(3.0 * n, w[H00 + i], -(g0 * g0))
        w[H11 + i] = fma(3.0 * n, w[H11 + i], -(g1 * g1)) * one
        w[H22 + i] = fma(3.0 * n, w[H22 + i], -(g2 * g2)) * two
        w[H01 + i] = fma(n, w[H01 + i], -(g0 * g1)) * one
        w[H02 + i] = fma(n, w[H02 + i], -(g0 * g2)) * two
        w[H12 + i] = fma(n, w[H12 + i], -(g1 * g2)) * two


@compiled(fast=True)
def derivatives_lanes(z, log_f, gradient, hessian):
    """For each row of z (n, d), d ≤ 4, any order and offset: log F (n,), ω (n, d), its Hessian (n, d, d), all written.

    Returns the first row that is not finite or spans more than `LARGEST`, or −1.
    """
    d = z.shape[1]
    w = np.empty(ROWS * LANES)
    largest, tops = np.empty(LANES, dtype=np.int64), np.empty(LANES)
    for start in range(0, z.shape[0], LANES):
        size = min(LANES, z.shape[0] - start)
        w[: 3 * LANES] = 0.0
        for i in range(size):
            k = start + i
            z0 = z1 = z2 = z3 = 0.0
            if d == 4:  # without jumps
                z0, z1, z2, z3 = z[k, 0], z[k, 1], z[k, 2], z[k, 3]
                total = z0 + z1 + z2 + z3
                top, low = max(max(z0, z1), max(z2, z3)), min(min(z0, z1), min(z2, z3))
                j = 0 if z0 == top else 1 if z1 == top else 2 if z2 == top else 3
            else:
                j = d - 1
                top = low = z[k, j]
                total = 0.0
                for m in range(d):
                    if z[k, m] > top:
                        j, top = m, z[k, m]
                    low = min(low, z[k, m])
                    total += z[k, m]
            if math.isnan(total) or not low - top >= -LARGEST:
                return k
            tops[i], largest[i] = top, j
            if d == 4:
                w[i] = (z3 if j == 0 else z0) - top
                w[LANES + i] = (z3 if j == 1 else z1) - top
                w[2 * LANES + i] = (z3 if j == 2 else z2) - top
            else:
                for m in range(d - 1):
                    w[m * LANES + i] = z[k, d - 1 if m == j else m] - top
        _block(w, d)
        for i in range(size):
            log_f[start + i] = math.log(w[F + i]) + LOG_FRONT[d - 2] + tops[i]
            g, h, j = gradient[start + i], hessian[start + i], largest[i]
            h00, h01, h02 = w[H00 + i], w[H01 + i], w[H02 + i]
            h11, h12, h22 = w[H11 + i], w[H12 + i], w[H22 + i]
            # log F(z + c) = log F(z) + c, hence every row of the Hessian sums to zero.
            h03, h13, h23 = -h00 - h01 - h02, -h01 - h11 - h12, -h02 - h12 - h22
            if d == 4:  # without jumps
                p, q, r = 3 if j == 0 else 0, 3 if j == 1 else 1, 3 if j == 2 else 2
                g[p], g[q], g[r], g[j] = w[G0 + i], w[G1 + i], w[G2 + i], w[G3 + i]
                h[p, p], h[p, q], h[p, r], h[p, j] = h00, h01, h02, h03
                h[q, p], h[q, q], h[q, r], h[q, j] = h01, h11, h12, h13
                h[r, p], h[r, q], h[r, r], h[r, j] = h02, h12, h22, h23
                h[j, p], h[j, q], h[j, r], h[j, j] = h03, h13, h23, -h03 - h13 - h23
                continue
            last = d - 1
            p, q = last if j == 0 else 0, last if j == 1 else 1
            g[p], g[j] = w[G0 + i], w[G3 + i]
            h[p, p], h[p, j], h[j, p], h[j, j] = h00, h03, h03, -h03 - h13 - h23
            if d > 2:
                g[q] = w[G1 + i]
                h[p, q], h[q, p], h[q, q], h[q, j], h[j, q] = h01, h01, h11, h13, h13
    return -1


@compiled(fast=True)
def derivatives_rows(z, log_f, gradient, hessian):
    """`derivatives_lanes` in any dimension."""
    n, d = z.shape
    x = np.empty(d)
    for k in range(n):
        top = z[k, 0]
        for j in range(d):
            top = max(top, z[k, j])
        for j in range(d):
            x[j] = z[k, j] - top
            if not x[j] >= -LARGEST:
                return k
        log_f[k] = derivatives(x, gradient[k], hessian[k]) + top
    return -1


@compiled(fast=True)
def _ascending(w, order):
    """Write the order (d,) that sorts w (d,)."""
    for i in range(w.size):
        j = i
        while j > 0 and w[order[j - 1]] > w[i]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = i


@compiled(fast=True)
def newton_rows_4(w, z, log_f, evaluations):
    """For each row of w (n, d), d ≤ 4, any order, Σ = 1: z (n, d) with ∇ log F(z) = w, log F (n,), evaluations (n,).

    Negative evaluations mark rows that did not converge.
    """
    n, d = w.shape
    x, y, order, terms = np.zeros(4), np.empty(4), np.empty(d, dtype=np.int64), np.empty(88)
    for k in range(n):
        _ascending(w[k], order)
        for i in range(d - 1):
            x[i] = w[k, order[i]]
        x[3] = w[k, order[d - 1]]
        log_f[k], evaluations[k] = newton_4(x, y, d, terms)
        for i in range(d - 1):
            z[k, order[i]] = y[i]
        z[k, order[d - 1]] = y[3]


@compiled(fast=True)
def newton_rows(w, z, log_f, evaluations):
    """`newton_rows_4` in any dimension."""
    n, d = w.shape
    x, y, order = np.empty(d), np.empty(d), np.empty(d, dtype=np.int64)
    for k in range(n):
        _ascending(w[k], order)
        for i in range(d):
            x[i] = w[k, order[i]]
        log_f[k], evaluations[k] = newton(x, y)
        for i in range(d):
            z[k, order[i]] = y[i]


@compiled(fast=True)
def diagonalize_rows_4(matrices, values, frames):
    """Eigenvalues (n, 4), ascending, and eigenvectors (n, 4, 4; by rows) of matrices (n, 4, 4).

    frames holds approximate eigenvectors by rows on entry; the matrices are carried into them first.
    """
    half, b = np.empty((4, 4)), np.empty((4, 4))
    for k in range(matrices.shape[0]):
        a, f = matrices[k], frames[k]
        for i in range(4):
            for j in range(4):
                t = 0.0
                for m in range(4):
                    t += f[i, m] * a[m, j]
                half[i, j] = t
        for i in range(4):
            for j in range(i, 4):
                t = 0.0
                for m in range(4):
                    t += half[i, m] * f[j, m]
                b[i, j] = t
        diagonalize_4(b, values[k], f)
        orthonormalize_4(f)
