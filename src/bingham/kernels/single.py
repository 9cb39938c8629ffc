"""Single filter steps for callers from Python: values in, new arrays out (M by columns, as `Bingham` stores it)."""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.moments import concentrations_2
from bingham.kernels.normalizer import derivatives_2, gradient_4
from bingham.kernels.quaternion import rotate_rows_left, rotate_rows_right
from bingham.kernels.step import add_matrix_4, compose_4, diffuse_4, update_2, update_4, work_space_4

__all__ = ["added_4", "composed_2", "composed_4", "diffused_4", "updated_2", "updated_4"]


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
    if left:
        rotate_rows_right(rotated, y)
    else:
        rotate_rows_left(y, rotated)
    work = work_space_4()
    top = update_4(z, frame, sensor_z, rotated, work)
    return z, frame.T.copy(), math.log(gradient_4(z, work[0])), top


@compiled()
def added_4(z, m, matrix):
    """Return (z', M', log F', top) of `step.add_matrix_4`."""
    z, frame = z.copy(), m.T.copy()
    work = work_space_4()
    top = add_matrix_4(z, frame, np.ascontiguousarray(matrix), work)
    return z, frame.T.copy(), math.log(gradient_4(z, work[0])), top


@compiled()
def _distribution_2(z1, c, s):
    z, m = np.empty(2), np.empty((2, 2))
    z[0], z[1] = z1, 0.0
    n = 1.0 / math.hypot(c, s)
    m[0, 0], m[1, 0], m[0, 1], m[1, 1] = -s * n, c * n, c * n, s * n
    return z, m


@compiled()
def composed_2(z, m, mode, noise_w):
    """Return (z', M', log F') of x ⊕ v, d = 2: angles add, noise_w is the small moment of v."""
    _, w, _ = derivatives_2(z[0])
    c, s = m[0, 1] * mode[0] - m[1, 1] * mode[1], m[1, 1] * mode[0] + m[0, 1] * mode[1]
    z1, log_f, _ = concentrations_2(w + noise_w - 2.0 * w * noise_w)
    z, m = _distribution_2(z1, c, s)
    return z, m, log_f


@compiled()
def updated_2(z, m, y, sensor_z, sensor_mode):
    """Return (z', M', log F', top) of `step.update_2` for the measured direction y and the noise (sensor_z, mode)."""
    a, b = y[0] * sensor_mode[0] + y[1] * sensor_mode[1], y[1] * sensor_mode[0] - y[0] * sensor_mode[1]
    z1, c, s, top = update_2(z[0], m[0, 1], m[1, 1], sensor_z[0], a, b)
    log_f, _, _ = derivatives_2(z1)
    z, m = _distribution_2(z1, c, s)
    return z, m, log_f, top
