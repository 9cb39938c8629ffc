"""Rows that come piece by piece: so many are kept, evenly or where curves have their extremes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bingham.decimate import extremes

__all__ = ["Peaks", "Thinned", "merged"]


class Thinned:
    """Every 2^k-th row of arrays that grow together, with the least k that leaves at most `limit` rows.

    Parameters
    ----------
    limit : int or None
        Rows to keep at most; None: all.
    """

    def __init__(self, limit: int | None) -> None:
        self.stride = 1
        self._limit = limit
        self._parts: list[tuple[Any, ...]] = []
        self._next: list[int] = []  # of each part the first row's number
        self._seen = self._kept = 0

    def add(self, *arrays: Any) -> None:
        """Add rows, the same of each array."""
        first = -self._seen % self.stride
        part = tuple(array[first :: self.stride].copy() for array in arrays)
        if len(part[0]):
            self._parts.append(part)
            self._next.append(self._seen + first)
            self._kept += len(part[0])
        self._seen += len(arrays[0])
        while self._limit is not None and self._kept > self._limit:
            self._halve()

    @property
    def numbers(self) -> Any:
        """Numbers of the rows that are kept."""
        return np.arange(0, self._seen, self.stride)

    def arrays(self) -> tuple[Any, ...]:
        """Return what is kept."""
        return tuple(np.concatenate(parts) for parts in zip(*self._parts, strict=True))

    def _halve(self) -> None:
        parts, numbers = self._parts, self._next
        self._parts, self._next, self._kept = [], [], 0
        for part, number in zip(parts, numbers, strict=True):
            first = number // self.stride % 2
            half = tuple(array[first::2].copy() for array in part)
            if len(half[0]):
                self._parts.append(half)
                self._next.append(number + first * self.stride)
                self._kept += len(half[0])
        self.stride *= 2


class Peaks:
    """Rows in which one of several curves is smallest or largest of its stretch, of arrays that grow together.

    Parameters
    ----------
    stretches : int
        Extremes are kept in at least half as many equal stretches of all rows, and at most as many and one.
    """

    def __init__(self, stretches: int) -> None:
        self._stretches = stretches
        self._kept: list[tuple[Any, ...]] = []  # row numbers, curves, arrays
        self._seen = self._curves = 0

    def add(self, curves: Sequence[Any], *arrays: Any) -> None:
        """Add rows: the curves (T,) that choose, and the arrays that are kept."""
        numbers = np.arange(self._seen, self._seen + len(arrays[0]))
        self._seen += len(numbers)
        self._curves = len(curves)
        self._kept.append(self._chosen((numbers, *curves, *arrays)))
        if sum(len(part[0]) for part in self._kept) > 4 * self._curves * self._stretches:
            self._kept = [self._chosen(self._joined())]

    def rows(self) -> tuple[Any, ...]:
        """Return the numbers of the rows that are kept, and of each array these rows."""
        numbers, *rest = self._chosen(self._joined())
        return numbers, *rest[self._curves :]

    def _joined(self) -> tuple[Any, ...]:
        return tuple(np.concatenate(parts) for parts in zip(*self._kept, strict=True))

    def _chosen(self, rows: tuple[Any, ...]) -> tuple[Any, ...]:
        # Stretches of 2^k rows: later ones are made of whole earlier ones, so that no extreme is lost on the way.
        width = 1 << (self._seen // self._stretches).bit_length()
        starts = np.flatnonzero(np.diff(rows[0] // width, prepend=-1))
        at = np.unique(np.concatenate([k for curve in rows[1 : 1 + self._curves] for k in extremes(curve, starts)]))
        return tuple(array[at] for array in rows)


def merged(thinned: Thinned, peaks: Peaks) -> tuple[Any, ...]:
    """Return row numbers, ascending, and the arrays' rows that either keeps."""
    numbers, *arrays = peaks.rows()
    order, first = np.unique(np.concatenate([thinned.numbers, numbers]), return_index=True)
    return order, *(np.concatenate(both)[first] for both in zip(thinned.arrays(), arrays, strict=True))
