"""Matrices from their spectral forms, many at once; frames hold eigenvectors by rows, as in `kernels.linalg`."""

from __future__ import annotations

import numpy as np

from bingham.kernels.compile import compiled

__all__ = ["combine_rows", "combine_rows_4", "curvature_rows", "likelihood_rows"]


@compiled()
def combine_rows_4(weights, frames, out):
    """`combine_rows` for d = 4, unrolled."""
    for r in range(weights.shape[0]):
        w, f, o = weights[r], frames[r], out[r]
        w0, w1, w2, w3 = w[0], w[1], w[2], w[3]
        for i in range(4):
            a0, a1, a2, a3 = w0 * f[0, i], w1 * f[1, i], w2 * f[2, i], w3 * f[3, i]
            o[i, 0] = (a0 * f[0, 0] + a1 * f[1, 0]) + (a2 * f[2, 0] + a3 * f[3, 0])
            o[i, 1] = (a0 * f[0, 1] + a1 * f[1, 1]) + (a2 * f[2, 1] + a3 * f[3, 1])
            o[i, 2] = (a0 * f[0, 2] + a1 * f[1, 2]) + (a2 * f[2, 2] + a3 * f[3, 2])
            o[i, 3] = (a0 * f[0, 3] + a1 * f[1, 3]) + (a2 * f[2, 3] + a3 * f[3, 3])


@compiled()
def combine_rows(weights, frames, out):
    """Write Σₖ wₖ mₖ mₖᵀ to out (n, d, d) for weights (n, d) and frames (n, d, d)."""
    n, d = weights.shape
    for r in range(n):
        for i in range(d):
            for j in range(i, d):
                t = 0.0
                for k in range(d):
                    t += weights[r, k] * frames[r, k, i] * frames[r, k, j]
                out[r, i, j] = out[r, j, i] = t


@compiled()
def likelihood_rows(matrices, x, tolerance, values, gradients):
    """Turn values (n,) = log F(A) and gradients (n, d, d) = E[yyᵀ] into log F(A) − uᵀAu and E[yyᵀ] − uuᵀ, u = x/|x|.

    Returns the first row of x (n, d) whose squared length is not within `tolerance` of 1, or −1.
    """
    n, d = x.shape
    for r in range(n):
        square = form = 0.0
        for i in range(d):
            square += x[r, i] * x[r, i]
            for j in range(d):
                form += x[r, i] * matrices[r, i, j] * x[r, j]
        if not abs(square - 1.0) <= tolerance:
            return r
        n2 = 1.0 / square
        values[r] -= form * n2
        for i in range(d):
            for j in range(d):
                gradients[r, i, j] -= x[r, i] * x[r, j] * n2
    return -1


@compiled()
def curvature_rows(frames, moments, hessian, directions, out):
    """Write dE[yyᵀ] for dA = (V + Vᵀ)/2, V in directions (n, d, d), to out (n, d, d).

    In the eigenframe log F has second derivatives Hᵢⱼ between diagonal entries of A; an entry off the diagonal answers
    with the divided difference (ωᵢ − ωⱼ)/(zᵢ − zⱼ) = 2 E[yᵢ² yⱼ²] = 2 (Hᵢⱼ + ωᵢ ωⱼ), equal eigenvalues or not.
    """
    n, d = moments.shape
    half, inner = np.empty((d, d)), np.empty((d, d))
    for r in range(n):
        f, v, w, h = frames[r], directions[r], moments[r], hessian[r]
        for i in range(d):
            for j in range(d):
                t = 0.0
                for k in range(d):
                    t += f[i, k] * (v[k, j] + v[j, k])
                half[i, j] = 0.5 * t
        for i in range(d):
            for j in range(d):
                t = 0.0
                for k in range(d):
                    t += half[i, k] * f[j, k]
                inner[i, j] = t
        for i in range(d):
            t = 0.0
            for j in range(d):
                t += h[i, j] * inner[j, j]
            half[i, i] = t
        for i in range(d):
            for j in range(d):
                if i != j:
                    inner[i, j] *= 2.0 * (h[i, j] + w[i] * w[j])
        for i in range(d):
            inner[i, i] = half[i, i]
        for i in range(d):
            for j in range(d):
                t = 0.0
                for k in range(d):
                    t += inner[i, k] * f[k, j]
                half[i, j] = t
        for i in range(d):
            for j in range(d):
                t = 0.0
                for k in range(d):
                    t += f[k, i] * half[k, j]
                out[r, i, j] = t
