"""
An inertial sensor, with and without its magnetometer
=====================================================

Gravity holds the inclination; only the magnetometer holds the heading. Without it the distribution says so: its spread
about the vertical grows, that about the horizontal axes does not.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

from bingham import Bingham
from bingham.filters import InertialFilter
from bingham.simulate import simulate_imu, simulate_tumbling

motion = simulate_tumbling(60.0, 100.0, rest_s=5.0)
recording = simulate_imu(motion, gyroscope_bias=(0.002, -0.001, 0.002), rng=1)
start = Bingham.from_covariance(recording.reference[0], 0.02**2 * np.eye(3), frame="world")

figure, panel = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
for name, given in (
    ("with magnetometer", recording),
    ("without", replace(recording, magnetometer=None)),
):
    track = InertialFilter().run(given, prior=start)
    sigma = np.degrees(np.sqrt(np.diagonal(track.covariance(frame="world"), axis1=-2, axis2=-1)))
    (line,) = panel.plot(track.time, sigma[:, 2], label=f"heading, {name}")
    panel.plot(track.time, sigma[:, :2].mean(axis=1), "--", color=line.get_color(), label=f"inclination, {name}")
    print(f"{name}: after {track.time[-1]:.0f} s heading ± {sigma[-1, 2]:.1f}°, inclination ± {sigma[-1, 0]:.1f}°")
panel.set(xlabel="time, s", ylabel="standard deviation, °", ylim=(0.0, None), xlim=(0.0, motion.time[-1]))
panel.legend(frameon=False)
panel.spines[["top", "right"]].set_visible(False)
