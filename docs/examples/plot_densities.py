"""
The papers' densities and models
================================

What the five papers draw to explain the distribution, from their parameters: on the circle (Kurz et al. 2013, Figs.
1, 2; 2014, Figs. 1, 2), on the sphere (2014, Fig. 3; Madaan et al. 2017, Figs. 1, 2), beside Gaussians (2013, Fig. 3;
2014, Figs. 6–8), the processes behind the filters (Glover & Kaelbling 2013, Fig. 1; Madaan et al., Fig. 3) and sensor
models of planes (Madaan et al., Fig. 9). :doc:`/papers` lists all figures.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle
from scipy.integrate import quad
from scipy.stats import norm

from bingham import Bingham
from bingham.distributions.gaussian_relations import conditioned_gaussian
from bingham.distributions.relations import angular_variance, to_gaussian
from bingham.rotations import rotate

# %%
# On the circle
# -------------
# M = I, Z = diag(z₁, 0): a ring over the plane for z₁ = −8, and f over the angle for the three standard deviations that
# the papers name. Both ends of an axis are equally probable.


def on_circle(angle):
    """Return unit vectors (..., 2)."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


angle = np.linspace(0.0, 2.0 * np.pi, 721)
figure = plt.figure(figsize=(9.5, 3.8), layout="constrained")
ring = figure.add_subplot(1, 2, 1, projection="3d")
density = Bingham([-8.0, 0.0], np.eye(2)).pdf(on_circle(angle))
ring.plot(*on_circle(angle).T, 0.0 * angle, color="0.6")
ring.plot(*on_circle(angle).T, density, color="#0072B2")
for k in range(0, angle.size, 12):
    ring.plot(*on_circle(np.repeat(angle[k], 2)).T, [0.0, density[k]], color="#0072B2", linewidth=0.5)
ring.set(xlabel="x₁", ylabel="x₂", zlabel="density", title="z₁ = −8", xticks=(-1, 0, 1), yticks=(-1, 0, 1))
panel = figure.add_subplot(1, 2, 2)
for z, colour in ((-2.0, "#009E73"), (-8.0, "#0072B2"), (-50.0, "#D55E00")):
    p = Bingham([z, 0.0], np.eye(2))
    spread = np.degrees(np.sqrt(angular_variance(p)))
    panel.plot(np.degrees(angle), p.pdf(on_circle(angle)), color=colour, label=f"z₁ = {z:g}: {spread:.0f}°")
panel.set(xlabel="angle, °", ylabel="density", xlim=(0, 360), ylim=(0, None), xticks=range(0, 361, 90))
legend = panel.legend(title="standard deviation", frameon=False, fontsize=8)

# %%
# On the sphere
# -------------
# Above, the three distributions of Kurz et al. 2014, mode (0, 0, 1); below, a distribution with its mode and two
# principal axes, and what happens when its smaller concentration goes to zero: the modes become a ring.

colatitude, longitude = np.meshgrid(np.linspace(0.0, np.pi, 61), np.linspace(0.0, 2.0 * np.pi, 121), indexing="ij")
sphere = np.stack(
    [np.sin(colatitude) * np.cos(longitude), np.sin(colatitude) * np.sin(longitude), np.cos(colatitude)], axis=-1
)


def draw_sphere(panel, p):
    """Colour the sphere by the density, dark where it is small."""
    f = p.pdf(sphere)
    panel.plot_surface(
        *np.moveaxis(sphere, -1, 0),
        facecolors=plt.get_cmap("viridis")((f / f.max())[:-1, :-1]),
        rstride=1,
        cstride=1,
        shade=False,
        antialiased=False,
    )
    panel.view_init(elev=30.0, azim=20.0)
    panel.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    panel.set_box_aspect((1, 1, 1), zoom=1.15)
    panel.set_axis_off()


