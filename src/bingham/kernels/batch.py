"""Normaliser, moments, their derivatives and inverse over batches (n, d)."""

from __future__ import annotations

import numpy as np
from numba import prange

from bingham.kernels.compile import compiled
from bingham.kernels.eigen import diagonalize_4, orthonormalize_4
from bingham.kernels.lanes import derivatives_lanes_4
from bingham.kernels.moments import concentrations, concentrations_4
from bingham.kernels.normalizer import LARGEST
from bingham.kernels.rule import log_normalizer_derivatives

__all__ = ["CHUNK", "batch_concentrations", "batch_derivatives", "concentrations_rows", "derivatives_rows",
           "diagonalize_rows_4"]  # fmt: skip

# Rows that one thread takes at a time; fewer than twice as many are not worth waking threads for.
CHUNK = 256
# Below this many rows the lanes of `derivatives_lanes_4` stay half empty.
FEW = 16


@compiled()
def _largest_last(x):
    """Swap the largest entry of x (d,) with the last one in place; return its old index."""
    i = x.size - 1
    for j in range(x.size):
        if x[j] > x[i]:
            i = j
    x[i], x[-1] = x[-1], x[i]
    return i


@compiled()
def derivatives_rows(z, log_f, gradient, hessian):
    """For each row of z (n, d), any order and offset: log F (n,), ω (n, d), Hessian of log F (n, d, d), all written.

    Returns the first row that is not finite or spans more than `LARGEST`, or −1.
    """
    n, d = z.shape
    if d == 4 and n >= FEW:
        return derivatives_lanes_4(z, log_f, gradient, hessian)
    for k in range(n):
        g, h = gradient[k], hessian[k]
        x = z[k].copy()
        i = _largest_last(x)
        top = x[d - 1]
        for j in range(d):
            x[j] -= top
            if not x[j] >= -LARGEST:
                return k
        log_f[k] = log_normalizer_derivatives(x, g, h) + top
        g[i], g[d - 1] = g[d - 1], g[i]
        for j in range(d):
            h[i, j], h[d - 1, j] = h[d - 1, j], h[i, j]
        for j in range(d):
            h[j, i], h[j, d - 1] = h[j, d - 1], h[j, i]
    return -1


@compiled(parallel=True)
def batch_derivatives(z, log_f, gradient, hessian):
    """`derivatives_rows` on all cores; returns any row of those that are not valid, or −1."""
    n = z.shape[0]
    bad = -1
    for c in prange((n + CHUNK - 1) // CHUNK):
        rows = slice(c * CHUNK, min(n, (c + 1) * CHUNK))
        found = derivatives_rows(z[rows], log_f[rows], gradient[rows], hessian[rows])
        bad = max(bad, found + c * CHUNK if found >= 0 else -1)
    return bad


@compiled()
def concentrations_rows(w, z, log_f, evaluations):
    """For each row of w (n, d), any order, Σ = 1: z (n, d) with ∇ log F(z) = w, log F (n,), evaluations (n,).

    Negative evaluations mark rows that did not converge.
    """
    n, d = w.shape
    gradient, hessian = np.empty(d), np.empty((d, d))
    for k in range(n):
        x = w[k].copy()
        i = _largest_last(x)
        if d == 4:
            log_f[k], evaluations[k] = concentrations_4(x, z[k])
        else:
            log_f[k], evaluations[k] = concentrations(x, z[k], gradient, hessian)
        z[k, i], z[k, d - 1] = z[k, d - 1], z[k, i]


@compiled(parallel=True)
def batch_concentrations(w, z, log_f, evaluations):
    """`concentrations_rows` on all cores."""
    n = w.shape[0]
    for c in prange((n + CHUNK - 1) // CHUNK):
        rows = slice(c * CHUNK, min(n, (c + 1) * CHUNK))
        concentrations_rows(w[rows], z[rows], log_f[rows], evaluations[rows])


@compiled()
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
            for j in range(4):
                t = 0.0
                for m in range(4):
                    t += half[i, m] * f[j, m]
                b[i, j] = t
        diagonalize_4(b, values[k], f)
        orthonormalize_4(f)
