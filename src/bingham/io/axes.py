"""Axes and quaternions without times, one a row: what a distribution is fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.errors import InvalidArgumentError, RecordingError, Setting
from bingham.io.angles import STEEP, AngleKind, angle_kind, recognised
from bingham.io.careful import called
from bingham.io.checks import narrowest, normalised, repaired
from bingham.io.field_notes import read_field_notes
from bingham.io.layout import Layout, find_layout
from bingham.io.table import read_table
from bingham.io.text import TextFile, opened_text
from bingham.io.words import joined
from bingham.io.written import Written, decoded

__all__ = ["Axes", "read_axes"]

# Names under which components are looked for: quaternions, axes as geologists and as everybody else write them.
KNOWN = (("qw", "qx", "qy", "qz"), ("n", "e", "d"), ("x", "y", "z"), ("x", "y"), ("ux", "uy"))

# Components of unit vectors are not above 1.
LIKE_DEGREES = 3.0

OF_WHAT = ("say it by ", Setting("angles", "trend-plunge"), ", plunge-trend, strike-dip or dip-direction, in order")


class Axes(NamedTuple):
    """Unit vectors whose sign means nothing.

    Parameters
    ----------
    name : str
        Name of the file.
    columns : tuple of str
        What the file calls the components; of angles, the components they were converted to.
    values : ndarray, shape (N, d)
        One unit vector a row.
    angles : str
        Kind of the angles that the file holds, see `bingham.io.angles`; empty if it holds components.
    """

    name: str
    columns: tuple[str, ...]
    values: NDArray[np.float64]
    angles: str = ""


def read_axes(path: str | Path, *, columns: Sequence[str] | None = None, angles: str | None = None) -> Axes:
    """Read unit vectors from a text file, columns separated by comma, semicolon, tab or white space.

    Parameters
    ----------
    path : str or Path
        File. If it names its columns, ``qw qx qy qz``, ``n e d`` (north, east, down), ``x y z``, ``x y`` or ``ux uy``
        are taken, or angles as `bingham.io.angles` knows them (``trend plunge``, ``phi1 Phi phi2``, …); without names
        all columns are components, in the order of the file. Notations of field books (`bingham.io.field_notes`) are
        read too.
    columns : sequence of str, optional
        Names of the columns in the file, in the order wanted; their numbers, from "1", where it names none.
    angles : str, optional
        What the columns are: a kind of `bingham.io.angles`, as "strike-dip"; recognised by their names without it.

    Returns
    -------
    Axes
        The rows as they stand, rounded ones normalised; angles converted.

    Warns
    -----
    RecordingWarning
        If rows were normalised whose rounding is more than a tenth of their least scatter (`checks.narrowest`).
    RepairWarning
        If rows that hold no axis were left out, with their number.

    Raises
    ------
    RecordingError
        If a column is missing, a value no number or a row no unit vector, naming the line.
    """
    kind = None if angles is None else angle_kind(angles)
    text = opened_text(path)
    path = text.path
    wanted = None if columns is None else list(columns)
    if (notes := _notes(text, wanted, kind, plain=False)) is not None:
        return notes
    try:
        layout = find_layout(text)
        if layout.names:
            at, kind, radians = _named(path, layout, columns, kind)
        else:
            at, radians = _unnamed(path, layout, columns, kind), False
    except RecordingError:
        if (notes := _notes(text, wanted, kind, plain=True)) is None:
            raise
        return notes
    table = read_table(text, layout, at)
    rows = table.matrix(at, [1.0] * len(at))
    empty = np.asarray(np.isnan(rows).all(axis=1))
    if empty.any() and not empty.all():
        repaired(
            path, f"{np.count_nonzero(empty)} of {len(rows)} rows hold no {'angles' if kind else 'axis'}, left out"
        )
        table = table.without(empty)
        rows = rows[~empty]
    finite = np.isfinite(rows).all(axis=1)
    if not finite.all():
        raise RecordingError(
            path, table.place(at, int(np.argmin(finite))), "not finite", "remove the row or complete it"
        )
    if kind is not None:
        return Axes(path.stem, kind.vector, decoded(table, Written(kind, at, radians)), kind.name)

    def place(_: str, index: int) -> str:
        return table.place(at, index)

    names = tuple(called(layout, k) for k in at) if layout.names else tuple(f"x{k + 1}" for k in range(len(at)))
    if not layout.names and len(at) != 2 and np.median(np.abs(rows).max(axis=1)) > LIKE_DEGREES:
        problem = f"{len(at)} columns without names, too large for components of unit vectors"
        way = (Setting("columns", ["1", "2"]), " ", Setting("angles", "trend-plunge"))
        hint = ("choose columns by their numbers and say what they are: ", *way)
        raise RecordingError(path, f"line {layout.first}", problem, hint)
    if not layout.names and len(at) == 2 and np.median(np.abs(rows).max(axis=1)) > LIKE_DEGREES:
        problem = "two columns without names that look like angles in degrees"
        raise RecordingError(path, f"line {layout.first}", problem, OF_WHAT)
    return Axes(path.stem, names, normalised(path, "axes", rows, place, scatter=narrowest))


def _notes(text: TextFile, columns: list[str] | None, kind: AngleKind | None, *, plain: bool) -> Axes | None:
    """Return the axes of a field book, None if a file is none."""
    if not text.complete or (notes := read_field_notes(text, columns, kind, plain=plain)) is None:
        return None
    try:
        values = notes.kind.decode(notes.values)
    except InvalidArgumentError:
        for line, row in zip(notes.lines, notes.values, strict=True):
            try:
                notes.kind.decode(row[None])
            except InvalidArgumentError as error:
                expected = f"{error.argument} is to be {error.expected}"
                raise RecordingError(text.path, f"line {line}", expected, "correct or remove the row") from None
        raise
    return Axes(text.path.stem, notes.kind.vector, values, notes.kind.name)


def _unnamed(path: Path, layout: Layout, columns: Sequence[str] | None, kind: AngleKind | None) -> list[int]:
    if columns is not None and all(name.isdecimal() and 1 <= int(name) <= layout.width for name in columns):
        if kind is not None and len(kind.columns) != len(columns):
            raise InvalidArgumentError(
                "columns", f"{len(kind.columns)} numbers, {' '.join(kind.columns)}", list(columns)
            )
        return [int(name) - 1 for name in columns]
    if columns is not None:
        got = f"numbers in line {layout.first}"
        raise InvalidArgumentError(
            "columns", "a file that names its columns", got, "number them, from 1, or leave it out"
        )
    if kind is None and layout.width < 2:
        raise RecordingError(path, f"line {layout.first}", "one column", "an axis has two components or more")
    if kind is not None and len(kind.columns) != layout.width:
        problem = f"{layout.width} columns, where {kind.name} has {len(kind.columns)}"
        numbers = Setting("columns", [str(k + 1) for k in range(len(kind.columns))])
        hint = (f"choose {' '.join(kind.columns)} by their numbers: ", numbers)
        raise RecordingError(path, f"line {layout.first}", problem, hint)
    return list(range(layout.width))


def _named(
    path: Path, layout: Layout, columns: Sequence[str] | None, kind: AngleKind | None
) -> tuple[list[int], AngleKind | None, bool]:
    """Return the columns to read in order, the kind of angles they are, None for components, and whether in radians."""
    cells, place = layout.names, f"line {layout.header}"
    there = f"columns in the file: {' '.join(cells)}"
    if columns is not None:
        if missing := [c for c in columns if c not in cells]:
            raise RecordingError(path, place, f"no column {' '.join(missing)}", there)
        if len(columns) < 2 and kind is None:
            raise InvalidArgumentError("columns", "two names or more", list(columns))
        if kind is not None and len(kind.columns) != len(columns):
            raise InvalidArgumentError("columns", f"{len(kind.columns)} names, {' '.join(kind.columns)}", list(columns))
        found = recognised(list(columns))
        if kind is None and found is not None and len(found[1]) == len(columns):
            return [cells.index(columns[k]) for k in found[1]], found[0], found[2]
        return [cells.index(c) for c in columns], kind, False
    if kind is not None:
        found = recognised(cells)
        if found is not None and found[0].name == kind.name:
            return found[1], kind, found[2]
        if len(cells) != len(kind.columns):
            hint = (f"name its {len(kind.columns)} by ", Setting("columns"), f"; {there}")
            raise RecordingError(path, place, f"which columns are {' '.join(kind.columns)}?", hint)
        return list(range(len(cells))), kind, False
    lower = [cell.lower() for cell in cells]
    known = [names for names in KNOWN if set(names) <= set(lower)]
    known = [names for names in known if not any(set(names) < set(other) for other in known)]
    found = recognised(cells)
    if not known and found is not None:
        return found[1], found[0], found[2]
    if len(known) != 1:
        if len(cells) == 2 and any(joined(cell) in STEEP for cell in cells):
            raise RecordingError(path, place, f"{' and '.join(cells)}: of lines or of planes?", OF_WHAT)
        problem = "names no known set of components" if not known else f"names {' and '.join(map(' '.join, known))}"
        hint = ("choose by ", Setting("columns"), ", or name angles by ", Setting("angles"), f"; {there}")
        raise RecordingError(path, place, problem, hint)
    return [lower.index(name) for name in known[0]], None, False