rows = [
    [(-1.0, -1.0, 0.0), (-5.0, -1.0, 0.0), (-50.0, -1.0, 0.0)],
    [(-25.0, -5.0, 0.0), (-25.0, -1.0, 0.0), (-25.0, 0.0, 0.0)],
]
tilt = np.eye(3)[:, [1, 2, 0]]
figure = plt.figure(figsize=(9.0, 6.4), layout="constrained")
for i, (frame, row) in enumerate(zip((np.eye(3), tilt), rows, strict=True)):
    for k, z in enumerate(row):
        panel = figure.add_subplot(2, 3, 3 * i + k + 1, projection="3d", computed_zorder=False)
        p = Bingham(z, frame)
        draw_sphere(panel, p)
        panel.set_title(f"Z = diag{z}".replace("-", "−").replace(".0", ""), fontsize=9)
        if i:
            for j, (colour, name) in enumerate((("#E69F00", "v₁"), ("#56B4E9", "v₂"), ("#D55E00", "mode"))):
                panel.plot(*np.outer(p.M[:, j], [1.0, 1.35]), color=colour, linewidth=2.5, label=name)
legend = figure.legend(*panel.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)

# %%
# Beside Gaussians
# ----------------
# Left: a Bingham distribution on the circle, drawn outwards from it, and the Gaussian in the plane with its mean at one
# mode and the covariance of that half (Kurz et al. 2014, eq. 57), as the Kalman filter beside it assumes. Right: a
# Gaussian about 0; what it says of vectors of length 1 is a Bingham distribution.

grid = np.linspace(-1.6, 1.6, 201)
plane = np.stack(np.meshgrid(grid, grid), axis=-1)


def gaussian(x, mean, covariance):
    """Return the density (...) of a Gaussian in the plane at x (..., 2)."""
    off = x - mean
    form = np.einsum("...i,ij,...j->...", off, np.linalg.inv(covariance), off)
    return np.exp(-0.5 * form) / (2.0 * np.pi * np.sqrt(np.linalg.det(covariance)))


noise = Bingham([-3.0, 0.0], np.eye(2))
fitted = to_gaussian(noise)
wide = np.array([[0.9, 0.35], [0.35, 0.3]])
figure, panels = plt.subplots(1, 2, figsize=(8.6, 4.2), layout="constrained")
for panel, p, mean, covariance, title in (
    (panels[0], noise, fitted.mean, fitted.covariance, "a Gaussian fitted to one mode"),
    (panels[1], conditioned_gaussian(wide), np.zeros(2), wide, "a Gaussian conditioned to the circle"),
):
    f = p.pdf(on_circle(angle))
    height = gaussian(plane, mean, covariance)
    panel.contour(grid, grid, height, levels=6, cmap="Greys", linewidths=0.8)
    panel.add_patch(Circle((0.0, 0.0), 1.0, fill=False, color="0.5"))
    outline = on_circle(angle) * (1.0 + 0.9 * f / f.max() * 0.5)[:, None]
    panel.fill(*np.vstack([outline, on_circle(angle)[::-1]]).T, color="#0072B2", alpha=0.35, linewidth=0)
    panel.plot(*outline.T, color="#0072B2")
    panel.set(title=title, aspect="equal", xlabel="x₁", ylabel="x₂", xlim=(-1.6, 1.6), ylim=(-1.6, 1.6))

# %%
# How far the Bingham distribution of one half circle is from the Gaussian of the same mode and standard deviation: the
# divergence (eq. 70) by quadrature. The curve of 2013 scatters because it was sampled.

concentrations = np.linspace(-30.0, -0.1, 100)
divergence = []
for z in concentrations:
    p = Bingham([z, 0.0], np.eye(2))
    sigma = np.sqrt(angular_variance(p))

    def integrand(t, p=p, sigma=sigma):
        """Return the term of eq. 70, on the half circle about the mode, whose share is 1."""
        log_f = p.logpdf(on_circle(np.pi / 2 + t)) + np.log(2.0)
        return np.exp(log_f) * (log_f - norm.logpdf(t, scale=sigma))

    divergence.append(quad(integrand, -np.pi / 2, np.pi / 2)[0])
