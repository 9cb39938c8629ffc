"""The inertial filter's model: state, transition F, noise Q, measurements H (derived in docs/theory/inertial.rst).

Errors e, in order: θ (world axes, R_true = Exp(θ) R), v (horizontal velocity, world), b (gyroscope bias, body) and a
(accelerometer bias, body); v_true = Exp(θ) v + δv is the right-invariant error of Barrau & Bonnabel (IEEE
Trans. Autom. Control 62(4), 2017), whose dynamics do not depend on heading: an unknown one leaves the tilt alone.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.quaternion import from_rotation_vector, product

__all__ = [
    "SIZE",
    "STATE",
    "WORK",
    "begin",
    "condition",
    "copy",
    "correct",
    "last_variance",
    "predict",
    "rotation_matrix",
    "update",
]

THETA, VELOCITY, BIAS, FORCE_BIAS, SIZE = 0, 3, 5, 8, 11
RECENT = 1024  # rates kept to recognise repeated blocks
STATE = np.dtype([
    # The estimate: unit quaternion, m/s, rad/s, m/s²; covariance of the errors.
    ("orientation", "f8", 4), ("velocity", "f8", 2), ("bias", "f8", 3), ("force_bias", "f8", 3),
    ("covariance", "f8", (SIZE, SIZE)),
    # 0 before the start, −1 prepared for the first accelerometer sample, −2 for the first orientation, 1 running;
    # seconds since the first sample; times of the last one of gyroscope, accelerometer, magnetometer, orientations.
    ("phase", "i8"), ("age", "f8"), ("last", "f8", 4),
    # Sums since the last update: s, ∫R dt, ∫Rω dt, ∫|ω| dt, ∫ω dt (raw), ∫(Rf − g) dt, ∫max(|f|² − g², 0) dt, s of
    # force and of clipped force, ΣRm, number of m.
    ("elapsed", "f8"), ("turn", "f8", (3, 3)), ("rotated", "f8", 3), ("travel", "f8"), ("raw_rotated", "f8", 3),
    ("impulse", "f8", 3), ("shake", "f8"), ("force_time", "f8"), ("clipped_time", "f8"), ("field", "f8", 3),
    ("field_count", "f8"),
    # Variances that faults add at the next update: θ (world), v, b; index of a restart's sample.
    ("lost", "f8", (3, 3)), ("lost_velocity", "f8"), ("lost_bias", "f8"), ("restarted", "i8"),
    # Last samples, those held back as implausible, usual steps between samples, see `imu_loop`.
    ("rate", "f8", 3), ("force", "f8", 3), ("last_field", "f8", 3), ("held_rate", "f8", 3), ("held_force", "f8", 3),
    ("held", "i8", 2), ("held_time", "f8", 2), ("force_change", "f8", 3), ("blank", "i8"), ("blank_time", "f8"),
    ("usual_jump", "f8", 2), ("usual_step", "f8"), ("usual_field", "f8"), ("range", "f8"), ("top", "f8"),
    ("flat_time", "f8", 3), ("slope", "f8", (2, 3)), ("coarse", "f8"), ("repeat_time", "f8"),
    # The latest rates, each as one number, and the place where a number was last seen; how many came; by how many a
    # repetition lags, and its length so far; the time now.
    ("recent", "f8", RECENT), ("place", "i8", RECENT), ("count", "i8"), ("lag", "i8"), ("matched", "i8"), ("now", "f8"),
    # What was done about faults: samples rejected of gyroscope, accelerometer, magnetometer; rows of zeros; samples of
    # a clipping and of a frozen gyroscope, repeated ones; gaps; restarts; contradictions; orientations rejected.
    ("faults", "i8", 11),
    # Motion: means over 0.5 s, s of quiet, rest; slow parts of force, swing and rate; variance of the velocity's slow
    # part and of all of it; tilt (θ₀, θ₁) that a velocity shows now, see `ending`.
    ("slow_rate", "f8", 3), ("slow_force", "f8", 3), ("force_deviation", "f8"), ("quiet_time", "f8"), ("resting", "i8"),
    ("rest_seen", "i8"), ("rest_refused", "f8"), ("mean_force", "f8", 3), ("swing", "f8", 3), ("slow_swing", "f8", 3),
    ("swing_power", "f8"), ("speed_power", "f8"), ("slow_turn", "f8", 3), ("ending", "f8", (2, 2)),
    # The age at the last start and ∫Rf dt since then, m/s, world: see `start_again`.
    ("begun", "f8"), ("since_begun", "f8", 3),
    # Corrections of the tilt in standard deviations and the variance expected of their sum; what they say about noise
    # and reported variance.
    ("drift", "f8", 2), ("drift_expected", "f8"), ("noise", "f8"), ("level", "f8"), ("level_time", "f8"),
    ("surprise", "f8"), ("contradiction", "f8"),
    # Expected field (horizontal, up), its weight in s; the field that may replace it, and for how long it has lasted.
    ("north", "f8"), ("up", "f8"), ("field_weight", "f8"), ("new_north", "f8"), ("new_up", "f8"), ("new_time", "f8"),
    ("heading_refused", "f8"), ("residual_mean", "f8"), ("residual_variance", "f8"),
    # Orientations, see `imu_orientation`: the one that waits; of the last, code, NIS, log-evidence; how many were used;
    # how many that agree were rejected, the last one's time and residual; variances of tilt and heading that rest on a
    # single one; corrections and what is expected of their sum, what they say about the gyroscope's noise; s since its
    # last sample. Variance of the heading at the start, rad², kept apart until something shows the heading.
    ("seen", "i8"), ("seen_time", "f8"), ("seen_orientation", "f8", 4), ("seen_covariance", "f8", (3, 3)),
    ("seen_code", "i8"), ("seen_nis", "f8"), ("seen_evidence", "f8"), ("seen_count", "i8"), ("refused", "i8"),
    ("refused_time", "f8"), ("refused_by", "f8", 3), ("doubt", "f8", 2), ("seen_drift", "f8", 3),
    ("seen_expected", "f8", 3), ("seen_noise", "f8"), ("unseen", "f8"), ("unknown_heading", "f8"),
    # ∫(Rᵀẑ) ωᵀ dt since the start: constant errors of scale and axes turn the heading by its product with them.
    ("turned", "f8", (3, 3)),
    # Standard deviation of a bias as the biases found say, rad/s: see `scale_of_biases`.
    ("bias_scale", "f8"),
    # Of the last update: log-evidence, statistic and code of the magnetometer.
    ("evidence", "f8"), ("statistic", "f8"), ("code", "i8"),
], align=True)  # fmt: skip
WORK = np.dtype([
    ("F", "f8", (SIZE, SIZE)), ("Q", "f8", (SIZE, SIZE)), ("product", "f8", (SIZE, SIZE)),
    ("predicted", "f8", (SIZE, SIZE)), ("h", "f8", SIZE), ("column", "f8", SIZE), ("moves", "f8", SIZE),
    ("error", "f8", SIZE), ("rotation", "f8", (3, 3)), ("before", "f8", SIZE), ("residual", "f8", 3),
    ("noise", "f8", (3, 3)),
], align=True)  # fmt: skip

ABSENT, USED, STRENGTH, DIP, HEADING, REPEATED, PENDING, EARLY, ABSURD = range(9)
CONTRADICTIONS = 9  # their place among the faults
LOG_2PI = math.log(2.0 * math.pi)
UNKNOWN = 20.0  # rad², the variance of an unknown angle: nothing is left of it modulo a turn

# First sample: its direction is up within 0.1 rad if its size is g; before its motion is known a body may swing by
# 0.16 m/s, and at 0.8 Hz, the slow end of human motion, as fast as its first acceleration says.
FIRST_TILT = 0.1
FIRST_SWING = 0.16
START_TIME = (0.2, 1.0)  # s after a start in which the mean force may prove it to have been none
NONLINEAR = 0.5  # rad, a tilt that no linear correction takes back
SWING_PERIOD = 0.2  # s/rad
# Scale errors that have changed sign after this (time, rotation angle) average out.
CORRELATION_TIME = 0.1  # s
CORRELATION_TURN = 0.1  # rad
SCALE_TIME = 1.0  # s
SWING_TIME = 1.0  # s, correlation time of a velocity that can be mistaken for a tilt
ACCELERATION_TIME = 0.15  # s, in which a body comes to its usual speed
REST_SPEED = 0.003  # m/s
FORGOTTEN_TIME = 0.5  # s without a force, after which nothing is known of the velocity
WATCHED_TIME = 5.0  # s after an orientation, in which that and not rest shows the bias: a slow turn looks like rest
DOUBTFUL_TILT = 0.05  # rad², variance of a tilt that says nothing about motion
MAXIMAL_SPEED = 3.0  # m/s, largest swing that is believed
FAST = 1.7  # m/s, a swing beyond which a body also travels
MAXIMAL_BIAS = 0.25  # rad/s; no gyroscope that is one has more
MAXIMAL_FORCE_BIAS = 0.5  # m/s²
BEYOND_PRIOR = 2.0  # deviations of its prior at which a bias says that the prior is too narrow
LASTING_REST = 10.0  # s of a steady rate that no slow turn keeps up
LIMIT = 9.0  # χ² of one degree of freedom: three standard deviations
# Consistency: corrections are summed over DRIFT_TIME; the noise of the tilt follows what they say within ADAPT_TIME, up
# to MAXIMAL_NOISE times what is given (a scale error of 0.16 for 0.003), reported variances within LEVEL_TIME; ratios
# beyond MAXIMAL_RATIO count as that.
DRIFT_TIME = 2.0  # s
ADAPT_TIME = 5.0  # s
MAXIMAL_NOISE = 3000.0
LEVEL_TIME = 30.0  # s
MAXIMAL_RATIO = 20.0
CONTRADICTION_TIME = 2.0  # s over which a velocity must be one that tilt and usual motion do not explain
WIDENING = 0.1  # share of the tilt variance that would explain it by which the tilt is widened
# Field.
REST_LASTS = 3.0  # a field error lasts that many times longer where the body rests: it stays in its place
RESIDUAL_TIME = 30.0  # s over which the variance of the heading's residual is taken: a field that turns
RESIDUAL_SHARE = 0.2  # of it that counts as the field's error
UNKNOWN_HEADING = 1.0  # rad², beyond which one sample sets the heading
NEW_FIELD_TIME = 5.0  # s over which a new field is averaged
HEADING_LIMIT = 100.0  # a heading ten standard deviations off contradicts the estimate


@compiled(inline=True)
def rotation_matrix(rotation, q):
    """Write the matrix (3, 3) of the unit quaternion q (4,)."""
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


@compiled(inline=True)
def rotate_left(q, x, y, z):
    """Replace q (4,) by Exp((x, y, z)) ⊗ q, normalised."""
    a, b, c, d = from_rotation_vector(x, y, z)
    a, b, c, d = product(a, b, c, d, q[0], q[1], q[2], q[3])
    n = 1.0 / math.sqrt(a * a + b * b + c * c + d * d)
    q[0], q[1], q[2], q[3] = a * n, b * n, c * n, d * n


@compiled(inner=True)
def rotation_between(r, m, q):
    """Write the first three of r with m = Exp(r) ⊗ q, |r| ≤ π."""
    a, b, c, d = product(m[0], m[1], m[2], m[3], q[0], -q[1], -q[2], -q[3])
    if a < 0.0:
        a, b, c, d = -a, -b, -c, -d
    sine = math.sqrt(b * b + c * c + d * d)
    factor = 2.0 if sine < 1e-9 else 2.0 * math.atan2(sine, a) / sine
    r[0], r[1], r[2] = factor * b, factor * c, factor * d


@compiled(inner=True)
def begin(s, par, f):
    """Start anew from the specific force f (3,): tilt from its direction, heading and biases as they are."""
    p = s.covariance
    size = math.sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2])
    w, x, y, z = s.orientation[0], s.orientation[1], s.orientation[2], s.orientation[3]
    tx, ty, tz = 2.0 * (y * f[2] - z * f[1]), 2.0 * (z * f[0] - x * f[2]), 2.0 * (x * f[1] - y * f[0])
    ux, uy = (f[0] + w * tx + y * tz - z * ty) / size, (f[1] + w * ty + z * tx - x * tz) / size
    uz = (f[2] + w * tz + x * ty - y * tx) / size
    sine = math.sqrt(ux * ux + uy * uy)
    angle = math.atan2(sine, uz)
    if sine > 1e-9:
        rotate_left(s.orientation, uy / sine * angle, -ux / sine * angle, 0.0)
    elif uz < 0.0:
        rotate_left(s.orientation, angle, 0.0, 0.0)
    excess = size - par.gravity
    tilt2 = FIRST_TILT**2 + (excess / par.gravity) ** 2
    swing2 = FIRST_SWING**2 + (SWING_PERIOD * excess) ** 2
    heading = min(UNKNOWN, p[2, 2] + s.lost[2, 2])
    swing2 = max(swing2, s.speed_power)
    for i in range(BIAS):
        for j in range(SIZE):
            p[i, j] = 0.0
            p[j, i] = 0.0
    for i in range(3):
        p[i, i] = min(tilt2, 1.0) if i < 2 else heading
        p[BIAS + i, BIAS + i] = min(p[BIAS + i, BIAS + i] + s.lost_bias, par.gyroscope_wide_bias**2)
        s.mean_force[i] = s.swing[i] = s.slow_swing[i] = 0.0
    for i in range(2):
        p[VELOCITY + i, VELOCITY + i] = 2.0 * swing2
        s.velocity[i] = 0.0
    s.swing_power = s.speed_power = swing2
    s.begun = s.age
    s.since_begun[:] = 0.0
    s.drift[:] = 0.0
    s.drift_expected = 0.0
    clear(s)


@compiled(inner=True)
def clear(s):
    """Begin a new interval."""
    s.elapsed = s.travel = s.shake = s.force_time = s.clipped_time = s.field_count = 0.0
    s.lost_velocity = s.lost_bias = 0.0
    for i in range(3):
        s.rotated[i] = s.raw_rotated[i] = s.impulse[i] = s.field[i] = 0.0
        for j in range(3):
            s.turn[i, j] = s.lost[i, j] = 0.0


@compiled(inner=True)
def transition(s, par, F):
    """Write F: θ ← θ − C b; v ← v + g dt (θ × up) + K b − C a, with C = ∫R dt and K = −v × C + g dt (up × C)/2."""
    fall = par.gravity * s.elapsed
    for i in range(SIZE):
        for j in range(SIZE):
            F[i, j] = 1.0 if i == j else 0.0
    for j in range(3):
        x, y, z = s.turn[0, j], s.turn[1, j], s.turn[2, j]
        F[0, BIAS + j], F[1, BIAS + j], F[2, BIAS + j] = -x, -y, -z
        F[3, BIAS + j] = -s.velocity[1] * z - 0.5 * fall * y
        F[4, BIAS + j] = s.velocity[0] * z + 0.5 * fall * x
        F[3, FORCE_BIAS + j], F[4, FORCE_BIAS + j] = -x, -y
    F[3, 1] = fall
    F[4, 0] = -fall


@compiled(inner=True)
def process_noise(s, par, Q):
    """Write Q: white noise, scale errors that do not average out while the body keeps turning one way, faults."""
    dt = s.elapsed
    net = 0.0
    for i in range(3):
        s.slow_turn[i] += min(1.0, dt / SCALE_TIME) * (s.rotated[i] / dt - s.slow_turn[i])
        net += s.slow_turn[i] ** 2
    theta = par.gyroscope_noise**2 * dt
    theta += par.gyroscope_scale_error**2 * (2.0 * SCALE_TIME * net * dt + CORRELATION_TURN * s.travel)
    velocity = par.accelerometer_noise**2 * dt + par.accelerometer_scale_error**2 * CORRELATION_TIME * s.shake
    velocity += par.gravity**2 * 0.05 * s.clipped_time + s.lost_velocity
    for i in range(3):
        for j in range(3):
            Q[i, j] = s.lost[i, j]
        Q[i, i] += s.seen_noise * theta * (s.noise if i < 2 else 1.0)
        Q[BIAS + i, BIAS + i] = par.gyroscope_bias_walk**2 * dt + s.lost_bias
        Q[FORCE_BIAS + i, FORCE_BIAS + i] = 1e-8 * dt
    Q[3, 3] = Q[4, 4] = velocity


@compiled(inner=True)
def copy(target, source):
    """Copy a matrix; Numba's own assignment of slices takes four seconds to compile."""
    n = source.shape[0]
    for i in range(n):
        for j in range(n):
            target[i, j] = source[i, j]


