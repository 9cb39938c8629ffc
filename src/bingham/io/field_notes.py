"""Axes as field books have them: N45E, 30SE, 252/64, 64→252, degree signs, a column of quadrants, remarks beside them.

What is ambiguous is not guessed: a strike by quadrants needs the side to which the plane dips, a pair 252/64 the name
of what it is.
"""

from __future__ import annotations

import csv
import re
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError, Setting
from bingham.io.angles import ANGLES, AngleKind, recognised
from bingham.io.text import TextFile

__all__ = ["FieldNotes", "read_field_notes"]

NUMBER = r"[-+]?\d+(?:[.,]\d+)?"
DEGREE = r"\s*(?:°|º|deg)?\s*"
PLAIN = re.compile(rf"({NUMBER})")
SIGNED = re.compile(rf"({NUMBER})\s*(?:°|º|deg)")
QUADRANT = re.compile(rf"([NS])\s*({NUMBER}){DEGREE}([EW])", re.IGNORECASE)
SIDED = re.compile(rf"({NUMBER}){DEGREE}(N|NE|E|SE|S|SW|W|NW)", re.IGNORECASE)
SIDE = re.compile(r"N|NE|E|SE|S|SW|W|NW", re.IGNORECASE)
PAIR = re.compile(rf"({NUMBER}){DEGREE}(/|→|->|>)\s*({NUMBER}){DEGREE}")
SIDES = {name: 45.0 * k for k, name in enumerate(("N", "NE", "E", "SE", "S", "SW", "W", "NW"))}
COMMENTS = ("#", "%", "//")
# A letter this close to the strike does not say to which side a plane dips.
ALONG = np.cos(np.radians(70.0))


class FieldNotes(NamedTuple):
    """Kind of the angles and their numbers (N, k), and the line of each row."""

    kind: AngleKind
    values: NDArray[np.float64]
    lines: list[int]


class Cell(NamedTuple):
    """What a cell says: numbers, and the letters of a side; `plain` if it is a bare number."""

    numbers: tuple[float, ...]
    side: float | None
    plain: bool
    arrow: bool = False


def read_field_notes(
    text: TextFile, columns: list[str] | None, kind: AngleKind | None, *, plain: bool = False
) -> FieldNotes | None:
    """Return the angles of a file in a notation of field books, None if it has none.

    With ``plain`` a table whose columns of angles are bare numbers will do too, with any remarks beside them.

    Raises
    ------
    RecordingError
        If a cell is no angle, or the notation leaves open what is meant, naming the line.
    """
    table = _rows(text)
    if len(table) < 2:
        return None
    names: list[str] = []
    if all(_cell(cell) is None for cell in table[0][1]):
        names, table = [cell.strip() for cell in table[0][1]], table[1:]
    elif (above := _commented(text, table[0])) is not None:
        names = above
    width = min(len(cells) for _, cells in table)
    cells = [[_cell(row[k]) for _, row in table] for k in range(width)]
    lines = [line for line, _ in table]
    sides = next((k for k in range(width) if all(_is_side(row[k]) for _, row in table)), None)
    found = recognised([_name(name) for name in names]) if names else None
    if columns is not None:
        chosen = recognised([_name(name) for name in columns])
        found = None if chosen is None else (chosen[0], [names.index(columns[k]) for k in chosen[1]], chosen[2])
    at = found[1] if found is not None else [k for k in range(width) if cells[k][0] is not None]
    at = [k for k in at if k < width]
    notation = sides is not None or any(c is not None and not c.plain for k in at for c in cells[k])
    if not (notation or (plain and found is not None)) or (found is not None and found[2]):
        return None
    kind = kind or (None if found is None else found[0])
    if len(at) == 1 and (pairs := [c for c in cells[at[0]] if c is not None and len(c.numbers) == 2]):
        kind = kind or _kind_of_pair(text, names[at[0]] if at[0] < len(names) else "", pairs[0], lines[0])
        return FieldNotes(kind, _complete(text, lines, [at[0]], cells, 2), lines)
    if kind is None:
        quadrants = at and any(c is not None and not c.plain and len(c.numbers) == 1 for c in cells[at[0]])
        if len(at) != 2 or not quadrants or not any(c is not None and c.side is not None for c in cells[at[1]]):
            return None
        kind = ANGLES["strike-dip"]
    if len(at) != len(kind.columns):
        return None
    values = _complete(text, lines, at, cells, len(at))
    if kind.name == "strike-dip":
        values[:, 0] = _right_hand(text, table, at, cells, values[:, 0], sides)
    return FieldNotes(kind, values, lines)


