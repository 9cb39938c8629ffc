"""Colours and axes that all study figures share."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

__all__ = ["COLORS", "LABELS", "axes_of", "new_figure"]

# Colour-blind safe (Okabe & Ito).
COLORS = {
    "bingham": "#0072B2",
    "bingham_second_order": "#0072B2",
    "bingham_first_order": "#56B4E9",
    "bingham_bank": "#009E73",
    "bingham_mixture": "#CC79A7",
    "bingham_mixture_published": "#CC79A7",
    "bingham_oracle": "#333333",
    "scalar_kalman": "#D55E00",
    "axial_kalman": "#D55E00",
    "wrapped_normal": "#009E73",
    "ekf_fixed": "#D55E00",
    "ekf_fair": "#E69F00",
    "ekf_padded": "#CC79A7",
    "bingham_first_order_fair": "#56B4E9",
    "ekf_first_order": "#E69F00",
    "ekf_first_order_fair": "#E69F00",
    "ekf_second_order": "#D55E00",
    "ekf_second_order_fair": "#CC79A7",
    "ekf_mixture": "#D55E00",
    "random_guess": "#999999",
    "measured": "#999999",
    "truth": "#000000",
}
LABELS = {
    "bingham": "Bingham filter",
    "bingham_second_order": "Bingham, 2nd order",
    "bingham_first_order": "Bingham, 1st order",
    "bingham_bank": "filter bank",
    "bingham_mixture": "mixture, adapted noises",
    "bingham_mixture_published": "mixture, published noises",
    "bingham_oracle": "oracle prior",
    "scalar_kalman": "scalar Kalman filter",
    "axial_kalman": "axial Kalman filter",
    "wrapped_normal": "wrapped normal filter",
    "ekf_fixed": "EKF, fixed noise",
    "ekf_fair": "EKF, rotated noise",
    "ekf_padded": "EKF, fixed and padded noise",
    "bingham_first_order_fair": "Bingham, 1st order, rotated noise",
    "ekf_first_order": "EKF, 1st order",
    "ekf_first_order_fair": "EKF, 1st order, rotated noise",
    "ekf_second_order": "EKF, 2nd order",
    "ekf_second_order_fair": "EKF, 2nd order, rotated noise",
    "ekf_mixture": "mixture of EKFs, joint covariance",
    "random_guess": "random guess",
    "measured": "measurements",
    "truth": "truth",
}


def new_figure(width: float, height: float, rows: int = 1, columns: int = 1, **options: Any) -> tuple[Figure, Any]:
    """Return a figure of the given size in inches and its axes (an array for more than one)."""
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(rows, columns, **options)
    for ax in axes_of(axes):
        ax.spines[["top", "right"]].set_visible(False)
        ax.grid(alpha=0.25, linewidth=0.5)
    return figure, axes


def axes_of(axes: Any) -> list[Any]:
    """Return axes as a flat list."""
    return list(axes.flat) if hasattr(axes, "flat") else [axes]
