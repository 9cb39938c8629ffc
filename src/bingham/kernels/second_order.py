"""Steps of the second-order quaternion filter: distributions of orientation and spin in, new arrays out.

Frames come and go by columns, as `Bingham` stores them; inside they are rows, as in `kernels.step`.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.normalizer import gradient_4
from bingham.kernels.quaternion import rotate_rows_left, rotate_rows_right
from bingham.kernels.step import compose_4, update_4, work_space_4

__all__ = ["composed_spin", "conditioned_spin"]


@compiled()
def _tangent_parts(z, frame, left, tangent, work):
    """Return E[(modeᵀ x)²] of (z, frame), as `compose_4` takes a noise, and write its tangent moment (3, 3).

    E[e eᵀ] of the vector part e of x ⊗ mode* (left) or mode* ⊗ x (right).
    """
    w = work[0]
    gradient_4(z, w)
    tangent[:] = 0.0
    s = 1.0 if left else -1.0
    m0, m1, m2, m3 = frame[3, 0], frame[3, 1], frame[3, 2], frame[3, 3]
    for j in range(3):
        q0, q1, q2, q3 = frame[j, 0], frame[j, 1], frame[j, 2], frame[j, 3]
        a = m0 * q1 - m1 * q0 + s * (q3 * m2 - q2 * m3)
        b = m0 * q2 - m2 * q0 + s * (q1 * m3 - q3 * m1)
        c = m0 * q3 - m3 * q0 + s * (q2 * m1 - q1 * m2)
        tangent[0, 0] += w[j] * a * a
        tangent[0, 1] += w[j] * a * b
        tangent[0, 2] += w[j] * a * c
        tangent[1, 1] += w[j] * b * b
        tangent[1, 2] += w[j] * b * c
        tangent[2, 2] += w[j] * c * c
    tangent[1, 0], tangent[2, 0], tangent[2, 1] = tangent[0, 1], tangent[0, 2], tangent[1, 2]
    return w[3]


@compiled()
def composed_spin(z, m, spin_z, spin_m):
    """Return (z', M', log F') of the moment-matched distribution of v ⊗ x, v ~ (spin_z, spin_m), x ~ (z, m)."""
    z, frame, spin = z.copy(), m.T.copy(), spin_m.T.copy()
    work, tangent = work_space_4(), np.empty((3, 3))
    weight = _tangent_parts(spin_z, spin, True, tangent, work)
    log_f = compose_4(z, frame, spin[3], tangent, weight, True, work)
    return z, frame.T.copy(), log_f


@compiled()
def conditioned_spin(spin_z, spin_m, z, m, y, sensor_z, sensor_frame, left):
    """Return (z', M', log F') of the spin given the orientation y of the body and (z, m) of one step before.

    The likelihood of y as a distribution of the orientation, composed with the inverse of the earlier one, multiplies
    the spin's distribution (Glover & Kaelbling 2013, §4). sensor_frame holds the conjugated noise axes by rows.
    """
    rotated, before = sensor_frame.copy(), m.T.copy()
    if left:
        rotate_rows_right(rotated, y)
    else:
        rotate_rows_left(y, rotated)
    for j in range(4):
        for k in range(1, 4):
            before[j, k] = -before[j, k]
    work, tangent = work_space_4(), np.empty((3, 3))
    weight = _tangent_parts(z, before, False, tangent, work)
    turn_z = sensor_z.copy()
    compose_4(turn_z, rotated, before[3], tangent, weight, False, work)
    new_z, new_frame = spin_z.copy(), spin_m.T.copy()
    update_4(new_z, new_frame, turn_z, rotated, work)
    return new_z, new_frame.T.copy(), math.log(gradient_4(new_z, work[0]))
