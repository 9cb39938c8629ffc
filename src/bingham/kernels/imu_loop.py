"""The inertial filter's compiled loop: what each sample does, a whole recording, and the smoother.

The run over a recording and the event interface call the same functions, so that they agree bit for bit.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.gap import LONG_GAP, gap_variance, is_gap, usual_step
from bingham.kernels.imu_model import (
    ABSENT,
    ABSURD,
    BIAS,
    EARLY,
    PENDING,
    RECENT,
    REPEATED,
    RESIDUAL_SHARE,
    SIZE,
    UNKNOWN,
    VELOCITY,
    begin,
    condition,
    copy,
    last_variance,
    rotation_matrix,
    update,
)
from bingham.kernels.imu_orientation import ORIENTATION_USED, ORIENTATION_WAITS, advance, flush, observe, passed
from bingham.kernels.quaternion import from_rotation_vector, product

__all__ = ["accelerate", "due", "magnetize", "readout", "rotate", "run", "smooth"]

QUIET_TIME = 0.5  # s over which a sensor's mean is taken that rest is judged by
GRAVITY = 9.80665
# What sensors can measure: rad/s, m/s², and multiples of the usual field.
MAXIMAL_RATE = 75.0
MAXIMAL_FORCE = 4000.0
MAXIMAL_FIELD = 100.0
# A jump between samples that, taken for one interval, turns by this (rad) or speeds up by this (m/s), and is that many
# usual jumps, is a spike, unless the next sample agrees.
JUMP = (0.05, 0.4)
USUAL_JUMPS = 10.0
RETURN = 0.25
SPIKE_STEP = 0.05  # s: of samples further apart none follows from the last
GOOD, HELD, BACK, BOTH = range(4)
FLAT_STEPS = 2.5  # steps without change that make a flat top
COARSE, COARSE_GAIN = 0.01, 0.005  # share of exact repetitions of a component beyond which they mean nothing; its mean
ENOUGH_REPEATS = 5
SMALLEST_RANGE = 2.0  # rad/s: no gyroscope ends at less than 125°/s = 2.2 rad/s
CLIP_EXCESS = 0.8  # share of the range by which a clipped rate exceeds it at most
FREEZE_TIME = 0.12  # s of exactly repeated rows that no resampling makes
FREEZE_NOISE = 0.3  # rad²/s, θ while the gyroscope is frozen: 1 rad/s with a correlation time of 0.15 s
LOST_TILT = 1.0  # rad², variance of the tilt beyond which the next force is a start
DELAY_SHARE = 1.0 / 3.0  # of the sensor's delay that is not known
NORTH_SHARE = 0.5  # of a magnetometer's error that the place and the calibration make: no averaging removes it
# Reported variances of the tilt are those of the filter times what its corrections say, at least LEVEL_FLOOR, and at
# once what they say now, up to MAXIMAL_SURPRISE, while they add up one way.
LEVEL_FLOOR = 0.5
MAXIMAL_SURPRISE = 100.0
SHARED = 0.1  # of the smoother's gain in variance that is not claimed: errors that last are on both sides
SHARED_LIMIT = 10.0
BENDING = 0.25  # error of the linear recursion, in squares of the tilt it corrects
SEEN = np.dtype([
    ("time", "f8"), ("orientation", "f8", 4), ("covariance", "f8", (3, 3)), ("code", "i8"), ("nis", "f8"),
    ("evidence", "f8"),
], align=True)  # fmt: skip
UPDATE = np.dtype([
    ("index", "i8"), ("restart", "i8"), ("level", "f8"), ("error", "f8", SIZE), ("F", "f8", (SIZE, SIZE)),
    ("predicted", "f8", (SIZE, SIZE)), ("filtered", "f8", (SIZE, SIZE)),
], align=True)  # fmt: skip


class Estimates(NamedTuple):
    """What `run` writes, an entry for each sample, NaN as given before the start."""

    mode: Any  # (N, 4)
    covariance: Any  # (N, 3, 3), world axes
    extra: Any  # (N, 3, 3) for the smoother, what no sample reveals; or (1, 3, 3)
    bias: Any  # (N, 3)
    bias_std: Any  # (N, 3)
    evidence: Any  # (N,)
    statistic: Any  # (N,), of the magnetometer's sample
    code: Any  # (N,), what became of it
    rest: Any  # (N,)
    unknown_heading: Any  # (N,), rad², in the covariance

    @classmethod
    def blank(cls, size: int, *, smooth: bool) -> Estimates:
        """Return those of a filter that has not begun."""
        return cls(
            np.full((size, 4), np.nan),
            np.full((size, 3, 3), np.nan),
            np.zeros((size if smooth else 1, 3, 3)),
            np.zeros((size, 3)),
            np.zeros((size, 3)),
            np.zeros(size),
            np.full(size, np.nan),
            np.zeros(size, dtype=np.int8),
            np.zeros(size, dtype=np.bool_),
            np.zeros(size),
        )


RATE_REJECTED, FORCE_REJECTED, FIELD_REJECTED, ZEROS, CLIPPED, FROZEN, REPEATS, GAPS, RESTARTS = range(9)


@compiled(inner=True)
def due(s, par):
    """Whether the interval since the last update is over (half a microsecond of rounding in times is forgiven)."""
    return s.phase > 0 and s.elapsed >= par.update_interval - 5e-7


@compiled(inner=True)
def judge(s, k, t, before, last, held, x, y, z):
    """Return what becomes of the sample (x, y, z) of sensor k at t, the last at `before`: GOOD, HELD, BACK or BOTH.

    A jump is held until the next sample: if that is where the last one was, it was a spike (BACK), else real (BOTH).
    """
    if t - before > SPIKE_STEP or (k == 0 and is_gap(t - before, s.usual_step)):
        s.held[k] = 0
        return GOOD
    jump = math.sqrt((x - last[0]) ** 2 + (y - last[1]) ** 2 + (z - last[2]) ** 2)
    if s.held[k] > 0:
        s.held[k] = 0
        away = math.sqrt((held[0] - last[0]) ** 2 + (held[1] - last[1]) ** 2 + (held[2] - last[2]) ** 2)
        if jump > RETURN * away:
            return BOTH
        s.faults[k] += 1
        return BACK
    if s.usual_jump[k] > 0.0 and jump * (t - before) > JUMP[k] and jump > USUAL_JUMPS * s.usual_jump[k]:
        s.held[k] = 1
        s.held_time[k] = t
        held[0], held[1], held[2] = x, y, z
        return HELD
    s.usual_jump[k] += (0.02 if s.usual_jump[k] > 0.0 else 1.0) * (jump - s.usual_jump[k])
    return GOOD


@compiled(inline=True)
def repeating(s):
    """Whether the last rate of a body that moves was one of a repeated block."""
    return s.matched >= ENOUGH_REPEATS and s.quiet_time == 0.0


@compiled(inner=True)
def repeats(s, x, y, z):
    """Whether the rates now coming are, one by one, those of a moment before: a block sent twice.

    Noise repeats no number by chance; coarse numbers do, but not `ENOUGH_REPEATS` in a row where a body moves.
    """
    key = 0.8414709848 * x + 0.5403023059 * y + 0.9092974268 * z
    spread = abs(key) * 43758.5453
    slot = int((spread - math.floor(spread)) * RECENT)
    count = s.count
    if s.lag > 0 and s.recent[(count - s.lag) % RECENT] == key:
        s.matched += 1
    else:
        s.lag = s.matched = 0
        before = s.place[slot]
        if 1 < count - before < RECENT and s.recent[before % RECENT] == key:
            s.lag, s.matched = count - before, 1
    s.recent[count % RECENT] = key
    s.place[slot] = count
    s.count = count + 1
    return repeating(s)


@compiled()
def rotate(s, par, w, t, x, y, z):
    """Take the gyroscope's rate (x, y, z) at t, which stands for the time since the last one."""
    s.now = t
    if s.blank > 0:  # zeros that no zeros of the accelerometer followed: a sample
        s.blank = 0
        rotate_by(s, par, w, s.blank_time, 0.0, 0.0, 0.0)
    if x == 0.0 and y == 0.0 and z == 0.0:
        s.blank, s.blank_time = 1, t
        return
    if repeats(s, x, y, z):
        s.faults[REPEATS] += 1
        return
    rotate_by(s, par, w, t, x, y, z)


