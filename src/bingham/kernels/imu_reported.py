"""How sure the inertial filter says it is: its own covariance, held against the corrections it had to make.

The corrections of a filter whose noises are described rightly are uncorrelated and have the variance P⁻ − P⁺ by which
they shrink its covariance (Mehra, IEEE Trans. Autom. Control 15(2), 1970, for innovations). Linear accelerations,
errors of scale and magnetic disturbances are neither white nor of one level, so their sum over a few seconds is
watched: where its square is smaller or larger than P⁻ − P⁺ says, the covariance is reported smaller or larger by that
factor. The estimate itself is not touched. What no later sample reveals is added: the sensor's axes against the body's,
its clock, and the direction of the field.
"""

from __future__ import annotations

import math

from bingham.kernels import imu_state as at
from bingham.kernels.compile import compiled

__all__ = ["JUDGED_TIME", "add_readout_error", "judge", "reported", "scales"]

SUM_TIME = 5.0  # s: longer than the errors' correlation, of the order of the filter's memory
JUDGED_TIME = 30.0  # s over which the ratio is averaged
PRIOR_TIME = 5.0  # s for which the prior, a ratio of 1, counts
DELAY_SHARE = 1.0 / 3.0  # of the sensor's delay that is not known
NORTH_SHARE = 0.5  # of a magnetometer's error that the place and the calibration make: no averaging removes it


@compiled()
def _watch(s, slot, moved2, shrink, leak2, dt):
    """Average the ratio of moved2 = |leaky sum of corrections|² to its expectation; slots: expectation, ratio, time.

    Only while there is something to learn: the body moves and its variance shrinks.
    """
    s[slot] = leak2 * s[slot] + shrink
    if shrink > 0.0 and s[at.REST] == 0.0:
        s[slot + 2] = min(s[slot + 2] + dt, JUDGED_TIME)
        s[slot + 1] += dt / s[slot + 2] * (moved2 / s[slot] - s[slot + 1])


@compiled()
def judge(s, p, x, tilt, heading, dt):
    """Compare the corrections x (12,) of an update with the variances before it, tilt and heading (rad²), and after.

    Corrections are taken in units of the standard deviation before them, so that the large ones of the start count as
    one or two more and are soon forgotten.
    """
    leak = math.exp(-dt / SUM_TIME)
    left = p[0, 0] + p[1, 1]
    root = 1.0 / math.sqrt(tilt)
    s[at.TILT_SUM] = leak * s[at.TILT_SUM] + root * x[0]
    s[at.TILT_SUM + 1] = leak * s[at.TILT_SUM + 1] + root * x[1]
    moved2 = s[at.TILT_SUM] ** 2 + s[at.TILT_SUM + 1] ** 2
    _watch(s, at.TILT_EXPECTED, moved2, max(1.0 - left / tilt, 0.0), leak * leak, dt)
    s[at.HEADING_SUM] = leak * s[at.HEADING_SUM] + x[2] / math.sqrt(heading)
    _watch(s, at.HEADING_EXPECTED, s[at.HEADING_SUM] ** 2, max(1.0 - p[2, 2] / heading, 0.0), leak * leak, dt)


@compiled()
def scales(s):
    """Return the factors by which variances of tilt and heading are reported.

    The heading's is 1 at least: a constant error of the field hides from it.
    """
    tilt = (PRIOR_TIME + s[at.TILT_TIME] * s[at.TILT_RATIO]) / (PRIOR_TIME + s[at.TILT_TIME])
    heading = (PRIOR_TIME + s[at.HEADING_TIME] * s[at.HEADING_RATIO]) / (PRIOR_TIME + s[at.HEADING_TIME])
    return tilt, max(heading, 1.0)


@compiled()
def add_readout_error(c, s, par, q):
    """Add to c (3, 3), world axes, what the sensor's mounting, its clock and the field's direction add; q (4,).

    Mounting: alignment_error² (|f|/g)² on the tilt, f the specific force, under which a mounting gives. Clock:
    σ² ωωᵀ with σ a share of the delay. Field: a share of the magnetometer's error, once it has set the heading.
    """
    f2 = s[at.LAST_ACC] ** 2 + s[at.LAST_ACC + 1] ** 2 + s[at.LAST_ACC + 2] ** 2
    mounting = par[at.P_ALIGNMENT] ** 2 * f2 / par[at.P_GRAVITY] ** 2
    c[0, 0] += mounting
    c[1, 1] += mounting
    if s[at.REF_WEIGHT] > 0.0:
        c[2, 2] += (NORTH_SHARE * par[at.P_MAG]) ** 2
    lag = DELAY_SHARE * par[at.P_DELAY]
    wx, wy, wz = s[at.RATE] - s[at.BIAS], s[at.RATE + 1] - s[at.BIAS + 1], s[at.RATE + 2] - s[at.BIAS + 2]
    tx = 2.0 * (q[2] * wz - q[3] * wy)
    ty = 2.0 * (q[3] * wx - q[1] * wz)
    tz = 2.0 * (q[1] * wy - q[2] * wx)
    turn = (
        lag * (wx + q[0] * tx + q[2] * tz - q[3] * ty),
        lag * (wy + q[0] * ty + q[3] * tx - q[1] * tz),
        lag * (wz + q[0] * tz + q[1] * ty - q[2] * tx),
    )
    for i in range(3):
        for j in range(3):
            c[i, j] += turn[i] * turn[j]


@compiled()
def reported(s, p, par, q, c):
    """Write the covariance c (3, 3) of the rotation error, world axes, that the filter states at orientation q (4,)."""
    tilt, heading = scales(s)
    a, b = math.sqrt(tilt), math.sqrt(heading)
    for i in range(3):
        for j in range(3):
            c[i, j] = (a if i < 2 else b) * (a if j < 2 else b) * p[i, j]
    add_readout_error(c, s, par, q)