@compiled(inner=True)
def predict(s, w):
    """P ← F P Fᵀ + Q, kept in w.predicted too; zeros of F cost nothing."""
    p, a = s.covariance, w.product
    n = p.shape[0]  # not the literal, which would be unrolled and cost seconds of compilation
    for i in range(n):
        for j in range(n):
            a[i, j] = p[i, j]
        for k in range(n):
            f = w.F[i, k]
            if f != 0.0 and k != i:
                for j in range(n):
                    a[i, j] += f * p[k, j]
    for i in range(n):
        for j in range(i + 1):
            total = w.Q[i, j] + a[i, j]
            for k in range(n):
                f = w.F[j, k]
                if f != 0.0 and k != j:
                    total += a[i, k] * f
            p[i, j] = total
            p[j, i] = total
    for i in range(n):  # an unknown angle or speed does not grow for ever
        most = UNKNOWN if i < VELOCITY else 1e4 if i < BIAS else 1.0
        if p[i, i] > most:
            root = math.sqrt(most / p[i, i])
            for j in range(n):
                p[i, j] *= root
                p[j, i] *= root
    copy(w.predicted, p)


@compiled(inner=True)
def condition(p, w, innovation, variance):
    """Condition on one number, innovation = h·(e − x) + noise; return its log-density.

    w.h (12,) is h, w.error the estimated error x, w.moves factors by which the optimal gain is taken: 1, or 0 for
    errors that the measurement must not move. P − k cᵀ − c kᵀ + s k kᵀ is the true covariance for any gain (Joseph).
    """
    n = p.shape[0]
    h, column, x, moves = w.h, w.column, w.error, w.moves
    for i in range(n):
        column[i] = 0.0
    s = variance
    for k in range(n):
        f = h[k]
        if f != 0.0:
            for i in range(n):
                column[i] += f * p[k, i]
    for k in range(n):
        s += h[k] * column[k]
    for i in range(n):
        ki = moves[i] * column[i] / s
        x[i] += ki * innovation
        for j in range(i, n):
            kj = moves[j] * column[j] / s
            v = p[i, j] - ki * column[j] - column[i] * kj + s * ki * kj
            p[i, j] = v
            p[j, i] = v
    return -0.5 * (innovation * innovation / s + math.log(s) + LOG_2PI)


