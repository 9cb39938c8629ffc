"""Figures of the 2019 study: method (Fig. 1), samples (2, 3), corrections (5), a run (6), errors (7) and time (8)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bingham.distributions.bingham import Bingham
from bingham.plot.sampling import draw_circle_samples, draw_sphere_samples, draw_tangent_samples
from bingham.plot.studies.style import new_figure
from bingham.sampling.gaussian_lcd import standard_normal_points
from bingham.sampling.riemannian import gnomonic, transported
from bingham.studies.study import StudyResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw"]

LEVELS = ("1e-1", "1e-2", "1e-4")
# Half width of the tangent plane that is drawn.
REACH = 1.4
LABELS = {
    "unscented_7": "UT-7",
    "unscented_progressive_7": "UT-7 progressive",
    "random_100": "random 100",
    "rss_20": "RSS-20",
    "rss_50": "RSS-50",
    "rss_100": "RSS-100",
    "rss_gnomonic_100": "RSS-100 gnomonic",
    "rss_progressive_100": "RSS-100 progressive",
    "particle_2000": "particles 2000",
    "particle_20000": "particles 20 000",
    "conjugate": "conjugate, isotropic",
    "quadrature": "quadrature",
}
# Okabe & Ito: one colour a family.
COLOURS = {"unscented": "#D55E00", "random": "#999999", "rss": "#0072B2", "particle": "#999999", "conjugate": "#009E73",
           "quadrature": "#009E73"}  # fmt: skip

# Filters whose run is drawn.
SHOWN = ("unscented_7", "rss_100", "rss_progressive_100")


def draw(result: StudyResult) -> dict[str, Figure]:
    """Return the figures ``method``, ``samples``, ``corrections``, ``track``, ``errors`` and ``time``."""
    return {
        "method": _method(),
        "samples": _samples(result),
        "corrections": _corrections(result),
        "track": _track(result),
        "errors": _errors(result),
        "time": _time(result),
    }


def _distribution(*diagonal: float) -> Bingham:
    return Bingham(-np.array(diagonal), np.eye(len(diagonal)))


def _plain(axes: Any) -> None:
    for ax in np.asarray(axes).flat:
        ax.grid(visible=False)


def _method() -> Figure:
    """Points of the normal distribution in the tangent plane at the mode, and what becomes of them on the sphere."""
    from matplotlib import colormaps

    distribution = _distribution(3.0, 12.0, 0.0)
    normal = standard_normal_points(2, 30)
    z = np.array(distribution.z)
    maps = {
        "gnomonic, as published": gnomonic(normal, z),
        "transport, the default": transported(normal, z, symmetric=True),
    }
    figure, axes = new_figure(8.4, 3.9, 1, 2, subplot_kw={"projection": "3d", "computed_zorder": False})
    polar, turn = np.meshgrid(np.linspace(0.0, 0.5 * np.pi, 40), np.linspace(0.0, 2.0 * np.pi, 80))
    dome = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], axis=-1)
    height = np.exp((dome * dome) @ z)
    for ax, (label, points) in zip(axes, maps.items(), strict=True):
        shades = colormaps["Blues"](0.1 + 0.6 * height)
        ax.plot_surface(
            *np.moveaxis(dome, -1, 0), facecolors=shades, rstride=1, cstride=1, lw=0, shade=False, alpha=0.9
        )
        x = np.where(points[:, 2:] < 0.0, -points, points)
        # Along the ray from the centre: where the plane at the mode meets it.
        plane = x / x[:, 2:]
        shown = np.linalg.norm(plane[:, :2], axis=1) < REACH
        side = np.array([-REACH, REACH])
        flat = np.meshgrid(side, side)
        ax.plot_surface(*flat, np.ones((2, 2)), color="0.5", alpha=0.15, lw=0)
        for a, b in zip(x[shown], plane[shown], strict=True):
            ax.plot(*np.stack([a, b], axis=1), color="0.5", lw=0.6)
        ax.plot(*plane[shown].T, "o", ms=3, color="#009E73")
        ax.plot(*(1.01 * x).T, "o", ms=4, color="#D55E00")
        ax.set(xlim=(-REACH, REACH), ylim=(-REACH, REACH), zlim=(0.0, 1.2))
        ax.set_box_aspect((1.0, 1.0, 0.6 / REACH), zoom=1.5)
        ax.set_title(label, fontsize=9)
        ax.view_init(elev=28.0, azim=-60.0)
        ax.set_axis_off()
    return figure


def _samples(result: StudyResult) -> Figure:
    figure, axes = new_figure(9.0, 8.6, 3, 3)
    _plain(axes)
    for column, (a, m) in enumerate(((5, 10), (10, 30), (30, 50))):
        points = result.curves[f"points/S1 C=(1,{a}) m={m}/rss"]
        draw_circle_samples(axes[0, column], _distribution(1.0, a), points)
        axes[0, column].set_title(f"S¹, −diag(1, {a}), m = {m}", fontsize=9)
    for column, (a, m) in enumerate(((5, 50), (10, 200), (40, 500))):
        points = result.curves[f"points/S2 C=(1,5,{a}) m={m}/rss"]
        draw_sphere_samples(axes[1, column], _distribution(1.0, 5.0, a), points)
        axes[1, column].set_title(f"S², −diag(1, 5, {a}), m = {m}", fontsize=9)
    for column, m in enumerate((50, 200, 500)):
        points = result.curves[f"points/S3 C=(1,5,5,5) m={m}/rss"]
        draw_tangent_samples(axes[2, column], _distribution(1.0, 5.0, 5.0, 5.0), points)
        axes[2, column].set_title(f"S³ (tangent), −diag(1, 5, 5, 5), m = {m}", fontsize=9)
    return figure


def _corrections(result: StudyResult) -> Figure:
    names = {
        "start": "before correction",
        "trust_region": "trust region",
        "trust_region_penalised": "trust region, penalised",
        "steepest_descent": "steepest descent",
        "newton": "Newton",
    }
    figure, axes = new_figure(11.0, 2.7, 1, len(names))
    _plain(axes)
    case = "S2 C=(1,8,70) m=150 correction"
    for ax, (name, label) in zip(axes, names.items(), strict=True):
        draw_sphere_samples(ax, _distribution(1.0, 8.0, 70.0), result.curves[f"correction/{name}"])
        residual = result.value(case, name, "residual")
        moved = result.value(case, name, "displacement_rad")
        ax.set_title(f"{label}\nE = {residual:.0e}, moved {1e3 * moved:.0f} mrad", fontsize=8)
    return figure


def _track(result: StudyResult) -> Figure:
    """Where the rotated vector points in one run, component by component."""
    figure, axes = new_figure(9.5, 5.0, 3, 1, sharex=True)
    truth = result.curves["track/truth"]
    steps = np.arange(1, len(truth) + 1)
    for i, ax in enumerate(axes):
        ax.plot(steps, truth[:, i], color="black", lw=2.2, label="truth")
        for name in SHOWN:
            label, colour = LABELS[name], "#56B4E9" if name == "rss_100" else COLOURS[name.split("_")[0]]
            ax.plot(steps, result.curves[f"track/{name}"][:, i], color=colour, lw=1.1, label=label)
        ax.set(ylabel="xyz"[i], ylim=(-1.05, 1.05), yticks=(-1, 0, 1))
    axes[0].set(title=f"rotated vector, a = {LEVELS[-1]}", xlim=(1, len(truth)))
    axes[-1].set(xlabel="step")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", fontsize=8, frameon=False)
    return figure


def _errors(result: StudyResult) -> Figure:
    figure, axes = new_figure(10.5, 4.2, 1, len(LEVELS), sharey=True)
    for level, ax in enumerate(axes):
        for row, name in enumerate(LABELS):
            values = result.curves[f"rmse/{level}/{name}"]
            box = ax.boxplot(values, positions=[-row], orientation="horizontal", widths=0.6, patch_artist=True,
                             flierprops={"ms": 2}, medianprops={"color": "black"})  # fmt: skip
            box["boxes"][0].set(facecolor=COLOURS[name.split("_")[0]], alpha=0.6)
        ax.set(xlabel="RMSE of the rotated vector [rad]", title=f"a = {LEVELS[level]}", xscale="log")
        _decimal_ticks(ax.xaxis)
    axes[0].set_yticks([-row for row in range(len(LABELS))], list(LABELS.values()))
    return figure


def _decimal_ticks(axis: Any) -> None:
    """Label a logarithmic axis with plain numbers, few enough to read."""
    ticks = np.outer(10.0 ** np.arange(-2, 3), [1.0, 2.0, 3.0, 4.0, 5.0, 7.0]).ravel()
    low, high = axis.get_view_interval()
    kept = ticks[(ticks >= low) & (ticks <= high)]
    if len(kept) > 6:
        kept = np.array([tick for tick in kept if f"{tick:.0e}"[0] in "125"])
    if len(kept) < 2:
        from matplotlib.ticker import MaxNLocator

        kept = np.array([tick for tick in MaxNLocator(4).tick_values(low, high) if low <= tick <= high])
    axis.set_ticks(kept, [f"{tick:g}" for tick in kept])
    axis.set_ticks([], minor=True)


def _time(result: StudyResult) -> Figure:
    figure, axes = new_figure(9.5, 3.8, 1, 2)
    marks = dict(zip(LABELS, "oshPXDv^<>*d", strict=True))
    for ax, level in zip(axes, (1, 2), strict=True):
        for name in LABELS:
            x = float(result.curves[f"ms/{level}/{name}"][0])
            y = result.curves[f"rmse/{level}/{name}"]
            spread = y.std(ddof=1) / np.sqrt(y.size) if y.size > 1 else 0.0
            style = {"fmt": marks[name], "ms": 6, "color": COLOURS[name.split("_")[0]], "capsize": 2, "lw": 0.8}
            ax.errorbar(x, y.mean(), spread, label=LABELS[name], **style)
        ax.set(xscale="log", yscale="log", xlabel="time per step [ms]", title=f"a = {LEVELS[level]}")
        _decimal_ticks(ax.xaxis)
        _decimal_ticks(ax.yaxis)
    axes[0].set(ylabel="mean RMSE of the rotated vector [rad]")
    handles, labels = axes[1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", fontsize=8, frameon=False)
    return figure