@compiled(inner=True)
def rotate_by(s, par, w, t, x, y, z):
    """Judge the rate (x, y, z) and integrate what is believed of it."""
    rate = s.rate
    if math.isnan(s.last[0]):
        s.last[0] = t
        rate[0], rate[1], rate[2] = x, y, z
        for i in range(3):
            s.slow_rate[i] = rate[i]
        return
    if x * x + y * y + z * z > MAXIMAL_RATE**2:
        s.faults[RATE_REJECTED] += 1
        return
    verdict = judge(s, 0, t, s.last[0], rate, s.held_rate, x, y, z)
    if verdict == HELD:
        return
    if verdict == BOTH:
        integrate(s, par, w, s.held_time[0], s.held_rate[0], s.held_rate[1], s.held_rate[2], False)
    integrate(s, par, w, t, x, y, z, verdict == BACK)


@compiled(inline=True)
def explained(s):
    """Whether the last force changed as the rate has it, by −ω × f: a steady turn without noise, no fault."""
    x, y, z = s.rate[0] - s.bias[0], s.rate[1] - s.bias[1], s.rate[2] - s.bias[2]
    f, change = s.force, s.force_change
    a, b, c = y * f[2] - z * f[1], z * f[0] - x * f[2], x * f[1] - y * f[0]
    left2 = (change[0] + a) ** 2 + (change[1] + b) ** 2 + (change[2] + c) ** 2
    return left2 < 0.25 * (a * a + b * b + c * c)


