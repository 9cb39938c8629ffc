"""One prediction or update of the first-order Bingham filter, in place.

A distribution is carried as concentrations z (d,), ascending with z_d = 0, and its frame (d, d) by rows: frame[j] is
the j-th principal axis, the last one the mode. Both steps work in the frame of the distribution that came in, where
small eigenvalues keep their relative accuracy and Jacobi's method starts nearly diagonal.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.fma import fma
from bingham.kernels.linalg import diagonalize_4, dot_4, orthonormalize_4
from bingham.kernels.newton import newton_4
from bingham.kernels.quaternion import rotate_rows
from bingham.kernels.rule import moments_4

__all__ = ["add_matrix_4", "compose_4", "composed_moments_4", "diffuse_4", "tangent_vectors", "update_2", "update_4",
           "work_space_4"]  # fmt: skip


@compiled(inner=True)
def work_space_4():
    """Scratch arrays shared by the d = 4 steps: moments (4,), three matrices (4, 4), terms of a sum (88,)."""
    return np.empty(4), np.empty((4, 4)), np.empty((4, 4)), np.empty((4, 4)), np.empty(88)


@compiled(inner=True)
def diffuse_4(z, uniform_weight, work):
    """Isotropic diffusion: ω ← ω + c (¼ − ω), c = `uniform_weight` = 1 − exp(−σ²t); the frame stays. Returns log F."""
    w = work[0]
    moments_4(z, w, work[4])
    for i in range(4):
        w[i] += uniform_weight * (0.25 - w[i])
    log_f, _ = newton_4(w, z, 4, work[4])
    return log_f


@compiled(inner=True)
def compose_4(z, frame, mode, tangent, weight, left, work):
    """Moment-matched distribution of x ⊕ v (left: v ⊕ x), in place; returns log F. Noise as `composed_moments_4`."""
    moments_4(z, work[0], work[4])
    rotate_rows(frame, mode, left)
    composed_moments_4(frame, tangent, weight, left, work)
    log_f, _ = newton_4(work[0], z, 4, work[4])
    orthonormalize_4(frame)
    return log_f


@compiled(inner=True)
def tangent_vectors(frame, left, a):
    """Write the vector parts a[j] of conj(m) ⊗ frame[j] (left: frame[j] ⊗ conj(m)), m = frame[3], j < 3."""
    s = -1.0 if left else 1.0
    m = frame[3]
    for row in range(3):
        q = frame[row]
        for i in range(3):
            j, k = (i + 1) % 3 + 1, (i + 2) % 3 + 1
            a[row, i] = m[0] * q[i + 1] - m[i + 1] * q[0] - s * (m[j] * q[k] - m[k] * q[j])


@compiled(inner=True)
def composed_moments_4(frame, tangent, weight, left, work):
    """Frame and moments work[0] of x ⊕ v (left: v ⊕ x) from those of x ⊕ mode, in place; rounding drift stays.

    The noise v has second moment weight·m mᵀ + Σ νᵢ (m ⊕ eᵢ)(m ⊕ eᵢ)ᵀ with mode m (left: eᵢ ⊕ m) and pure
    quaternions eᵢ; tangent (3, 3) = Σ νᵢ eᵢ eᵢᵀ, so that weight + tr tangent = 1.

    S' = Σ_m ν_m R_m S R_mᵀ (Glover & Kaelbling 2013, A.9.2), written in the rotated frame of x: right multiplication by
    a pure unit quaternion e is antisymmetric, and between the axes of an orthonormal quaternion frame its entries are
    ± aₖ·e, where a_j is the vector part of conj(frame[3]) ⊗ frame[j].
    """
    w, a, b, q, _ = work  # rows of a: a_0, a_1, a_2
    tangent_vectors(frame, left, a)
    det = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        det += a[0, i] * (a[1, j] * a[2, k] - a[1, k] * a[2, j])
        for m in range(3):
            b[i, m] = a[i, 0] * tangent[0, m] + a[i, 1] * tangent[1, m] + a[i, 2] * tangent[2, m]
    s = math.copysign(1.0, -det if left else det)
    # qᵢⱼ = aᵢ·tangent·aⱼ
    for i in range(3):
        for m in range(3):
            q[i, m] = b[i, 0] * a[m, 0] + b[i, 1] * a[m, 1] + b[i, 2] * a[m, 2]
    b[3, 3] = weight * w[3] + q[0, 0] * w[0] + q[1, 1] * w[1] + q[2, 2] * w[2]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        b[i, i] = weight * w[i] + q[i, i] * w[3] + q[j, j] * w[k] + q[k, k] * w[j]
        b[i, j] = b[j, i] = (w[3] - w[k]) * q[i, j]
        b[i, 3] = s * (w[k] - w[j]) * q[j, k]
    diagonalize_4(b, w, frame)


@compiled()
def _posterior_4(z, frame, work):
    """Diagonalise b = diag z + likelihood (in the frame), write z and frame; return the largest eigenvalue, ≤ 0."""
    b = work[2]
    for i in range(4):
        b[i, i] += z[i]
    diagonalize_4(b, z, frame)
    orthonormalize_4(frame)
    top = z[3]
    for i in range(4):
        z[i] -= top
    return min(top, 0.0)


@compiled(inner=True)
def update_4(z, frame, likelihood_z, likelihood_frame, work):
    """Multiply by exp(Σ likelihood_z[m] (n_mᵀ x)²), n_m = likelihood_frame[m]; return the largest eigenvalue, ≤ 0.

    Posterior A + L in place (Kurz et al. 2014, eq. 53). log F(A + L) = log F(z) + the returned value.
    """
    _, c, b, _, _ = work
    for i in range(4):
        for m in range(4):
            c[i, m] = dot_4(frame, i, likelihood_frame, m)
    for i in range(4):
        for j in range(i, 4):
            t = likelihood_z[0] * c[i, 0] * c[j, 0]
            for m in range(1, 4):
                t = fma(likelihood_z[m] * c[i, m], c[j, m], t)
            b[i, j] = t
    return _posterior_4(z, frame, work)


@compiled(inner=True)
def add_matrix_4(z, frame, matrix, work):
    """Multiply by exp(xᵀ L x) for a symmetric L (4, 4) with largest eigenvalue 0; as `update_4`."""
    _, c, b, _, _ = work
    for i in range(4):
        for k in range(4):
            c[i, k] = dot_4(frame, i, matrix, k)
    for i in range(4):
        for j in range(i, 4):
            b[i, j] = dot_4(c, i, frame, j)
    return _posterior_4(z, frame, work)


@compiled(inner=True)
def update_2(z1, c, s, y1, a, b):
    """Product of the d = 2 distributions with (z1, mode (c, s)) and (y1, mode (a, b)).

    With κ = −z₁/2 both are von Mises distributions of the doubled angle (Kurz et al. 2014, eq. 76), so κ e^{2iμ} add.
    Returns (z₁, mode c, mode s, largest eigenvalue of the sum).
    """
    k, j = -0.5 * z1, -0.5 * y1
    x = k * (c * c - s * s) + j * (a * a - b * b)
    y = 2.0 * (k * c * s + j * a * b)
    r = math.hypot(x, y)
    if r == 0.0:
        return 0.0, c, s, -(k + j)
    cross = c * b - s * a
    top = -4.0 * k * j * cross * cross / (k + j + r)
    # Half of the angle of (x, y), on the side of the prior's mode.
    if x > 0.0:
        p, q = x + r, y
    else:
        p, q = abs(y), math.copysign(r - x, y)
    n = 1.0 / math.hypot(p, q)
    if p * c + q * s < 0.0:
        n = -n
    return -2.0 * r, p * n, q * n, top