@compiled(inner=True)
def correct(s, x):
    """Move the state by the estimated error x (12,)."""
    rotate_left(s.orientation, x[0], x[1], x[2])
    vx, vy = s.velocity[0], s.velocity[1]
    s.velocity[0] += x[3] - x[2] * vy
    s.velocity[1] += x[4] + x[2] * vx
    for i in range(3):
        s.bias[i] = min(max(s.bias[i] + x[BIAS + i], -MAXIMAL_BIAS), MAXIMAL_BIAS)
        change = x[FORCE_BIAS + i]
        s.force_bias[i] = min(max(s.force_bias[i] + change, -MAXIMAL_FORCE_BIAS), MAXIMAL_FORCE_BIAS)


@compiled(inner=True)
def speed_variance(s, par, dt):
    """Track over dt seconds how fast the body swings about its mean velocity; return (m/s)² per axis of its slow part.

    The linear acceleration, freed of its mean (a tilt error looks like one), is integrated with a leak; what is left
    after smoothing over `SWING_TIME` is the part of the velocity slow enough to be mistaken for a tilt.
    """
    gain = min(1.0, dt / par.motion_window)
    slow = whole = 0.0
    for i in range(3):
        force = s.impulse[i] / dt
        s.mean_force[i] += gain * (force - s.mean_force[i])
        s.swing[i] += (force - s.mean_force[i]) * dt - gain * s.swing[i]
        s.slow_swing[i] += min(1.0, dt / SWING_TIME) * (s.swing[i] - s.slow_swing[i])
        slow += s.slow_swing[i] ** 2
        whole += s.swing[i] ** 2
    if s.covariance[0, 0] + s.covariance[1, 1] < DOUBTFUL_TILT:  # else gravity is taken for motion
        s.swing_power += gain * (min(slow / 3.0, MAXIMAL_SPEED**2) - s.swing_power)
        s.speed_power += gain * (min(whole / 3.0, MAXIMAL_SPEED**2) - s.speed_power)
    return travelling(s, par, s.swing_power) + par.slow_velocity**2