@compiled(inline=True)
def beyond_range(s, i, value, dt):
    """By how much the rate of axis i is likely to exceed its flat top, from the slope with which it came there.

    A parabola of slope σ at the ends of a top of τ encloses σ τ²/6: the excess grows by σ τ/3.
    """
    slope, time = s.slope[1, i], s.flat_time[i]
    if time < FLAT_STEPS * dt or slope * value <= 0.0:
        return 0.0
    return math.copysign(min(abs(slope) * (time - 0.5 * dt) / 3.0, CLIP_EXCESS * abs(value)), value)


@compiled(inner=True)
def integrate(s, par, w, t, x, y, z, bridged):
    """Rotate the orientation by the rate (x, y, z) since the last sample; `bridged` over one that was a spike."""
    rate = s.rate
    dt = t - s.last[0]
    s.last[0] = t
    s.unseen = 0.0
    s.age += dt
    gain = max(1.0 - math.exp(-dt / QUIET_TIME), min(1.0, dt / s.age))
    deviation = change2 = 0.0
    repeats = x == rate[0] and y == rate[1] and z == rate[2]
    largest = max(abs(x), abs(y), abs(z))
    for i in range(3):
        new = x if i == 0 else y if i == 1 else z
        change2 += (new - rate[i]) ** 2
        # Flat tops: at the end of a range that is given, or exactly repeated while other axes move, at the largest rate
        # or where noise repeats nothing.
        same = new == rate[i] and not repeats and abs(new) > SMALLEST_RANGE and (abs(new) >= s.top or s.coarse < COARSE)
        if abs(new) >= s.range if s.range > 0.0 else same:
            s.flat_time[i] += dt
        else:
            s.flat_time[i] = 0.0
            s.slope[1, i], s.slope[0, i] = s.slope[0, i], (new - rate[i]) / dt
        if abs(new) < SMALLEST_RANGE:
            s.coarse += COARSE_GAIN * ((1.0 if new == rate[i] else 0.0) - s.coarse)
        s.slow_rate[i] += gain * (new - s.slow_rate[i])
        deviation += (new - s.slow_rate[i]) ** 2
    s.top = max(s.top, largest)
    s.repeat_time = s.repeat_time + dt if repeats else 0.0
    gap = is_gap(dt, s.usual_step)
    s.usual_step = usual_step(s.usual_step, dt)
    s.quiet_time = s.quiet_time + dt if deviation <= par.rest_rate**2 and not gap else 0.0
    still = s.force_deviation <= par.rest_acceleration**2 and not math.isnan(s.last[1])
    s.resting = 1 if s.quiet_time >= par.rest_time and still else 0
    mx, my, mz = x, y, z
    if gap or bridged:
        mx, my, mz = 0.5 * (x + rate[0]), 0.5 * (y + rate[1]), 0.5 * (z + rate[2])
    rate[0], rate[1], rate[2] = x, y, z
    if s.phase <= 0:
        return
    frozen = s.repeat_time > FREEZE_TIME and s.force_deviation > par.rest_acceleration**2 and not explained(s)
    if frozen:
        s.faults[FROZEN] += 1
        mx, my, mz = s.bias[0], s.bias[1], s.bias[2]
    wx, wy, wz = (mx - s.bias[0]) * dt, (my - s.bias[1]) * dt, (mz - s.bias[2]) * dt
    if s.flat_time[0] + s.flat_time[1] + s.flat_time[2] > 0.0 and not gap:
        wx += beyond_range(s, 0, x, dt) * dt
        wy += beyond_range(s, 1, y, dt) * dt
        wz += beyond_range(s, 2, z, dt) * dt
    q = s.orientation
    a, b, c, d = from_rotation_vector(wx, wy, wz)
    a, b, c, d = product(q[0], q[1], q[2], q[3], a, b, c, d)
    n = 1.0 / math.sqrt(a * a + b * b + c * c + d * d)
    q[0], q[1], q[2], q[3] = a * n, b * n, c * n, d * n
    rotation = w.rotation
    rotation_matrix(rotation, q)
    for i in range(3):
        for j in range(3):
            s.turn[i, j] += rotation[i, j] * dt
        s.rotated[i] += rotation[i, 0] * wx + rotation[i, 1] * wy + rotation[i, 2] * wz
        s.raw_rotated[i] += rate[i] * dt
    s.travel += math.sqrt(wx * wx + wy * wy + wz * wz)
    s.elapsed += dt
    lost = FREEZE_NOISE * dt if frozen else 0.0
    if gap:
        s.faults[GAPS] += 1
        # In a long one the body may have turned as fast as around it, any other way.
        fast2 = x * x + y * y + z * z if dt >= LONG_GAP else 0.0
        lost += gap_variance(dt, deviation + change2 + fast2)
        s.lost_velocity += min((par.gravity * dt) ** 2, 1e4)
        s.lost_bias += par.gyroscope_bias_walk**2 * dt
    elif bridged:
        lost += 0.25 * change2 * dt * dt
    if lost > 0.0:
        for i in range(3):
            s.lost[i, i] += min(lost, UNKNOWN)
    for i in range(3):
        if s.flat_time[i] > FLAT_STEPS * dt or (s.range > 0.0 and s.flat_time[i] > 0.0):
            s.faults[CLIPPED] += 1
            before = s.flat_time[i] - dt if s.flat_time[i] > (FLAT_STEPS + 1.0) * dt else 0.0
            most2 = (CLIP_EXCESS * largest) ** 2 * (s.flat_time[i] ** 2 - before**2)
            excess2 = min(most2, s.slope[1, i] ** 2 / 36.0 * (s.flat_time[i] ** 4 - before**4))
            for j in range(3):
                for k in range(3):
                    s.lost[j, k] += rotation[j, i] * rotation[k, i] * excess2


