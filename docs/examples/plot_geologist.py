"""
For the geologist: lineations, folds and their uncertainty
===========================================================

Lineations that cluster and poles of folded layers that lie about a great circle: eigenvalues, shape, mean axis,
best-fit plane and fold axis, each with the region that holds it in 95 % of such samples. ``bingham fit FILE.csv -o
FOLDER`` prints and draws the same for a file of trend and plunge, strike and dip, or n, e, d.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import bingham
from bingham import Bingham
from bingham.geology import draw_axes, draw_contours, draw_great_circle, draw_net, fabric, to_trend_plunge
from bingham.inference import cluster_girdle_test, common_axis_test, symmetry_test, uniformity_test
from bingham.plot import draw_fabric

# %%
# The samples: 84 lineations of the Quetico province (from the R package structr) and 56 poles to folded layers (Vollmer
# 1981). They lie beside the project, not in it; without them, samples drawn from similar distributions stand in.

DATA = Path(bingham.__file__).resolve().parents[2] / "../shared/data/axial"


def read(name, stand_in):
    path = DATA / f"{name}.csv"
    if not path.is_file():
        print(f"{name} is not beside the project: drawn samples stand in")
        return Bingham(stand_in, np.eye(3)).rvs(70, rng=1)
    rows = np.loadtxt(path, delimiter=",", skiprows=2, usecols=(2, 3, 4))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


lineations = read("quetico_lineations", [-12.5, -8.1, 0.0])
poles = read("vollmer1981_poles", [-30.0, -1.0, 0.0])

# %%
# What is printed in a paper.

for name, x in (("lineations", lineations), ("poles", poles)):
    result = fabric(x)
    trend, plunge = result.mean_axis
    print(f"{name}: n = {result.size}, S = {result.eigenvalues.round(5)} ± {result.eigenvalue_errors.round(4)}")
    print(f"  Woodcock K = {result.K:.3f}, C = {result.C:.3f}; Vollmer P, G, R = "
          f"{result.P:.3f}, {result.G:.3f}, {result.R:.3f}")  # fmt: skip
    print(
        f"  mean axis {trend:05.1f}/{plunge:04.1f}, 95 % region {np.degrees(result.mean_ellipse.semi_axes).round(1)}°"
    )
    trend, plunge = result.fold_axis
    print(f"  pole of the best-fit plane {trend:05.1f}/{plunge:04.1f}, "
          f"95 % region {np.degrees(result.pole_ellipse.semi_axes).round(1)}°")  # fmt: skip

# %%
# The net: contours by exponential counting, the plane, both axes and their regions. A semi-axis of 90° means that the
# sample leaves the axis open; such a region is not drawn. The pole of a cluster with rotational symmetry is open.

figure, panels = plt.subplots(1, 2, figsize=(10.0, 6.2), layout="constrained")
for panel, x in zip(panels, (lineations, poles), strict=True):
    draw_fabric(panel, x)
    panel.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=2, fontsize=7, frameon=False)

# %%
# Tests. The lineations are no uniform sample, of course; that their cluster is not round cannot be said (p = 0.17). The
# poles are a girdle.

for name, x in (("lineations", lineations), ("poles", poles)):
    shape = cluster_girdle_test(x)
    print(f"{name}: uniform p = {uniformity_test(x).pvalue:.2g}; symmetry p = {symmetry_test(x).pvalue:.3f}; "
          f"{'cluster' if shape.statistic > 0 else 'girdle'}, p = {shape.pvalue:.2g}")  # fmt: skip

# %%
# Do two halves of the lineations share their mean axis?

print(f"p = {common_axis_test(lineations[::2], lineations[1::2]).pvalue:.2f}")

# %%
# Piece by piece, on axes of your own: the fitted density in multiples of the uniform one on an equal-angle net, and
# Kamb's contours on an equal-area one. The same functions draw on the axes of mplstereonet.

figure, panels = plt.subplots(1, 2, figsize=(9.0, 4.8), layout="constrained")
result = fabric(poles)
draw_net(panels[0], projection="equal-angle", step_deg=None)
lines = draw_contours(panels[0], result.distribution, projection="equal-angle", levels=[0.5, 1, 2, 4, 6])
panels[0].clabel(lines, fontsize=7)
draw_axes(panels[0], poles, projection="equal-angle")
panels[0].set_title("fitted density, multiples of uniform; equal angle", fontsize=9)
draw_net(panels[1])
draw_contours(panels[1], poles, "kamb", cmap="viridis", linewidths=0.9)
draw_axes(panels[1], poles)
draw_great_circle(panels[1], result.eigenvectors[:, 2], color="C0")
panels[1].set_title("Kamb, every 2σ; equal area", fontsize=9)
trend, plunge = to_trend_plunge(result.eigenvectors[:, 2])
print(f"fold axis {float(trend):.0f}/{float(plunge):.0f}")