@compiled(inline=True)
def travelling(s, par, swing2):
    """Return the variance of a velocity whose swing has the variance swing2: limbs swing, what is faster is a vehicle.

    A vehicle turns for longer than `motion_window`, which shows of its speed only a part; before that it is a guess.
    """
    return swing2 * (1.0 + (swing2 / FAST**2) ** 2) if s.age - s.begun > par.motion_window else swing2


@compiled(inner=True)
def rest_is_believed(s, par, dt):
    """Whether a steady rate is a bias and not a slow turn; widen the bias where its prior was wrong.

    The first rest shows the bias, whatever the prior said: where the mean over `QUIET_TIME`, not a noisy interval,
    contradicts it. Afterwards a steady rate that contradicts the known bias is a slow turn, unless it lasts.
    """
    contradicted = steady = False
    for i in range(3):
        residual = s.raw_rotated[i] / dt - s.bias[i]
        allowed = LIMIT * (s.covariance[BIAS + i, BIAS + i] + par.rest_rate_error**2)
        steady = steady or (s.slow_rate[i] - s.bias[i]) ** 2 > allowed
        if abs(s.raw_rotated[i]) > MAXIMAL_BIAS * dt:
            return False
        if residual * residual > allowed:
            contradicted = True
    if not contradicted:
        s.rest_refused = 0.0
        return True
    s.rest_refused += dt
    if not steady or (s.rest_seen > 0 and s.rest_refused < LASTING_REST):
        return False
    s.lost_bias += par.gyroscope_wide_bias**2
    s.rest_refused = 0.0
    return False


