"""
For the crystallographer: orientations known up to their symmetry
==================================================================

A cubic crystal looks the same in 24 orientations, and a map of orientations jumps between them from point to point,
with wrong solutions in between. A Bingham distribution with the symmetry of the crystal and a background for outliers
reads such records as they are. ``bingham fit map.ang --symmetry 432`` does it from the command line.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import bingham
from bingham import Bingham
from bingham.distributions.crystal import likely_symmetry, misorientation, symmetry_group
from bingham.distributions.symmetric import SymmetricMixture
from bingham.geology import draw_net, project
from bingham.inference import mean_rotation
from bingham.rotations import compose, rotate

# %%
# Fourteen scans of one nickel surface (M. A. Bingham, Nordman & Vardeman 2009; from the R package rotations). They lie
# beside the project, not in it; without them a drawn sample stands in.

NICKEL = Path(bingham.__file__).resolve().parents[2] / "../shared/data/nickel_ebsd/nickel.npz"
if NICKEL.is_file():
    scans = np.load(NICKEL)
    good = scans["is_rotation"]
    q = scans["quat"][good].astype(float)
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    place, scan = scans["location"][good], scans["rep"][good]
    at = np.column_stack([scans["xpos"], scans["ypos"]])[good]
else:
    print("the nickel scans are not beside the project: a drawn sample stands in")
    frame = np.linalg.qr(np.random.default_rng(0).normal(size=(4, 4)))[0]
    truth = SymmetricMixture([0.95], Bingham([[-9e4, -6e4, -3e4, 0.0]], [frame]), "432", 0.05)
    q = truth.rvs(14 * 300, rng=1)
    place, scan = np.tile(np.arange(300), 14), np.repeat(np.arange(1, 15), 300)
    at = np.column_stack([place % 20, place // 20])

print(f"{len(q)} orientations; they jump by rotations of the group {likely_symmetry(q)}")

# %%
# One grain: the places where most scans lie within 3° of a seed. All records of these places are kept, wrong ones too.

rng = np.random.default_rng(0)
trial = q[rng.choice(len(q), 300, replace=False)]
held = [np.sum(misorientation(trial, t, "432").angle < np.radians(3)) for t in trial[:60]]
near = misorientation(q, trial[int(np.argmax(held))], "432").angle < np.radians(3)
inside = np.isin(place, [k for k in np.unique(place[near]) if near[place == k].sum() >= 8])
grain, number, spot = q[inside], scan[inside], at[inside]
print(f"{len(np.unique(place[inside]))} places, {len(grain)} records")

# %%
# Its orientation, scatter and outliers. Without the group the same records give next to nothing.

fitted = SymmetricMixture.fit(grain, "432", rng=0)
component = fitted.components[0]
deviation = np.degrees(np.sqrt(np.diag(component.covariance(frame="body"))))
print(f"mode {component.mode.round(4)}, deviations about the crystal's axes {deviation.round(2)}°")
print(f"background {100 * fitted.background:.2f} %: {np.sum(fitted.predict(grain) < 0)} records")
print(f"concentrations {component.z.round()}, without symmetry {Bingham.fit(grain).z.round(1)}")

# %%
# Pole figure of {100}, upper part of the sample: every record by its three cube axes. Records given to the background
# are crosses.

label = fitted.predict(grain)
figure, panels = plt.subplots(1, 3, figsize=(13.0, 4.3), layout="constrained")
draw_net(panels[0], step_deg=None)
for axis in np.eye(3):
    tips = rotate(grain, axis)
    # x to the right, y up, z towards the reader: the map's east, north and hemisphere.
    points = project(tips[:, [1, 0, 2]])
    panels[0].plot(*points[label < 0].T, "x", ms=4, color="C3", mew=0.8, zorder=1)
    panels[0].plot(*points[label == 0].T, ".", ms=2, color="C0", zorder=2)
panels[0].texts[-1].set_text("y")
panels[0].set_title("{100} pole figure", fontsize=10)

# %%
# How far the records lie from the mode, beside what the fitted distribution expects.

angle = np.degrees(misorientation(grain, component.mode, "432").angle)
drawn = np.degrees(2.0 * np.arccos(np.minimum(1.0, np.abs(component.rvs(20_000, rng=1) @ component.mode))))
bins = np.linspace(0.0, 2.5, 51)
panels[1].hist(angle, bins, density=True, color="0.75", label="records")
panels[1].hist(drawn, bins, density=True, histtype="step", color="C0", label="fitted distribution")
panels[1].set(xlabel="misorientation from the mode [°]", ylabel="density")
panels[1].legend(frameon=False, fontsize=8)

# %%
# Fourteen scans, fourteen means: the grain's orientation repeats far within the scatter of single points. Errors of
# neighbouring points are alike, so that ``position`` makes the deviations of the means (bars) several times larger than
# independent points would have. What is left is common to all grains of a scan: the sample lay differently in scans 1
# to 3 (:doc:`/theory/inference` takes it off).

group = symmetry_group("432")
turns, errors = [], []
for k in np.unique(number):
    part = mean_rotation(grain[number == k], group="432", position=spot[number == k])
    between = compose(compose(component.mode * [1, -1, -1, -1], part.mean), group)
    e = between[np.argmax(np.abs(between[:, 0]))]
    turns.append(np.degrees(2.0 * e[1:] * np.sign(e[0])))
    errors.append(np.degrees(np.sqrt(np.diag(part.covariance(frame="body")))))
turns, errors = np.array(turns), np.array(errors)
for axis, name in enumerate("xyz"):
    panels[2].errorbar(
        np.unique(number) + 0.15 * (axis - 1), turns[:, axis], errors[:, axis], fmt="o", ms=3, label=f"about {name}"
    )
band = deviation.mean()
panels[2].axhspan(-band, band, color="0.92", zorder=0, label="± deviation of one point")
panels[2].set(xlabel="scan", ylabel="rotation from the grain's mode [°]", ylim=(-1.25 * band, 1.9 * band))
panels[2].legend(frameon=False, fontsize=8, ncols=2, loc="upper center")
print(
    f"standard deviation over the scans {turns.std(axis=0, ddof=1).round(3)}°, stated {errors.mean(axis=0).round(3)}°"
)
