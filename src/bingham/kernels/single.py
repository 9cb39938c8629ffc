"""Single filter steps for callers from Python: values in, new arrays out (M by columns, as `Bingham` stores it)."""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.newton import newton_2
from bingham.kernels.quaternion import rotate_rows
from bingham.kernels.rule import moments_2, moments_4
from bingham.kernels.step import (
    add_matrix_4,
    compose_4,
    diffuse_4,
    tangent_vectors,
    update_2,
    update_4,
    work_space_4,
)

__all__ = ["added_4", "composed_2", "composed_4", "composed_spin", "conditioned_spin", "diffused_2", "diffused_4",
           "updated_2", "updated_4"]  # fmt: skip


@compiled()
def composed_4(z, m, mode, tangent, weight, left):
    """Return (z', M', log F') of `step.compose_4`."""
    z, frame = z.copy(), m.T.copy()
    log_f = compose_4(z, frame, mode, tangent, weight, left, work_space_4())
    return z, frame.T.copy(), log_f


@compiled()
def diffused_4(z, uniform_weight):
    """Return (z', log F') of `step.diffuse_4`."""
    z = z.copy()
    log_f = diffuse_4(z, uniform_weight, work_space_4())
    return z, log_f


@compiled()
def updated_4(z, m, y, sensor_z, sensor_frame, left):
    """Return (z', M', log F', top) of `step.update_4` for the measured orientation y and conjugated noise axes."""
    z, frame, rotated = z.copy(), m.T.copy(), sensor_frame.copy()
    rotate_rows(rotated, y, not left)
    work = work_space_4()
    top = update_4(z, frame, sensor_z, rotated, work)
    return z, frame.T.copy(), moments_4(z, work[0], work[4]), top


@compiled()
def added_4(z, m, matrix):
    """Return (z', M', log F', top) of `step.add_matrix_4`."""
    z, frame = z.copy(), m.T.copy()
    work = work_space_4()
    top = add_matrix_4(z, frame, matrix, work)
    return z, frame.T.copy(), moments_4(z, work[0], work[4]), top


@compiled(inner=True)
def _write_2(new_z, new_m, z1, c, s):
    n = 1.0 / math.hypot(c, s)
    new_z[0], new_z[1] = z1, 0.0
    new_m[0, 0], new_m[1, 0], new_m[0, 1], new_m[1, 1] = -s * n, c * n, c * n, s * n


@compiled()
def composed_2(z, m, mode, noise_w, new_z, new_m):
    """Write (z', M') of x ⊕ v, d = 2, and return log F': angles add, noise_w is the small moment of v.

    Arrays that Python makes cost it half of what those cost that are handed out.
    """
    terms = np.empty(32)
    _, w, _ = moments_2(z[0], terms)
    c, s = m[0, 1] * mode[0] - m[1, 1] * mode[1], m[1, 1] * mode[0] + m[0, 1] * mode[1]
    z1, log_f, _ = newton_2(w + noise_w - 2.0 * w * noise_w, terms)
    _write_2(new_z, new_m, z1, c, s)
    return log_f


@compiled()
def diffused_2(z, uniform_weight):
    """Return (z', log F') after isotropic diffusion, d = 2."""
    z, terms = z.copy(), np.empty(32)
    _, w, _ = moments_2(z[0], terms)
    z[0], log_f, _ = newton_2(w + uniform_weight * (0.5 - w), terms)
    return z, log_f


@compiled()
def updated_2(z, m, y, sensor_z, sensor_mode, new_z, new_m):
    """Write (z', M') of `step.update_2` for the direction y and the noise (sensor_z, mode); return log F', top."""
    a, b = y[0] * sensor_mode[0] + y[1] * sensor_mode[1], y[1] * sensor_mode[0] - y[0] * sensor_mode[1]
    z1, c, s, top = update_2(z[0], m[0, 1], m[1, 1], sensor_z[0], a, b)
    log_f, _, _ = moments_2(z1, np.empty(32))
    _write_2(new_z, new_m, z1, c, s)
    return log_f, top


@compiled()
def _as_noise(z, frame, left, tangent, work):
    """Write the tangent moment (3, 3) of the distribution (z, frame) and return its weight, as `compose_4` wants them.

    They are E[e eᵀ], e the vector part of mode* ⊗ x (left: x ⊗ mode*), and E[(modeᵀ x)²].
    """
    w, a, _, _, terms = work
    moments_4(z, w, terms)
    tangent_vectors(frame, left, a)
    for i in range(3):
        for j in range(3):
            tangent[i, j] = w[0] * a[0, i] * a[0, j] + w[1] * a[1, i] * a[1, j] + w[2] * a[2, i] * a[2, j]
    return w[3]


@compiled()
def composed_spin(z, m, spin_z, spin_m):
    """Return (z', M', log F') of the moment-matched distribution of v ⊗ x, v ~ (spin_z, spin_m), x ~ (z, m)."""
    z, frame, spin = z.copy(), m.T.copy(), spin_m.T.copy()
    work, tangent = work_space_4(), np.empty((3, 3))
    weight = _as_noise(spin_z, spin, True, tangent, work)
    log_f = compose_4(z, frame, spin[3], tangent, weight, True, work)
    return z, frame.T.copy(), log_f


@compiled()
def conditioned_spin(spin_z, spin_m, z, m, y, sensor_z, sensor_frame, left):
    """Return (z', M', log F') of the spin given the orientation y of the body and its distribution one step before.

    The likelihood of y as a distribution of the orientation, composed with the inverse of the earlier one (z, m),
    multiplies the spin's (Glover & Kaelbling 2013, §4). sensor_frame holds the conjugated noise axes by rows.
    """
    likelihood, before = sensor_frame.copy(), m.T.copy()
    rotate_rows(likelihood, y, not left)
    for j in range(4):
        for k in range(1, 4):
            before[j, k] = -before[j, k]
    work, tangent = work_space_4(), np.empty((3, 3))
    weight = _as_noise(z, before, False, tangent, work)
    likelihood_z = sensor_z.copy()
    compose_4(likelihood_z, likelihood, before[3], tangent, weight, False, work)
    new_z, new_frame = spin_z.copy(), spin_m.T.copy()
    update_4(new_z, new_frame, likelihood_z, likelihood, work)
    return new_z, new_frame.T.copy(), moments_4(new_z, work[0], work[4])
