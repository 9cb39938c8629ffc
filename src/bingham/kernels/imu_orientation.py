"""Orientations beside the gyroscope: a camera, motion capture or a star tracker, now and then, at its own times.

A measurement waits until the gyroscope has passed its time, is carried there by the rate, and conditions orientation
and biases. One that the estimate cannot explain is rejected; if several such agree with one another, as outliers do
not, it is the estimate that is wrong, and it is widened.
"""

from __future__ import annotations

import math

from bingham.kernels.compile import compiled
from bingham.kernels.gap import LONG_GAP, gap_variance, is_gap
from bingham.kernels.imu_model import (
    BIAS,
    FORCE_BIAS,
    SIZE,
    condition,
    copy,
    correct,
    rotate_left,
    rotation_between,
    rotation_matrix,
    update,
)
from bingham.kernels.quaternion import from_rotation_vector, product

__all__ = ["NO_ORIENTATION", "ORIENTATION_REJECTED", "ORIENTATION_USED", "ORIENTATION_WAITS", "advance", "observe"]

NO_ORIENTATION, ORIENTATION_USED, ORIENTATION_REJECTED, ORIENTATION_WAITS = range(4)
ORIENTATION_FAULT = 10  # its place in the state's `faults`
ORIENTATION_LIMIT = 16.27  # χ² of three degrees of freedom: one regular measurement in a thousand is rejected
AGREEING = 3  # rejected measurements that agree with one another and so contradict the estimate
AGREEING_AT_START = 2  # the same as long as the estimate rests on one measurement
OUTLIERS = 0.1  # share of outliers to be feared of a single measurement that nothing confirms yet
UNIFORM = math.pi**2 / 3.0  # rad², variance of an angle that is anything
KNOWN = 1.0  # rad², variance of an angle below which a measurement can be checked by it
# How much the gyroscope's noise and scale errors are than given: corrections are summed over DRIFT_COUNT measurements,
# and their sum is as large as expected if the noise is right; it follows within ADAPT_COUNT measurements.
DRIFT_COUNT = 16.0
ADAPT_COUNT = 10.0
NOISE_RANGE = (0.01, 3000.0)
MAXIMAL_RATIO = 5.0
REJECTED_RATIO = 3.0  # what a rejected measurement counts as
UNSEEN_NOISE = 0.3  # rad²/s, where the gyroscope is missing: 1 rad/s with a correlation time of 0.15 s
DELAY_SHARE = 1.0 / 3.0  # of the gyroscope's delay that is not known


@compiled(inner=True)
def advance(s, par, w):
    """Update the filter, with the orientation that waits if the gyroscope has passed it; return the log-evidence."""
    if s.elapsed > 0.0:
        update(s, par, w)
    else:  # nothing has happened since the last update
        copy(w.predicted, s.covariance)
        s.evidence = 0.0
        for i in range(SIZE):
            w.error[i] = 0.0
            for j in range(SIZE):
                w.F[i, j] = 1.0 if i == j else 0.0
    evidence = s.evidence
    if passed(s):
        evidence += orient(s, par, w)
    s.evidence = evidence
    return evidence


@compiled(inner=True)
def passed(s):
    """Whether the gyroscope has passed the orientation that waits."""
    return s.seen > 0 and s.last[0] >= s.seen_time


@compiled(inner=True)
def observe(s, par, t, q, covariance):
    """Let the orientation q (4,), body to world, of time t wait for the gyroscope; covariance (3, 3), world axes.

    Returns whether it does: not before the filter has started. The one that waited must have been flushed.
    """
    s.last[3] = t
    if s.phase == -2 and not math.isnan(s.last[0]):  # the state holds this very measurement
        s.phase = 1
        s.doubt[0] = s.doubt[1] = OUTLIERS * UNIFORM
        for i in range(4):
            s.seen_orientation[i] = s.orientation[i]
        s.seen_time = t
        carry(s, par.gyroscope_delay)
        for i in range(4):
            s.orientation[i] = s.seen_orientation[i]
        s.seen_count, s.seen_code = 1, ORIENTATION_USED
        s.seen_nis = s.seen_evidence = 0.0
        return False
    if s.phase <= 0:
        return False
    s.seen, s.seen_time = 1, t
    for i in range(4):
        s.seen_orientation[i] = q[i]
    for i in range(3):
        for j in range(3):
            s.seen_covariance[i, j] = covariance[i, j]
    return True


@compiled(inner=True)
def flush(s, par, w):
    """Use the orientation that waits now: another one has come before a sample of the gyroscope."""
    if s.seen_time > s.last[0]:
        coast(s, par, w, s.seen_time)
    return advance(s, par, w)