@compiled(inline=True)
def at_range_end(size):
    """Whether |f| is within 2 % of 2, 4, 8 or 16 g, where the ranges of accelerometers end."""
    g = size / GRAVITY
    while g > 3.0:
        g *= 0.5
    return size < 17.0 * GRAVITY and abs(g - 2.0) < 0.04


@compiled(inner=True)
def accelerate(s, par, w, t, x, y, z):
    """Take the specific force (x, y, z) at t, which stands for the time since the last one."""
    if x == 0.0 and y == 0.0 and z == 0.0:
        s.faults[ZEROS] += 1
        s.blank = 0
        return
    if s.blank > 0:
        s.blank = 0
        rotate_by(s, par, w, s.blank_time, 0.0, 0.0, 0.0)
    if repeating(s):
        return
    force = s.force
    if s.phase <= 0 or math.isnan(s.last[1]):
        s.phase = abs(s.phase)
        s.last[1] = t
        force[0], force[1], force[2] = x, y, z
        for i in range(3):
            s.slow_force[i] = force[i]
        return
    if x * x + y * y + z * z > MAXIMAL_FORCE**2:
        s.faults[FORCE_REJECTED] += 1
        return
    verdict = judge(s, 1, t, s.last[1], force, s.held_force, x, y, z)
    if verdict == HELD:
        return
    if verdict == BOTH:
        push(s, par, s.held_time[1], s.held_force[0], s.held_force[1], s.held_force[2])
    push(s, par, t, x, y, z)


