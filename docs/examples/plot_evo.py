"""
Tracks in TUM files, judged by evo
==================================

`evo <https://github.com/MichaelGrupp/evo>`_ compares trajectories, and much of robotics does it with evo. A track goes
there as a TUM file, ``t x y z qx qy qz qw``, which `write_tum` writes, or ``bingham track RECORDING --tum -o FOLDER``.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from evo.core import metrics, sync
from evo.tools import file_interface

from bingham import ImuFilter
from bingham.io import write_tum
from bingham.metrics import broad_rmse
from bingham.simulate import simulate_imu, simulate_tumbling

# %%
# Two tracks of one recording
# ---------------------------
# An inertial sensor that tumbles for a minute: filtered as samples come, and smoothed afterwards.

recording = simulate_imu(simulate_tumbling(60.0, 100.0, rest_s=5.0), gyroscope_bias=(0.01, -0.02, 0.01), rng=4)
tracks = {"online": ImuFilter().run(recording), "smoothed": ImuFilter().smooth(recording)}

folder = Path(tempfile.mkdtemp())
write_tum(folder / "truth.txt", time=recording.time, orientation=recording.reference)
for name, track in tracks.items():
    write_tum(folder / f"{name}.txt", time=track.time, orientation=track.aligned_modes)

# %%
# evo's verdict
# -------------
# ``evo_ape tum truth.txt online.txt --pose_relation angle_deg`` on a command line. Without ``--align``: that aligns
# positions, of which an inertial sensor has none, and both files are east, north, up already. The first five seconds,
# in which the filter looks for north, are left out.

scored = recording.time >= 5.0
errors = {}
for name, track in tracks.items():
    truth = file_interface.read_tum_trajectory_file(folder / "truth.txt")
    estimate = file_interface.read_tum_trajectory_file(folder / f"{name}.txt")
    truth.reduce_to_time_range(5.0)
    ape = metrics.APE(metrics.PoseRelation.rotation_angle_deg)
    ape.process_data(sync.associate_trajectories(truth, estimate, max_diff=0.001))
    errors[name] = ape.error
    rmse = ape.get_statistic(metrics.StatisticsType.rmse)
    ours = broad_rmse(track.modes[scored], recording.reference[scored])
    print(f"{name:9} evo {rmse:.3f}° RMSE, bingham {np.degrees(ours.total):.3f}°"
          f" (heading {np.degrees(ours.heading):.3f}°, inclination {np.degrees(ours.inclination):.3f}°)")  # fmt: skip
    assert np.isclose(rmse, np.degrees(ours.total), rtol=1e-4)

# %%
# What a TUM file leaves out
# --------------------------
# evo sees errors; the track also says how large they may be. Its 95 % bound is that of the rotation's angle, twice the
# angle on the sphere. It is wide here: the filter's defaults are for real sensors and disturbed places, and the
# simulated sensor is better than that.

figure, panel = plt.subplots(figsize=(8.0, 3.6), layout="constrained")
some = np.flatnonzero(scored)[::20]
first = np.argmax(scored)
for k, (name, track) in enumerate(tracks.items()):
    bound = np.degrees(2.0 * track.distributions[some].credible_angle(0.95))
    panel.plot(track.time[some], errors[name][some - first], color=f"C{k}", linewidth=1.0, label=f"{name}: error (evo)")
    panel.plot(track.time[some], bound, "--", color=f"C{k}", linewidth=1.0, label="95 % bound (bingham)")
    print(f"{name:9} {np.mean(errors[name][some - first] <= bound):.1%} of the errors lie within the 95 % bound")
panel.set(xlabel="time, s", ylabel="rotation angle, °", yscale="log", xlim=(5.0, 60.0))
panel.legend(frameon=False, ncols=2)
panel.spines[["top", "right"]].set_visible(False)
