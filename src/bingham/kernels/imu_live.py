"""The inertial filter's ways in, a sample at a time: what each sensor's sample does, as in `imu_loop.run`.

state, parameters and work are arrays (1,) of the records that the loop works on: of a record by itself NumPy spells out
the format at each call, which takes ten times as long as the sample.
"""

from __future__ import annotations

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.imu_loop import accelerate, due, magnetize, readout, rotate
from bingham.kernels.imu_orientation import advance, flush, observe, passed

__all__ = ["follow", "read", "take_field", "take_force", "take_orientation", "take_rate"]


@compiled()
def take_rate(state, parameters, work, t, x, y, z):
    """Take the gyroscope's sample; return the log-evidence of orientations that it has passed."""
    s, par, w = state[0], parameters[0], work[0]
    evidence = advance(s, par, w) if due(s, par) else 0.0
    rotate(s, par, w, t, x, y, z)
    return evidence + (advance(s, par, w) if passed(s) else 0.0)


@compiled()
def take_force(state, parameters, work, t, x, y, z):
    """Take the accelerometer's sample."""
    s = state[0]
    accelerate(s, parameters[0], work[0], t, x, y, z)
    s.restarted = 0


@compiled()
def take_field(state, t, x, y, z):
    """Take the magnetometer's sample."""
    magnetize(state[0], t, x, y, z)


@compiled()
def take_orientation(state, parameters, work, t, q, covariance):
    """Take an orientation q (4,) with its covariance (3, 3), world axes; return log-evidence as `take_rate` does."""
    s, par, w = state[0], parameters[0], work[0]
    evidence = flush(s, par, w) if s.seen > 0 else 0.0
    if observe(s, par, t, q, covariance) and passed(s):
        evidence += advance(s, par, w)
    return evidence


@compiled()
def read(state, parameters, q, covariance):
    """Write orientation q (4,) and its covariance (3, 3), world axes, now."""
    readout(state[0], parameters[0], q, covariance, np.empty((3, 3)), True)


@compiled()
def follow(state, parameters, work, sensors, samples, out):
    """Take samples (N, 4), time and vector, of sensors (N,): 0 gyroscope, 1 accelerometer, 2 magnetometer.

    The state has been begun by a first accelerometer sample. out (N, 7): after each sample the orientation, the
    variance of the inclination and of the heading, and whether the body rests.
    """
    q = np.empty(4)
    c = np.empty((3, 3))
    for i in range(sensors.size):
        t, x, y, z = samples[i, 0], samples[i, 1], samples[i, 2], samples[i, 3]
        if sensors[i] == 0:
            take_rate(state, parameters, work, t, x, y, z)
        elif sensors[i] == 1:
            take_force(state, parameters, work, t, x, y, z)
        else:
            take_field(state, t, x, y, z)
        read(state, parameters, q, c)
        for j in range(4):
            out[i, j] = q[j]
        out[i, 4], out[i, 5] = c[0, 0] + c[1, 1], c[2, 2]
        out[i, 6] = 1.0 if state[0].resting > 0 else 0.0