@compiled(inner=True)
def push(s, par, t, x, y, z):
    """Integrate the specific force (x, y, z) since the last sample; start anew from it if the attitude is lost."""
    force = s.force
    dt = t - s.last[1]
    s.last[1] = t
    gain = max(1.0 - math.exp(-dt / QUIET_TIME), min(1.0, dt / max(s.age, 1e-9)))
    clipped = False
    s.force_deviation = 0.0
    for i in range(3):
        f = x if i == 0 else y if i == 1 else z
        clipped = clipped or (f == force[i] and at_range_end(abs(f)))
        s.force_change[i] = (f - force[i]) / dt
        force[i] = f
        s.slow_force[i] += gain * (f - s.slow_force[i])
        s.force_deviation += (f - s.slow_force[i]) ** 2
    if s.force_deviation > par.rest_acceleration**2:
        s.quiet_time = 0.0
        s.resting = 0
    if s.lost[0, 0] + s.lost[1, 1] > LOST_TILT:
        begin(s, par, force)
        s.faults[RESTARTS] += 1
        s.restarted = 1
        return
    if dt >= LONG_GAP:
        return
    fx, fy, fz = x - s.force_bias[0], y - s.force_bias[1], z - s.force_bias[2]
    q = s.orientation
    # R f by two cross products: f + 2 w (u × f) + 2 u × (u × f).
    tx, ty, tz = 2.0 * (q[2] * fz - q[3] * fy), 2.0 * (q[3] * fx - q[1] * fz), 2.0 * (q[1] * fy - q[2] * fx)
    wx = fx + q[0] * tx + q[2] * tz - q[3] * ty
    wy = fy + q[0] * ty + q[3] * tx - q[1] * tz
    wz = fz + q[0] * tz + q[1] * ty - q[2] * tx
    s.impulse[0] += wx * dt
    s.impulse[1] += wy * dt
    s.impulse[2] += (wz - par.gravity) * dt
    s.velocity[0] += wx * dt
    s.velocity[1] += wy * dt
    s.shake += max(0.0, x * x + y * y + z * z - par.gravity**2) * dt
    s.force_time += dt
    if clipped:
        s.clipped_time += dt


@compiled(inner=True)
def magnetize(s, t, x, y, z):
    """Take the field (x, y, z) at t; return what becomes of it: a repetition says nothing new, absurd ones are none."""
    last = s.last_field
    s.last[2] = t
    if x == last[0] and y == last[1] and z == last[2]:
        return REPEATED
    size = max(abs(x), abs(y), abs(z))
    if size > 1e12 or (s.usual_field > 0.0 and size > MAXIMAL_FIELD * s.usual_field):
        s.faults[FIELD_REJECTED] += 1
        return ABSURD
    s.usual_field = usual_step(s.usual_field, size)
    last[0], last[1], last[2] = x, y, z
    if s.phase <= 0:
        return EARLY
    q = s.orientation
    tx, ty, tz = 2.0 * (q[2] * z - q[3] * y), 2.0 * (q[3] * x - q[1] * z), 2.0 * (q[1] * y - q[2] * x)
    s.field[0] += x + q[0] * tx + q[2] * tz - q[3] * ty
    s.field[1] += y + q[0] * ty + q[3] * tx - q[1] * tz
    s.field[2] += z + q[0] * tz + q[1] * ty - q[2] * tx
    s.field_count += 1.0
    return PENDING


@compiled(inline=True)
def told_level(s):
    """By how much the reported variances of the tilt are those of the filter: what its corrections say of them."""
    return max(s.level, LEVEL_FLOOR, min(s.surprise, MAXIMAL_SURPRISE))


