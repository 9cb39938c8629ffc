"""Steps of the inertial filter: what each sensor's sample does, and the update that closes an interval.

The run over a recording and the event interface call the same four functions, so that they agree bit for bit.
"""

from __future__ import annotations

import math

from bingham.kernels import imu_state as at
from bingham.kernels.compile import compiled
from bingham.kernels.imu_field import field_update
from bingham.kernels.imu_state import coupling_matrix, covariance_step, rotation_matrix, scalar_update
from bingham.kernels.quaternion import from_rotation_vector, product

__all__ = ["accelerate", "due", "magnetize", "output", "rotate", "update"]

# Part of the accelerometer's scale error and of the gyroscope's that changes sign within this time or turn averages out.
CORRELATION_TIME = 0.1
CORRELATION_TURN = 0.1
SCALE_TIME = 1.0
SWING_TIME = 1.0
REST_SMOOTHING = 0.5
CONTRADICTION_TIME = 2.0
# A bias prior three standard deviations off (χ² of one degree of freedom) is wrong.
CONTRADICTION_LIMIT = 9.0
LASTING_REST = 10.0  # s of a steady rate that no slow turn keeps up
GAP = 0.25  # s without a gyroscope sample after which the rate between is unknown
GAP_RATE = 1.0  # rad/s, standard deviation of the rate in a gap
REST_SPEED = 0.003  # m/s
MAXIMAL_SPEED = 3.0  # m/s, largest typical speed that is believed
STANDARD_GRAVITY = 9.80665


@compiled()
def due(s, par):
    """Whether the interval since the last update is over (half a microsecond of rounding in times is forgiven)."""
    return s[at.ALIGNED] > 0.0 and s[at.ELAPSED] >= par[at.P_INTERVAL] - 5e-7


@compiled()
def rotate(s, p, par, dt, x, y, z, rotation):
    """Turn by the gyroscope's mean rate (x, y, z) over the last dt seconds; dt = 0 for the first sample."""
    s[at.AGE] += dt
    s[at.RATE], s[at.RATE + 1], s[at.RATE + 2] = x, y, z
    if dt <= 0.0:
        for i in range(3):
            s[at.SLOW_RATE + i] = s[at.RATE + i]
        return
    if s[at.INTERVAL] == 0.0:
        s[at.INTERVAL] = dt
    elif dt < GAP:
        s[at.INTERVAL] += 0.05 * (dt - s[at.INTERVAL])
    gain = max(1.0 - math.exp(-dt / REST_SMOOTHING), min(1.0, dt / s[at.AGE]))
    deviation = 0.0
    for i in range(3):
        s[at.SLOW_RATE + i] += gain * (s[at.RATE + i] - s[at.SLOW_RATE + i])
        deviation += (s[at.RATE + i] - s[at.SLOW_RATE + i]) ** 2
    s[at.REST_TIME] = s[at.REST_TIME] + dt if deviation <= par[at.P_REST_RATE] ** 2 and dt < GAP else 0.0
    s[at.REST] = 1.0 if s[at.REST_TIME] >= par[at.P_REST_TIME] else 0.0
    if s[at.ALIGNED] <= 0.0:
        return
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
    if dt >= GAP:
        for i in range(3):
            p[i, i] += (GAP_RATE * dt) ** 2
            p[3 + i, 3 + i] += (par[at.P_GRAVITY] * dt) ** 2


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
    if dt <= 0.0 or dt >= GAP:
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
    # A rate that stands for the interval before it, taken to its end, is half an interval ahead already.
    lead = (par[at.P_DELAY] - 0.5) * s[at.INTERVAL]
    a, b, c, d = from_rotation_vector(
        (s[at.RATE] - s[at.BIAS]) * lead,
        (s[at.RATE + 1] - s[at.BIAS + 1]) * lead,
        (s[at.RATE + 2] - s[at.BIAS + 2]) * lead,
    )
    q[0], q[1], q[2], q[3] = product(s[0], s[1], s[2], s[3], a, b, c, d)


