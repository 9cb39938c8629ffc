"""Normaliser, moments, their derivatives and inverse over batches (n, d)."""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from bingham.kernels.compile import compiled
from bingham.kernels.eigen import diagonalize_4, orthonormalize_4
from bingham.kernels.moments import concentrations, concentrations_4
from bingham.kernels.normalizer import derivatives_4
from bingham.kernels.rule import log_normalizer_derivatives

__all__ = ["batch_concentrations", "batch_derivatives", "batch_diagonalize_4"]


@compiled()
def _largest_last(x):
    """Swap the largest entry of x (d,) with the last one in place; return its old index."""
    i = x.size - 1
    for j in range(x.size):
        if x[j] > x[i]:
            i = j
    x[i], x[-1] = x[-1], x[i]
    return i


@compiled(parallel=True)
def batch_derivatives(z, log_f, gradient, hessian):
    """For each row of z (n, d), any order, max 0: log F (n,), ω (n, d), Hessian of log F (n, d, d), all written."""
    n, d = z.shape
    for k in prange(n):
        g, h = gradient[k], hessian[k]
        # The first row of the Hessian lends its place to the sorted z, which is read before anything is written.
        x = h[0] if d == 4 else z[k].copy()
        x[:] = z[k]
        i = _largest_last(x)
        log_f[k] = math.log(derivatives_4(x, g, h)) if d == 4 else log_normalizer_derivatives(x, g, h)
        if i == d - 1:
            continue
        g[i], g[d - 1] = g[d - 1], g[i]
        for j in range(d):
            h[i, j], h[d - 1, j] = h[d - 1, j], h[i, j]
        for j in range(d):
            h[j, i], h[j, d - 1] = h[j, d - 1], h[j, i]


@compiled(parallel=True)
def batch_concentrations(w, z, log_f, evaluations):
    """For each row of w (n, d), any order, Σ = 1: z (n, d) with ∇ log F(z) = w, log F (n,), evaluations (n,).

    Negative evaluations mark rows that did not converge.
    """
    n, d = w.shape
    for k in prange(n):
        gradient, hessian = np.empty(d), np.empty((d, d))
        x = w[k].copy()
        i = _largest_last(x)
        if d == 4:
            log_f[k], evaluations[k] = concentrations_4(x, z[k], gradient, hessian)
        else:
            log_f[k], evaluations[k] = concentrations(x, z[k], gradient, hessian)
        z[k, i], z[k, d - 1] = z[k, d - 1], z[k, i]


@compiled(parallel=True)
def batch_diagonalize_4(matrices, values, frames):
    """Eigenvalues (n, 4), ascending, and eigenvectors (n, 4, 4; by rows) of matrices (n, 4, 4).

    frames holds approximate eigenvectors by rows on entry; the matrices are carried into them first.
    """
    for k in prange(matrices.shape[0]):
        a, f = matrices[k], frames[k]
        half, b = np.empty((4, 4)), np.empty((4, 4))
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
