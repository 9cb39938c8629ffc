"""
Follow a tumbling body through a gap
====================================

A body tumbles; a camera sees its orientation ten times a second, with noise, and loses sight of it for four seconds.
A gyroscope carries the estimate across. The uncertainty grows in the gap and closes after it, and 95 % of the errors
should lie under the 95 % bound, in the gap too.

(The picture in the README is this one: ``python docs/examples/plot_track.py docs/_static/track.png``.)
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

from bingham import Bingham, BinghamFilter, Gyroscope
from bingham.rotations import align_signs, compose, conjugate
from bingham.simulate import simulate_orientations, simulate_tumbling

# %%
# The motion, and what is measured
# --------------------------------
# The gyroscope runs at 100 Hz and is noisy, 0.03 rad/s/√Hz. The camera's noise is a Bingham distribution about the
# identity: 1/√(−2z) is half the standard deviation of the rotation about each axis, here 3, 5 and 8 degrees.

rate, noise_density = 100.0, 0.03
rng = np.random.default_rng(7)
motion = simulate_tumbling(20.0, rate, rng=rng)
angles = np.radians([3.0, 5.0, 8.0])
camera_noise = Bingham([*(-2.0 / angles**2), 0.0], np.eye(4)[:, [1, 2, 3, 0]])
seen = simulate_orientations(motion, camera_noise, rng=rng).orientation.copy()
t = motion.time
hidden = (np.arange(len(t)) % 10 != 0) | ((t > 8.0) & (t < 12.0))
seen[hidden] = np.nan
gyroscope = motion.angular_velocity + noise_density * np.sqrt(rate) * rng.standard_normal((len(t), 3))

# %%
# The filter
# ----------
# A row of NaN is a missing measurement: the state is predicted and nothing else.

tracker = BinghamFilter(Gyroscope(noise_density), camera_noise)
track = tracker.run(Bingham.uniform(4), seen, controls=gyroscope, times=t)
print(track.final)
print("standard deviations in the body frame, degrees:")
print(np.degrees(np.sqrt(np.diagonal(track.final.covariance(frame="body")))).round(2))

# %%
# Error and bound
# ---------------
# `credible_angle` is an angle on the sphere of quaternions; the rotation turns by twice as much.


def degrees_between(p, q):
    """Return the angle of the rotation p* ⊗ q, degrees."""
    return np.degrees(2.0 * np.arccos(np.clip(np.abs(compose(conjugate(p), q)[..., 0]), 0.0, 1.0)))


some = np.arange(5, len(t), 5)
error = degrees_between(track.modes[some], motion.orientation[some])
bound = np.degrees(2.0 * track.distributions[some].credible_angle(0.95))
print(f"{np.mean(error <= bound):.1%} of the errors lie within the 95 % bound")

truth = align_signs(motion.orientation)
modes = align_signs(np.vstack([truth[:1], track.modes]))[1:]
points = np.where(np.sum(seen * truth, axis=1, keepdims=True) < 0.0, -seen, seen)

figure, (top, bottom) = plt.subplots(2, 1, figsize=(8.0, 5.0), sharex=True, height_ratios=[3, 2], layout="constrained")
for axis, name, colour in zip(range(4), "wxyz", ("0.35", "tab:red", "tab:green", "tab:blue"), strict=True):
    top.plot(t, points[:, axis], ".", color=colour, markersize=3, alpha=0.6)
    top.plot(t, modes[:, axis], color=colour, linewidth=1.2, label=name)
top.set_ylabel("quaternion: estimate, measurements")
top.legend(ncols=4, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.0, frameon=False)
bottom.fill_between(t[some], 0.0, bound, color="tab:blue", alpha=0.25, linewidth=0.0, label="95 % credible")
bottom.plot(t[some], error, color="0.2", linewidth=0.9, label="error")
bottom.set(xlabel="time, s", ylabel="rotation angle, °", ylim=(0.0, None), xlim=(t[0], t[-1]))
bottom.legend(ncols=2, loc="upper left", frameon=False)
for panel in (top, bottom):
    panel.axvspan(8.0, 12.0, color="0.92", zorder=0)
    panel.spines[["top", "right"]].set_visible(False)
if len(sys.argv) > 1 and sys.argv[1].endswith((".png", ".svg")):
    figure.savefig(sys.argv[1], dpi=110)
