"""Lines of a text file as columns, one cell after the other, so that what is wrong can be said with its place."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from decimal import Decimal
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError
from bingham.io.checks import note
from bingham.io.dates import is_date
from bingham.io.layout import COMMENTS, LONGEST_CELL, Layout, is_number, split_cells
from bingham.io.text import TextFile

__all__ = ["by_lines", "called", "numbered_rows"]

BATCH = 20_000  # rows that are in memory as text
MISSING = ("", "nan", "NaN", "NAN", "-nan", "null", "NULL", "None", "NA", "N/A", "n/a")
FLOAT = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?inf(?:inity)?", re.ASCII | re.IGNORECASE)
POWER = re.compile(r"[+-]?\d(\.\d{1,40})?[eE]\+?0{0,3}\d{1,2}", re.ASCII)
INTEGER = re.compile(r"[-+]?\d{1,19}", re.ASCII)
# Decimal mark → separator of thousands, and numbers with it that are no others.
THOUSANDS = {
    ".": (",", re.compile(r"[-+]?\d{1,3}(?:,\d{3})+\.\d*|[-+]?\d{1,3}(?:,\d{3}){2,}", re.ASCII)),
    ",": (".", re.compile(r"[-+]?\d{1,3}(?:\.\d{3})+,\d*|[-+]?\d{1,3}(?:\.\d{3}){2,}", re.ASCII)),
}
FOOTER = 20  # lines below a table at most
DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?", re.ASCII)


def called(layout: Layout, column: int) -> str:
    """Return a column's name in the file, or its number where it has none."""
    name = layout.names[column] if layout.names else ""
    return name or str(column + 1)


def numbered_rows(text: TextFile, layout: Layout) -> Iterator[tuple[int, str]]:
    """Yield the numbered lines of the table: no comments, and no names once more, as loggers that restart write."""
    header = dict(text.head).get(layout.header, "").strip()
    repeated = 0
    words: list[tuple[int, str]] = []  # lines without a number: below the table if no row follows
    for number, line in text.lines():
        if number < layout.first or line.lstrip().startswith(COMMENTS):
            continue
        if line.strip() == header:
            repeated += 1
        elif number > layout.first and line.lstrip()[:1].isalpha() and _is_words(line, layout):
            words.append((number, line))
            if len(words) > FOOTER:
                yield from words
                words.clear()
        else:
            yield from words
            words.clear()
            yield number, line
    if words:
        first, said = words[0]
        note(text.path, f"line {first} and those after it left out, which hold no numbers: {said[:40]!r}")
    if layout.header and repeated:
        note(text.path, f"the names of the columns stand in it {repeated + 1} times; taken as one table")


def _is_words(line: str, layout: Layout) -> bool:
    """Whether no cell of a line holds a number, a date or nothing in the place of one."""
    cells = [cell for cell in split_cells(line, layout.separator) if cell]
    return not any(is_number(cell, comma=layout.separator != ",") or is_date(cell) for cell in cells)


def by_lines(text: TextFile, layout: Layout, kinds: dict[int, str], skipped: int = 0) -> Iterator[dict[int, Any]]:
    """Yield the columns of some rows after the other, without the first `skipped` rows.

    Raises
    ------
    RecordingError
        If a row has too few or too many cells, or a cell is not what it should be, naming line and column.
    """
    lines = numbered_rows(text, layout)
    next(islice(lines, skipped, skipped), None)
    while batch := list(islice(lines, BATCH)):
        rows = _split(text, layout, batch)
        numbers = [number for number, _ in batch]
        columns: dict[int, Any] = {}
        for k, kind in kinds.items():
            cells = [row[k].strip() for row in rows]
            columns[k] = cells if kind == "word" else _converted(text, layout, k, cells, numbers, kind)
        yield columns


def _split(text: TextFile, layout: Layout, batch: list[tuple[int, str]]) -> list[list[str]]:
    """Return the cells of lines; every row must have a cell for every column."""
    separator, width = layout.separator, layout.width
    lines = [line for _, line in batch]
    if separator is None:
        rows = [line.split() for line in lines]
    elif any('"' in line for line in lines):
        rows = _quoted(text, separator, batch)
    else:
        rows = [line.split(separator) for line in lines]
    for (number, line), row in zip(batch, rows, strict=True):
        if len(row) == width + 1 and not row[-1].strip():
            row.pop()  # a separator at the end of the line
        if len(row) != width:
            raise _miscounted(text, layout, number, row)
        if len(line) > LONGEST_CELL:
            _check_lengths(text, layout, number, row)
    return rows


