"""
Axes in space: a cluster and a girdle
=====================================

Poles of bedding, crystal axes, fibres: lines without a direction. One distribution describes a cluster about an axis,
a girdle in a plane and everything between; the fit says which, with standard errors.
"""

import matplotlib.pyplot as plt
import numpy as np

from bingham import Bingham

rng = np.random.default_rng(4)
frame = np.linalg.qr(rng.standard_normal((3, 3)))[0]
distributions = {"cluster": Bingham([-40.0, -15.0, 0.0], frame), "girdle": Bingham([-30.0, -0.5, 0.0], frame)}

# %%
# A lower-hemisphere equal-area plot, the geologists' projection. Contours are the fitted density.


def project(x):
    """Return equal-area coordinates (..., 2) of axes x (..., 3): east, north, up."""
    x = np.where(x[..., 2:] > 0.0, -x, x)
    return x[..., :2] * np.sqrt(1.0 / (1.0 - x[..., 2:]))


grid = np.linspace(-1.0, 1.0, 201)
east, north = np.meshgrid(grid, grid)
radius2 = east**2 + north**2
inside = radius2 <= 1.0
scale = np.sqrt(np.maximum(2.0 - radius2, 0.0))
directions = np.stack([east * scale, north * scale, radius2 - 1.0], axis=-1)

figure, panels = plt.subplots(1, 2, figsize=(8.0, 4.2), layout="constrained")
for panel, (name, distribution) in zip(panels, distributions.items(), strict=True):
    x = distribution.rvs(200, rng=rng)
    fitted = Bingham.fit(x)
    errors = fitted.standard_errors(len(x))
    print(f"{name}: true z {distribution.z}, fitted {fitted.z.round(1)} ± {errors.concentrations.round(1)}")
    density = np.full(radius2.shape, np.nan)
    density[inside] = fitted.pdf(directions[inside] / np.linalg.norm(directions[inside], axis=-1, keepdims=True))
    panel.contour(east, north, density, levels=6, cmap="viridis", linewidths=0.9)
    panel.plot(*project(x).T, ".", color="0.3", markersize=3)
    panel.add_patch(plt.Circle((0.0, 0.0), 1.0, fill=False, color="0.3"))
    panel.set(title=name, aspect="equal", xlim=(-1.05, 1.05), ylim=(-1.05, 1.05))
    panel.axis("off")
