"""Point clouds of the formats that scanners and robots write: PCD (Point Cloud Library) and PLY (Stanford)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError
from bingham.io.bounds import check_size

__all__ = ["read_pcd", "read_ply"]

FloatArray = NDArray[np.float64]
AXES = ("x", "y", "z")
# Longest header that is looked for.
HEADER_LINES, LINE_BYTES = 1000, 4096
# Numbers in a field of one point, at most.
MOST_REPEATS = 100_000
PCD_TYPES = {f"{t}{n}": f"<{t.lower()}{n}" for t, sizes in (("F", "48"), ("I", "1248"), ("U", "1248")) for n in sizes}
PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8", "bool": "u1",
}  # fmt: skip


def read_pcd(path: Path) -> FloatArray:
    """Return x, y, z of a PCD file, shape (HEIGHT, WIDTH, 3), or (n, 3) where HEIGHT is 1 (a loose cloud).

    Data may be ``ascii``, ``binary`` or ``binary_compressed``.
    """
    with path.open("rb") as file:
        header, kind = _pcd_header(path, file)
        names = header.get("FIELDS", header.get("COLUMNS", []))
        if "WIDTH" not in header:  # older files say POINTS alone
            header |= {"WIDTH": header.get("POINTS", []), "HEIGHT": ["1"]}
        width, height = (_count(path, header, name) for name in ("WIDTH", "HEIGHT"))
        if "POINTS" in header and _count(path, header, "POINTS") != width * height:
            said = f"POINTS {header['POINTS'][0]}, WIDTH {width}, HEIGHT {height}"
            raise RecordingError(path, "header", said, "POINTS is WIDTH times HEIGHT")
        try:
            repeats = [int(c) for c in header.get("COUNT", ["1"] * len(names))]
            kinds = [PCD_TYPES[t + s] for t, s in zip(header["TYPE"], header["SIZE"], strict=True)]
            if not all(0 < c <= MOST_REPEATS for c in repeats):
                raise ValueError
            fields = zip(names, kinds, repeats, strict=True)
            layout = np.dtype([(f"{k} {name}", kind, (c,)) for k, (name, kind, c) in enumerate(fields)])
        except (KeyError, ValueError) as error:
            raise RecordingError(path, "", "a header whose FIELDS, SIZE, TYPE and COUNT do not go together") from error
        columns = [f"{names.index(a)} {a}" if a in names else "" for a in AXES]
        if not all(columns):
            raise _without_points(path, names)
        points = width * height
        check_size(path, "points", float(points * layout.itemsize))
        if kind == "ascii":
            starts = np.cumsum([0, *repeats])
            places = [int(starts[names.index(a)]) for a in AXES]
            values = _rows(path, file, points, places)
        elif kind == "binary":
            rows = np.frombuffer(_exactly(path, file, points * layout.itemsize), dtype=layout)
            values = np.stack([rows[c][:, 0] for c in columns], axis=1).astype(np.float64)
        elif kind == "binary_compressed":
            values = _compressed(path, file, layout, columns, points)
        else:
            raise RecordingError(path, "", f"DATA {kind}", "ascii, binary and binary_compressed are read")
    return values.reshape(height, width, 3) if height > 1 and width > 1 else values


def _pcd_header(path: Path, file: BinaryIO) -> tuple[dict[str, list[str]], str]:
    header: dict[str, list[str]] = {}
    for line in _header_lines(path, file):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        header[words[0].upper()] = words[1:]
        if words[0].upper() == "DATA":
            return header, (words[1] if len(words) > 1 else "").lower()
    raise RecordingError(path, "", "no header of a PCD file", "it ends with a line DATA")


def _count(path: Path, header: dict[str, list[str]], name: str) -> int:
    words = header.get(name, [])
    if len(words) != 1 or not words[0].isdecimal():
        raise RecordingError(path, "header", f"{name} {' '.join(words)}", "a number of points is meant")
    return int(words[0])


def _compressed(path: Path, file: BinaryIO, layout: np.dtype, columns: list[str], points: int) -> FloatArray:
    """Return x, y, z (n, 3) of fields stored one after another and packed by LZF (liblzf's format)."""
    packed, size = (int(n) for n in np.frombuffer(_exactly(path, file, 8), dtype="<u4"))
    if size != points * layout.itemsize:
        raise RecordingError(path, "", f"{size} bytes unpacked", f"{points} points have {points * layout.itemsize}")
    data = _unpacked(path, _exactly(path, file, packed), size)
    values, start = np.empty((points, 3)), 0
    for name in layout.names or ():
        field = layout[name]
        if name in columns:
            one = np.frombuffer(data, dtype=field.base, count=points * field.shape[0], offset=start)
            values[:, columns.index(name)] = one.reshape(points, -1)[:, 0]
        start += points * field.itemsize
    return values


def _unpacked(path: Path, data: bytes, size: int) -> bytes:
    """Return what LZF packed: runs of literals, and repetitions of what came up to 8 kB before."""
    out = bytearray()
    at, end = 0, len(data)
    try:
        while at < end:
            control = data[at]
            at += 1
            if control < 32:
                out += data[at : at + control + 1]
                at += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += data[at]
                at += 1
            back = ((control & 31) << 8) + data[at] + 1
            at += 1
            length += 2
            start = len(out) - back
            if start < 0 or len(out) + length > size:
                raise IndexError
            if back >= length:
                out += out[start : start + length]
            else:  # a repetition of what it itself writes
                piece = bytes(out[start:])
                out += (piece * (length // back + 1))[:length]
    except IndexError:
        out.clear()
    if len(out) != size:
        raise RecordingError(path, "", "compressed points that do not unpack: the file is damaged", "copy it anew")
    return bytes(out)


class _Element(NamedTuple):
    """Of a PLY file: number of rows, and (type, name) of each property; the type of a list is empty."""

    name: str
    rows: int
    properties: list[tuple[str, str]]


def read_ply(path: Path) -> FloatArray:
    """Return x, y, z (n, 3) of the vertices of a PLY file, ASCII or binary."""
    with path.open("rb") as file:
        order, elements = _ply_header(path, file)
        for element in elements:
            lists = [name for kind, name in element.properties if not kind]
            if element.name == "vertex":
                break
            if order and lists:
                raise RecordingError(
                    path, "", f"lists of {element.name} before the vertices", "store the vertices first"
                )
            if order:
                _exactly(path, file, element.rows * _ply_layout(element, order).itemsize)
            else:
                for _ in _lines(path, file, element.rows):
                    pass
        else:
            raise _without_points(path, [element.name for element in elements])
        names = [name.lower() for _, name in element.properties]
        if not all(a in names for a in AXES):
            raise _without_points(path, names)
        if lists:
            raise RecordingError(
                path, "header", f"vertices with a list, {lists[0]}", "numbers alone are read: leave it out"
            )
        columns = [names.index(a) for a in AXES]
        check_size(path, "vertices", 8.0 * len(names) * element.rows)
        if not order:
            return _rows(path, file, element.rows, columns)
        layout = _ply_layout(element, order)
        rows = np.frombuffer(_exactly(path, file, element.rows * layout.itemsize), dtype=layout)
        return np.stack([rows[f"{k}"] for k in columns], axis=1).astype(np.float64)


def _ply_layout(element: _Element, order: str) -> np.dtype:
    # Fields by their place: names of damaged files come twice.
    return np.dtype([(f"{k}", order + kind) for k, (kind, _) in enumerate(element.properties)])


def _ply_header(path: Path, file: BinaryIO) -> tuple[str, list[_Element]]:
    """Return the order of bytes ("" for ASCII) and the elements."""
    lines = _header_lines(path, file)
    orders = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
    order: str | None = None
    elements: list[_Element] = []
    if next(lines, "").strip() != "ply":
        raise RecordingError(path, "", "not a PLY file", "its first line is ply")
    for number, line in enumerate(lines, 2):
        words = line.split() or [""]
        try:
            if words[0] == "end_header":
                if order is None:
                    break
                return order, elements
            if words[0] == "format":
                order = orders[words[1]]
            elif words[0] == "element":
                if not words[2].isdecimal():
                    raise ValueError
                elements.append(_Element(words[1], int(words[2]), []))
            elif words[0] == "property":
                kind = "" if words[1] == "list" else PLY_TYPES[words[1]]
                elements[-1].properties.append((kind, words[-1]))
        except (IndexError, KeyError, ValueError) as error:
            raise RecordingError(path, f"line {number}", f"{line.strip()!r}", "no line of a PLY header") from error
    raise RecordingError(path, "", "no header of a PLY file", "it has a line format and ends with end_header")


def _header_lines(path: Path, file: BinaryIO) -> Iterator[str]:
    for _ in range(HEADER_LINES):
        line = file.readline(LINE_BYTES)
        if not line:
            return
        yield line.decode("ascii", errors="replace")


def _exactly(path: Path, file: BinaryIO, size: int) -> bytes:
    here = file.tell()
    there = path.stat().st_size - here
    data = file.read(size) if 0 <= size <= there else b""
    if len(data) != size:
        raise RecordingError(path, "", f"{there} bytes of data", f"{size} bytes by its header: the file is cut off")
    return data


def _lines(path: Path, file: BinaryIO, count: int) -> Iterator[bytes]:
    """Yield the next `count` lines that are not empty."""
    left = count
    while left > 0:
        line = file.readline()
        if not line:
            raise RecordingError(path, "", f"{count - left} rows", f"{count} by its header: the file is cut off")
        if line.strip():
            left -= 1
            yield line


def _rows(path: Path, file: BinaryIO, count: int, columns: list[int]) -> FloatArray:
    """Return some columns (count, 3) of the next rows of numbers."""
    if not count:
        return np.empty((0, 3))
    try:
        return np.loadtxt(_lines(path, file, count), usecols=columns, ndmin=2, comments=None)
    except ValueError as error:
        raise RecordingError(path, "data", str(error), "rows of numbers as the header has them") from error


def _without_points(path: Path, names: list[str]) -> RecordingError:
    return RecordingError(
        path, "header", f"no x, y, z among {' '.join(names) or 'nothing'}", "a cloud of points is meant"
    )
