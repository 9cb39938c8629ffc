"""Specific force averaged in a frame that the gyroscope holds still (the idea of VQF: Laidig & Seel 2023).

Linear accelerations average to almost nothing there while gravity stays, because that frame drifts only by the
gyroscope's bias. Two first-order stages in series attenuate fast motion with the square of its frequency.
"""

from __future__ import annotations

import math

from bingham.kernels.compile import compiled
from bingham.kernels.quaternion import from_rotation_vector, product

__all__ = ["LOWPASS_STATE", "average_specific_force"]

# Quaternion of the held frame, weight of each stage's running mean (2), first and second stage (3 each).
LOWPASS_STATE = 12
# rad², variance of the rotation in a gap beyond which directions from before it are worth nothing (6° per axis).
LOST_FRAME = 0.01


@compiled(inline=True)
def _rotated(w, x, y, z, a, b, c):
    """R(q) (a, b, c) for the unit quaternion q = (w, x, y, z)."""
    t, u, v = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * t + y * v - z * u, b + w * u + z * t - x * v, c + w * v + x * u - y * t


@compiled()
def average_specific_force(steps, gyroscope, gaps, accelerometer, time_constant, state, out):
    """Write the averaged specific force in body axes to out (T, 3); state (`LOWPASS_STATE`,) carries on.

    Each stage obeys m ← m + a (x − m) with a = 1 − e^{−dt/τ}, but is a plain mean until that settles. Rows of NaN are
    predicted from the average; before the first sample out is NaN. A zero state starts afresh, and so do the means
    after a gap in which the held frame is lost: gaps (T,) has the variance of the rotation in it, rad².
    """
    w, x, y, z = state[0], state[1], state[2], state[3]
    if w == 0.0 and x == 0.0 and y == 0.0 and z == 0.0:
        w = 1.0
    for t in range(steps.size):
        dt = steps[t]
        rate = gyroscope[t]
        a, b, c, d = from_rotation_vector(rate[0] * dt, rate[1] * dt, rate[2] * dt)
        w, x, y, z = product(w, x, y, z, a, b, c, d)
        n = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
        w, x, y, z = w * n, x * n, y * n, z * n
        if gaps[t] > LOST_FRAME:
            state[4] = state[5] = 0.0
        f = accelerometer[t]
        if not math.isnan(f[0] + f[1] + f[2]):
            e0, e1, e2 = _rotated(w, x, y, z, f[0], f[1], f[2])
            gain = -math.expm1(-dt / time_constant)
            for stage in range(2):
                # The share of the newest sample in a plain mean, until the exponential one takes over.
                start = 1.0 / (1.0 + state[4 + stage])
                g = max(gain, start)
                state[4 + stage] += 1.0
                i = 6 + 3 * stage
                state[i] += g * (e0 - state[i])
                state[i + 1] += g * (e1 - state[i + 1])
                state[i + 2] += g * (e2 - state[i + 2])
                e0, e1, e2 = state[i], state[i + 1], state[i + 2]
        if state[5] == 0.0:
            out[t] = math.nan
        else:
            out[t, 0], out[t, 1], out[t, 2] = _rotated(w, -x, -y, -z, state[9], state[10], state[11])
    state[0], state[1], state[2], state[3] = w, x, y, z