@compiled(inner=True)
def update(s, par, w):
    """Close the interval: move the covariance over it, condition on what the sensors said, correct the state.

    Afterwards w.F, w.predicted and w.error hold F, P⁻ and the correction.
    """
    dt = s.elapsed
    p, h, x = s.covariance, w.h, w.error
    if s.field_count > 0.0:
        p[2, 2] += s.unknown_heading
        s.unknown_heading = 0.0
    transition(s, par, w.F)
    process_noise(s, par, w.Q)
    predict(s, w)
    s.lost[:, :] = 0.0
    s.lost_velocity = s.lost_bias = 0.0
    x[:] = 0.0
    h[:] = 0.0
    w.moves[:] = 1.0
    s.evidence = 0.0
    s.code, s.statistic = ABSENT, math.nan
    for i in range(3):
        for j in range(3):
            s.turned[i, j] += s.turn[2, i] / dt * (s.raw_rotated[j] - s.bias[j] * dt)
    watched = s.seen_count > 0 and s.last[0] - s.last[3] < WATCHED_TIME
    at_rest = s.resting > 0 and (watched or rest_is_believed(s, par, dt))
    if s.force_time > 0.0:
        span = s.force_time
        speed2 = speed_variance(s, par, span)
        tilt_consistency(s, par, span)
        w.moves[2] = 0.0  # an accelerometer knows nothing about heading
        if not at_rest and s.clipped_time == 0.0:
            # A mean acceleration of 0: what the velocity's variance allows if it changes as a random walk.
            variance = last_variance(s, par) / (ACCELERATION_TIME * span)
            for i in range(2):
                h[1 - i] = par.gravity if i == 0 else -par.gravity
                s.evidence += condition(p, w, -s.impulse[i] / span - h[1 - i] * x[1 - i], variance)
                h[1 - i] = 0.0
        # A velocity of 0, give or take the typical speed, once in twice its correlation time.
        variance = (REST_SPEED**2 if at_rest else 2.0 * SWING_TIME * speed2) / span
        for i in range(2):
            h[VELOCITY + i] = 1.0
            s.evidence += condition(p, w, -s.velocity[i] - x[VELOCITY + i], variance)
            h[VELOCITY + i] = 0.0
        w.moves[2] = 1.0
    if at_rest and not watched:
        s.rest_seen = 1
        for i in range(3):
            h[BIAS + i] = 1.0
            innovation = s.raw_rotated[i] / dt - s.bias[i] - x[BIAS + i]
            s.evidence += condition(p, w, innovation, 0.3 * par.rest_rate_error**2 / dt)
            h[BIAS + i] = 0.0
    if s.field_count > 0.0:
        s.evidence += heading_update(s, par, w)
    if s.force_time > 0.0:
        watch(s, w, dt)
    elif math.isnan(s.last[1]) or s.last[0] - s.last[1] > FORGOTTEN_TIME:
        forget_velocity(p, par)
    correct(s, x)
    if s.age - s.begun < START_TIME[1]:
        start_again(s, par, w)
    ending(s, par)
    scale_of_biases(s, par)
    keep = s.lost.copy()
    v, b = s.lost_velocity, s.lost_bias
    clear(s)
    copy(s.lost, keep)
    s.lost_velocity, s.lost_bias = v, b


