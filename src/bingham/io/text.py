"""Lines and columns of text files, with the line number of everything that goes wrong."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError
from bingham.io.checks import existing

__all__ = ["TextTable", "is_utf16", "numbered_lines"]

T = TypeVar("T")

DATE = re.compile(r"\d{4}-\d\d-\d\d([T ].*)?")
DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")


def is_utf16(start: bytes) -> bool:
    """Whether a file that starts so is UTF-16 text: its mark is there, or every other byte is zero."""
    even, odd = start[::2], start[1::2]
    zero_beside_text = len(start) > 3 and ((all(even) and not any(odd)) or (all(odd) and not any(even)))
    return start.startswith((b"\xff\xfe", b"\xfe\xff")) or zero_beside_text


def numbered_lines(path: str | Path) -> list[tuple[int, str]]:
    """Return the lines that are not blank, numbered from 1.

    Raises
    ------
    RecordingError
        If the file is absent, empty or not UTF-8 text.
    """
    path = existing(path)
    with path.open("rb") as file:
        if is_utf16(file.read(16)):
            raise RecordingError(path, "", "UTF-16 text", "save it as UTF-8, as iconv -f UTF-16 -t UTF-8 does")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise RecordingError(path, f"byte {error.start}", "not UTF-8 text", "give a text file") from None
    if "\0" in text:
        raise RecordingError(path, f"byte {text.index(chr(0))}", "not text but binary", "give a text file")
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip()]
    if not lines:
        raise RecordingError(path, "", "the file is empty", "record or copy it again")
    return lines


@dataclass(frozen=True, slots=True, eq=False)
class TextTable:
    """Cells of a text file under named columns.

    Parameters
    ----------
    path : Path
        The file, for messages.
    names : list of str
        A name for each column.
    lines : list of int
        Line number of each row.
    cells : list of list of str
        One list a column.
    """

    path: Path
    names: list[str]
    lines: list[int]
    cells: list[list[str]]

    @classmethod
    def parse(cls, path: str | Path, names: list[str], body: list[tuple[int, str]], separator: str | None) -> TextTable:
        """Split lines at `separator` (None: at white space); every row must have a cell for every name."""
        path = Path(path)
        lines = [k for k, _ in body]
        texts = [line for _, line in body]
        rows = [t.split() for t in texts] if separator is None else list(csv.reader(texts, delimiter=separator))
        if not rows:
            raise RecordingError(path, "", "no rows of numbers", "record or copy it again")
        for k, row in zip(lines, rows, strict=False):
            if len(row) != len(names):
                hint = f"expected: {' '.join(names)}"
                if separator == "," and len(names) < len(row) <= 2 * len(names) and all(map(_whole, row)):
                    hint = "decimal commas? Write numbers with a point, or separate columns by ;"
                elif k == lines[-1]:
                    hint = "the file looks cut off: copy it again"
                raise RecordingError(path, f"line {k}", f"{len(row)} columns where {len(names)} are expected", hint)
        if len(rows) != len(lines):
            raise RecordingError(path, "", "a quoted cell runs over several lines", "keep each row on one line")
        return cls(path, names, lines, [list(c) for c in zip(*rows, strict=True)])

    def place(self, columns: list[str], index: int) -> str:
        """Name row `index` and columns the way a reader finds them in the file."""
        return f"line {self.lines[index]}, {'column' if len(columns) == 1 else 'columns'} {' '.join(columns)}"

    def as_numbers(self, columns: list[str]) -> NDArray[np.float64]:
        """Return columns as floats, shape (N, len(columns)); an empty cell is NaN."""
        return np.array([self._convert(c, _float, "a number") for c in columns], dtype=np.float64).T

    def integers(self, column: str) -> NDArray[np.int64]:
        """Return a column of integers, exact beyond 2**53."""
        return np.array(self._convert(column, _int64, "an integer"), dtype=np.int64)

    def _convert(self, column: str, convert: Callable[[str], T], wanted: str) -> list[T]:
        values: list[T] = []
        for k, cell in enumerate(self.cells[self.names.index(column)]):
            try:
                values.append(convert(cell.strip()))
            except ValueError:
                place, hint = self.place([column], k), _fix(cell.strip())
                raise RecordingError(self.path, place, f"{cell!r} is not {wanted}", hint) from None
        return values


def _fix(cell: str) -> str:
    """Return how to fix a cell that is no number."""
    if DATE.fullmatch(cell):
        return "a date: give numbers instead, seconds, or ns, us or ms with the unit in the column's name, as t_ns"
    if DECIMAL_COMMA.fullmatch(cell):
        return "a decimal comma: write numbers with a point, throughout the file"
    return "correct the cell"


def _whole(cell: str) -> bool:
    return cell.strip().lstrip("+-").isdigit()


def _float(cell: str) -> float:
    return float(cell) if cell else math.nan


def _int64(cell: str) -> int:
    value = int(cell)
    if not -(2**63) <= value < 2**63:
        raise ValueError
    return value