@compiled(inner=True)
def readout(s, par, q, c, extra, last):
    """Write orientation q (4,) and its covariance c (3, 3), world axes, now; extra (3, 3) is what no sample reveals.

    Where nothing later is known (`last`), the present velocity shows the tilt, too (`ending`). No variance is claimed
    for that.
    The gyroscope's samples lag behind the motion by a delay, of which a share σ is unknown: σ² ωωᵀ. The mounting gives
    under the force: alignment_error² (|f|/g)². Where nothing shows the heading, constant errors of scale and axes, each
    with the standard deviation gyroscope_scale_error, add up over the turns since the start. A field that has set the
    heading leaves a share of its error; where it lately disagrees with the heading, one of the two is wrong by that.
    """
    o, lead = s.orientation, par.gyroscope_delay
    x, y, z = s.rate[0] - s.bias[0], s.rate[1] - s.bias[1], s.rate[2] - s.bias[2]
    a, b, e, d = from_rotation_vector(x * lead, y * lead, z * lead)
    q[0], q[1], q[2], q[3] = product(o[0], o[1], o[2], o[3], a, b, e, d)
    if last:
        k, v = s.ending, s.velocity
        b, e = -0.5 * (k[0, 0] * v[0] + k[0, 1] * v[1]), -0.5 * (k[1, 0] * v[0] + k[1, 1] * v[1])
        n = 1.0 / math.sqrt(1.0 + b * b + e * e)  # (1, r/2) is Exp(r) but for terms of r³
        q[0], q[1], q[2], q[3] = product(n, n * b, n * e, 0.0, q[0], q[1], q[2], q[3])
    tx, ty, tz = 2.0 * (q[2] * z - q[3] * y), 2.0 * (q[3] * x - q[1] * z), 2.0 * (q[1] * y - q[2] * x)
    lag = DELAY_SHARE * lead
    x, y, z = (
        lag * (x + q[0] * tx + q[2] * tz - q[3] * ty),
        lag * (y + q[0] * ty + q[3] * tx - q[1] * tz),
        lag * (z + q[0] * tz + q[1] * ty - q[2] * tx),
    )
    f2 = s.force[0] ** 2 + s.force[1] ** 2 + s.force[2] ** 2
    mounting = par.alignment_error**2 * f2 / par.gravity**2
    extra[0, 0], extra[0, 1], extra[0, 2] = x * x + mounting, x * y, x * z
    extra[1, 0], extra[1, 1], extra[1, 2] = x * y, y * y + mounting, y * z
    extra[2, 0], extra[2, 1], extra[2, 2] = x * z, y * z, z * z
    if s.unknown_heading > 0.0:
        turned2 = 0.0
        for i in range(3):
            for j in range(3):
                turned2 += s.turned[i, j] ** 2
        extra[2, 2] += par.gyroscope_scale_error**2 * turned2
    if s.field_weight > 0.0:
        extra[2, 2] += (NORTH_SHARE * par.magnetometer_error) ** 2
        extra[2, 2] += s.residual_mean**2 + RESIDUAL_SHARE * s.residual_variance
    root = math.sqrt(told_level(s))
    for i in range(3):
        for j in range(3):
            factor = (root if i < 2 else 1.0) * (root if j < 2 else 1.0)
            c[i, j] = factor * s.covariance[i, j] + s.lost[i, j] + extra[i, j]
        c[i, i] += s.doubt[0] if i < 2 else s.doubt[1] + s.unknown_heading
    unseen = s.now - s.last[0]
    if unseen > 2.0 * s.usual_step:
        for i in range(3):
            c[i, i] += gap_variance(unseen, (s.rate[0] ** 2 + s.rate[1] ** 2 + s.rate[2] ** 2))


@compiled(inner=True)
def report(s, w, row, begin, out, waiting, orientations, kept, count, restart):
    """Write what the last update says about samples and the orientation that waited, and what the smoother needs."""
    for k in range(begin, row):
        if out.code[k] == PENDING:
            out.code[k], out.statistic[k] = s.code, s.statistic
    if orientations is not None and waiting >= 0 and s.seen == 0:
        z = orientations[waiting]
        z.code, z.nis, z.evidence = s.seen_code, s.seen_nis, s.seen_evidence
    if kept.size > 0:
        u = kept[count]
        u.index, u.restart, u.level = row, restart, told_level(s)
        for k in range(SIZE):
            u.error[k] = w.error[k]
        copy(u.F, w.F)
        copy(u.predicted, w.predicted)
        copy(u.filtered, s.covariance)


@compiled(inner=True)
def finish(s, par, w, u, row):
    """Write the end as one more update u, in which the last velocity is 0 ± √2 σ (`imu_model.ending`)."""
    h, x = w.h, w.error
    u.index, u.restart, u.level = row, -1, told_level(s)
    copy(u.predicted, s.covariance)
    copy(u.filtered, s.covariance)
    for i in range(SIZE):
        x[i] = h[i] = 0.0
        w.moves[i] = 1.0 if i != 2 else 0.0
        for j in range(SIZE):
            u.F[i, j] = 1.0 if i == j else 0.0
    for i in range(2):
        h[VELOCITY + i] = 1.0
        condition(u.filtered, w, -s.velocity[i] - x[VELOCITY + i], last_variance(s, par))
        h[VELOCITY + i] = 0.0
    for i in range(SIZE):
        u.error[i] = x[i]