@compiled(inner=True)
def coast(s, par, w, t):
    """Go on to time t without a sample of the gyroscope, at its last rate; that tells nothing of what a gap holds."""
    dt = t - s.last[0]
    s.unseen += dt
    gap = is_gap(s.unseen, s.usual_step)
    rotation = w.rotation
    share = 0.0 if dt >= LONG_GAP else dt
    x, y, z = share * (s.rate[0] - s.bias[0]), share * (s.rate[1] - s.bias[1]), share * (s.rate[2] - s.bias[2])
    fast2 = (x * x + y * y + z * z) / (dt * dt)
    q = s.orientation
    a, b, c, d = from_rotation_vector(x, y, z)
    q[0], q[1], q[2], q[3] = product(q[0], q[1], q[2], q[3], a, b, c, d)
    rotation_matrix(rotation, q)
    lost = gap_variance(dt, fast2) + UNSEEN_NOISE * dt if gap else gap_variance(dt, 0.0)
    for i in range(3):
        for j in range(3):
            s.turn[i, j] += rotation[i, j] * dt
        s.rotated[i] += rotation[i, 0] * x + rotation[i, 1] * y + rotation[i, 2] * z
        s.raw_rotated[i] += s.rate[i] * dt
        s.lost[i, i] += min(lost, 20.0)
        if gap:
            s.rate[i] = s.bias[i]
    s.travel += math.sqrt(x * x + y * y + z * z)
    s.elapsed += dt
    s.age += dt
    s.last[0] = t
    if gap:
        s.quiet_time, s.resting = 0.0, 0
        s.lost_velocity += min((par.gravity * dt) ** 2, 1e4)


@compiled(inner=True)
def carry(s, lead):
    """Carry the orientation that waits to the instant that the state is of: the gyroscope's last, less its delay."""
    dt = s.last[0] - lead - s.seen_time
    a, b, c, d = from_rotation_vector(
        dt * (s.rate[0] - s.bias[0]), dt * (s.rate[1] - s.bias[1]), dt * (s.rate[2] - s.bias[2])
    )
    q = s.seen_orientation
    q[0], q[1], q[2], q[3] = product(q[0], q[1], q[2], q[3], a, b, c, d)


@compiled(inner=True)
def decompose(a):
    """Replace the lower triangle of a (3, 3), positive definite, by L and D of a = L D Lᵀ; L has a diagonal of ones."""
    for j in range(3):
        for k in range(j):
            a[j, j] -= a[j, k] * a[j, k] * a[k, k]
        for i in range(j + 1, 3):
            for k in range(j):
                a[i, j] -= a[i, k] * a[k, k] * a[j, k]
            a[i, j] /= a[j, j]


