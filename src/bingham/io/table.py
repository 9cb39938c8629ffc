"""Columns of a text file as arrays: by a fast parser where it can, by a careful one that explains where it cannot.

The fast parser (pyarrow's, of the extra ``io``; without it NumPy's) takes a subset of what the careful one takes, to
the same numbers. Whatever it stumbles over the careful one reads once more: line by line, so that it can say where.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError
from bingham.io.checks import note
from bingham.io.dates import is_date
from bingham.io.layout import COMMENTS, LONGEST_CELL, Layout
from bingham.io.text import TextFile

__all__ = ["Table", "read_table"]

FAST = 1_000_000  # bytes from which loading a fast parser pays
BLOCK = 4 * 1024 * 1024  # bytes; longer than any line
BATCH = 20_000  # rows that the careful parser has in memory as text
MISSING = ("", "nan", "NaN", "NAN", "-nan", "null", "NULL", "None", "NA", "N/A", "n/a")
USUALLY_MISSING = ("", "nan", "NaN")  # to the fast parser, which each further word slows down
FLOAT = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?inf(?:inity)?", re.ASCII | re.IGNORECASE)
INTEGER = re.compile(r"[-+]?\d{1,19}", re.ASCII)
DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?", re.ASCII)


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Columns of a text file.

    Parameters
    ----------
    text : TextFile
        The file.
    layout : Layout
        How it keeps its table.
    columns : dict of int to array or list of str
        Of each column asked for, by its number from 0: floats (N,), integers (N,) or text.
    """

    text: TextFile
    layout: Layout
    columns: dict[int, Any] = field(default_factory=dict[int, Any])

    def place(self, columns: Sequence[int], row: int) -> str:
        """Name a row and columns the way a reader finds them in the file."""
        names = [called(self.layout, k) for k in columns]
        lines = (k for k, _ in _body(self.text, self.layout))
        line = next(islice(lines, int(row), None), None)
        return f"line {line}, {'column' if len(names) == 1 else 'columns'} {' '.join(names)}"

    def matrix(self, columns: Sequence[int], factors: Sequence[float]) -> NDArray[np.float64]:
        """Return columns times factors, shape (N, len(columns)), as an own array."""
        values = np.empty((len(self.columns[columns[0]]), len(columns)))
        for k, (column, factor) in enumerate(zip(columns, factors, strict=True)):
            np.multiply(self.columns[column], factor, out=values[:, k])
        return values


def called(layout: Layout, column: int) -> str:
    """Return a column's name in the file, or its number where it has none."""
    name = layout.names[column] if layout.names else ""
    return name or str(column + 1)


def read_table(
    text: TextFile, layout: Layout, numbers: Sequence[int], *, integers: Sequence[int] = (), words: Sequence[int] = ()
) -> Table:
    """Read columns of a file, and only these.

    Parameters
    ----------
    text, layout : TextFile, Layout
        The file and its table.
    numbers, integers, words : sequence of int
        Columns to read: as floats, NaN for an empty cell; as integers, exact to 64 bits; as text.

    Raises
    ------
    RecordingError
        If a row has too few or too many cells, or a cell is not what it should be, naming line and column.
    """
    kinds = dict.fromkeys(numbers, "number") | dict.fromkeys(integers, "integer") | dict.fromkeys(words, "word")
    columns = None
    if text.path.stat().st_size >= FAST:
        columns = _by_arrow(text, layout, kinds)
        if columns is None and layout.decimal == "." and not integers and not words:
            columns = _by_numpy(text, layout, kinds)
    return Table(text, layout, _carefully(text, layout, kinds) if columns is None else columns)