@compiled(inner=True)
def take(s, par, w, row, begin, out, waiting, orientations, seen, kept, count, restart):
    """Let the next orientation wait, after the one that still does; return begin, restart, count and waiting."""
    z = orientations[seen]
    if s.seen > 0:
        out.evidence[row] += flush(s, par, w)
        report(s, w, row, begin, out, waiting, orientations, kept, count, restart)
        begin, restart, count = row, -1, count + 1
    started = s.phase > 0
    waiting = -1
    if observe(s, par, z.time, z.orientation, z.covariance):
        waiting, z.code = seen, ORIENTATION_WAITS
    elif s.phase > 0 and not started:
        z.code = ORIENTATION_USED
    return begin, restart, count, waiting


@compiled()
def run(s, par, w, time, gyroscope, accelerometer, magnetometer, orientations, out, kept):
    """Filter samples of one recording; s holds the state before and after.

    time (N,), gyroscope, accelerometer, magnetometer (N, 3), the latter two NaN where there is no sample, or (0, 3).
    orientations: `SEEN` records (M,), in the order of their times, each used once the gyroscope has passed it; or None,
    for which nothing about them is compiled.
    kept: `UPDATE` records for the smoother, or empty. Returns the number of updates.
    """
    count = begin = seen = 0
    waiting = restart = -1
    size = time.size
    smoothing = out.extra.shape[0] == size
    for t in range(size):
        if orientations is not None:  # those since the last sample
            while seen < orientations.size and orientations[seen].time < time[t]:
                begin, restart, count, waiting = take(
                    s, par, w, t, begin, out, waiting, orientations, seen, kept, count, restart
                )
                seen += 1
        if due(s, par):
            if orientations is None:
                update(s, par, w)
            else:
                advance(s, par, w)
            out.evidence[t] += s.evidence
            report(s, w, t, begin, out, -1, orientations, kept, count, restart)
            begin, restart, count = t, -1, count + 1
        rotate(s, par, w, time[t], gyroscope[t, 0], gyroscope[t, 1], gyroscope[t, 2])
        if orientations is not None and passed(s):
            out.evidence[t] += advance(s, par, w)
            report(s, w, t, begin, out, waiting, orientations, kept, count, restart)
            begin, restart, count = t, -1, count + 1
        if accelerometer.shape[0] > 0 and not math.isnan(accelerometer[t, 0]):
            accelerate(s, par, w, time[t], accelerometer[t, 0], accelerometer[t, 1], accelerometer[t, 2])
            if s.restarted > 0:
                restart, s.restarted = t, 0
        out.code[t] = ABSENT
        if magnetometer.shape[0] > 0 and not math.isnan(magnetometer[t, 0]):
            out.code[t] = magnetize(s, time[t], magnetometer[t, 0], magnetometer[t, 1], magnetometer[t, 2])
        if orientations is not None:  # those of the time of this one
            while seen < orientations.size and orientations[seen].time == time[t]:
                begin, restart, count, waiting = take(
                    s, par, w, t, begin, out, waiting, orientations, seen, kept, count, restart
                )
                seen += 1
            if passed(s):
                out.evidence[t] += advance(s, par, w)
                report(s, w, t, begin, out, waiting, orientations, kept, count, restart)
                begin, restart, count = t, -1, count + 1
        out.rest[t] = s.resting > 0
        out.unknown_heading[t] = s.unknown_heading
        for i in range(3):
            out.bias[t, i] = s.bias[i]
            out.bias_std[t, i] = math.sqrt(s.covariance[BIAS + i, BIAS + i])
        if s.phase > 0:
            readout(s, par, out.mode[t], out.covariance[t], out.extra[t if smoothing else 0], not smoothing)
    return count


@compiled(inner=True)
def solve(a, b):
    """Replace b (n, n) by a⁻¹ b for a positive definite a (n, n), which is overwritten by its Cholesky factor."""
    n = a.shape[0]
    for j in range(n):
        for k in range(j):
            f = a[j, k]
            for i in range(j, n):
                a[i, j] -= a[i, k] * f
        root = 1.0 / math.sqrt(a[j, j])
        for i in range(j, n):
            a[i, j] *= root
    for i in range(n):
        for k in range(i):
            f = a[i, k]
            for c in range(n):
                b[i, c] -= f * b[k, c]
        f = 1.0 / a[i, i]
        for c in range(n):
            b[i, c] *= f
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            f = a[k, i]
            for c in range(n):
                b[i, c] -= f * b[k, c]
        f = 1.0 / a[i, i]
        for c in range(n):
            b[i, c] *= f


