"""Columns of a text file by fast parsers, which take a subset of what the careful one takes, to the same numbers.

pyarrow's, of the extra ``io``, or NumPy's. Both go through the file once and keep no more of it than a block.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import islice
from typing import Any

import numpy as np

from bingham.io.careful import numbered_rows
from bingham.io.layout import Layout
from bingham.io.text import LONGEST_LINE, TextFile

__all__ = ["StumbledError", "by_arrow", "by_numpy"]

BLOCK = 1024 * 1024  # bytes that are parsed at once; longer than any line
LINES = 50_000  # the same for NumPy


class StumbledError(Exception):
    """The parser met something unusual after what it has yielded."""


def by_arrow(text: TextFile, layout: Layout, kinds: dict[int, str], *, threads: int = 1) -> Iterator[dict[int, Any]]:
    """Yield columns block by block, read by pyarrow, some blocks ahead in so many threads if there are more than one.

    Raises
    ------
    StumbledError
        If it is not installed or meets anything unusual.
    """
    separator = layout.separator or _lone_separator(text, layout)
    if separator is None:
        raise StumbledError
    try:
        import pyarrow as pa
        from pyarrow import csv as reader
    except ImportError:
        raise StumbledError from None
    types = {"number": pa.float64(), "integer": pa.int64(), "word": pa.string()}
    quoted = any('"' in line for _, line in text.head)  # quotes further down make it fail, and the careful one read
    names = [str(k) for k in range(layout.width)]
    parsing = reader.ParseOptions(delimiter=separator, quote_char='"' if quoted else False)
    conversion = reader.ConvertOptions(
        column_types={str(k): types[kind] for k, kind in kinds.items()},
        include_columns=[str(k) for k in kinds],
        null_values=[""],  # each further word slows the parser down; nan is a number to it
        decimal_point=layout.decimal,
        check_utf8="word" in kinds.values(),
    )

    def parsed(place: tuple[int, int]) -> dict[int, Any] | None:
        begin, end = place
        with text.path.open("rb") as file:
            file.seek(begin)
            block = file.read(end - begin)
        if block.isspace():
            return None
        reading = reader.ReadOptions(
            use_threads=False,
            block_size=len(block) + 1,
            skip_rows=0 if begin else layout.first - 1,
            column_names=names,
        )
        try:
            table = reader.read_csv(pa.py_buffer(block), reading, parsing, conversion)
        except (pa.ArrowException, UnicodeDecodeError):
            raise StumbledError from None
        columns = {k: v.chunk(0) for k, v in zip(kinds, table.columns, strict=True)}
        if any(columns[k].null_count for k, kind in kinds.items() if kind == "integer"):
            raise StumbledError
        return {k: v.to_pylist() if kinds[k] == "word" else _array(v) for k, v in columns.items()}

    try:
        yield from filter(None, _ahead(parsed, _blocks(text), threads))
    except OSError:
        raise StumbledError from None


def _blocks(text: TextFile) -> Iterator[tuple[int, int]]:
    """Yield where blocks of whole lines begin and end, each about as many bytes as are parsed at once."""
    size = text.path.stat().st_size
    begin = 0
    with text.path.open("rb") as file:
        while begin < size:
            file.seek(begin + BLOCK)
            if not file.readline(LONGEST_LINE).endswith(b"\n") and file.tell() < size:
                raise StumbledError
            end = min(file.tell(), size)
            yield begin, end
            begin = end


def _ahead(function: Callable[[Any], Any], items: Iterable[Any], threads: int) -> Iterator[Any]:
    """Yield a function of items in their order, those that follow being worked on in threads of their own."""
    if threads == 1:
        yield from map(function, items)
        return
    waiting: deque[Future[Any]] = deque()
    with ThreadPoolExecutor(threads) as pool:
        for item in items:
            waiting.append(pool.submit(function, item))
            if len(waiting) > threads:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


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


def by_numpy(text: TextFile, layout: Layout, kinds: dict[int, str]) -> Iterator[dict[int, Any]]:
    """Yield columns of numbers with decimal points, read by NumPy; other columns and what is unusual it leaves alone.

    Raises
    ------
    StumbledError
        As above.
    """
    if layout.decimal != "." or set(kinds.values()) != {"number"}:
        raise StumbledError
    lines = (line for _, line in numbered_rows(text, layout))
    try:
        while batch := list(islice(lines, LINES)):
            rows = np.loadtxt(batch, delimiter=layout.separator, comments=None, ndmin=2, quotechar='"')
            if rows.shape != (len(batch), layout.width):
                raise StumbledError
            yield {k: rows[:, k] for k in kinds}
    except ValueError:
        raise StumbledError from None
