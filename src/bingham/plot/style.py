"""What the figures share: colours, sizes, and figures that need no display."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.decimate import envelope_indices
from bingham.errors import MissingExtraError
from bingham.notebook import AXIS_COLOURS

__all__ = [
    "AXIS_COLOURS",
    "COLUMNS",
    "GAP_COLOUR",
    "INK",
    "MEASURED",
    "OVERLAY",
    "PALE",
    "draw_band",
    "draw_between",
    "draw_line",
    "fit_angles",
    "legend_above",
    "new_figure",
    "shade_gaps",
    "shade_unscored",
    "since_start",
    "stride",
    "unbroken",
]

INK, PALE, OVERLAY = "#333333", "#BBBBBB", "#56B4E9"
MEASURED, GAP_COLOUR = "#E69F00", "#CC79A7"
COLUMNS = 2000  # no panel is wider, in pixels


def new_figure(width: float, height: float) -> Any:
    """Return a matplotlib figure of the given size, inches, that belongs to no window and no global state."""
    try:
        from bingham.plot._figure import FreeFigure
    except ImportError:
        raise MissingExtraError("matplotlib", "plot", "drawing figures") from None
    return FreeFigure(figsize=(width, height), layout="constrained")


def stride(size: int, maximum: int = 3000) -> slice:
    """Return a slice that keeps at most `maximum` of `size` samples, evenly."""
    return slice(None, None, max(1, -(-size // maximum)))


def since_start(time: NDArray[np.float64]) -> tuple[NDArray[np.float64], str]:
    """Return seconds (T,) since the first time, and the axis label, which names that time unless it is 0.

    Examples
    --------
    >>> since_start(np.array([1305031098.6659, 1305031099.1659]))
    (array([0. , 0.5]), 'seconds since t = 1305031098.666 s')
    """
    start = float(time[0])
    return time - start, f"seconds since t = {f'{start:.3f}'.rstrip('0').rstrip('.')} s" if start else "time [s]"


def draw_line(axes: Any, t: NDArray[np.float64], y: NDArray[np.float64], **style: Any) -> None:
    """Draw a curve (T,) through the extremes of every column of pixels; NaN breaks it."""
    kept = envelope_indices(y, COLUMNS)
    axes.plot(t[kept], y[kept], **style)


def draw_between(
    axes: Any, t: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64], **style: Any
) -> None:
    """Fill between two curves (T,), in every column of pixels from the lowest of `low` to the highest of `high`."""
    if len(t) > 2 * COLUMNS:
        starts = np.linspace(0, len(t), COLUMNS + 1).astype(np.intp)[:-1]
        t, low, high = t[starts], np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)
    axes.fill_between(t, low, high, lw=0, **style)


def unbroken(angle_deg: NDArray[np.float64], jump_deg: float = 180.0) -> NDArray[np.float64]:
    """Return angles (T,) with NaN where they jump, so that no line is drawn across."""
    drawn = np.array(angle_deg)
    drawn[1:][np.abs(np.diff(drawn)) > jump_deg] = np.nan
    return drawn


def draw_band(
    axes: Any, t: NDArray[np.float64], middle: NDArray[np.float64], half: NDArray[np.float64], colour: str
) -> None:
    """Fill the band about a line; where the half-width is NaN, nothing is known and nothing drawn."""
    axes.fill_between(t, middle - half, middle + half, color=colour, alpha=0.2, lw=0)


def fit_angles(axes: Any, circle_deg: float, *lines: NDArray[np.float64], band: NDArray[np.float64]) -> None:
    """Let the axis show the angles (T,), degrees, and nearly all of their band; all of the circle if one goes round it.

    `lines` are as `unbroken` leaves them, `band` (T, n) holds ends of bands.
    """
    half = circle_deg / 2.0
    if any(np.isnan(line[1:]).any() for line in lines):
        axes.set(ylim=(-1.03 * half, 1.03 * half), yticks=np.linspace(-half, half, 5))
        return
    # The first samples may know nothing: their bands would be all that is seen.
    wide = band[np.isfinite(band)]
    ends = [np.nanmin(lines), np.nanmax(lines), *(np.quantile(wide, [0.01, 0.99]) if wide.size else [])]
    low, high = min(ends), max(ends)
    margin = max(0.08 * (high - low), 0.5)
    axes.set(ylim=(max(low - margin, -1.03 * half), min(high + margin, 1.03 * half)))


def legend_above(axes: Any, columns: int = 4) -> None:
    """Put the legend above the panel, where it hides no data."""
    place = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.1}
    if axes.get_legend_handles_labels()[1]:
        axes.legend(ncols=columns, fontsize="small", frameon=False, **place)


def shade_unscored(axes: Any, t: NDArray[np.float64], scored: NDArray[np.bool_]) -> None:
    """Shade the times whose samples do not count, and say so in the legend."""
    if not scored.all():
        edge = axes.get_xaxis_transform()
        about = {"color": PALE, "alpha": 0.3, "lw": 0, "zorder": 0, "label": "not scored"}
        axes.fill_between(t, 0, 1, where=~scored, step="mid", transform=edge, **about)


def shade_gaps(axes: Any, spans: NDArray[np.float64]) -> None:
    """Shade the times (n, 2) without samples."""
    for count, (start, end) in enumerate(spans):
        axes.axvspan(start, end, color=GAP_COLOUR, alpha=0.25, lw=0, zorder=0, label="_" if count else "gap")
