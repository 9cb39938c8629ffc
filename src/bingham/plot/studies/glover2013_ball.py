"""Figure 4 of the ball study: orientation and spin error and classification over frames, and by kind of spin."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bingham.plot.studies.style import COLORS, LABELS, new_figure
from bingham.studies.glover2013_ball import ASSUMED, DEFAULT
from bingham.studies.study import StudyResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]

NAMES = (
    "bingham_second_order",
    "bingham_mixture",
    "bingham_mixture_published",
    "bingham_oracle",
    "bingham_bank",
    "bingham_first_order",
    "ekf_first_order",
    "bingham_first_order_fair",
    "ekf_first_order_fair",
    "ekf_second_order",
    "ekf_mixture",
    "random_guess",
)
PANELS = (
    ("orientation_error", "orientation error [°]"),
    ("spin_error", "spin error [°/frame]"),
    ("correct", "classified right [%]"),
)
STYLES = {
    "bingham_oracle": ":",
    "bingham_bank": "--",
    "bingham_mixture_published": "--",
    "bingham_first_order_fair": (0, (1, 1)),
    "ekf_first_order_fair": (0, (1, 1)),
    "ekf_mixture": "--",
    "random_guess": "--",
}


def draw(result: StudyResult) -> dict[str, Figure]:
    """Return the figures ``frames`` at the default logo noise and ``frames_assumed`` at the one the filters assume."""
    return {"frames": _frames_figure(result, DEFAULT), "frames_assumed": _frames_figure(result, ASSUMED)}


def _frames_figure(result: StudyResult, level: int) -> Figure:
    figure, axes = new_figure(10.0, 6.2, 2, 3, sharex=True)
    sideways = (result.curves["kind"] // 3) >= 2
    for j, (quantity, label) in enumerate(PANELS):
        for name in NAMES:
            curve = result.curves.get(f"{level}/{quantity}/{name}")
            if curve is not None:
                line = {"color": COLORS[name], "ls": STYLES.get(name, "-"), "lw": 1.4}
                axes[0, j].plot(_frames(curve), _scaled(quantity, curve), label=LABELS[name], **line)
        curve = result.curves[f"{level}/{quantity}/bingham_second_order"]
        for rows, name, color in ((~sideways, "topspin, underspin", "#0072B2"), (sideways, "sidespin", "#D55E00")):
            if rows.any():
                axes[1, j].plot(_frames(curve), _scaled(quantity, curve[rows]), color=color, label=f"2nd order, {name}")
        axes[0, j].set(ylabel=label, ylim=(0.0, None))
        axes[1, j].set(ylabel=label, ylim=(0.0, None), xlabel="frame")
    handles, labels = axes[0, 1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=8, frameon=False)
    axes[1, 2].legend(fontsize=8, frameon=False, loc="lower right")
    return figure


def _frames(curve: np.ndarray) -> np.ndarray:
    return np.arange(1, curve.shape[1] + 1)


def _scaled(quantity: str, curve: np.ndarray) -> np.ndarray:
    mean = curve.mean(axis=0)
    return 100.0 * mean if quantity == "correct" else np.degrees(mean)