figure, panel = plt.subplots(figsize=(6.0, 3.4), layout="constrained")
panel.plot(concentrations, divergence, color="#0072B2")
panel.axvline(-15.0, color="0.7", linewidth=0.8)
panel.set(xlabel="z₁", ylabel="divergence, nats", xlim=(-30, 0), ylim=(0, None), xticks=range(-30, 1, 5))
at = {z: np.interp(z, concentrations, divergence) for z in (-1.0, -4.0, -15.0)}
print(", ".join(f"z₁ = {z:g}: {value:.4f} nats" for z, value in at.items()))

# %%
# The processes
# -------------
# First order: xₙ = wₙ ∘ uₙ ∘ xₙ₋₁. Second order: xₙ = vₙ₋₁ ∘ xₙ₋₁, vₙ = wₙ ∘ uₙ ∘ vₙ₋₁. Of both only yₙ = zₙ ∘ xₙ and
# the controls are seen (grey).

steps = ("ₙ₋₁", "ₙ", "ₙ₊₁")
figure, panels = plt.subplots(1, 2, figsize=(9.0, 3.6), layout="constrained")
for panel, chains in zip(panels, (("u", "x", "y"), ("u", "v", "x", "y")), strict=True):
    level = {name: float(len(chains) - 1 - i) for i, name in enumerate(chains)}
    arrows = [("u", "x", 0), ("x", "x", 1), ("x", "y", 0)]
    if "v" in level:
        arrows = [("u", "v", 0), ("v", "v", 1), ("v", "x", 1), ("x", "x", 1), ("x", "y", 0)]
    for k in range(3):
        for a, b, later in arrows:
            if k + later < 3:
                start, end = np.array([1.6 * k, level[a]]), np.array([1.6 * (k + later), level[b]])
                towards = (end - start) / np.linalg.norm(end - start)
                style = {"arrowstyle": "-|>", "color": "0.3"}
                panel.annotate("", end - 0.29 * towards, start + 0.29 * towards, arrowprops=style)
        for name in chains:
            seen = name in "uy"
            panel.add_patch(
                Circle((1.6 * k, level[name]), 0.29, facecolor="0.85" if seen else "white", edgecolor="0.2")
            )
            panel.text(1.6 * k, level[name], name + steps[k], ha="center", va="center", fontsize=10)
    panel.set(xlim=(-0.5, 3.7), ylim=(-0.5, len(chains) - 0.5), aspect="equal")
    panel.set_title("second order" if "v" in level else "first order")
    panel.axis("off")

# %%
# Sensor models of planes
# -----------------------
# A plane's normal (cyan), turned by 1000 quaternions of each noise with its mode at the identity.

point = np.array([0.5, -0.4, 0.77])
point /= np.linalg.norm(point)
identity = np.eye(4)[:, [1, 2, 3, 0]]
figure = plt.figure(figsize=(9.5, 3.5), layout="constrained")
for k, z in enumerate([(-30.0, -30.0, -600.0), (-60.0, -60.0, -900.0), (-800.0, -800.0, -900.0)]):
    panel = figure.add_subplot(1, 3, k + 1, projection="3d", computed_zorder=False)
    panel.plot_surface(*np.moveaxis(sphere, -1, 0), color="0.92", rstride=3, cstride=3, linewidth=0.2, edgecolor="0.8")
    turned = rotate(Bingham([*z, 0.0], identity).rvs(1000, rng=1), point)
    panel.plot(*turned.T, ".", color="black", markersize=1.5)
    panel.plot(*point[:, None], "o", color="cyan", markeredgecolor="black", markersize=6)
    panel.view_init(elev=np.degrees(np.arcsin(point[2])), azim=np.degrees(np.arctan2(point[1], point[0])))
    panel.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    panel.set_box_aspect((1, 1, 1), zoom=1.2)
    panel.set_axis_off()
    panel.set_title(f"Λ = {z}".replace("-", "−").replace(".0", ""), fontsize=9)
