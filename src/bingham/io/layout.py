"""Where the table of a text file begins, what separates its cells, and what its columns are called.

Loggers write preambles, comments, a row of units below the names, or no names at all. The table begins where lines of
as many cells each, most of them numbers, follow each other; its names stand above.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from dataclasses import dataclass, field, replace

from bingham.errors import RecordingError
from bingham.io.dates import is_date
from bingham.io.text import TextFile

__all__ = ["COMMENTS", "NUMBER", "Layout", "find_layout", "is_number", "split_cells", "without_copies"]

COMMENTS = ("#", "//", "%")
NUMBER = re.compile(r"[-+]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][-+]?\d+)?", re.ASCII)
COMMA_NUMBER = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?", re.ASCII)
NOTHING = {"", "nan", "null", "none", "na", "n/a", "-nan", "inf", "-inf", "true", "false"}
SEPARATORS = (",", ";", "\t", "|", None)
LINES = 400  # within which a table begins
ROWS = 3  # that are alike make a table, fewer at the end of a file
LONGEST_CELL = 65_536


@dataclass(frozen=True, slots=True)
class Layout:
    """How a text file keeps its table.

    Parameters
    ----------
    separator : str or None
        Between cells; None: white space.
    decimal : {".", ","}
        Decimal mark.
    names : list of str
        What the file calls its columns; empty where it does not say.
    units : list of str
        What a row of units below the names says; empty without.
    header : int
        Line of the names, 0 without.
    first : int
        Line of the first row.
    width : int
        Cells in a row.
    preamble : list of str
        Lines above the names, and comments.
    fits : bool
        Whether there are as many names as cells in the first row.
    """

    separator: str | None
    decimal: str
    names: list[str]
    units: list[str]
    header: int
    first: int
    width: int
    preamble: list[str] = field(default_factory=list[str])
    fits: bool = True


def split_cells(line: str, separator: str | None) -> list[str]:
    """Return the cells of a line, stripped of white space and quotes; a lone cell if its quotes do not match."""
    if separator is None:
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    except (csv.Error, StopIteration):
        return [line]


def find_layout(text: TextFile) -> Layout:
    """Find the table of a text file.

    Raises
    ------
    RecordingError
        If no lines of it look like the rows of one.
    """
    lines = text.head[:LINES]
    if lines[0][1].lower().startswith("sep="):  # what spreadsheets and Shimmer write
        given = lines[0][1][4:].strip(' "').replace("\\t", "\t") or "\t"
        found = _table(lines[1:], given[:1], text.complete)
        candidates = [found] if found else []
    else:
        found = [_table(lines, s, text.complete) for s in SEPARATORS]
        candidates = [table for table in found if table is not None]
        candidates = [table for table in candidates if table.width > 1] or candidates
    start = lines[0][1].lstrip()[:1]
    document = start == "{" or lines[0][1].lstrip()[:2] in ("[[", "[{") or lines[0][1].strip() == "["
    if not candidates or document:
        problem = "only comments in it" if all(_is_comment(line) for _, line in lines) else "no rows of numbers"
        what = {"{": "JSON", "[": "JSON", "<": "markup"}.get(start)
        hint = f"{what}? A table" if what else "a table"
        raise RecordingError(text.path, "", problem, f"{hint} is expected, one sample a line")
    return max(candidates, key=_credibility)


def _credibility(layout: Layout) -> tuple[bool, bool, int]:
    return layout.fits, bool(layout.names), layout.width


def without_copies(text: TextFile, layout: Layout) -> Layout:
    """Return the layout without the names of columns that repeat another of the same name, cell by cell so far."""
    copies = {k for k, name in enumerate(layout.names) if name and name in layout.names[:k]}
    if not copies:
        return layout
    body = [split_cells(line, layout.separator) for number, line in text.head if number >= layout.first]
    rows = [row for row in body if len(row) >= len(layout.names)]
    same = {k for k in copies if rows and all(row[k] == row[layout.names.index(layout.names[k])] for row in rows)}
    return replace(layout, names=["" if k in same else name for k, name in enumerate(layout.names)])


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(COMMENTS)


def is_number(cell: str, *, comma: bool) -> bool:
    """Whether a cell holds a number, or what stands in its place where there is none."""
    return cell.lower() in NOTHING or bool(
        NUMBER.fullmatch(cell) if comma else NUMBER.fullmatch(cell) and "," not in cell
    )


def _is_row(cells: list[str], separator: str | None) -> bool:
    """Whether cells look like samples: one cell or more is a number or date, and at most half are words."""
    if separator is None and not {",", ";", "|"}.isdisjoint(cells):
        return False  # separators with spaces around
    numbers = [is_number(c, comma=separator != ",") or is_date(c) for c in cells]
    said = [good for good, c in zip(numbers, cells, strict=True) if c.lower() not in NOTHING]
    return bool(said) and any(said) and 2 * sum(numbers) >= len(cells)


def _table(lines: list[tuple[int, str]], separator: str | None, complete: bool) -> Layout | None:
    body = [(k, split_cells(line, separator)) for k, (_, line) in enumerate(lines) if not _is_comment(line)]
    # Nothing but separators, or NaN, is neither a row to begin with nor names.
    body = [(k, row) for k, row in body if any(cell.lower() not in NOTHING for cell in row)]
    cells = [row for _, row in body]
    alike = [len(c) > (separator is not None) and _is_row(c, separator) for c in cells]
    widths = Counter(len(c) for c, good in zip(cells, alike, strict=True) if good)
    if not widths:
        return None
    usual = max(widths.values())
    places = [place for place, _ in body]
    found = [
        _layout(lines, places, cells, alike, _first(cells, alike, width, complete), separator)
        for width, count in widths.items()
        if count == usual
    ]
    return max(found, key=_credibility)


def _first(cells: list[list[str]], alike: list[bool], width: int, complete: bool) -> int:
    """Return the first of the rows of a width that others like it follow, or else the first at all."""
    rows = [k for k, c in enumerate(cells) if alike[k] and len(c) == width]
    for k in rows:
        following = range(k, min(k + ROWS, len(cells)))
        if (len(following) == ROWS or complete) and all(len(cells[i]) == width for i in following):
            return k
    return rows[0]


def _layout(
    lines: list[tuple[int, str]],
    at: list[int],
    cells: list[list[str]],
    alike: list[bool],
    k: int,
    separator: str | None,
) -> Layout:
    """Make the layout of a table whose first row is the k-th line that is no comment."""
    width = len(cells[k])
    names, units, header = _names(lines, at, cells, alike, k, width, separator)
    width = len(names) or width
    decimal = "."
    if separator != ",":
        sample = [cell for row in cells[k : k + 100] if len(row) == width for cell in row]
        if any(COMMA_NUMBER.fullmatch(cell) for cell in sample) and not any(
            re.fullmatch(r"-?\d*\.\d+", c) for c in sample
        ):
            decimal = ","
    top = next((i for i, (number, _) in enumerate(lines) if number == header), at[k])
    preamble = [line for line in (line for _, line in lines[: at[k]]) if line != (lines[top][1] if header else None)]
    fits = width == len(cells[k])
    return Layout(separator, decimal, names, units, header, lines[at[k]][0], width, preamble, fits)


def _names(
    lines: list[tuple[int, str]],
    at: list[int],
    cells: list[list[str]],
    alike: list[bool],
    k: int,
    width: int,
    separator: str | None,
) -> tuple[list[str], list[str], int]:
    """Return the names above the table, units between, and the line of the names: 0 if there are none."""
    above = [(lines[at[i]][0], cells[i]) for i in range(max(k - 2, 0), k) if not alike[i]]
    above = [(number, row) for number, row in above if _fits(row, width)]
    if len(above) == 2 and _are_units(above[1][1]) and not _are_units(above[0][1]):
        return _fitted(above[0][1], width), _fitted(above[1][1], width), above[0][0]
    if above and k and above[-1][0] == lines[at[k - 1]][0]:
        names = _fitted(above[-1][1], width)
        if len(above) == 2 and len(set(names)) < len(names):
            names = _grouped(_fitted(above[0][1], width), names)
        return names, [], above[-1][0]
    direct = cells[k - 1] if k and not alike[k - 1] else []
    if len(direct) > 2 and 2 * len(direct) >= width and not any(NUMBER.fullmatch(c) for c in direct):
        return direct, [], lines[at[k - 1]][0]  # names, but not as many as cells: the reader of rows says so
    # A comment right above may hold the names: "#timestamp [ns],…", "%time,field.…".
    for number, line in reversed(lines[: at[k]]):
        if not _is_comment(line):
            break
        row = split_cells(line.strip().lstrip("#/% "), separator)
        sentence = separator is None and not re.match(
            r"t(ime|imestamp)?(?![a-z])", row[0] if row else "", re.IGNORECASE
        )
        distinct = len(set(row)) == len(row) > 1 and not any(NUMBER.fullmatch(c) for c in row)
        if _fits(row, width) and distinct and not sentence:
            return _fitted(row, width), [], number
    return [], [], 0


def _grouped(groups: list[str], names: list[str]) -> list[str]:
    """Return names that stand in two rows, "Gyroscope (deg/s),,," over "X,Y,Z,", in one: "Gyroscope X (deg/s)"."""
    from bingham.io.units import bracketed

    found: list[str] = []
    above = ""
    for group, name in zip(groups, names, strict=True):
        above = group or above
        text, unit = bracketed(above)
        if _are_units([name]):
            text, name, unit = text, "", name
        found.append(" ".join(part for part in (text, name, f"({unit})" if unit else "") if part))
    return found


def _fits(row: list[str], width: int) -> bool:
    """Whether names are as many as cells; one of them may end in a separator too many."""
    return len(row) == width or (len(row) == width + 1 and not row[-1]) or (0 < len(row) == width - 1 and bool(row[-1]))


def _fitted(row: list[str], width: int) -> list[str]:
    return [*row, ""][:width]


def _are_units(row: list[str]) -> bool:
    """Whether a row below the names holds units: known ones, most of them."""
    from bingham.io.units import UNITS, spelled

    known = {unit for units in UNITS.values() for unit in units} | {"no_units", "", "%", "c", "hz", "mv", "kpa", "degc"}
    cells = [re.sub(r"^[\[(]|[\])]$", "", cell) for cell in row]
    return any(cells) and 2 * sum(spelled(c) in known or c.lower().startswith("yyyy") for c in cells) > len(cells)
