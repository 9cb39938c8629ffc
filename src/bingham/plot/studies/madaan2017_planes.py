"""Figures of the study of planes: the scene, its normals, the sensor models (report, Fig. 9) and the loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bingham.distributions.bingham import Bingham
from bingham.distributions.mixture import BinghamMixture
from bingham.plot.mixture import plot_mixture, plot_rotation_cloud
from bingham.plot.segmentation import plot_segmentation
from bingham.plot.studies.style import new_figure
from bingham.studies.study import StudyResult
from bingham.surfaces.segmentation import PlaneDirections

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]

# Λ of the report's Fig. 9 (a) to (c).
SENSOR_MODELS = ((-30.0, -30.0, -600.0), (-60.0, -60.0, -900.0), (-800.0, -800.0, -900.0))
# The two estimates may lie on one another: one is a line, the other open circles about it, and the truth beside shows.
LOOP = {
    "truth": {"color": "#000000", "lw": 1.2},
    "odometry": {"color": "#999999", "lw": 1.4, "ls": ":"},
    "gaussian": {"color": "#D55E00", "ls": "", "marker": "o", "ms": 4.5, "mfc": "none", "mew": 0.9},
    "bingham": {"color": "#0072B2", "lw": 1.2},
}


def draw(result: StudyResult) -> dict[str, Figure]:
    """Return the figures ``scene``, ``normals``, ``sensor`` and ``loop``."""
    curves = {key.removeprefix("example/"): value for key, value in result.curves.items()}
    distributions = Bingham.from_spectrum(np.array(curves["z"]), np.array(curves["M"]))
    mixture = BinghamMixture(curves["shares"][:-1], distributions, float(curves["shares"][-1]))
    found = PlaneDirections(curves["directions"], curves["weights"], mixture, curves["owner"])
    identity_last = np.eye(4)[:, [1, 2, 3, 0]]
    models = [Bingham([*spectrum, 0.0], identity_last) for spectrum in SENSOR_MODELS]
    return {
        "scene": plot_segmentation(curves["depth"], curves["label"], found, wrong=curves["wrong"]),
        "normals": plot_mixture(curves["normals"], mixture, names=("x", "y", "z"), title="normals of the room"),
        "sensor": plot_rotation_cloud(models, rng=result.seed),
        "loop": _loop(result),
    }


def _loop(result: StudyResult) -> Figure:
    figure, axes = new_figure(8.4, 3.8, 1, 2, sharex=True, sharey=True)
    for ax, noise in zip(axes, ("small", "large"), strict=True):
        for name, style in LOOP.items():
            path = result.curves[f"{noise}/{name}"]
            ax.plot(path[:, 0], path[:, 1], label=name, **style)
        ax.set(aspect="equal", xlabel="x [m]", title=f"{noise} plane noise")
    axes[0].set(ylabel="y [m]")
    axes[0].legend(fontsize=8, frameon=False)
    return figure
