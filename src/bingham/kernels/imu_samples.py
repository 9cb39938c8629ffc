"""What each sample of a sensor does to the state of the inertial filter.

The run over a recording and the event interface call the same functions, so that they agree bit for bit.
"""

from __future__ import annotations

import math

from bingham.kernels import imu_state as at
from bingham.kernels.compile import compiled
from bingham.kernels.gap import LONG_GAP, gap_variance, is_gap, usual_step
from bingham.kernels.imu_state import rotation_matrix
from bingham.kernels.quaternion import from_rotation_vector, product

__all__ = ["accelerate", "due", "magnetize", "output", "rotate"]

REST_SMOOTHING = 0.5  # s
STANDARD_GRAVITY = 9.80665


@compiled()
def due(s, par):
    """Whether the interval since the last update is over (half a microsecond of rounding in times is forgiven)."""
    return s[at.ALIGNED] > 0.0 and s[at.ELAPSED] >= par[at.P_INTERVAL] - 5e-7


@compiled()
def rotate(s, p, par, dt, x, y, z, rotation):
    """Turn by the gyroscope's mean rate (x, y, z) over the last dt seconds; dt = 0 for the first sample."""
    s[at.AGE] += dt
    last_x, last_y, last_z = s[at.RATE], s[at.RATE + 1], s[at.RATE + 2]
    s[at.RATE], s[at.RATE + 1], s[at.RATE + 2] = x, y, z
    if dt <= 0.0:
        for i in range(3):
            s[at.SLOW_RATE + i] = s[at.RATE + i]
        return
    gain = max(1.0 - math.exp(-dt / REST_SMOOTHING), min(1.0, dt / s[at.AGE]))
    deviation = 0.0
    for i in range(3):
        s[at.SLOW_RATE + i] += gain * (s[at.RATE + i] - s[at.SLOW_RATE + i])
        deviation += (s[at.RATE + i] - s[at.SLOW_RATE + i]) ** 2
    gap = is_gap(dt, s[at.USUAL_STEP])
    s[at.USUAL_STEP] = usual_step(s[at.USUAL_STEP], dt)
    s[at.REST_TIME] = s[at.REST_TIME] + dt if deviation <= par[at.P_REST_RATE] ** 2 and not gap else 0.0
    s[at.REST] = 1.0 if s[at.REST_TIME] >= par[at.P_REST_TIME] else 0.0
    if s[at.ALIGNED] <= 0.0:
        return
    if gap:
        change2 = deviation + (x - last_x) ** 2 + (y - last_y) ** 2 + (z - last_z) ** 2
        rotated, fallen = gap_variance(dt, change2), (par[at.P_GRAVITY] * dt) ** 2
        for i in range(3):
            p[i, i] += rotated
            p[3 + i, 3 + i] += fallen
        s[at.GAP_TURN] += rotated
        s[at.GAP_SPEED] += fallen
        x, y, z = 0.5 * (x + last_x), 0.5 * (y + last_y), 0.5 * (z + last_z)
    wx = (x - s[at.BIAS]) * dt
    wy = (y - s[at.BIAS + 1]) * dt
    wz = (z - s[at.BIAS + 2]) * dt
    a, b, c, d = from_rotation_vector(wx, wy, wz)
    a, b, c, d = product(s[0], s[1], s[2], s[3], a, b, c, d)
    n = 1.0 / math.sqrt(a * a + b * b + c * c + d * d)
    s[0], s[1], s[2], s[3] = a * n, b * n, c * n, d * n
    rotation_matrix(rotation, s)
    for i in range(3):
        for j in range(3):
            s[at.TURN + 3 * i + j] += rotation[i, j] * dt
        s[at.WORLD_TURN + i] += rotation[i, 0] * wx + rotation[i, 1] * wy + rotation[i, 2] * wz
        s[at.BODY_TURN + i] += s[at.RATE + i] * dt
    s[at.TRAVEL] += math.sqrt(wx * wx + wy * wy + wz * wz)
    s[at.ELAPSED] += dt


