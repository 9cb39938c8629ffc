"""A track of rotations over time: angles with their band, errors against what the filter claims, the sphere."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, ndtri

from bingham.distributions.bingham import Bingham
from bingham.plot.sphere import draw_axes_cloud, draw_axes_path, draw_sphere
from bingham.plot.style import (
    AXIS_COLOURS,
    INK,
    OVERLAY,
    PALE,
    draw_band,
    fit_angles,
    legend_above,
    new_figure,
    shade_unscored,
    since_start,
    stride,
    unbroken,
)
from bingham.rotations import compose, conjugate, to_rotation_vector

__all__ = ["plot_track"]

FloatArray = NDArray[np.float64]

LEVEL = 0.95
PER_AXIS = float(ndtri((1 + LEVEL) / 2))  # half-width of a normal variable's interval, standard deviations
IN_PLANE = float(np.sqrt(chdtri(2, 1 - LEVEL)))  # radius of a plane normal variable's disc, the same
CLOUDS, CLOUD_SIZE = 12, 80
# An interval of this half-width, degrees, holds 95 % of the circle: nothing is known, and no band is drawn.
UNKNOWN = 0.95 * 180.0


def plot_track(
    time: FloatArray,
    distributions: Bingham,
    *,
    covariance: FloatArray | None = None,
    truth: FloatArray | None = None,
    scored: NDArray[np.bool_] | None = None,
    measured: FloatArray | None = None,
    world: tuple[str, str, str] = ("x", "y", "z"),
    title: str = "",
    note: str = "",
) -> Any:
    """Draw a track of rotations.

    Triangles at the edge of a panel of errors stand for values beyond it; the legend tells the farthest one.

    Parameters
    ----------
    time : (T,) ndarray
        Seconds; drawn since the first one.
    distributions : Bingham
        Of the rotations, d = 4, a batch (T,).
    covariance : (T, 3, 3) ndarray, optional
        Of a small rotation in world axes, rad², NaN where undefined; that of the distributions unless given.
    truth : (T, 4) ndarray, optional
        True orientations, NaN where unknown.
    scored : (T,) ndarray of bool, optional
        Samples whose errors count; the others are shaded.
    measured : (T, 4) ndarray, optional
        What the filter was given, for comparison.
    world : tuple of str
        Names of the world's axes, the third one vertical.
    title : str
        Heading.
    note : str
        What to say in the panel of the heading.

    Returns
    -------
    matplotlib.figure.Figure
        Save it with ``savefig``.
    """
    # Thinned before what is costly is computed: no screen has more columns. Errors are not: no peak may be lost.
    kept = stride(len(time))
    seconds, label = since_start(time)
    modes = distributions.mode
    t, distributions = seconds[kept], distributions[kept]
    if covariance is None:
        covariance = distributions.covariance(frame="world", undefined="nan")
    else:
        covariance = covariance[kept]
    figure = new_figure(11.0, 6.5)
    grid = figure.add_gridspec(3, 2, width_ratios=[2.2, 1.0])
    angles = figure.add_subplot(grid[0, 0])
    heading, inclination = (figure.add_subplot(grid[row, 0], sharex=angles) for row in (1, 2))
    _draw_angles(angles, t, distributions.mode, covariance, None if truth is None else truth[kept])
    if truth is None:
        _draw_widths(heading, inclination, t, covariance)
    else:
        raw = None if measured is None else _error_deg(measured, truth)
        _draw_errors(heading, inclination, seconds, kept, _error_deg(modes, truth), covariance, raw)
        for axes in (heading, inclination):
            if scored is not None:
                shade_unscored(axes, t, scored[kept])
            legend_above(axes)
    if note:
        _say(heading, note, 0.05, "bottom")
    inclination.set(xlabel=label, xlim=(t[0], t[-1]))
    _draw_cloud(figure.add_subplot(grid[:, 1]), distributions, world)
    figure.suptitle(title, fontsize=11)
    return figure


def _draw_angles(axes: Any, t: FloatArray, q: FloatArray, covariance: FloatArray, truth: FloatArray | None) -> None:
    """Yaw, pitch and roll (intrinsic z, y', x'') with bands, true ones dashed."""
    angle, jacobian = _yaw_pitch_roll(q)
    deviation = np.sqrt(np.einsum("tai,tij,taj->ta", jacobian, covariance, jacobian))
    band = _known(PER_AXIS * np.degrees(deviation))
    lines = [unbroken(np.degrees(column)) for column in angle.T]
    for k, (name, colour) in enumerate(zip(("yaw", "pitch", "roll"), AXIS_COLOURS[::-1], strict=True)):
        axes.plot(t, lines[k], color=colour, lw=0.9, label=name)
        draw_band(axes, t, lines[k], band[:, k], colour)
        if truth is not None:
            true = unbroken(np.degrees(_yaw_pitch_roll(truth)[0][:, k]))
            axes.plot(t, true, color=INK, lw=0.6, ls=":")
    if truth is not None:
        axes.plot([], [], color=INK, lw=0.6, ls=":", label="truth")
    axes.fill_between([], [], [], color=INK, alpha=0.2, lw=0, label="95 % band")
    axes.set_ylabel("orientation [°]")
    ends = np.degrees(angle)[:, :, None] + band[:, :, None] * [-1.0, 1.0]
    fit_angles(axes, 360.0, *lines, band=ends.reshape(len(t), -1))
    legend_above(axes, 5)


def _yaw_pitch_roll(q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return R = R_z(yaw) R_y(pitch) R_x(roll), (T, 3), and their change with a small world rotation, (T, 3, 3)."""
    w, x, y, z = q.T
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    c, s = np.cos(yaw), np.sin(yaw)
    # Upright the three angles are not defined; the band is then as wide as the circle.
    cosine = np.maximum(np.cos(pitch), 1e-6)
    zero, one = np.zeros_like(c), np.ones_like(c)
    rows = [
        [c * np.sin(pitch) / cosine, s * np.sin(pitch) / cosine, one],
        [-s, c, zero],
        [c / cosine, s / cosine, zero],
    ]
    return np.stack([yaw, pitch, roll], axis=1), np.moveaxis(np.array(rows), 2, 0)


def _known(half_deg: FloatArray) -> FloatArray:
    return np.where(half_deg < UNKNOWN, half_deg, np.nan)


def _error_deg(q: FloatArray, truth: FloatArray) -> FloatArray:
    """Rotation vector of q ⊗ truth* (T, 3), world axes, degrees."""
    return np.degrees(to_rotation_vector(compose(q, conjugate(truth))))


def _half_widths(covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Heading's 95 % half-width and a radius about the vertical that holds at least 95 %, degrees (T,)."""
    (a, b), (_, c) = covariance[:, 0, :2].T, covariance[:, 1, :2].T
    widest = (a + c) / 2 + np.hypot((a - c) / 2, b)
    return _known(PER_AXIS * np.degrees(np.sqrt(covariance[:, 2, 2]))), _known(IN_PLANE * np.degrees(np.sqrt(widest)))


def _draw_widths(heading: Any, inclination: Any, t: FloatArray, covariance: FloatArray) -> None:
    panels = ((heading, "heading"), (inclination, "inclination"))
    for (axes, name), width in zip(panels, _half_widths(covariance), strict=True):
        axes.fill_between(t, 0, width, color=PALE, alpha=0.5, lw=0)
        axes.set_ylabel(f"{name}:\n95 % within ± [°]")
        axes.set_ylim(0, _limit(width))
        _say_unknown(axes, width)


def _draw_errors(
    heading: Any,
    inclination: Any,
    t: FloatArray,
    kept: slice,
    error: FloatArray,
    covariance: FloatArray,
    raw: FloatArray | None,
) -> None:
    """Signed heading error in its band, size of the inclination error under its bound, measurements behind."""
    across, around = _half_widths(covariance)
    tilt = np.hypot(error[:, 0], error[:, 1])
    most, steepest = _limit(np.abs(error[:, 2]), across), _limit(tilt, around)
    if raw is not None:
        _draw_clipped(heading, t, kept, raw[:, 2], most, PALE, "measured", marker=".", ms=2, ls="")
        _draw_clipped(
            inclination, t, kept, np.hypot(raw[:, 0], raw[:, 1]), steepest, PALE, "measured", marker=".", ms=2, ls=""
        )
    # The bands lie above the errors, whose restless lines would hide them.
    shade: dict[str, Any] = {"color": OVERLAY, "alpha": 0.4, "lw": 0, "zorder": 3}
    heading.fill_between(t[kept], -across, across, **shade, label=_label(across))
    inclination.fill_between(t[kept], 0, around, **shade, label=_label(around))
    _draw_clipped(heading, t, kept, error[:, 2], most, AXIS_COLOURS[2], "error", lw=0.7)
    _draw_clipped(inclination, t, kept, tilt, steepest, AXIS_COLOURS[0], "error", lw=0.7)
    heading.set(ylabel="heading error [°]", ylim=(-most, most))
    inclination.set(ylabel="inclination error [°]", ylim=(0, steepest))
    for axes, width in ((heading, across), (inclination, around)):
        _say_unknown(axes, width)


def _draw_clipped(
    axes: Any, t: FloatArray, kept: slice, value: FloatArray, limit: float, colour: str, label: str, **style: Any
) -> None:
    """Draw the values kept, triangles at the edge for all beyond ±limit, and tell the farthest one."""
    above, below = value > limit, value < -limit
    if above.any() or below.any():
        marks = "▴" * bool(above.any()) + "▾" * bool(below.any())
        label += f", up to {np.nanmax(np.abs(value)):.3g}° {marks}"
    axes.plot(t[kept], value[kept], color=colour, label=label, **style)
    for side, edge, marker in ((above, limit, "^"), (below, -limit, "v")):
        axes.plot(t[side], np.full(int(side.sum()), 0.96 * edge), marker, color=colour, ms=3, mew=0, zorder=4)


def _label(half_deg: FloatArray) -> str:
    return "95 % band" if np.isfinite(half_deg).any() else "_"  # matplotlib leaves such out of the legend


def _say_unknown(axes: Any, half_deg: FloatArray) -> None:
    """Write into a panel without a band why it has none."""
    if not np.isfinite(half_deg).any():
        _say(axes, "nothing is known: the 95 % band is the whole circle", 0.95, "top")


def _say(axes: Any, words: str, height: float, side: str) -> None:
    at = {"transform": axes.transAxes, "ha": "left", "va": side, "fontsize": 8, "color": INK, "zorder": 5}
    axes.text(0.01, height, words, bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}, **at)


def _limit(*values: FloatArray) -> float:
    """Upper end of an axis that shows nearly all values, whatever the wide bands and errors of the first samples."""
    shown = [np.nanquantile(v, 0.99) for v in values if np.isfinite(v).any()]
    return float(1.4 * max(*shown, 0.1)) if shown else 180.0


def _draw_cloud(axes: Any, distributions: Bingham, world: tuple[str, str, str]) -> None:
    draw_sphere(axes, world)
    draw_axes_path(axes, distributions.mode)
    chosen = np.unique(np.linspace(0, len(distributions.z) - 1, CLOUDS).astype(int))[1:]
    # Distributions without a clear mode, of a start that knows no heading, would cover the sphere and say nothing.
    clear = distributions.axis_moments[chosen, 3] > 2 * distributions.axis_moments[chosen, 2]
    rng = np.random.default_rng(0)
    samples = [distributions[int(k)].rvs(CLOUD_SIZE, rng=rng) for k in (chosen[clear] if clear.any() else chosen)]
    if samples:
        draw_axes_cloud(axes, np.concatenate(samples), size=3.0, alpha=0.6)
    axes.set_title(
        f"where the body's x, y and z axes point:\npath, and {len(samples)} distributions by samples", fontsize=9
    )
    for name, colour in zip("xyz", AXIS_COLOURS, strict=True):
        axes.plot([], [], "o", color=colour, ms=4, label=f"body {name}")
    axes.legend(loc="lower center", ncols=3, fontsize=8, frameon=False)
