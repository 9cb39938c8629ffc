"""
For the statistician: choosing, estimating and testing
=======================================================

Which distribution, with which parameters, how well known, and whether the sample is one of it at all: on published
samples of axes, with the coverage of the intervals and the power of the tests by simulation.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import bingham
from bingham import Bingham
from bingham.distributions.sibling import select
from bingham.inference import (
    concentration_intervals,
    confidence_ellipse,
    goodness_of_fit_test,
    mean_axis_test,
    symmetry_test,
    uniformity_test,
)

# %%
# Axes of quartz (Kamb 1959, fig. 7), beside the project; without them a drawn sample stands in.

PATH = Path(bingham.__file__).resolve().parents[2] / "../shared/data/axial/kamb1959_fig7.csv"
if PATH.is_file():
    rows = np.loadtxt(PATH, delimiter=",", skiprows=2, usecols=(2, 3, 4))
    x = rows / np.linalg.norm(rows, axis=1, keepdims=True)
else:
    print("the quartz axes are not beside the project: a drawn sample stands in")
    x = Bingham([-2.8, -1.5, 0.0], np.eye(3)).rvs(112, rng=1)

# %%
# Distributions of axes, ranked by Schwarz's criterion. Those of directions need signs, which axes have not.

print(select(x, ["uniform", "watson", "bingham", "angular_central_gaussian"]))

# %%
# Is Bingham's distribution good enough? The angles to the mode against their exact distribution, by parametric
# bootstrap; and the hypotheses that would make it simpler.

print(f"goodness of fit p = {goodness_of_fit_test(x, rng=0).pvalue:.3f}")
print(f"uniform: S = {uniformity_test(x).statistic:.1f}, p = {uniformity_test(x).pvalue:.1g}; "
      f"Giné p = {uniformity_test(x, method='gine').pvalue:.1g}")  # fmt: skip
symmetry = symmetry_test(x)
print(f"rotational symmetry {symmetry.statistic:.2f}, p = {symmetry.pvalue:.3f}")

# %%
# Concentrations: maximum likelihood, the estimate with the axes integrated out, and its profile interval.

found = concentration_intervals(x)
for k in range(2):
    print(f"z{k + 1}: ML {Bingham.fit(x).z[k]:.2f}, corrected {found.estimate[k]:.2f}, "
          f"95 % from {found.low[k]:.2f} to {found.high[k]:.2f}")  # fmt: skip

# %%
# Why not the usual ellipse? Its coverage by simulation, 2000 samples of each size.

sizes = [6, 8, 10, 15, 20, 30, 50, 100]
z = [-20.0, -8.0, 0.0]
truth = Bingham(z, np.eye(3))
samples = {n: truth.rvs((2000, n), rng=n) for n in sizes}
cover = {
    m: [confidence_ellipse(samples[n], method=m).contains(truth.mode).mean() for n in sizes] for m in ("chi2", "f")
}
cover["likelihood"] = [np.mean(mean_axis_test(samples[n], truth.mode).pvalue > 0.05) for n in sizes]
bias = {
    "maximum likelihood": [np.median(Bingham.fit(samples[n]).z[:, 0]) / z[0] for n in sizes],
    "bias_corrected=True": [np.median(Bingham.fit(samples[n], bias_corrected=True).z[:, 0]) / z[0] for n in sizes],
}
figure, panels = plt.subplots(1, 3, figsize=(13.0, 4.0), layout="constrained")
for name, values in cover.items():
    panels[0].semilogx(sizes, values, "o-", ms=3, label={"chi2": "χ² ellipse", "f": "F ellipse"}.get(name, name))
panels[0].axhline(0.95, color="0.6", lw=0.8, ls="--")
panels[0].set(xlabel="number of axes n", ylabel="coverage of the mean axis", ylim=(0.7, 1.0))
panels[0].legend(frameon=False, fontsize=8)
for name, values in bias.items():
    panels[1].semilogx(sizes, values, "o-", ms=3, label=name)
panels[1].axhline(1.0, color="0.6", lw=0.8, ls="--")
panels[1].set(xlabel="number of axes n", ylabel="median of the steepest concentration / truth")
panels[1].legend(frameon=False, fontsize=8)
for panel in panels[:2]:
    panel.set_xticks([6, 10, 20, 50, 100], ["6", "10", "20", "50", "100"])
    panel.minorticks_off()

# %%
# Power: how often twenty axes show that they are not uniform, or not symmetric, as the departure grows.

strength = np.linspace(0.0, 1.0, 7)
for name, test, shape in (
    ("uniformity, z = (−5s, −5s, 0)", uniformity_test, lambda s: [-5.0 * s, -5.0 * s, 0.0]),
    ("symmetry, z = (−10 − 40s, −10, 0)", symmetry_test, lambda s: [-10.0 - 40.0 * s, -10.0, 0.0]),
):
    power = [np.mean(test(Bingham(shape(s), np.eye(3)).rvs((2000, 20), rng=7)).pvalue < 0.05) for s in strength]
    panels[2].plot(strength, power, "o-", ms=3, label=name)
panels[2].axhline(0.05, color="0.6", lw=0.8, ls="--")
panels[2].set(xlabel="strength s", ylabel="share of rejections at 0.05, n = 20", ylim=(0, 1.35))
panels[2].set_yticks(np.linspace(0.0, 1.0, 6))
panels[2].legend(frameon=False, fontsize=8, loc="upper left")

# sphinx_gallery_thumbnail_number = -1
