"""Arrays of numbers from MATLAB's version 5 files (``-v6``, ``-v7``), each element checked before it is followed.

Only what is asked for is read: real arrays of numbers and booleans. Sizes that an element declares are compared with
those of the element around it, and what is compressed with `bingham.io.bounds`, before memory is taken. Source:
"MAT-File Format", The MathWorks, 2024, ch. 1.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError
from bingham.io.bounds import allowed, check_size

__all__ = ["read_mat5"]

HEADER = 128
MATRIX, COMPRESSED = 14, 15
# Types of elements that hold numbers → NumPy's, without byte order.
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
INT32, UINT32, INT8 = 5, 6, 1
NUMERIC_CLASSES = range(6, 16)  # double, single and integers; others hold cells, structures, text, objects
COMPLEX_FLAG = 0x0800


class Element(NamedTuple):
    """A data element: its type, the bytes of its data, and where the next one begins."""

    kind: int
    data: memoryview
    end: int


def read_mat5(path: Path, names: tuple[str, ...]) -> dict[str, NDArray[np.generic]]:
    """Return the named arrays that a file has, shaped as in MATLAB.

    Raises
    ------
    RecordingError
        If an element is not as it declares, one of the arrays is complex or holds no numbers, or too much is declared.
    """
    content = memoryview(path.read_bytes())
    if len(content) < HEADER:
        raise _damaged(path, "its header is cut off")
    order = {b"IM": "<", b"MI": ">"}.get(bytes(content[126:128]), "")
    version = int.from_bytes(content[124:126], "little" if order == "<" else "big")
    if not order or version != 0x0100:
        raise _damaged(path, "its header names neither byte order nor version 5")
    arrays: dict[str, NDArray[np.generic]] = {}
    unfolded = 0.0
    for element in _elements(path, content[HEADER:], order):
        data = element.data
        if element.kind == COMPRESSED:
            data = _inflated(path, data, unfolded)
            unfolded += len(data)
            inner = next(_elements(path, data, order), None)
            if inner is None or inner.kind != MATRIX:
                raise _damaged(path, "a compressed element holds no array")
            data = inner.data
        elif element.kind != MATRIX:
            continue
        found = _array(path, data, order, names)
        if found is not None:
            arrays[found[0]] = found[1]
    return arrays


def _elements(path: Path, content: memoryview, order: str) -> Iterator[Element]:
    """Yield the elements that follow each other, each within the bytes there are."""
    at = 0
    while len(content) - at >= 8:
        element = _element(path, content, at, order)
        yield element
        at = element.end
    if len(content) != at and any(content[at:]):
        raise _damaged(path, "it is cut off")


def _element(path: Path, content: memoryview, at: int, order: str) -> Element:
    if len(content) - at < 8:
        raise _damaged(path, "an element is cut off")
    first, second = np.frombuffer(content[at : at + 8], dtype=f"{order}u4").tolist()
    if first >> 16:  # small: type and size share four bytes
        size, kind = first >> 16, first & 0xFFFF
        if size > 4:
            raise _damaged(path, "an element's size contradicts its form")
        return Element(kind, content[at + 4 : at + 4 + size], at + 8)
    start, size = at + 8, int(second)
    if size > len(content) - start:
        raise _damaged(path, "an element is longer than what is left")
    padding = 0 if first == COMPRESSED else -size % 8
    return Element(first, content[start : start + size], min(start + size + padding, len(content)))


def _inflated(path: Path, data: memoryview, before: float) -> memoryview:
    limit = int(allowed(path) - before)
    engine = zlib.decompressobj()
    try:
        out = engine.decompress(data, max(limit, 0) + 1)
    except zlib.error as error:
        raise _damaged(path, f"compressed data: {error}") from None
    if len(out) > limit:
        check_size(path, "compressed data", before + len(out))
    if not engine.eof:
        raise _damaged(path, "compressed data are cut off")
    return memoryview(out)


def _array(path: Path, data: memoryview, order: str, names: tuple[str, ...]) -> tuple[str, NDArray[np.generic]] | None:
    """Return name and values of an array, None if it is none of those asked for."""
    flags = _element(path, data, 0, order)
    if flags.kind != UINT32 or len(flags.data) < 8:
        raise _damaged(path, "an array without flags")
    shape = _element(path, data, flags.end, order)
    if shape.kind != INT32 or len(shape.data) % 4 or not 8 <= len(shape.data) <= 4 * 32:
        if _class(flags, order) == 17:
            return None  # an opaque object has its name here
        raise _damaged(path, "an array without dimensions")
    name_element = _element(path, data, shape.end, order)
    name = bytes(name_element.data).decode("latin-1").rstrip("\0")
    if name_element.kind != INT8 or name not in names:
        return None
    kind = _class(flags, order)
    word = int(np.frombuffer(flags.data[:4], dtype=f"{order}u4")[0])
    if word & COMPLEX_FLAG:
        raise RecordingError(path, f"field {name}", "of complex numbers", "real numbers are expected")
    if kind not in NUMERIC_CLASSES:
        raise RecordingError(path, f"field {name}", "holds no array of numbers", "numbers are expected")
    lengths = np.frombuffer(shape.data, dtype=f"{order}i4").tolist()
    count = math.prod(lengths)
    values = _element(path, data, name_element.end, order)
    if min(lengths) < 0 or values.kind not in NUMBERS:
        raise _damaged(path, f"field {name} has no numbers")
    dtype = np.dtype(f"{order}{NUMBERS[values.kind]}")
    if count * dtype.itemsize != len(values.data):
        raise _damaged(path, f"field {name} declares {count} numbers and holds {len(values.data) // dtype.itemsize}")
    check_size(path, f"field {name}", 8.0 * count)
    return name, np.frombuffer(values.data, dtype=dtype).reshape(lengths, order="F")


def _class(flags: Element, order: str) -> int:
    return int(np.frombuffer(flags.data[:4], dtype=f"{order}u4")[0]) & 0xFF


def _damaged(path: Path, reason: str) -> RecordingError:
    return RecordingError(path, "", f"not a readable MATLAB file ({reason})", "copy or save it again")
