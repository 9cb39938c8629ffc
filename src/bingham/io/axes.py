"""Axes and quaternions without times, one a row: what a distribution is fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io.checks import normalised
from bingham.io.text import TextTable, numbered_lines

__all__ = ["Axes", "read_axes"]

# Names under which components are looked for: quaternions, axes as geologists and as everybody else write them.
KNOWN = (("qw", "qx", "qy", "qz"), ("n", "e", "d"), ("x", "y", "z"), ("x", "y"), ("ux", "uy"))


class Axes(NamedTuple):
    """Unit vectors whose sign means nothing.

    Parameters
    ----------
    name : str
        Name of the file.
    columns : tuple of str
        What the file calls the components.
    values : ndarray, shape (N, d)
        One unit vector a row.
    """

    name: str
    columns: tuple[str, ...]
    values: NDArray[np.float64]


def read_axes(path: str | Path, *, columns: Sequence[str] | None = None) -> Axes:
    """Read unit vectors from a text file, columns separated by comma, semicolon, tab or white space.

    Parameters
    ----------
    path : str or Path
        File. If its first line that is no comment holds a word, it names the columns, and of these
        ``qw qx qy qz``, ``n e d`` (north, east, down), ``x y z``, ``x y`` or ``ux uy`` are taken; without names all
        columns are components, in the order of the file.
    columns : sequence of str, optional
        Names of the components in the file, in the order wanted.

    Returns
    -------
    Axes
        The rows as they stand; rounded ones normalised.

    Warns
    -----
    RecordingWarning
        If rounded rows were normalised (norm off by 1e-6 to 1e-3), naming the largest deviation.

    Raises
    ------
    RecordingError
        If a column is missing, a value no number or a row no unit vector, naming the line.
    """
    lines = [(k, line) for k, line in numbered_lines(path) if not line.lstrip().startswith("#")]
    path = Path(path)
    if not lines:
        raise RecordingError(path, "", "only comments in it", "one axis a row is expected")
    first, header = lines[0]
    separator = next((s for s in ",;\t" if s in header), None)
    cells = [cell.strip().strip('"') for cell in header.split(separator)]
    if all(map(_is_number, cells)):
        names, chosen = _unnamed(path, first, cells, columns)
        table = TextTable.parse(path, names, lines, separator)
    else:
        chosen = _named(path, first, cells, columns)
        table = TextTable.parse(path, cells, lines[1:], separator)
    rows = table.as_numbers(list(chosen))

    def place(_: str, index: int) -> str:
        return table.place(list(chosen), index)

    finite = np.isfinite(rows).all(axis=1)
    if not finite.all():
        raise RecordingError(path, place("", int(np.argmin(finite))), "not finite", "remove the row or complete it")
    return Axes(path.stem, chosen, normalised(path, "axes", rows, place))


def _unnamed(
    path: Path, line: int, cells: list[str], columns: Sequence[str] | None
) -> tuple[list[str], tuple[str, ...]]:
    if columns is not None:
        raise InvalidArgumentError(
            "columns", "a file that names its columns", f"numbers in line {line}", "leave it out"
        )
    if len(cells) < 2:
        raise RecordingError(path, f"line {line}", "one column", "an axis has two components or more")
    names = [f"x{k + 1}" for k in range(len(cells))]
    return names, tuple(names)


def _named(path: Path, line: int, cells: list[str], columns: Sequence[str] | None) -> tuple[str, ...]:
    there = f"columns in the file: {' '.join(cells)}"
    if columns is not None:
        if missing := [c for c in columns if c not in cells]:
            raise RecordingError(path, f"line {line}", f"no column {' '.join(missing)}", there)
        if len(columns) < 2:
            raise InvalidArgumentError("columns", "two names or more", list(columns))
        return tuple(columns)
    lower = [cell.lower() for cell in cells]
    found = [known for known in KNOWN if set(known) <= set(lower)]
    found = [known for known in found if not any(set(known) < set(other) for other in found)]
    if len(found) != 1:
        problem = "names no known set of components" if not found else f"names {' and '.join(map(' '.join, found))}"
        raise RecordingError(path, f"line {line}", problem, f"choose by columns=; {there}")
    return tuple(cells[lower.index(name)] for name in found[0])


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
