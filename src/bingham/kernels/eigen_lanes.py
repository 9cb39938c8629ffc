"""Symmetric 4×4 eigenproblems over many matrices at once: one matrix to each lane of the vector unit.

The cyclic Jacobi sweeps of `linalg.diagonalize_4` without their jumps, in the layout of `kernels.rows`: each row of a
flat work array, ``LANES`` entries long, holds one entry of every matrix. All lanes sweep until the last has converged.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.rows import LANES

__all__ = ["diagonalize_lanes_4"]

MAX_SWEEPS = 30
# An off-diagonal entry x between diagonal entries p, q with x² below both products is gone after one more sweep, whose
# convergence is quadratic: (x/(q − p))² at the level of a double, or x below the rounding of the whole matrix.
QUADRATIC = (1e-9) ** 2
NEGLIGIBLE = (1e-17) ** 2
# Rows of the work array: b00 b11 b22 b33, b01 b02 b03 b12 b13 b23, then the frame by rows.
ROWS = 26
FRAME = 10


@compiled(inline=True, fast=True)
def _rotate(w, size, p, q, x, a, b, c, d):
    """Clear row x between the diagonal rows p, q in every lane; (a, b), (c, d) are the other pairs of rows (pr, qr).

    Returns whether a lane was not nearly diagonal yet. t = x/θ-form of `linalg._rotation`.
    """
    busy = 0
    fp, fq = FRAME + 4 * p, FRAME + 4 * q
    for i in range(LANES):
        v, bp, bq = w[x * LANES + i], w[p * LANES + i], w[q * LANES + i]
        gap, vv = bq - bp, v * v
        busy += 1 if vv > QUADRATIC * gap * gap and vv > NEGLIGIBLE * size[i] else 0
        h = gap + math.copysign(math.sqrt(gap * gap + 4.0 * vv), gap)
        h = 1.0 if h == 0.0 else h
        n = 1.0 / math.sqrt(h * h + 4.0 * vv)
        cs, sn, t = abs(h) * n, math.copysign(2.0 * n, h) * v, 2.0 * vv / h
        w[p * LANES + i], w[q * LANES + i], w[x * LANES + i] = bp - t, bq + t, 0.0
        y, z = w[a * LANES + i], w[b * LANES + i]
        w[a * LANES + i], w[b * LANES + i] = cs * y - sn * z, sn * y + cs * z
        y, z = w[c * LANES + i], w[d * LANES + i]
        w[c * LANES + i], w[d * LANES + i] = cs * y - sn * z, sn * y + cs * z
        for k in range(4):
            y, z = w[(fp + k) * LANES + i], w[(fq + k) * LANES + i]
            w[(fp + k) * LANES + i], w[(fq + k) * LANES + i] = cs * y - sn * z, sn * y + cs * z
    return busy


@compiled(fast=True)
def _sweeps(w, size):
    for _ in range(MAX_SWEEPS):
        busy = _rotate(w, size, 0, 1, 4, 5, 7, 6, 8)
        busy += _rotate(w, size, 2, 3, 9, 5, 6, 7, 8)
        busy += _rotate(w, size, 0, 2, 5, 4, 7, 6, 9)
        busy += _rotate(w, size, 1, 3, 8, 4, 6, 7, 9)
        busy += _rotate(w, size, 0, 3, 6, 4, 8, 5, 9)
        busy += _rotate(w, size, 1, 2, 7, 4, 5, 8, 9)
        if busy == 0:
            return


@compiled(fast=True)
def diagonalize_lanes_4(matrices, values, frames):
    """Eigenvalues (n, 4), in no order, and eigenvectors (n, 4, 4; rows) of the symmetric parts of matrices (n, 4, 4).

    Rows of a matrix that is not finite come out not finite.
    """
    w, size = np.empty(ROWS * LANES), np.empty(LANES)
    for start in range(0, matrices.shape[0], LANES):
        count = min(LANES, matrices.shape[0] - start)
        w[:] = 0.0
        size[:] = 0.0
        for i in range(count):
            m = matrices[start + i]
            k, total = 4, 0.0
            for p in range(4):
                w[p * LANES + i] = m[p, p]
                total += m[p, p] * m[p, p]
                for q in range(p + 1, 4):
                    v = 0.5 * (m[p, q] + m[q, p])
                    w[k * LANES + i] = v
                    total += v * v
                    k += 1
            size[i] = total
        for p in range(4):
            w[(FRAME + 5 * p) * LANES : (FRAME + 5 * p + 1) * LANES] = 1.0
        _sweeps(w, size)
        for i in range(count):
            for p in range(4):
                values[start + i, p] = w[p * LANES + i]
                for q in range(4):
                    frames[start + i, p, q] = w[(FRAME + 4 * p + q) * LANES + i]
