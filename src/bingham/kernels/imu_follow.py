"""The inertial filter over samples of any sensor in the order in which they come, in one compiled loop."""

from __future__ import annotations

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.imu_loop import accelerate, due, magnetize, readout, rotate
from bingham.kernels.imu_orientation import advance

__all__ = ["follow"]


@compiled()
def follow(s, par, w, sensors, samples, out):
    """Take samples (N, 4), time and vector, of sensors (N,): 0 gyroscope, 1 accelerometer, 2 magnetometer.

    s holds the state before and after, begun by a first accelerometer sample. out (N, 7): after each sample the
    orientation, the variance of the inclination and of the heading, and whether the body rests.
    """
    q = np.empty(4)
    c = np.empty((3, 3))
    extra = np.empty((3, 3))
    for i in range(sensors.size):
        t, x, y, z = samples[i, 0], samples[i, 1], samples[i, 2], samples[i, 3]
        if sensors[i] == 0:
            if due(s, par):
                advance(s, par, w)
            rotate(s, par, w, t, x, y, z)
        elif sensors[i] == 1:
            accelerate(s, par, w, t, x, y, z)
            s.restarted = 0
        else:
            magnetize(s, t, x, y, z)
        readout(s, par, q, c, extra)
        for j in range(4):
            out[i, j] = q[j]
        out[i, 4], out[i, 5] = c[0, 0] + c[1, 1], c[2, 2]
        out[i, 6] = 1.0 if s.resting > 0 else 0.0