def _quoted(text: TextFile, separator: str, batch: list[tuple[int, str]]) -> list[list[str]]:
    rows: list[list[str]] = []
    for number, line in batch:
        try:
            cells = list(csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True))
        except csv.Error as error:
            hint = "close the quotes, and keep each row on one line"
            if len(line) > csv.field_size_limit():
                hint = f"cells have at most {LONGEST_CELL} characters: leave the column out"
            raise RecordingError(text.path, f"line {number}", f"cannot be split into cells ({error})", hint) from None
        rows.append(cells[0])
    return rows


def _miscounted(text: TextFile, layout: Layout, number: int, row: list[str]) -> RecordingError:
    names = layout.names or [str(k + 1) for k in range(layout.width)]
    hint = f"expected: {' '.join(names)}"
    if layout.separator == "," and layout.width < len(row) <= 2 * layout.width and all(map(_integer_like, row)):
        hint = "decimal commas? Write numbers with a point, or separate columns by ;"
    elif _is_last(text, number):
        hint = "the file looks cut off: copy it again"
    problem = f"{len(row)} columns where {layout.width} are expected"
    return RecordingError(text.path, f"line {number}", problem, hint)


def _is_last(text: TextFile, number: int) -> bool:
    return not any(k > number for k, _ in text.lines())


def _check_lengths(text: TextFile, layout: Layout, number: int, row: list[str]) -> None:
    for k, cell in enumerate(row):
        if len(cell) > LONGEST_CELL:
            problem = f"a cell of {len(cell)} characters"
            hint = f"at most {LONGEST_CELL} are expected: leave the column out"
            raise RecordingError(text.path, f"line {number}, column {called(layout, k)}", problem, hint)


def _converted(
    text: TextFile, layout: Layout, column: int, cells: list[str], lines: list[int], kind: str
) -> NDArray[Any]:
    if kind == "integer":
        cells = _written_out(text, layout, column, cells)
        for number, cell in zip(lines, cells, strict=True):
            if not INTEGER.fullmatch(cell) or not -(2**63) <= int(cell) < 2**63:
                raise _wrong(text, layout, column, number, cell, "an integer")
        return np.array([int(cell) for cell in cells], dtype=np.int64)
    cells = _without_thousands(cells, layout.decimal)
    if layout.decimal == ",":
        cells = [cell.replace(",", ".") if "." not in cell else f"{cell}?" for cell in cells]
    together = "".join(cells)
    if together.isascii() and "_" not in together:
        try:
            return np.array([float(cell) if cell else np.nan for cell in cells])
        except ValueError:
            pass
    values = np.empty(len(cells))
    for k, (number, cell) in enumerate(zip(lines, cells, strict=True)):
        if cell in MISSING:
            values[k] = np.nan
        elif FLOAT.fullmatch(cell):
            values[k] = float(cell)
        else:
            raise _wrong(text, layout, column, number, cell, "a number")
    return values


def _written_out(text: TextFile, layout: Layout, column: int, cells: list[str]) -> list[str]:
    """Write out integers that a spreadsheet rounded to a power of ten, as 1.40363657975856E+18."""
    rounded = [k for k, cell in enumerate(cells) if POWER.fullmatch(cell)]
    if not rounded:
        return cells
    cells = list(cells)
    for k in rounded:
        cells[k] = f"{Decimal(cells[k]):f}"
    note(text.path, f"column {called(layout, column)}: integers as powers of ten, as spreadsheets round them")
    return cells


def _without_thousands(cells: list[str], decimal: str) -> list[str]:
    """Take separators of thousands out of cells in which both marks stand, ``1,234.5``, or one of them twice."""
    mark, form = THOUSANDS[decimal]
    if not any(mark in cell for cell in cells):
        return cells
    return [cell.replace(mark, "") if mark in cell and form.fullmatch(cell) else cell for cell in cells]


def _wrong(text: TextFile, layout: Layout, column: int, line: int, cell: str, wanted: str) -> RecordingError:
    """Return the error for a cell that is not what it should be, with how to fix it."""
    hint = "correct the cell"
    if is_date(cell):
        hint = "a date: give numbers instead, seconds, or ns, us or ms with the unit in the column's name, as t_ns"
    elif DECIMAL_COMMA.fullmatch(cell):
        hint = "a decimal comma: write numbers with a point, throughout the file"
    shown = cell if len(cell) <= 40 else f"{cell[:40]}…"
    place = f"line {line}, column {called(layout, column)}"
    return RecordingError(text.path, place, f"{shown!r} is not {wanted}", hint)


def _integer_like(cell: str) -> bool:
    return cell.strip().lstrip("+-").isdigit()
