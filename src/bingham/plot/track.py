"""A track of rotations over time: angles with their band, errors against what the filter claims, the sphere."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from bingham.decimate import envelope_indices, gaps
from bingham.distributions.bingham import Bingham
from bingham.distributions.uncertainty import heading_and_inclination
from bingham.errors import InvalidArgumentError
from bingham.plot.sphere import draw_axes_cloud, draw_axes_density, draw_axes_path, draw_sphere
from bingham.plot.style import (
    AXIS_COLOURS,
    COLUMNS,
    GAP_COLOUR,
    INK,
    MEASURED,
    OVERLAY,
    draw_between,
    draw_line,
    fit_angles,
    legend_above,
    new_figure,
    shade_gaps,
    shade_unscored,
    since_start,
    unbroken,
)
from bingham.rotations import compose, conjugate, from_rotation_vector, rotate, to_rotation_vector, yaw_pitch_roll
from bingham.validation import as_numbers

__all__ = ["plot_track"]

FloatArray = NDArray[np.float64]

LEVEL = 0.95
PER_AXIS = float(ndtri((1 + LEVEL) / 2))  # half-width of a normal variable's interval, standard deviations
CLOUDS, CLOUD_SIZE = 12, 80
DENSITY = 50_000  # samples that a density of directions needs
LONG_PATH = 40.0  # rad an axis travels, beyond which its path would be a tangle and its density is drawn
# An interval of this half-width, degrees, holds 95 % of the circle: nothing is known, and no band is drawn.
UNKNOWN = 0.95 * 180.0


def plot_track(
    time: FloatArray,
    orientations: Bingham | FloatArray,
    covariance: FloatArray | None = None,
    *,
    truth: FloatArray | None = None,
    scored: NDArray[np.bool_] | None = None,
    measured: FloatArray | None = None,
    rejected: NDArray[np.bool_] | None = None,
    world: tuple[str, str, str] = ("x", "y", "z"),
    title: str = "",
    note: str = "",
    axes: Any = None,
) -> Any:
    """Draw a track of rotations, of any length: what is drawn of each curve has the extremes of every column of pixels.

    Triangles at the edge of a panel of errors stand for values beyond it; the legend tells the farthest one. Grey is
    what does not count in an error, pink is a gap.

    Parameters
    ----------
    time : (T,) ndarray
        Seconds; drawn since the first one.
    orientations : Bingham or (T, 4) ndarray
        Distributions, d = 4, a batch (T,), or quaternions (w, x, y, z), NaN where unknown.
    covariance : (T, 3, 3) ndarray, optional
        Of a small rotation in world axes, rad², NaN where undefined; that of the distributions unless given.
    truth : (T, 4) ndarray, optional
        True orientations, NaN where unknown.
    scored : (T,) ndarray of bool, optional
        Evaluation mask: samples whose errors count; the others are shaded.
    measured : (T, 4) ndarray, optional
        What the filter was given, for comparison; NaN where nothing was.
    rejected : (T,) ndarray of bool, optional
        Which of the measurements were rejected.
    world : tuple of str
        Names of the world's axes, the third one vertical.
    title : str
        Heading.
    note : str
        What to say in the panel of the heading.
    axes : sequence of three matplotlib axes, optional
        Where to draw angles, heading and inclination, without the sphere; a new figure unless given.

    Returns
    -------
    matplotlib.figure.Figure
        Save it with ``savefig``.
    """
    seconds, label = since_start(time)
    if isinstance(orientations, Bingham):
        q = orientations.mode
        c = orientations.covariance(frame="world", undefined="nan") if covariance is None else covariance
    else:
        q = as_numbers(orientations, "orientations")
        c = np.full((len(q), 3, 3), np.nan) if covariance is None else covariance
    if q.shape != (len(seconds), 4):
        raise InvalidArgumentError("orientations", f"shape ({len(seconds)}, 4), one for each time", q.shape)
    # A row without values after each gap breaks every line there.
    breaks = gaps(seconds)
    spans = np.stack([seconds[breaks], seconds[breaks + 1]], axis=1)
    if len(breaks):
        after = breaks + 1
        seconds, q, c = np.insert(seconds, after, seconds[breaks]), _broken(q, after), _broken(c, after)
        truth = None if truth is None else _broken(truth, after)
        measured = None if measured is None else _broken(measured, after)
        scored = None if scored is None else np.insert(scored, after, scored[breaks])
        rejected = None if rejected is None else np.insert(rejected, after, False)
    cloud = None
    if axes is None:
        figure = new_figure(11.0, 6.5)
        grid = figure.add_gridspec(3, 2, width_ratios=[2.2, 1.0])
        angles = figure.add_subplot(grid[0, 0])
        heading, inclination = (figure.add_subplot(grid[row, 0], sharex=angles) for row in (1, 2))
        cloud = figure.add_subplot(grid[:, 1])
    else:
        angles, heading, inclination = axes
        figure = angles.figure
    _draw_angles(angles, seconds, q, c, truth)
    if truth is None:
        _draw_widths(heading, inclination, seconds, q, c)
    else:
        raw = None if measured is None else _error_deg(measured, truth)
        _draw_errors(heading, inclination, seconds, _error_deg(q, truth), c, raw, rejected)
    for panel in (angles, heading, inclination):
        shade_gaps(panel, spans)
    for panel in (heading, inclination):
        if truth is not None and scored is not None:
            shade_unscored(panel, seconds, scored)
        legend_above(panel)
    if note:
        _say(heading, note, 0.05, "bottom")
    inclination.set(xlabel=label, xlim=(seconds[0], seconds[-1]))
    if cloud is not None:
        _draw_cloud(cloud, q, c, world)
        figure.suptitle(title)
    return figure


def _broken(rows: FloatArray, at: NDArray[np.intp]) -> FloatArray:
    return np.insert(rows, at, np.nan, axis=0)


def _draw_angles(axes: Any, t: FloatArray, q: FloatArray, covariance: FloatArray, truth: FloatArray | None) -> None:
    """Yaw, pitch and roll (intrinsic z, y', x'') with bands, true ones dotted."""
    angle = yaw_pitch_roll(q)
    band = _known(PER_AXIS * np.degrees(_spread_of_angles(angle, covariance)))
    lines = [unbroken(np.degrees(column)) for column in angle.T]
    true = () if truth is None else np.degrees(yaw_pitch_roll(truth)).T
    for k, (name, colour) in enumerate(zip(("yaw", "pitch", "roll"), AXIS_COLOURS[::-1], strict=True)):
        draw_line(axes, t, lines[k], color=colour, lw=0.9, label=name)
        draw_between(axes, t, lines[k] - band[:, k], lines[k] + band[:, k], color=colour, alpha=0.2)
        if len(true):
            draw_line(axes, t, unbroken(true[k]), color=INK, lw=0.6, ls=":")
    if truth is not None:
        axes.plot([], [], color=INK, lw=0.6, ls=":", label="truth")
    if np.isfinite(band).any():
        axes.fill_between([], [], [], color=INK, alpha=0.2, lw=0, label="95 % band")
    axes.set_ylabel("orientation [°]")
    ends = np.degrees(angle)[:, :, None] + band[:, :, None] * [-1.0, 1.0]
    fit_angles(axes, 360.0, *lines, band=ends.reshape(len(t), -1))
    legend_above(axes, 5)


def _spread_of_angles(angle: FloatArray, covariance: FloatArray) -> FloatArray:
    """Standard deviations (T, 3) of yaw, pitch, roll (T, 3) for the covariance (T, 3, 3) of a small world rotation.

    The angles' change is J r, J = [[c tan p, s tan p, 1], [−s, c, 0], [c / cos p, s / cos p, 0]], c, s of the yaw.
    """
    c, s = np.cos(angle[:, 0]), np.sin(angle[:, 0])
    # Upright the three angles are not defined; the band is then as wide as the circle.
    cosine = np.maximum(np.cos(angle[:, 1]), 1e-6)
    sine = np.sin(angle[:, 1])
    xx, xy, yy = covariance[:, 0, 0], covariance[:, 0, 1], covariance[:, 1, 1]
    along = c * c * xx + 2.0 * c * s * xy + s * s * yy
    mixed = c * covariance[:, 0, 2] + s * covariance[:, 1, 2]
    tangent = sine / cosine
    variances = (
        tangent * tangent * along + 2.0 * tangent * mixed + covariance[:, 2, 2],
        s * s * xx - 2.0 * c * s * xy + c * c * yy,
        along / (cosine * cosine),
    )
    return np.sqrt(np.stack(variances, axis=1))


def _known(half_deg: FloatArray) -> FloatArray:
    return np.where(half_deg < UNKNOWN, half_deg, np.nan)


def _error_deg(q: FloatArray, truth: FloatArray) -> FloatArray:
    """Rotation vector of q ⊗ truth* (T, 3), world axes, degrees."""
    return np.degrees(to_rotation_vector(compose(q, conjugate(truth))))


def _half_widths(covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Heading's 95 % half-width and a radius about the vertical that holds at least 95 %, degrees (T,)."""
    across, around = heading_and_inclination(covariance, LEVEL)
    return _known(np.degrees(across)), _known(np.degrees(around))


def _draw_widths(heading: Any, inclination: Any, t: FloatArray, q: FloatArray, covariance: FloatArray) -> None:
    """Half-widths of the 95 % sets; for a heading of which nothing is known, how far it has come since the start."""
    across, around = _half_widths(covariance)
    for axes, name, width in ((heading, "heading", across), (inclination, "inclination", around)):
        if not np.isfinite(width).any() and name == "heading" and np.isfinite(q).all(axis=1).any():
            yaw = np.full(len(q), np.nan)
            known = np.isfinite(q).all(axis=1)
            yaw[known] = np.degrees(np.unwrap(yaw_pitch_roll(q[known])[:, 0]))
            draw_line(axes, t, yaw - yaw[known][0], color=AXIS_COLOURS[2], lw=0.9)
            axes.set_ylabel("heading since\nthe start [°]")
            continue
        draw_between(axes, t, np.zeros_like(width), width, color=OVERLAY, alpha=0.4)
        axes.set_ylabel(f"{name}:\n95 % within ± [°]")
        axes.set_ylim(0, _limit(t, width))
        _say_unknown(axes, width)


def _draw_errors(
    heading: Any,
    inclination: Any,
    t: FloatArray,
    error: FloatArray,
    covariance: FloatArray,
    raw: FloatArray | None,
    rejected: NDArray[np.bool_] | None,
) -> None:
    """Signed heading error in its band, size of the inclination error under its bound, measurements behind."""
    across, around = _half_widths(covariance)
    tilt = np.hypot(error[:, 0], error[:, 1])
    widest, steepest = _limit(t, np.abs(error[:, 2]), across), _limit(t, tilt, around)
    if raw is not None:
        _draw_measured(heading, t, raw[:, 2], widest, rejected)
        _draw_measured(inclination, t, np.hypot(raw[:, 0], raw[:, 1]), steepest, rejected)
    # The bands lie above the errors, whose restless lines would hide them.
    shade: dict[str, Any] = {"color": OVERLAY, "alpha": 0.4, "zorder": 3}
    draw_between(heading, t, -across, across, **shade, label=_label(across))
    draw_between(inclination, t, np.zeros_like(around), around, **shade, label=_label(around))
    _draw_clipped(heading, t, error[:, 2], widest, AXIS_COLOURS[2], "error")
    _draw_clipped(inclination, t, tilt, steepest, AXIS_COLOURS[0], "error")
    heading.set(ylabel="heading error [°]", ylim=(-widest, widest))
    inclination.set(ylabel="inclination error [°]", ylim=(0, steepest))
    for axes, width in ((heading, across), (inclination, around)):
        _say_unknown(axes, width)


def _draw_clipped(axes: Any, t: FloatArray, value: FloatArray, limit: float, colour: str, label: str) -> None:
    """Draw a line, triangles at the edge for all beyond ±limit, and tell the farthest one."""
    draw_line(axes, t, value, color=colour, label=label + _beyond(value, limit), lw=0.7)
    _mark_beyond(axes, t, value, limit, colour)


def _draw_measured(
    axes: Any, t: FloatArray, value: FloatArray, limit: float, rejected: NDArray[np.bool_] | None
) -> None:
    """Draw measurements as dots, rejected ones as crosses; of many the extremes of every column."""
    out = np.zeros(len(value), dtype=np.bool_) if rejected is None else rejected
    kinds = ((~out, MEASURED, ".", "measured"), (out, GAP_COLOUR, "x", "rejected"))
    for chosen, colour, marker, name in kinds:
        at = np.flatnonzero(chosen & np.isfinite(value))
        if len(at):
            kept = at[envelope_indices(value[at], COLUMNS)]
            label = name + _beyond(value[at], limit)
            axes.plot(t[kept], value[kept], marker, color=colour, ms=2.5, mew=0.6, label=label)
            _mark_beyond(axes, t[kept], value[kept], limit, colour)


def _beyond(value: FloatArray, limit: float) -> str:
    above, below = bool(np.any(value > limit)), bool(np.any(value < -limit))
    marks = "▴" * above + "▾" * below
    return f", up to {np.nanmax(np.abs(value)):.3g}° {marks}" if marks else ""


def _mark_beyond(axes: Any, t: FloatArray, value: FloatArray, limit: float, colour: str) -> None:
    for side, edge, marker in ((value > limit, limit, "^"), (value < -limit, -limit, "v")):
        at = np.flatnonzero(side)
        at = at[:: len(at) // COLUMNS + 1]
        axes.plot(t[at], np.full(len(at), 0.96 * edge), marker, color=colour, ms=3, mew=0, zorder=4)


def _label(half_deg: FloatArray) -> str:
    return "95 % band" if np.isfinite(half_deg).any() else "_"  # matplotlib leaves such out of the legend


def _say_unknown(axes: Any, half_deg: FloatArray) -> None:
    """Write into a panel without a band why it has none."""
    if not np.isfinite(half_deg).any():
        _say(axes, "nothing is known: the 95 % band is the whole circle", 0.95, "top")


def _say(axes: Any, words: str, height: float, side: str) -> None:
    at = {"transform": axes.transAxes, "ha": "left", "va": side, "fontsize": "small", "color": INK, "zorder": 5}
    axes.text(0.01, height, words, bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}, **at)


def _limit(t: FloatArray, *values: FloatArray) -> float:
    """Upper end of an axis that shows nearly all values after the start, which may know nothing."""
    settled = t >= min(30.0, 0.25 * (t[-1] - t[0]))
    shown = [np.nanquantile(v[settled], 0.995) for v in values if np.isfinite(v[settled]).any()]
    shown = shown or [np.nanquantile(v, 0.99) for v in values if np.isfinite(v).any()]
    return float(1.4 * max(*shown, 0.1)) if shown else 180.0


def _draw_cloud(axes: Any, q: FloatArray, covariance: FloatArray, world: tuple[str, str, str]) -> None:
    """Draw where the body's axes point: their path, or its density where a path would be a tangle, and samples."""
    draw_sphere(axes, world)
    known = np.flatnonzero(np.isfinite(q).all(axis=1))
    path = q[known[:: len(known) // DENSITY + 1]]
    travelled = np.linalg.norm(np.diff(rotate(path, np.eye(3)[0]), axis=0), axis=1).sum() if len(path) > 1 else 0.0
    what = "density" if travelled > LONG_PATH else "path"
    (draw_axes_density if travelled > LONG_PATH else draw_axes_path)(axes, path)
    # Where no mode is clear, at a start that knows no heading, samples would cover the sphere and say nothing.
    clear = known[np.trace(covariance[known], axis1=1, axis2=2) < 1.0]
    samples: list[FloatArray] = []
    if what == "path" and len(clear):
        rng = np.random.default_rng(0)
        for k in clear[np.unique(np.linspace(0, len(clear) - 1, CLOUDS).astype(int))]:
            off = rng.multivariate_normal(np.zeros(3), covariance[k], size=CLOUD_SIZE, method="eigh")
            samples.append(compose(from_rotation_vector(off), q[k]))
        draw_axes_cloud(axes, np.concatenate(samples), size=3.0, alpha=0.6)
    more = f", and {len(samples)} distributions by samples" if samples else ""
    axes.set_title(f"where the body's x, y and z axes point:\n{what}{more}", fontsize="medium")
    for name, colour in zip("xyz", AXIS_COLOURS, strict=True):
        axes.plot([], [], "o", color=colour, ms=4, label=f"body {name}")
    axes.legend(loc="lower center", ncols=3, fontsize="small", frameon=False)