@compiled(inner=True)
def start_again(s, par, w):
    """Begin from the mean force since the start where that is too far from up for linear corrections.

    The mean errs by the change of velocity over g t: after some tenths of a second by less than its first sample. The
    turn that this takes is added to w.error, as the smoother hands it back.
    """
    m, x, q, f, old = s.since_begun, w.error, s.orientation, w.residual, w.before
    m[2] += par.gravity * s.force_time
    for i in range(3):
        m[i] += s.impulse[i]
    a, b, c, d = from_rotation_vector(x[0], x[1], x[2])
    turn(m, m, a, b, c, d)
    size = math.sqrt(m[0] ** 2 + m[1] ** 2 + m[2] ** 2)
    tilt = math.atan2(math.hypot(m[0], m[1]), m[2])
    begun, time = s.begun, s.age - s.begun
    if tilt < NONLINEAR or time < START_TIME[0] or size < 0.5 * par.gravity * time:  # a body that falls shows no up
        return
    for i in range(4):
        old[i] = q[i]
    rotate_left(old, -x[0], -x[1], -x[2])
    turn(f, m, q[0], -q[1], -q[2], -q[3])
    for i in range(3):
        f[i] /= time
    s.speed_power = max(s.speed_power, (SWING_PERIOD * par.gravity * tilt) ** 2)
    if s.field_weight > 0.0:  # it has set the heading by the wrong vertical
        s.lost[2, 2] += tilt * tilt
    begin(s, par, f)
    for i in range(2):
        s.covariance[i, i] = min(1.0, s.covariance[i, i] + 2.0 * s.speed_power / (par.gravity * time) ** 2)
    s.begun = begun
    m[0], m[1], m[2] = 0.0, 0.0, size
    rotation_between(x, q, old)


@compiled(inner=True)
def turn(out, v, a, b, c, d):
    """Write v (3,) turned by the unit quaternion (a, b, c, d)."""
    e, f, g, h = product(a, b, c, d, 0.0, v[0], v[1], v[2])
    _, out[0], out[1], out[2] = product(e, f, g, h, a, -b, -c, -d)


