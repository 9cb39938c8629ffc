"""The update that closes an interval of the inertial filter."""

from __future__ import annotations

import math

from bingham.kernels import imu_state as at
from bingham.kernels.compile import compiled
from bingham.kernels.imu_field import field_update
from bingham.kernels.imu_reported import judge
from bingham.kernels.imu_state import coupling_matrix, covariance_step, scalar_update
from bingham.kernels.quaternion import from_rotation_vector, product

__all__ = ["update"]

# Scale errors of accelerometer (time, s) and gyroscope (turn, rad) that have changed sign after this average out.
CORRELATION_TIME = 0.1
CORRELATION_TURN = 0.1
SCALE_TIME = 1.0
SWING_TIME = 1.0
CONTRADICTION_TIME = 2.0
# A bias prior three standard deviations off (χ² of one degree of freedom) is wrong.
CONTRADICTION_LIMIT = 9.0
LASTING_REST = 10.0  # s of a steady rate that no slow turn keeps up
REST_SPEED = 0.003  # m/s
MAXIMAL_SPEED = 3.0  # m/s, largest typical speed that is believed


@compiled()
def _typical_speed2(s, par, dt):
    """Track over dt seconds how fast the body swings about its mean velocity; return (m/s)² per axis.

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
    """Whether a steady rate is a bias and not a slow rotation; widen the bias where its prior was wrong.

    The first rest shows the bias, whatever the prior said. Afterwards a steady rate that contradicts the known bias
    is a slow rotation, unless it lasts.
    """
    contradicted = False
    for i in range(3):
        residual = s[at.BODY_TURN + i] / dt - s[at.BIAS + i]
        if residual * residual > CONTRADICTION_LIMIT * (p[6 + i, 6 + i] + par[at.P_REST_NOISE] ** 2):
            contradicted = True
    if not contradicted:
        s[at.REST_REJECTED] = 0.0
        return True
    s[at.REST_REJECTED] += dt
    if s[at.REST_SEEN] > 0.0 and s[at.REST_REJECTED] < LASTING_REST:
        return False
    for i in range(3):
        p[6 + i, 6 + i] += par[at.P_WIDE_BIAS] ** 2
    s[at.REST_REJECTED] = 0.0
    return True


@compiled()
def update(s, p, par, x, work, out, keep):
    """Close the interval: move the covariance (12, 12) over it, condition on what the sensors said, correct the state.

    x (12,) becomes the correction; work (3, 12, 12) is scratch; keep (26,), if not empty, gets what the smoother
    needs: turn (9), coupling (9), noise (4), fall, a place for `imu.run`, and what gaps added to the variances of θ
    and v. out (4,) becomes log-evidence, magnetometer statistic and code, restarted.
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
    tilt, heading = p[0, 0] + p[1, 1], p[2, 2]
    if keep.size > 0:
        for i in range(3):
            for j in range(3):
                keep[3 * i + j] = turn[i, j]
                keep[9 + 3 * i + j] = coupling[i, j]
        for i in range(4):
            keep[18 + i] = noise[i]
        keep[22] = fall
        keep[24], keep[25] = s[at.GAP_TURN], s[at.GAP_SPEED]
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
    judge(s, p, x, tilt, heading, dt)
    _correct(s, x)
    out[at.O_EVIDENCE] = evidence
    for i in range(at.ELAPSED, at.FIELD_COUNT + 1):
        s[i] = 0.0
    s[at.GAP_TURN] = s[at.GAP_SPEED] = 0.0


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