@compiled()
def smooth(s, par, w, kept, out):
    """Condition every state on the whole recording, in place (Rauch, Tung & Striebel 1965).

    G = P Fᵀ (P⁻)⁻¹, P_s = P + G (P_s⁺ − P⁻) Gᵀ, e_s = G (e_s⁺ + correction). kept: `UPDATE` records (E,), the
    last one free for the end; s and out: as `run` leaves them. Across a restart nothing is handed back.
    """
    count = kept.size
    n = SIZE
    finish(s, par, w, kept[count - 1], out.mode.shape[0])
    gain, factor, middle = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))  # gain is Gᵀ
    before, after = np.zeros((count, n)), np.zeros((count, n))  # smoothed errors around each update
    online = np.empty((count, 3, 3))  # as reported
    for e in range(count - 1, -1, -1):
        p = kept[e].filtered
        root = math.sqrt(kept[e].level)
        for i in range(3):
            for j in range(3):
                online[e, i, j] = (root if i < 2 else 1.0) * (root if j < 2 else 1.0) * p[i, j]
        before[e] = kept[e].error
        if e == count - 1 or kept[e + 1].restart >= 0:
            continue
        F, predicted, later = kept[e + 1].F, kept[e + 1].predicted, kept[e + 1].filtered
        copy(gain, p)
        for i in range(n):
            for k in range(n):
                f = F[i, k]
                if f != 0.0 and k != i:
                    for j in range(n):
                        gain[i, j] += f * p[k, j]
        copy(factor, predicted)
        solve(factor, gain)
        for i in range(n):
            for j in range(n):
                middle[i, j] = 0.0
            for k in range(n):
                f = later[i, k] - predicted[i, k]
                for j in range(n):
                    middle[i, j] += f * gain[k, j]
        for k in range(n):
            for i in range(n):
                f = gain[k, i]
                after[e, i] += f * before[e + 1, k]
                for j in range(n):
                    p[i, j] += f * middle[k, j]
        for i in range(n):
            before[e, i] += after[e, i]
    e = -1
    claimed, unclaimed = np.empty(3), np.empty(3)  # square roots of shares
    for t in range(out.mode.shape[0]):
        if math.isnan(out.mode[t, 0]):
            continue
        while e + 1 < count and kept[e + 1].index <= t:
            e += 1
        here, there = max(e, 0), min(e + 1, count - 1)
        if e < 0:
            share = 1.0
        elif e + 1 == count:
            share = 0.0
        elif kept[there].restart >= 0:
            share = 1.0 if t >= kept[there].restart else 0.0
        else:
            share = (t - kept[here].index + 1.0) / (kept[there].index - kept[here].index)
        left, right, p = after[here], before[there], kept[here].filtered
        x, y = left[0] + share * (right[0] - left[0]), left[1] + share * (right[1] - left[1])
        a, b, c, d = from_rotation_vector(x, y, left[2] + share * (right[2] - left[2]))
        m = out.mode[t]
        m[0], m[1], m[2], m[3] = product(a, b, c, d, m[0], m[1], m[2], m[3])
        bent = BENDING * (x * x + y * y)
        for i in range(3):
            out.bias[t, i] += left[BIAS + i] + share * (right[BIAS + i] - left[BIAS + i])
            out.bias_std[t, i] = math.sqrt(p[BIAS + i, BIAS + i])
            gained, most = online[here, i, i] - p[i, i], SHARED_LIMIT * p[i, i]
            share2 = SHARED * (most / gained if gained > most else 1.0)
            claimed[i], unclaimed[i] = math.sqrt(1.0 - share2), math.sqrt(share2)
        for i in range(3):
            for j in range(3):
                told = claimed[i] * claimed[j] * p[i, j] + unclaimed[i] * unclaimed[j] * online[here, i, j]
                out.covariance[t, i, j] = told + out.extra[t, i, j]
            out.covariance[t, i, i] += bent * bent
        out.covariance[t, 2, 2] += out.unknown_heading[t]
