"""Columns of a text file as arrays, by a fast parser where it can, by a careful one that explains where it cannot."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.io.careful import by_lines, called, numbered_rows
from bingham.io.fast import StumbledError, by_arrow, by_numpy
from bingham.io.layout import Layout
from bingham.io.text import TextFile

__all__ = ["Table", "read_batches", "read_table"]

FAST = 1_000_000  # bytes from which loading a fast parser pays
THREADS = 4  # that parse at once; more wait for one another
EXTRA = 1.02  # times as many rows as the first lines promise are given room at once


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Columns of a text file, or of some rows of it.

    Parameters
    ----------
    text : TextFile
        The file.
    layout : Layout
        How it keeps its table.
    columns : dict of int to array or list of str
        Of each column asked for, by its number from 0: floats (N,), integers (N,) or text.
    together : dict of tuple to array
        Columns that lie side by side, (N, k).
    first : int
        Rows of the file before these.
    kept : ndarray of int, optional
        Which rows of the file these are, if some were left out.
    """

    text: TextFile
    layout: Layout
    columns: dict[int, Any] = field(default_factory=dict[int, Any])
    together: dict[tuple[int, ...], NDArray[np.float64]] = field(
        default_factory=dict[tuple[int, ...], NDArray[np.float64]]
    )
    first: int = 0
    kept: NDArray[np.intp] | None = None

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    def place(self, columns: Sequence[int], row: int) -> str:
        """Name a row and columns the way a reader finds them in the file."""
        names = [called(self.layout, k) for k in columns]
        lines = (k for k, _ in numbered_rows(self.text, self.layout))
        at = self.first + int(row if self.kept is None else self.kept[row])
        line = next(islice(lines, at, None), None)
        return f"line {line}, {'column' if len(names) == 1 else 'columns'} {' '.join(names)}"

    def without(self, left_out: NDArray[np.bool_]) -> Table:
        """Return the numbers of the other rows."""
        columns = {k: values[~left_out] for k, values in self.columns.items()}
        return Table(self.text, self.layout, columns, first=self.first, kept=np.flatnonzero(~left_out))

    def matrix(self, columns: Sequence[int], factors: Sequence[float]) -> NDArray[np.float64]:
        """Return columns times factors, shape (N, len(columns))."""
        values = self.together.get(tuple(columns))
        if values is None:
            values = np.empty((len(self), len(columns)))
            for k, column in enumerate(columns):
                values[:, k] = self.columns[column]
        return values if all(factor == 1.0 for factor in factors) else values * np.array(factors)


def read_table(
    text: TextFile,
    layout: Layout,
    numbers: Sequence[int],
    *,
    integers: Sequence[int] = (),
    words: Sequence[int] = (),
    together: Sequence[Sequence[int]] = (),
) -> Table:
    """Read columns of a file, and only these.

    Parameters
    ----------
    text, layout : TextFile, Layout
        The file and its table.
    numbers, integers, words : sequence of int
        Columns to read: as floats, NaN for an empty cell; as integers, exact to 64 bits; as text.
    together : sequence of sequence of int
        Columns of numbers to lay side by side.

    Raises
    ------
    RecordingError
        If a row has too few or too many cells, or a cell is not what it should be, naming line and column.
    """
    kinds = dict.fromkeys(numbers, "number") | dict.fromkeys(integers, "integer") | dict.fromkeys(words, "word")
    groups = [tuple(group) for group in together]
    alone = [k for k in kinds if not any(k in group for group in groups)]
    room = _expected(text)
    gathered: dict[Any, Any] = {k: [] if kinds[k] == "word" else _Growing(room) for k in alone}
    gathered |= {group: _Growing(room) for group in groups}
    for batch in read_batches(text, layout, kinds, threads=min(THREADS, os.cpu_count() or 1)):
        for k in alone:
            gathered[k].extend(batch[k])
        for group in groups:
            gathered[group].extend_columns([batch[k] for k in group])
    done: dict[Any, Any] = {k: v if isinstance(v, list) else v.finished() for k, v in gathered.items()}
    columns = {k: done[k] for k in alone}
    for group in groups:
        if done[group].ndim == 1:  # no rows; a view of those that there are would have to be copied
            done[group] = done[group].reshape(0, len(group))
        columns |= {k: done[group][:, i] for i, k in enumerate(group)}
    return Table(text, layout, columns, {group: done[group] for group in groups})


def read_batches(
    text: TextFile, layout: Layout, kinds: Mapping[int, str], *, threads: int = 1
) -> Iterator[dict[int, Any]]:
    """Yield columns, "number", "integer" or "word", some rows after the other, parsed in so many threads.

    What a fast parser stumbles over the careful one goes on with, so that it can say where it is.
    """
    done = 0
    if text.path.stat().st_size >= FAST:
        for parser in (partial(by_arrow, threads=threads), by_numpy):
            try:
                for batch in parser(text, layout, dict(kinds)):
                    done += len(next(iter(batch.values())))
                    yield batch
            except StumbledError:
                if not done:
                    continue
                break
            return
    yield from by_lines(text, layout, dict(kinds), done)


def _expected(text: TextFile) -> int:
    """Return about how many rows a file has."""
    if text.complete:
        return len(text.head)
    lines = [line for _, line in text.head[len(text.head) // 2 :]]
    return int(EXTRA * text.path.stat().st_size / (1 + sum(map(len, lines)) / len(lines))) + 1


class _Growing:
    """Rows of an array that come bit by bit; with room for as many as are expected they are written but once."""

    def __init__(self, room: int) -> None:
        self._room = room
        self._size = 0
        self._rows: NDArray[Any] | None = None

    def extend(self, values: NDArray[Any]) -> None:
        """Add numbers (n,)."""
        rows = self._with_room(len(values), (), values.dtype)
        rows[self._size : self._size + len(values)] = values
        self._size += len(values)

    def extend_columns(self, columns: Sequence[NDArray[np.float64]]) -> None:
        """Add rows (n, k), given by columns (n,)."""
        size = len(columns[0])
        rows = self._with_room(size, (len(columns),), columns[0].dtype)
        for k, values in enumerate(columns):
            rows[self._size : self._size + size, k] = values
        self._size += size

    def finished(self) -> NDArray[Any]:
        """Return all rows as an array that owns them."""
        if self._rows is None:
            return np.empty(0)
        self._rows.resize((self._size, *self._rows.shape[1:]), refcheck=False)
        return self._rows

    def _with_room(self, size: int, tail: tuple[int, ...], dtype: Any) -> NDArray[Any]:
        if self._rows is None:
            self._rows = np.empty((max(self._room, size), *tail), dtype=dtype)
        elif self._size + size > len(self._rows):
            larger = np.empty((self._size + max(size, self._size // 4), *tail), dtype=self._rows.dtype)
            larger[: self._size] = self._rows[: self._size]
            self._rows = larger
        return self._rows