def _rows(text: TextFile) -> list[tuple[int, list[str]]]:
    lines = [(k, line) for k, line in text.head if not line.lstrip().startswith(COMMENTS)]
    some = [line for _, line in lines[1:6]]
    mark = next((m for m in ("\t", ";", ",") if some and all(m in line for line in some)), None)
    try:
        if mark is None:
            pairs = any(PAIR.fullmatch(line.strip()) for line in some)
            return [(k, [line] if pairs else line.split()) for k, line in lines]
        return [(k, next(csv.reader([line], delimiter=mark))) for k, line in lines]
    except (csv.Error, StopIteration):
        return []


def _commented(text: TextFile, first: tuple[int, list[str]]) -> list[str] | None:
    """Return the names in a comment right above the first row, None if none stand there."""
    line = next((line for k, line in reversed(text.head) if k < first[0]), "")
    if not line.lstrip().startswith(COMMENTS):
        return None
    said = line.strip().lstrip("#%/ ")
    names = next(
        (cells for mark in ("\t", ";", ",", None) if len(cells := said.split(mark)) == len(first[1])), list[str]()
    )
    return [name.strip() for name in names] if recognised([_name(name) for name in names]) is not None else None


def _name(name: str) -> str:
    """Return a heading without what only says which convention it follows."""
    return re.sub(r"[\s_(\[]*(rhr|right[-_ ]hand([-_ ]rule)?)[)\]]?$", "", name.strip(), flags=re.IGNORECASE)


def _is_side(cell: str) -> bool:
    return SIDE.fullmatch(cell.strip()) is not None


def _number(text: str) -> float:
    return float(text.replace(",", "."))


def _cell(cell: str) -> Cell | None:
    s = cell.strip()
    if found := PLAIN.fullmatch(s):
        return Cell((_number(found[1]),), None, True)
    if found := SIGNED.fullmatch(s):
        return Cell((_number(found[1]),), None, False)
    if found := QUADRANT.fullmatch(s):
        angle = _number(found[2])
        if not 0.0 <= angle <= 90.0:
            return None
        north, east = found[1].upper() == "N", found[3].upper() == "E"
        azimuth = angle if north else 180.0 - angle
        return Cell(((azimuth if east else -azimuth) % 360.0,), None, False)
    if found := SIDED.fullmatch(s):
        return Cell((_number(found[1]),), SIDES[found[2].upper()], False)
    if found := PAIR.fullmatch(s):
        return Cell((_number(found[1]), _number(found[3])), None, False, found[2] != "/")
    return None


def _kind_of_pair(text: TextFile, name: str, pair: Cell, line: int) -> AngleKind:
    parts = [_name(part) for part in re.split(r"/|→|->", name) if part.strip()]
    found = recognised(parts) if len(parts) == 2 else None
    if found is not None and found[1] == [0, 1]:
        return found[0]
    if pair.arrow:
        return ANGLES["plunge-trend"]
    raise RecordingError(
        text.path,
        f"line {line}",
        "a pair of angles without a name",
        ("say what it is by ", Setting("angles"), ", as trend-plunge, strike-dip or dip-direction"),
    )


def _complete(
    text: TextFile, lines: list[int], at: list[int], cells: list[list[Cell | None]], size: int
) -> NDArray[np.float64]:
    """Return the numbers (N, size) of columns; a cell that is no angle raises."""
    out = np.empty((len(lines), size))
    for i, line in enumerate(lines):
        row: list[float] = []
        for k in at:
            cell = cells[k][i]
            if cell is None:
                raise RecordingError(text.path, f"line {line}, column {k + 1}", "no angle", "correct or remove the row")
            row.extend(cell.numbers)
        if len(row) != size:
            raise RecordingError(text.path, f"line {line}", f"{len(row)} angles, not {size}", "correct the row")
        out[i] = row
    return out


def _right_hand(
    text: TextFile,
    table: list[tuple[int, list[str]]],
    at: list[int],
    cells: list[list[Cell | None]],
    strike: NDArray[np.float64],
    sides: int | None,
) -> NDArray[np.float64]:
    """Return strikes (N,) from which the plane dips to the right, as the letters of its dip say."""
    out = strike.copy()
    for i, (line, row) in enumerate(table):
        first, second = cells[at[0]][i], cells[at[1]][i]
        side = SIDES[row[sides].strip().upper()] if sides is not None else second.side if second is not None else None
        if side is None:
            if first is not None and not first.plain and QUADRANT.fullmatch(row[at[0]].strip()):
                problem = f"strike {row[at[0]].strip()} without the side to which the plane dips"
                raise RecordingError(text.path, f"line {line}", problem, "write the dip as 30SE, or strikes by azimuth")
            continue
        toward = np.cos(np.radians(strike[i] + 90.0 - side))
        dip = second.numbers[0] if second is not None else 0.0
        if abs(toward) < ALONG and 0.0 < dip < 90.0:
            problem = "a plane that dips along its strike"
            raise RecordingError(text.path, f"line {line}", problem, "correct the strike or the side of the dip")
        out[i] = strike[i] if toward >= 0.0 else (strike[i] + 180.0) % 360.0
    return out