@compiled(inline=True)
def _at_range_end(size):
    """Whether |f| is within 2 % of 2, 4, 8 or 16 g, where the ranges of such sensors end."""
    g = size / STANDARD_GRAVITY
    while g > 3.0:
        g *= 0.5
    return size < 17.0 * STANDARD_GRAVITY and abs(g - 2.0) < 0.04


@compiled()
def accelerate(s, par, dt, x, y, z):
    """Take the specific force (x, y, z), which stands for the last dt seconds; dt = 0 for the first sample."""
    clipped = False
    deviation = 0.0
    gain = max(1.0 - math.exp(-dt / REST_SMOOTHING), min(1.0, dt / max(s[at.AGE], 1e-9))) if dt > 0.0 else 1.0
    for i in range(3):
        f = x if i == 0 else y if i == 1 else z
        size = abs(f)
        last = s[at.LAST_ACC + i]
        if f == last and _at_range_end(size):
            clipped = True
        s[at.LAST_ACC + i] = f
        s[at.SLOW_ACC + i] += gain * (f - s[at.SLOW_ACC + i])
        deviation += (f - s[at.SLOW_ACC + i]) ** 2
    if deviation > par[at.P_REST_ACC] ** 2:
        s[at.REST_TIME] = 0.0
        s[at.REST] = 0.0
    if s[at.ALIGNED] <= 0.0:
        s[at.ALIGNED] = -s[at.ALIGNED]  # −1: the state is ready and waits for this sample
        return
    if dt <= 0.0 or dt >= LONG_GAP:
        return
    fx, fy, fz = x - s[at.ACC_BIAS], y - s[at.ACC_BIAS + 1], z - s[at.ACC_BIAS + 2]
    qw, qx, qy, qz = s[0], s[1], s[2], s[3]
    # R f by two cross products: f + 2 w (u × f) + 2 u × (u × f).
    tx = 2.0 * (qy * fz - qz * fy)
    ty = 2.0 * (qz * fx - qx * fz)
    tz = 2.0 * (qx * fy - qy * fx)
    wx = fx + qw * tx + qy * tz - qz * ty
    wy = fy + qw * ty + qz * tx - qx * tz
    wz = fz + qw * tz + qx * ty - qy * tx - par[at.P_GRAVITY]
    s[at.LINEAR] += wx * dt
    s[at.LINEAR + 1] += wy * dt
    s[at.LINEAR + 2] += wz * dt
    s[at.V] += wx * dt
    s[at.V + 1] += wy * dt
    s[at.V + 2] += wz * dt
    s[at.SHAKE] += max(0.0, x * x + y * y + z * z - par[at.P_GRAVITY] ** 2) * dt
    s[at.ACC_TIME] += dt
    if clipped:
        s[at.CLIPPED] += dt


@compiled()
def magnetize(s, x, y, z):
    """Take the field (x, y, z); return False for a repetition of the sample before, which says nothing new."""
    if x == s[at.LAST_MAG] and y == s[at.LAST_MAG + 1] and z == s[at.LAST_MAG + 2]:
        return False
    s[at.LAST_MAG], s[at.LAST_MAG + 1], s[at.LAST_MAG + 2] = x, y, z
    if s[at.ALIGNED] > 0.0:
        qw, qx, qy, qz = s[0], s[1], s[2], s[3]
        tx = 2.0 * (qy * z - qz * y)
        ty = 2.0 * (qz * x - qx * z)
        tz = 2.0 * (qx * y - qy * x)
        s[at.FIELD] += x + qw * tx + qy * tz - qz * ty
        s[at.FIELD + 1] += y + qw * ty + qz * tx - qx * tz
        s[at.FIELD + 2] += z + qw * tz + qx * ty - qy * tx
        s[at.FIELD_COUNT] += 1.0
    return True


@compiled()
def output(s, par, q):
    """Write the orientation q (4,) of this moment: the gyroscope's samples lag behind the motion."""
    lead = par[at.P_DELAY]
    a, b, c, d = from_rotation_vector(
        (s[at.RATE] - s[at.BIAS]) * lead,
        (s[at.RATE + 1] - s[at.BIAS + 1]) * lead,
        (s[at.RATE + 2] - s[at.BIAS + 2]) * lead,
    )
    q[0], q[1], q[2], q[3] = product(s[0], s[1], s[2], s[3], a, b, c, d)
