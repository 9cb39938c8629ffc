"""Layout of the inertial filter's state and parameters, and the linear algebra of its covariance.

The state is one flat array and one 12×12 matrix, so that saving them saves everything. Error coordinates, in order:
θ (rotation vector, world axes: R_true = Exp(θ) R), v (velocity, world), b (gyroscope bias, body), a (accelerometer
bias, body); v_true = Exp(θ) v + δv, the right-invariant error of Barrau & Bonnabel (IEEE Trans. Autom. Control 62(4),
2017): its dynamics do not depend on heading, so an unknown heading leaves the inclination alone.
"""

from __future__ import annotations

import math

from bingham.kernels.compile import compiled

__all__ = ["coupling_matrix", "covariance_step", "rotation_matrix", "scalar_update", "transition_rows"]

# Slots of the state.
Q, BIAS, V, ACC_BIAS = 0, 4, 7, 10
ELAPSED, TURN, WORLD_TURN, TRAVEL = 13, 14, 23, 26  # since the last update: s, ∫R dt, ∫Rω dt, ∫|ω| dt
BODY_TURN, LINEAR, SHAKE, CLIPPED = 27, 30, 33, 34  # ∫ω dt (raw), ∫(R a − g) dt, ∫max(|a|² − g², 0) dt, s clipped
ACC_TIME, FIELD, FIELD_COUNT = 35, 36, 39  # s covered by accelerometer samples, Σ R m, number of m
SLOW_RATE, SLOW_ACC, REST_TIME, REST, REST_SEEN = 40, 43, 46, 47, 48
SLOW_FORCE, SWING, SLOW_SWING, SWING_POWER = 49, 52, 55, 58
SLOW_TURN, CONTRADICTION = 59, 62
REF_N, REF_U, REF_WEIGHT, NEW_N, NEW_U, NEW_TIME = 63, 64, 65, 66, 67, 68
HEADING_REJECTED, LAST_MAG, LAST_ACC, AGE, ALIGNED = 69, 70, 73, 76, 77
RATE = 78  # last raw gyroscope sample
REST_REJECTED = 81
# Corrections made, against those expected (`imu_reported`).
TILT_SUM, TILT_EXPECTED, TILT_RATIO, TILT_TIME = 82, 84, 85, 86
HEADING_SUM, HEADING_EXPECTED, HEADING_RATIO, HEADING_TIME = 87, 88, 89, 90
USUAL_STEP = 91  # running median of the gyroscope's steps, s
GAP_TURN, GAP_SPEED = 92, 93  # variances added for gaps since the last update, rad², (m/s)²
STATE_SIZE = 94
ERROR_SIZE = 12

# Slots of the parameters.
(
    P_GYRO, P_SCALE, P_PRIOR_BIAS, P_WIDE_BIAS, P_WALK, P_ACC, P_ACC_SCALE, P_ACC_BIAS, P_VELOCITY, P_WINDOW,
    P_REST_RATE, P_REST_ACC, P_REST_TIME, P_REST_NOISE, P_MAG, P_MAG_TIME, P_MEMORY, P_LIMIT, P_NEW_TIME,
    P_GRAVITY, P_DECLINATION, P_INTERVAL, P_DELAY, P_ALIGNMENT,
) = range(24)  # fmt: skip
PARAMETER_SIZE = 24

# Slots of what an update says.
O_EVIDENCE, O_STATISTIC, O_CODE, O_RESTARTED = 0, 1, 2, 3
OUTPUT_SIZE = 4

LOG_2PI = math.log(2.0 * math.pi)


@compiled(inline=True)
def rotation_matrix(rotation, q):
    """Write the matrix (3, 3) of the quaternion at q[0:4]."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    rotation[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    rotation[0, 1] = 2.0 * (x * y - w * z)
    rotation[0, 2] = 2.0 * (x * z + w * y)
    rotation[1, 0] = 2.0 * (x * y + w * z)
    rotation[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    rotation[1, 2] = 2.0 * (y * z - w * x)
    rotation[2, 0] = 2.0 * (x * z - w * y)
    rotation[2, 1] = 2.0 * (y * z + w * x)
    rotation[2, 2] = 1.0 - 2.0 * (x * x + y * y)


@compiled()
def scalar_update(p, x, column, prediction, variance, residual, gain):
    """Condition on one number: residual = h·e + noise, e ~ (x, p); return its log-density.

    column (12,) is p h, prediction hᵀp h, gain (12,) the factors by which the optimal gain is taken: 1, or 0 for
    coordinates the measurement must not move. p − k cᵀ − c kᵀ + s k kᵀ is the true covariance for any gain k (Joseph).
    """
    n = p.shape[0]  # not the literal 12, which would be unrolled and cost seconds of compilation
    s = prediction + variance
    for i in range(n):
        ki = gain[i] * column[i] / s
        x[i] += ki * residual
        for j in range(i, n):
            kj = gain[j] * column[j] / s
            v = p[i, j] - ki * column[j] - column[i] * kj + s * ki * kj
            p[i, j] = v
            p[j, i] = v
    return -0.5 * (residual * residual / s + math.log(s) + LOG_2PI)


@compiled()
def transition_rows(m, out, turn, coupling, fall):
    """Write out = F m, F = I except θ←b: −turn, v←θ: fall (0 g; −g 0), v←b: coupling, v←a: −turn (12, n)."""
    n = m.shape[1]
    for i in range(n):
        for j in range(n):
            out[i, j] = m[i, j]
    for i in range(3):
        for k in range(3):
            t, c = turn[i, k], coupling[i, k]
            for j in range(n):
                out[i, j] -= t * m[6 + k, j]
                out[3 + i, j] += c * m[6 + k, j] - t * m[9 + k, j]
    for j in range(n):
        out[3, j] += fall * m[1, j]
        out[4, j] -= fall * m[0, j]


@compiled()
def coupling_matrix(turn, velocity, fall, out):
    """Write v←b over the step: −v × (turn ·) and, to second order, gravity through the tilt the bias makes."""
    for j in range(3):
        x, y, z = turn[0, j], turn[1, j], turn[2, j]
        out[0, j] = -(velocity[1] * z - velocity[2] * y) - 0.5 * fall * y
        out[1, j] = -(velocity[2] * x - velocity[0] * z) + 0.5 * fall * x
        out[2, j] = -(velocity[0] * y - velocity[1] * x)


@compiled()
def covariance_step(p, turn, coupling, fall, noise, work):
    """Replace p by F p Fᵀ + diag(noise[0] θ, noise[1] v, noise[2] b, noise[3] a)."""
    n = p.shape[0]
    transition_rows(p, work, turn, coupling, fall)
    for i in range(n):
        for j in range(i):
            work[i, j], work[j, i] = work[j, i], work[i, j]
    transition_rows(work, p, turn, coupling, fall)
    for i in range(n):
        p[i, i] += noise[i // 3]
        for j in range(i):
            v = 0.5 * (p[i, j] + p[j, i])
            p[i, j] = v
            p[j, i] = v
