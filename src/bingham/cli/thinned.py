"""Rows that come piece by piece, thinned out evenly so that no more than so many are kept."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["Thinned"]


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
