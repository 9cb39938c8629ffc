"""Normaliser and derivatives for d = 4 over many spectra at once: one spectrum to each lane of the vector unit.

The sums of `normalizer.scalars_4`, written so that the compiler vectorises over spectra instead of nodes: no sums
across lanes, no scalar tail. The rows of one flat work array, ``LANES`` entries each, hold z₀ z₁ z₂, F, ω and the
upper triangle of the Hessian; constant offsets within one array prove to the compiler that rows do not overlap.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.normalizer import CI, CR, LARGEST, SI, SR, node_4

__all__ = ["LANES", "derivatives_lanes_4"]

LANES = 16
ROWS = 14
# Offsets of the rows.
F, G0, G1, G2, G3 = 3 * LANES, 4 * LANES, 5 * LANES, 6 * LANES, 7 * LANES
H00, H01, H02, H11, H12, H22 = 8 * LANES, 9 * LANES, 10 * LANES, 11 * LANES, 12 * LANES, 13 * LANES


@compiled()
def _block(w):
    """Fill all rows of w (ROWS·LANES,) but the first three: F, ω, upper 3×3 triangle of the Hessian of log F."""
    w[F:] = 0.0
    for k in range(SR.size):
        sr, si, cr, ci = SR[k], SI[k], CR[k], CI[k]
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
    for i in range(LANES):
        n = 1.0 / (w[G0 + i] + w[G1 + i] + w[G2 + i] + w[G3 + i])
        g0, g1, g2 = w[G0 + i] * n, w[G1 + i] * n, w[G2 + i] * n
        w[G0 + i], w[G1 + i], w[G2 + i], w[G3 + i] = g0, g1, g2, w[G3 + i] * n
        n = 0.25 / w[F + i]
        w[H00 + i] = 3.0 * n * w[H00 + i] - g0 * g0
        w[H11 + i] = 3.0 * n * w[H11 + i] - g1 * g1
        w[H22 + i] = 3.0 * n * w[H22 + i] - g2 * g2
        w[H01 + i] = n * w[H01 + i] - g0 * g1
        w[H02 + i] = n * w[H02 + i] - g0 * g2
        w[H12 + i] = n * w[H12 + i] - g1 * g2


@compiled()
def derivatives_lanes_4(z, log_f, gradient, hessian):
    """For each row of z (n, 4), any order and offset: log F (n,), ω (n, 4), Hessian of log F (n, 4, 4), all written.

    Returns the first row that is not finite or spans more than `LARGEST`, or −1.
    """
    w = np.empty(ROWS * LANES)
    last, tops = np.empty(LANES, dtype=np.int64), np.empty(LANES)
    for start in range(0, z.shape[0], LANES):
        size = min(LANES, z.shape[0] - start)
        w[: 3 * LANES] = 0.0
        for i in range(size):
            z0, z1, z2, z3 = z[start + i, 0], z[start + i, 1], z[start + i, 2], z[start + i, 3]
            top = max(max(z0, z1), max(z2, z3))
            if math.isnan(z0 + z1 + z2 + z3) or not min(min(z0, z1), min(z2, z3)) - top >= -LARGEST:
                return start + i
            j = 0 if z0 == top else 1 if z1 == top else 2 if z2 == top else 3
            tops[i], last[i] = top, j
            w[i] = (z3 if j == 0 else z0) - top
            w[LANES + i] = (z3 if j == 1 else z1) - top
            w[2 * LANES + i] = (z3 if j == 2 else z2) - top
        _block(w)
        for i in range(size):
            log_f[start + i] = math.log(2.0 * math.pi**2 * w[F + i]) + tops[i]
            g, h, j = gradient[start + i], hessian[start + i], last[i]
            g[0], g[1], g[2], g[3] = w[G0 + i], w[G1 + i], w[G2 + i], w[G3 + i]
            g[3], g[j] = g[j], g[3]
            p, q, r = 3 if j == 0 else 0, 3 if j == 1 else 1, 3 if j == 2 else 2
            h00, h01, h02 = w[H00 + i], w[H01 + i], w[H02 + i]
            h11, h12, h22 = w[H11 + i], w[H12 + i], w[H22 + i]
            # log F(z + c) = log F(z) + c, hence every row of the Hessian sums to zero.
            h03, h13, h23 = -h00 - h01 - h02, -h01 - h11 - h12, -h02 - h12 - h22
            h[p, p], h[p, q], h[p, r], h[p, j] = h00, h01, h02, h03
            h[q, p], h[q, q], h[q, r], h[q, j] = h01, h11, h12, h13
            h[r, p], h[r, q], h[r, r], h[r, j] = h02, h12, h22, h23
            h[j, p], h[j, q], h[j, r], h[j, j] = h03, h13, h23, -h03 - h13 - h23
    return -1
