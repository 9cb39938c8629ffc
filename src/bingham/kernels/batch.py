"""Normaliser, moments, their derivatives and inverse over batches (n, d)."""

from __future__ import annotations

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.eigen import diagonalize_4, orthonormalize_4
from bingham.kernels.moments import concentrations, concentrations_4
from bingham.kernels.normalizer import LARGEST
from bingham.kernels.rule import log_normalizer_derivatives

__all__ = ["concentrations_rows", "concentrations_rows_4", "derivatives_rows", "diagonalize_rows_4"]


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

    Returns the first row that is not finite or spans more than `LARGEST`, or −1. `derivatives_lanes_4` is for d = 4.
    """
    n, d = z.shape
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


@compiled()
def concentrations_rows(w, z, log_f, evaluations):
    """For each row of w (n, d), any order, Σ = 1: z (n, d) with ∇ log F(z) = w, log F (n,), evaluations (n,).

    Negative evaluations mark rows that did not converge. `concentrations_rows_4` is for d = 4.
    """
    n, d = w.shape
    gradient, hessian = np.empty(d), np.empty((d, d))
    for k in range(n):
        x = w[k].copy()
        i = _largest_last(x)
        log_f[k], evaluations[k] = concentrations(x, z[k], gradient, hessian)
        z[k, i], z[k, d - 1] = z[k, d - 1], z[k, i]


@compiled()
def concentrations_rows_4(w, z, log_f, evaluations):
    """`concentrations_rows` for d = 4."""
    x = np.empty(4)
    for k in range(w.shape[0]):
        x[:] = w[k]
        i = _largest_last(x)
        log_f[k], evaluations[k] = concentrations_4(x, z[k])
        z[k, i], z[k, 3] = z[k, 3], z[k, i]


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