def _by_arrow(text: TextFile, layout: Layout, kinds: dict[int, str]) -> dict[int, Any] | None:
    """Read by pyarrow; None if it is not installed or meets anything unusual."""
    separator = layout.separator or _lone_separator(text, layout)
    if separator is None:
        return None
    try:
        import pyarrow as pa
        from pyarrow import csv as reader
    except ImportError:
        return None
    types = {"number": pa.float64(), "integer": pa.int64(), "word": pa.string()}
    quoted = any('"' in line for _, line in text.head)  # quotes further down make it fail, and the careful one read
    try:
        table = reader.read_csv(
            text.path,
            read_options=reader.ReadOptions(
                use_threads=False,
                block_size=BLOCK,
                skip_rows=layout.first - 1,
                column_names=[str(k) for k in range(layout.width)],
            ),
            parse_options=reader.ParseOptions(delimiter=separator, quote_char='"' if quoted else False),
            convert_options=reader.ConvertOptions(
                column_types={str(k): types[kind] for k, kind in kinds.items()},
                include_columns=[str(k) for k in kinds],
                null_values=list(USUALLY_MISSING),
                decimal_point=layout.decimal,
                check_utf8="word" in kinds.values(),
            ),
        )
    except (pa.ArrowException, OSError, UnicodeDecodeError):
        return None
    columns: dict[int, Any] = {}
    for k, kind in kinds.items():
        values = table.column(str(k))
        if kind == "integer" and values.null_count:
            return None
        columns[k] = values.to_pylist() if kind == "word" else np.concatenate([_array(c) for c in values.chunks])
    return columns


def _array(values: Any) -> Any:
    """Return a chunk of numbers as an array; `to_numpy` would import pandas, which takes as long as 20 MB of text."""
    if values.null_count:
        return values.to_numpy(zero_copy_only=False)
    whole = np.frombuffer(values.buffers()[1], dtype=f"{values.type}".replace("double", "float64"))
    return whole[values.offset : values.offset + len(values)]


def _lone_separator(text: TextFile, layout: Layout) -> str | None:
    """Return the white space that stands alone between all cells of the first rows, None if there is none."""
    rows = [line for number, line in text.head[:200] if number >= layout.first]
    for separator in (" ", "\t"):
        if all(len(row.split(separator)) == len(row.split()) == layout.width for row in rows):
            return separator
    return None


def _by_numpy(text: TextFile, layout: Layout, kinds: dict[int, str]) -> dict[int, Any] | None:
    try:
        rows = np.loadtxt(
            text.path,
            delimiter=layout.separator,
            skiprows=layout.first - 1,
            comments=None,
            encoding=text.encoding,
            ndmin=2,
            quotechar='"',
        )
    except (ValueError, UnicodeDecodeError, OSError):
        return None
    return {k: rows[:, k].copy() for k in kinds} if rows.shape[1] == layout.width else None


def _body(text: TextFile, layout: Layout) -> Iterator[tuple[int, str]]:
    """Yield the numbered lines of the table: no comments, and no names once more, as loggers that restart write."""
    header = dict(text.head).get(layout.header, "").strip()
    for number, line in text.lines():
        if number >= layout.first and not line.lstrip().startswith(COMMENTS) and line.strip() != header:
            yield number, line


def _carefully(text: TextFile, layout: Layout, kinds: dict[int, str]) -> dict[int, Any]:
    parts: dict[int, list[Any]] = {k: [] for k in kinds}
    lines = _body(text, layout)
    while batch := list(islice(lines, BATCH)):
        rows = _split(text, layout, batch)
        for k, kind in kinds.items():
            cells = [row[k].strip() for row in rows]
            if kind == "word":
                parts[k].extend(cells)
            else:
                numbers = [number for number, _ in batch]
                parts[k].append(_converted(text, layout, k, cells, numbers, kind))
    repeated = sum(line.strip() == dict(text.head).get(layout.header, "") for _, line in text.head) - 1
    if layout.header and repeated > 0:
        note(f"{text.path}: the names of the columns stand in it {repeated + 1} times; taken as one table")
    return {k: parts[k] if kind == "word" else np.concatenate(parts[k]) for k, kind in kinds.items()}


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
            if "field larger" in str(error):
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
        for number, cell in zip(lines, cells, strict=True):
            if not INTEGER.fullmatch(cell) or not -(2**63) <= int(cell) < 2**63:
                raise _wrong(text, layout, column, number, cell, "an integer")
        return np.array([int(cell) for cell in cells], dtype=np.int64)
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