@compiled(inner=True)
def last_variance(s, par):
    """Return 2 σ² with the variance σ² of the velocity, (m/s)² per axis: see `ending`."""
    return 2.0 * (travelling(s, par, s.speed_power) + par.slow_velocity**2)


@compiled(inner=True)
def ending(s, par):
    """Write P_θv (P_vv + 2 σ²)⁻¹, what a velocity now shows of the tilt.

    An Ornstein-Uhlenbeck velocity has −log p = (v(0)² + v(T)²)/(4 σ²) + ∫(v²/τ + τ a²) dt/(4 σ²):
    the last one is 0 ± √2 σ, for the present estimate only and not for those to come.
    """
    p = s.covariance
    variance = last_variance(s, par)
    a, b, d = p[3, 3] + variance, p[3, 4], p[4, 4] + variance
    size = a * d - b * b
    for i in range(2):
        s.ending[i, 0] = (d * p[i, 3] - b * p[i, 4]) / size
        s.ending[i, 1] = (a * p[i, 4] - b * p[i, 3]) / size


@compiled(inner=True)
def scale_of_biases(s, par):
    """Widen the bias where one axis's, until rest shows them, is beyond twice what was expected of all of them.

    The prior of one sensor's biases is N(0, σ²) with one σ, of which the largest one tells: the others may be like it.
    """
    if s.rest_seen > 0:
        return
    largest = 0.0
    for i in range(3):
        largest = max(largest, abs(s.bias[i]))
    scale = min(largest, par.gyroscope_wide_bias)
    if largest > BEYOND_PRIOR * s.bias_scale and scale > s.bias_scale:
        s.lost_bias += scale * scale - s.bias_scale * s.bias_scale
        s.bias_scale = scale


@compiled(inner=True)
def forget_velocity(p, par):
    """Make the velocity error unknown and independent: without forces it says nothing about the tilt."""
    n = p.shape[0]
    for i in range(VELOCITY, BIAS):
        for j in range(n):
            p[i, j] = p[j, i] = 0.0
    for i in range(VELOCITY, BIAS):
        p[i, i] = 1.0 + par.slow_velocity**2


@compiled(inner=True)
def tilt_consistency(s, par, dt):
    """Widen the estimate where the horizontal velocity, for seconds, is none that tilt and usual motion explain."""
    p = s.covariance
    usual2 = s.swing_power + par.slow_velocity**2
    ratio = 0.5 * (s.velocity[0] ** 2 / (p[3, 3] + usual2) + s.velocity[1] ** 2 / (p[4, 4] + usual2))
    s.contradiction += min(1.0, dt / CONTRADICTION_TIME) * (ratio - s.contradiction)
    if s.contradiction > LIMIT and s.age > 1.0:
        speed2 = s.velocity[0] ** 2 + s.velocity[1] ** 2
        for i in range(2):
            s.lost[i, i] += WIDENING * speed2 / (par.gravity * CONTRADICTION_TIME) ** 2
        if s.rest_seen == 0:  # the prior of the bias is in doubt
            s.lost[2, 2] += 0.25
            s.lost_bias += par.gyroscope_wide_bias**2
        s.contradiction = 0.0
        s.faults[CONTRADICTIONS] += 1


@compiled(inner=True)
def watch(s, w, dt):
    """Hold the corrections made against those expected; adapt the noise of the tilt and what is reported.

    The corrections of a filter whose noises are described rightly are uncorrelated and have the variance P⁻ − P⁺
    (Mehra, IEEE Trans. Autom. Control 15(2), 1970, for innovations). One-sided ones add up over `DRIFT_TIME`.
    """
    leak = math.exp(-dt / DRIFT_TIME)
    p, before, x = s.covariance, w.predicted, w.error
    tilt = before[0, 0] + before[1, 1]
    s.drift[0] = leak * s.drift[0] + x[0] / math.sqrt(tilt)
    s.drift[1] = leak * s.drift[1] + x[1] / math.sqrt(tilt)
    s.drift_expected = leak * leak * s.drift_expected + max(1.0 - (p[0, 0] + p[1, 1]) / tilt, 1e-9)
    if s.resting == 0:
        ratio = (s.drift[0] ** 2 + s.drift[1] ** 2) / s.drift_expected
        s.noise *= math.exp(dt / ADAPT_TIME * (min(ratio, MAXIMAL_RATIO) - 1.0))
        s.noise = min(max(s.noise, 1.0), MAXIMAL_NOISE)
        s.level_time = min(max(s.level_time, 5.0) + dt, LEVEL_TIME)
        s.level += dt / s.level_time * (min(ratio, MAXIMAL_RATIO) - s.level)
        s.surprise = ratio