@compiled()
def _typical_speed2(s, par, dt):
    """Track over dt seconds how fast the body swings about its mean velocity; return the typical speed², (m/s)² per axis.

    The linear acceleration, freed of its mean (a tilt error looks like one), is integrated with a leak; what is left
    after smoothing over `SWING_TIME` is the part of the velocity slow enough to be mistaken for a tilt.
    """
    window = par[at.P_WINDOW]
    gain = min(1.0, dt / window)
    power = 0.0
    for i in range(3):
        force = s[at.LINEAR + i] / dt
        s[at.SLOW_FORCE + i] += gain * (force - s[at.SLOW_FORCE + i])
        s[at.SWING + i] += (force - s[at.SLOW_FORCE + i]) * dt - gain * s[at.SWING + i]
        s[at.SLOW_SWING + i] += min(1.0, dt / SWING_TIME) * (s[at.SWING + i] - s[at.SLOW_SWING + i])
        power += s[at.SLOW_SWING + i] ** 2
    s[at.SWING_POWER] += gain * (min(power / 3.0, MAXIMAL_SPEED**2) - s[at.SWING_POWER])
    return s[at.SWING_POWER] + par[at.P_VELOCITY] ** 2


@compiled()
def _restart(s, p, par):
    """Begin anew with a wide prior about the present orientation: the bias prior was wrong."""
    heading = p[2, 2]
    p[:, :] = 0.0
    for i in range(3):
        p[i, i] = 0.09 if i < 2 else heading + 0.25
        p[3 + i, 3 + i] = 1.0
        p[6 + i, 6 + i] = par[at.P_WIDE_BIAS] ** 2
        p[9 + i, 9 + i] = par[at.P_ACC_BIAS] ** 2
        s[at.V + i] = 0.0
    s[at.CONTRADICTION] = 0.0


@compiled()
def _rest_is_believed(s, p, par, dt):
    """Whether a steady rate is a bias and not a slow turn; widen the law of the bias where its prior was wrong.

    The first rest shows the bias, whatever the prior said. Afterwards a steady rate that contradicts the known bias is a
    slow turn, unless it lasts.
    """
    contradicted = False
    for i in range(3):
        residual = s[at.BODY_TURN + i] / dt - s[at.BIAS + i]
        if residual * residual > CONTRADICTION_LIMIT * (p[6 + i, 6 + i] + par[at.P_REST_NOISE] ** 2):
            contradicted = True
    if not contradicted:
        s[at.REST_REFUSED] = 0.0
        return True
    s[at.REST_REFUSED] += dt
    if s[at.REST_SEEN] > 0.0 and s[at.REST_REFUSED] < LASTING_REST:
        return False
    for i in range(3):
        p[6 + i, 6 + i] += par[at.P_WIDE_BIAS] ** 2
    s[at.REST_REFUSED] = 0.0
    return True


