"""The inertial filter over a whole recording, in one compiled loop."""

from __future__ import annotations

import numpy as np

from bingham.kernels import imu_state as at
from bingham.kernels.compile import compiled
from bingham.kernels.imu_field import ABSENT, EARLY, PENDING, REPEATED
from bingham.kernels.imu_reported import add_readout_error, reported, scales
from bingham.kernels.imu_samples import accelerate, due, magnetize, output, rotate
from bingham.kernels.imu_update import update

__all__ = ["run"]


@compiled()
def run(s, p, par, time, last, gyroscope, accelerometer, magnetometer, modes, covariances, bias, bias_std, rest,
        evidence, code, statistic, indices, filtered, transitions, corrections, factors, readout):  # fmt: skip
    """Filter samples of one recording; s (94,) and p (12, 12) hold the state before and after.

    time (N,), gyroscope, accelerometer, magnetometer (N, 3), the latter two NaN where there is no sample, or (0, 3);
    last (3,): times of the samples before of each sensor, NaN before the first. Per sample: modes (N, 4), covariances
    (N, 3, 3) of θ (world axes) as reported, bias, bias_std (N, 3), rest (N,), evidence (N,), code (N,), statistic (N,).
    Before the first accelerometer sample modes and covariances stay as they are given: NaN.
    For the smoother, or empty, per update: indices (E,), filtered (E, 12, 12), transitions (E, 26), corrections
    (E, 12), factors (E, 2) of the reported variances; per sample: readout (N, 3, 3), what is added to them.

    Returns the number of updates.
    """
    rotation = np.empty((3, 3))
    x = np.zeros(12)
    work = np.zeros((3, 12, 12))
    out = np.zeros(at.OUTPUT_SIZE)
    q = np.empty(4)
    empty = np.empty(0)
    count = 0
    begin = 0
    keep_all = indices.size > 0
    for t in range(time.size):
        if due(s, par):
            update(s, p, par, x, work, out, transitions[count] if keep_all else empty)
            evidence[t] = out[at.O_EVIDENCE]
            for k in range(begin, t):
                if code[k] == PENDING:
                    code[k] = int(out[at.O_CODE])
                    statistic[k] = out[at.O_STATISTIC]
            begin = t
            if keep_all:
                indices[count] = t
                corrections[count] = x
                filtered[count] = p
                transitions[count, 23] = out[at.O_RESTARTED]
                factors[count, 0], factors[count, 1] = scales(s)
            count += 1
        dt = 0.0 if np.isnan(last[0]) else time[t] - last[0]
        rotate(s, p, par, dt, gyroscope[t, 0], gyroscope[t, 1], gyroscope[t, 2], rotation)
        last[0] = time[t]
        if accelerometer.shape[0] > 0 and not np.isnan(accelerometer[t, 0]):
            dt = 0.0 if np.isnan(last[1]) else time[t] - last[1]
            accelerate(s, par, dt, accelerometer[t, 0], accelerometer[t, 1], accelerometer[t, 2])
            last[1] = time[t]
        code[t] = ABSENT
        if magnetometer.shape[0] > 0 and not np.isnan(magnetometer[t, 0]):
            fresh = magnetize(s, magnetometer[t, 0], magnetometer[t, 1], magnetometer[t, 2])
            code[t] = PENDING if fresh else REPEATED
            last[2] = time[t]
        for i in range(3):
            bias[t, i] = s[at.BIAS + i]
            bias_std[t, i] = np.sqrt(p[6 + i, 6 + i])
        rest[t] = s[at.REST] > 0.0
        if s[at.ALIGNED] <= 0.0:
            if code[t] == PENDING:
                code[t] = EARLY
            if keep_all:
                readout[t] = np.nan
            begin = t + 1
            continue
        output(s, par, q)
        if keep_all:
            add_readout_error(readout[t], s, par, q)
        if count == 0 or not keep_all:  # the smoother writes them after the first update
            reported(s, p, par, q, covariances[t])
        for i in range(4):
            modes[t, i] = q[i]
    return count