@compiled(inner=True)
def heading_update(s, par, w):
    """Correct heading and bias by the mean field of the interval; return the log-evidence, set statistic and code.

    Of a disturbance only two components can be seen: those that change the field's horizontal and its upward part. The
    third turns the heading. It is taken to be as large as the two visible ones, so that a disturbed sample is not
    dropped but counts for less, and none is believed more than its surroundings allow.
    """
    dt, p = s.elapsed, s.covariance
    east, north, up = s.field[0] / s.field_count, s.field[1] / s.field_count, s.field[2] / s.field_count
    horizontal = math.sqrt(east * east + north * north)
    if s.field_weight == 0.0:
        s.north, s.up, s.new_north, s.new_up = horizontal, up, horizontal, up
    if horizontal == 0.0:
        s.code, s.statistic = DIP, math.inf
        return 0.0
    scale = max(min(horizontal, s.north), 1e-300)
    visible2 = (horizontal - s.north) ** 2 + (up - s.up) ** 2
    hidden2 = 0.5 * visible2 / (scale * scale)
    own2 = par.magnetometer_error**2
    variance = own2 + hidden2
    # The expected field follows the samples, slower the less they are believed.
    weight = own2 / variance
    s.field_weight += dt * weight
    rate = max(dt / par.field_memory, dt / max(s.field_weight, dt))
    s.north += rate * weight * (horizontal - s.north)
    s.up += rate * weight * (up - s.up)
    s.statistic = math.sqrt(hidden2 / own2)
    # A field unlike the expected that lasts while the body moves is the new one.
    near = (horizontal - s.new_north) ** 2 + (up - s.new_up) ** 2
    far = near > (0.5 * par.field_limit * max(s.new_north, 1e-300)) ** 2
    rate = min(1.0, dt / NEW_FIELD_TIME)
    s.new_north += rate * (horizontal - s.new_north)
    s.new_up += rate * (up - s.new_up)
    if far:
        s.new_time = 0.0
    elif s.resting == 0:
        s.new_time += dt
    if hidden2 > par.field_limit**2:
        if s.new_time < par.new_field_time:
            # Which of the two visible parts gave it away: along the expected field (strength) or across it (dip).
            along = abs(math.hypot(horizontal, up) - math.hypot(s.north, s.up))
            s.code = STRENGTH if 2.0 * along * along >= visible2 else DIP
            return 0.0
        s.north, s.up, s.field_weight = s.new_north, s.new_up, NEW_FIELD_TIME
        variance = own2
    # The tilt errors turn the apparent heading; they are counted, not corrected.
    bearing = math.atan2(east, north)
    hx, hy = -up / horizontal * math.sin(bearing), -up / horizontal * math.cos(bearing)
    x = w.error
    residual = bearing - par.declination - (hx * x[0] + hy * x[1] + x[2])
    residual -= 2.0 * math.pi * math.floor(residual / (2.0 * math.pi) + 0.5)
    predicted = hx * hx * p[0, 0] + hy * hy * p[1, 1] + p[2, 2]
    predicted += 2.0 * (hx * hy * p[0, 1] + hx * p[0, 2] + hy * p[1, 2])
    surprise = residual * residual / (predicted + variance)
    if surprise > HEADING_LIMIT:
        s.heading_refused += dt
        s.code, s.statistic = HEADING, surprise
        if s.heading_refused >= par.new_field_time:
            # Contradicted for that long by an undisturbed field, the heading itself is in doubt.
            s.lost[2, 2] += residual * residual
            s.heading_refused = 0.0
        return 0.0
    s.heading_refused = 0.0
    if predicted < UNKNOWN_HEADING:
        gain = min(1.0, dt / RESIDUAL_TIME)
        change = residual - s.residual_mean
        s.residual_mean += gain * change
        s.residual_variance = (1.0 - gain) * (s.residual_variance + gain * change * change)
        # Errors of a magnetometer are places, not noise: independent once in twice the time a place lasts.
        lasts = par.magnetometer_time * (REST_LASTS if s.resting > 0 else 1.0)
        variance = (variance * lasts + RESIDUAL_SHARE * s.residual_variance * par.magnetometer_time) * 2.0 / dt
    # Directions on a circle add as vectors of length κ (von Mises: the Bingham density along the girdle of headings).
    concentration = 0.5 / math.sinh(0.5 * min(predicted, 40.0))
    move = math.atan2(math.sin(residual), concentration * variance + math.cos(residual))
    w.h[0], w.h[1], w.h[2] = hx, hy, 1.0
    for i in range(SIZE):
        w.moves[i] = 1.0 if i == 2 or BIAS <= i < FORCE_BIAS else 0.0
    evidence = condition(p, w, move * (predicted + variance) / predicted, variance)
    w.h[0] = w.h[1] = w.h[2] = 0.0
    for i in range(SIZE):
        w.moves[i] = 1.0
    s.code = USED
    return evidence
