"""Fewer samples for the same picture: the smallest and the largest value of every stretch, so that no peak is lost."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["envelope", "envelope_indices", "extremes", "gaps"]

FloatArray = NDArray[np.float64]

GAP, GAP_SECONDS = 5.0, 0.25  # a step so many times the usual one, and at least so long, is a gap
MAX_GAPS = 2000  # no picture shows more


def envelope(y: FloatArray, stretches: int) -> tuple[NDArray[np.intp], FloatArray]:
    """Return where each stretch of y (T,) begins and has its middle, and its two extremes in the order of their times.

    Both have two entries a stretch; the union of [min, max] over all stretches is that of y. A stretch of NaN gives
    NaN. With T ≤ 2 `stretches`, y comes back as it is.

    Examples
    --------
    >>> import numpy as np
    >>> index, value = envelope(np.array([0.0, 3.0, 1.0, 2.0, -5.0, 4.0]), 2)
    >>> index.tolist(), value.tolist()
    ([0, 1, 3, 4], [0.0, 3.0, -5.0, 4.0])
    """
    if len(y) <= 2 * stretches:
        return np.arange(len(y)), y
    starts = np.linspace(0, len(y), stretches + 1).astype(np.intp)[:-1]
    low, high = extremes(y, starts)
    first = np.where(low <= high, low, high)
    last = np.where(low <= high, high, low)
    ends = np.append(starts[1:], len(y))
    positions = np.stack([starts, (starts + ends) // 2], axis=1)
    return positions.ravel(), y[np.stack([first, last], axis=1).ravel()]


def envelope_indices(y: FloatArray, stretches: int) -> NDArray[np.intp]:
    """Return ascending indices of both extremes of each stretch of y (T,), its ends and both sides of NaN runs.

    A line through these points covers, in each stretch, the same range as y.
    """
    if len(y) <= 2 * stretches:
        return np.arange(len(y))
    starts = np.linspace(0, len(y), stretches + 1).astype(np.intp)[:-1]
    missing = np.isnan(y)
    breaks = np.flatnonzero(missing[1:] != missing[:-1])
    if len(breaks) > stretches:  # more runs than columns: any of them will do
        breaks = breaks[:: len(breaks) // stretches + 1]
    low, high = extremes(y, starts)
    return np.unique(np.concatenate([[0, len(y) - 1], low, high, breaks, breaks + 1]))


def gaps(t: FloatArray) -> NDArray[np.intp]:
    """Return the indices of the last samples before steps of the times t (T,) that are no usual ones, at most 2000."""
    step = np.diff(t)
    limit = max(GAP * float(np.median(step)), GAP_SECONDS) if len(step) else 0.0
    return np.flatnonzero(step > limit)[:MAX_GAPS]


def extremes(y: FloatArray, starts: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the indices of the smallest and largest entry of each stretch; its first one where all is NaN."""
    found: list[NDArray[np.intp]] = []
    stretch = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(y))))
    for sign in (1.0, -1.0):
        filled = np.where(np.isnan(y), np.inf, sign * y)
        least = np.minimum.reduceat(filled, starts)
        hit = np.flatnonzero(filled == least[stretch])
        first = np.full(len(starts), -1, dtype=np.intp)
        first[stretch[hit][::-1]] = hit[::-1]
        found.append(np.where(first < 0, starts, first))
    return found[0], found[1]
