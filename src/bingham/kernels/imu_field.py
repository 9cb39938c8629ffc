"""What a magnetometer tells about heading, and how far to believe it.

Of a disturbance only two components can be seen: those that change the field's strength and its dip, that is its
horizontal and its upward part. The third rotates the heading. It is taken to be as large as the two visible ones, so
that a disturbed sample is not dropped but counts for less, and none is believed more than its surroundings allow.
"""

from __future__ import annotations

import math

from bingham.kernels import imu_state as at
from bingham.kernels.compile import compiled
from bingham.kernels.imu_state import scalar_update

__all__ = ["field_update"]

ABSENT, ACCEPTED, STRENGTH, DIP, HEADING, REPEATED, PENDING, EARLY = 0, 1, 2, 3, 4, 5, 6, 7

NEW_FIELD_SMOOTHING = 5.0  # s over which a new field is averaged
HEADING_LIMIT = 100.0  # a heading ten standard deviations off contradicts the estimate


@compiled()
def _reference(s, par, dt, h, u, weight):
    """Let the reference (horizontal, upward) follow the samples, slower the less they are believed."""
    s[at.REF_WEIGHT] += dt * weight
    rate = max(dt / par[at.P_MEMORY], dt / max(s[at.REF_WEIGHT], dt))
    s[at.REF_N] += rate * weight * (h - s[at.REF_N])
    s[at.REF_U] += rate * weight * (u - s[at.REF_U])


@compiled()
def _lasting_change(s, par, dt, h, u):
    """Whether a field unlike the reference has lasted so long, while the body moved, that it is the new one."""
    near = (h - s[at.NEW_N]) ** 2 + (u - s[at.NEW_U]) ** 2
    limit = (0.5 * par[at.P_LIMIT] * max(s[at.NEW_N], 1e-300)) ** 2
    rate = min(1.0, dt / NEW_FIELD_SMOOTHING)
    s[at.NEW_N] += rate * (h - s[at.NEW_N])
    s[at.NEW_U] += rate * (u - s[at.NEW_U])
    if near > limit:
        s[at.NEW_TIME] = 0.0
    elif s[at.REST] == 0.0:
        s[at.NEW_TIME] += dt
    return s[at.NEW_TIME] >= par[at.P_NEW_TIME]


@compiled()
def field_update(s, p, par, x, gain, column, out):
    """Correct heading and biases by the mean field of the interval; return the log-evidence, write statistic and code.

    The statistic is the angle by which the visible disturbance may turn the heading, in units of the magnetometer's own
    error, or for code HEADING the squared residual over its variance.
    """
    dt = s[at.ELAPSED]
    n = s[at.FIELD_COUNT]
    east, north, up = s[at.FIELD] / n, s[at.FIELD + 1] / n, s[at.FIELD + 2] / n
    h = math.sqrt(east * east + north * north)
    if s[at.REF_WEIGHT] == 0.0:
        s[at.REF_N], s[at.REF_U], s[at.NEW_N], s[at.NEW_U] = h, up, h, up
    if h == 0.0:
        out[at.O_CODE] = DIP
        out[at.O_STATISTIC] = math.inf
        return 0.0
    ref = s[at.REF_N]
    scale = max(min(h, ref), 1e-300)
    hidden2 = 0.5 * ((h - ref) ** 2 + (up - s[at.REF_U]) ** 2) / (scale * scale)
    own2 = par[at.P_MAG] ** 2
    variance = own2 + hidden2
    _reference(s, par, dt, h, up, own2 / variance)
    out[at.O_STATISTIC] = math.sqrt(hidden2 / own2)
    changed = _lasting_change(s, par, dt, h, up)
    if hidden2 > par[at.P_LIMIT] ** 2:
        if not changed:
            size, expected = math.sqrt(h * h + up * up), math.sqrt(ref * ref + s[at.REF_U] ** 2)
            # Which of the two visible parts gave it away: along the reference (strength) or across it (dip).
            along = abs(size - expected)
            across = math.sqrt(max((h - ref) ** 2 + (up - s[at.REF_U]) ** 2 - along * along, 0.0))
            out[at.O_CODE] = STRENGTH if along >= across else DIP
            return 0.0
        s[at.REF_N], s[at.REF_U], s[at.REF_WEIGHT] = s[at.NEW_N], s[at.NEW_U], NEW_FIELD_SMOOTHING
        variance = own2
    # The vertical and horizontal tilt errors turn the apparent heading; they are counted, not corrected.
    bearing = math.atan2(east, north)
    hx, hy = -up / h * math.sin(bearing), -up / h * math.cos(bearing)
    predicted = 0.0
    for i in range(12):
        column[i] = hx * p[i, 0] + hy * p[i, 1] + p[i, 2]
    predicted = hx * column[0] + hy * column[1] + column[2]
    residual = bearing - par[at.P_DECLINATION] - (hx * x[0] + hy * x[1] + x[2])
    residual -= 2.0 * math.pi * math.floor(residual / (2.0 * math.pi) + 0.5)
    surprise = residual * residual / (predicted + variance)
    if surprise > HEADING_LIMIT:
        s[at.HEADING_REJECTED] += dt
        if s[at.HEADING_REJECTED] < par[at.P_NEW_TIME]:
            out[at.O_CODE] = HEADING
            out[at.O_STATISTIC] = surprise
            return 0.0
        # Contradicted for that long by an undisturbed field, the heading itself is in doubt.
        p[2, 2] += residual * residual
        column[2] += residual * residual
        predicted += residual * residual
    s[at.HEADING_REJECTED] = 0.0
    # Errors of a magnetometer are places, not noise: independent once in twice the time a place lasts.
    variance *= 2.0 * par[at.P_MAG_TIME] / dt
    # Directions on a circle add as vectors of length κ (von Mises: the Bingham distribution along the girdle of
    # headings).
    prior = 0.5 / math.sinh(0.5 * min(predicted, 40.0))
    move = math.atan2(math.sin(residual), prior * variance + math.cos(residual))
    effective = move * (predicted + variance) / predicted
    for i in range(12):
        gain[i] = 1.0 if i == 2 or 6 <= i < 9 else 0.0
    evidence = scalar_update(p, x, column, predicted, variance, effective, gain)
    gain[:] = 1.0
    out[at.O_CODE] = ACCEPTED
    return evidence