@compiled(inner=True)
def orient(s, par, w):
    """Condition on the orientation that waits; return its log-evidence. Leaves code and NIS in the state."""
    p, h, x, r, c = s.covariance, w.h, w.error, w.residual, w.noise
    s.seen = 0
    carry(s, par.gyroscope_delay)
    if s.seen_count == 0 and s.rest_seen == 0:  # the prior of the bias is for what shows it only in motion
        for i in range(BIAS, FORCE_BIAS):
            p[i, i] += par.gyroscope_wide_bias**2
    p[2, 2] += s.unknown_heading
    s.unknown_heading = 0.0
    before = w.before
    for i in range(SIZE):
        before[i] = x[i]
        x[i] = h[i] = 0.0
        w.moves[i] = 1.0
    # An unknown heading is set first, so that the correction left is small; the prior is a turn away from there then.
    shift = 0.0
    if p[2, 2] > KNOWN:
        m, q = s.seen_orientation, s.orientation
        a, _, _, d = product(m[0], m[1], m[2], m[3], q[0], -q[1], -q[2], -q[3])
        shift = 2.0 * math.atan2(d, a)
        shift -= 2.0 * math.pi * math.floor(shift / (2.0 * math.pi) + 0.5)
        rotate_left(s.orientation, 0.0, 0.0, shift)
        vx, vy, cosine, sine = s.velocity[0], s.velocity[1], math.cos(shift), math.sin(shift)
        s.velocity[0], s.velocity[1] = cosine * vx - sine * vy, sine * vx + cosine * vy
        x[2] = -shift
    rotation_between(r, s.seen_orientation, s.orientation)
    # What is not known of the delay turns with the body.
    late2 = (DELAY_SHARE * par.gyroscope_delay) ** 2
    late2 *= (s.rate[0] - s.bias[0]) ** 2 + (s.rate[1] - s.bias[1]) ** 2 + (s.rate[2] - s.bias[2]) ** 2
    spread = 0.0
    for i in range(3):
        s.seen_covariance[i, i] += late2
        spread += s.seen_covariance[i, i]
    s.seen_nis, s.seen_evidence = surprise(s, c, r, x[2])
    if s.seen_nis > ORIENTATION_LIMIT:
        s.faults[ORIENTATION_FAULT] += 1
        since = s.seen_time - s.refused_time
        away2 = (r[0] - s.refused_by[0]) ** 2 + (r[1] - s.refused_by[1]) ** 2 + (r[2] - s.refused_by[2]) ** 2
        agrees = s.refused > 0 and away2 < ORIENTATION_LIMIT * (
            2.0 * spread / 3.0 + (par.gyroscope_wide_bias * since) ** 2
        )
        s.refused = s.refused + 1 if agrees else 1
        s.refused_time = s.seen_time
        for i in range(3):
            s.refused_by[i] = r[i]
        if s.refused < (AGREEING if s.doubt[0] + s.doubt[1] == 0.0 else AGREEING_AT_START):
            correct(s, x)
            for i in range(SIZE):
                x[i] = before[i]
            adapt(s, REJECTED_RATIO)
            s.seen_code = ORIENTATION_REJECTED
            return s.seen_evidence
        size2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
        for i in range(3):
            p[i, i] += size2
            p[BIAS + i, BIAS + i] += par.gyroscope_wide_bias**2
    known_tilt, known_heading = p[0, 0] + p[1, 1] < KNOWN, p[2, 2] < KNOWN
    v0, v1, v2 = p[0, 0], p[1, 1], p[2, 2]
    for i in range(3):
        for j in range(3):
            c[i, j] = s.seen_covariance[i, j]
    decompose(c)
    # Rows of L⁻¹ make the three numbers independent of one another.
    l10, l20, l21 = c[1, 0], c[2, 0], c[2, 1]
    y0 = r[0]
    y1 = r[1] - l10 * y0
    y2 = r[2] - l20 * y0 - l21 * y1
    h[0] = 1.0
    condition(p, w, y0 - x[0], c[0, 0])
    h[0], h[1] = -l10, 1.0
    condition(p, w, y1 - (x[1] - l10 * x[0]), c[1, 1])
    h[0], h[1], h[2] = l21 * l10 - l20, -l21, 1.0
    condition(p, w, y2 - (x[2] - l21 * x[1] + (l21 * l10 - l20) * x[0]), c[2, 2])
    h[0] = h[1] = h[2] = 0.0
    if known_tilt and known_heading:
        leak = math.exp(-1.0 / DRIFT_COUNT)
        total, expected = 0.0, 0.0
        for i in range(3):
            v = v0 if i == 0 else v1 if i == 1 else v2
            s.seen_drift[i] = leak * s.seen_drift[i] + x[i] / math.sqrt(v)
            s.seen_expected[i] = leak * leak * s.seen_expected[i] + max(1.0 - p[i, i] / v, 1e-9)
            total += s.seen_drift[i] ** 2
            expected += s.seen_expected[i]
        adapt(s, total / expected)
    correct(s, x)
    for i in range(SIZE):
        x[i] += before[i]
    x[2] += shift
    s.doubt[0] = 0.0 if known_tilt else OUTLIERS * UNIFORM
    s.doubt[1] = 0.0 if known_heading else OUTLIERS * UNIFORM
    s.refused = 0
    s.seen_count += 1
    s.seen_code = ORIENTATION_USED
    return s.seen_evidence


@compiled(inner=True)
def adapt(s, ratio):
    """Let the gyroscope's noise follow the ratio of what corrections add up to and what they should."""
    s.seen_noise *= math.exp((min(ratio, MAXIMAL_RATIO) - 1.0) / ADAPT_COUNT)
    s.seen_noise = min(max(s.seen_noise, NOISE_RANGE[0]), NOISE_RANGE[1])


@compiled(inner=True)
def surprise(s, c, r, turned):
    """Return NIS and log-density of the residual r (3,) under prediction and noise; c (3, 3) is overwritten.

    turned: the prediction's angle about the vertical, rad.
    """
    for i in range(3):
        for j in range(3):
            c[i, j] = s.covariance[i, j] + s.seen_covariance[i, j]
    decompose(c)
    y0 = r[0]
    y1 = r[1] - c[1, 0] * y0
    y2 = r[2] - turned - c[2, 0] * y0 - c[2, 1] * y1
    nis = y0 * y0 / c[0, 0] + y1 * y1 / c[1, 1] + y2 * y2 / c[2, 2]
    log_det = math.log(c[0, 0]) + math.log(c[1, 1]) + math.log(c[2, 2])
    return nis, -0.5 * (nis + log_det + 3.0 * math.log(2.0 * math.pi))