@compiled()
def update(s, p, par, x, work, out, keep):
    """Close the interval: move the covariance (12, 12) over it, condition on what the sensors said, correct the state.

    x (12,) becomes the correction; work (3, 12, 12) is scratch; keep (24,), if not empty, gets what the smoother needs: turn
    (9), coupling (9), noise (4), fall. out (4,) becomes log-evidence, magnetometer statistic and code, restarted.
    """
    dt = s[at.ELAPSED]
    turn, coupling = work[1, :3, :3], work[1, 3:6, :3]
    noise, gain, column = work[2, 0], work[2, 1], work[2, 2]
    for i in range(3):
        for j in range(3):
            turn[i, j] = s[at.TURN + 3 * i + j]
    fall = par[at.P_GRAVITY] * dt
    coupling_matrix(turn, s[at.V : at.V + 3], fall, coupling)
    # Errors of scale and alignment do not average out while the body keeps turning the same way.
    net = 0.0
    for i in range(3):
        s[at.SLOW_TURN + i] += min(1.0, dt / SCALE_TIME) * (s[at.WORLD_TURN + i] / dt - s[at.SLOW_TURN + i])
        net += s[at.SLOW_TURN + i] ** 2
    noise[0] = par[at.P_GYRO] ** 2 * dt
    noise[0] += par[at.P_SCALE] ** 2 * (2.0 * SCALE_TIME * net * dt + CORRELATION_TURN * s[at.TRAVEL])
    noise[1] = par[at.P_ACC] ** 2 * dt + par[at.P_ACC_SCALE] ** 2 * CORRELATION_TIME * s[at.SHAKE]
    noise[1] += par[at.P_GRAVITY] ** 2 * 0.05 * s[at.CLIPPED]
    noise[2] = par[at.P_WALK] ** 2 * dt
    noise[3] = 1e-8 * dt
    covariance_step(p, turn, coupling, fall, noise, work[0])
    if keep.size > 0:
        for i in range(3):
            for j in range(3):
                keep[3 * i + j] = turn[i, j]
                keep[9 + 3 * i + j] = coupling[i, j]
        for i in range(4):
            keep[18 + i] = noise[i]
        keep[22] = fall
    for i in range(at.OUTPUT_SIZE):
        out[i] = 0.0
    x[:] = 0.0
    gain[:] = 1.0
    evidence = 0.0
    at_rest = s[at.REST] > 0.0 and _rest_is_believed(s, p, par, dt)
    if s[at.ACC_TIME] > 0.0:
        span = s[at.ACC_TIME]
        speed2 = _typical_speed2(s, par, span)
        share = min(1.0, span / CONTRADICTION_TIME)
        ratio = 0.5 * (s[at.V] ** 2 / (p[3, 3] + speed2) + s[at.V + 1] ** 2 / (p[4, 4] + speed2))
        s[at.CONTRADICTION] += share * (ratio - s[at.CONTRADICTION])
        if s[at.CONTRADICTION] > CONTRADICTION_LIMIT and s[at.REST_SEEN] == 0.0 and s[at.AGE] > 1.0:
            _restart(s, p, par)
            out[at.O_RESTARTED] = 1.0
        # A velocity of 0, give or take the typical speed, once in twice its correlation time.
        variance = REST_SPEED**2 / span if at_rest else 2.0 * SWING_TIME * speed2 / span
        gain[2] = 0.0  # an accelerometer knows nothing about heading
        for i in range(3):
            for j in range(12):
                column[j] = p[j, 3 + i]
            evidence += scalar_update(p, x, column, column[3 + i], variance, -s[at.V + i] - x[3 + i], gain)
        gain[2] = 1.0
    if at_rest:
        s[at.REST_SEEN] = 1.0
        variance = 0.3 * par[at.P_REST_NOISE] ** 2 / dt
        for i in range(3):
            for j in range(12):
                column[j] = p[j, 6 + i]
            residual = s[at.BODY_TURN + i] / dt - s[at.BIAS + i] - x[6 + i]
            evidence += scalar_update(p, x, column, column[6 + i], variance, residual, gain)
    if s[at.FIELD_COUNT] > 0.0:
        evidence += field_update(s, p, par, x, gain, column, out)
    _correct(s, x)
    out[at.O_EVIDENCE] = evidence
    for i in range(at.ELAPSED, at.FIELD_COUNT + 1):
        s[i] = 0.0


@compiled()
def _correct(s, x):
    """Move the state by the estimated error x."""
    a, b, c, d = from_rotation_vector(x[0], x[1], x[2])
    a, b, c, d = product(a, b, c, d, s[0], s[1], s[2], s[3])
    n = 1.0 / math.sqrt(a * a + b * b + c * c + d * d)
    s[0], s[1], s[2], s[3] = a * n, b * n, c * n, d * n
    vx, vy, vz = s[at.V], s[at.V + 1], s[at.V + 2]
    s[at.V] += x[1] * vz - x[2] * vy + x[3]
    s[at.V + 1] += x[2] * vx - x[0] * vz + x[4]
    s[at.V + 2] += x[0] * vy - x[1] * vx + x[5]
    for i in range(3):
        s[at.BIAS + i] += x[6 + i]
        s[at.ACC_BIAS + i] += x[9 + i]
