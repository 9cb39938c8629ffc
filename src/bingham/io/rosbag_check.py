"""What a bag may be before its reader sees it: its files inside it, and nothing that unfolds beyond plausible sizes.

Formats: https://wiki.ros.org/Bags/Format/2.0 (records of header and data; a chunk holds compressed messages),
https://mcap.dev/spec (records of opcode and length; chunks declare their uncompressed size), rosbag2's metadata.yaml.
"""

from __future__ import annotations

import bz2
import re
import sqlite3
import struct
from collections.abc import Iterator
from contextlib import closing
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO
from urllib.parse import quote

from bingham.errors import RecordingError
from bingham.io.bounds import allowed, check_size
from bingham.io.checks import optional_module

__all__ = ["check_bag"]

LONGEST_METADATA = 4_000_000  # bytes
ROS1 = b"#ROSBAG V2.0\n"
MCAP = b"\x89MCAP0\r\n"
MCAP_CHUNK = 0x06
ANCHOR = re.compile(r"(?:^|[\s\[{,:-])[&*][^\s,\]}]", re.MULTILINE)
ENTRY = re.compile(r"^\s*-\s*(?:path:\s*)?(.+?)\s*$", re.MULTILINE)


def check_bag(path: Path) -> None:
    """Raise an error if a bag names files outside itself, or unfolds to more than is allowed.

    Raises
    ------
    RecordingError
        If so, or if its records are longer than its file.
    """
    if path.is_dir():
        for file in _files_of(path):
            _check_file(file)
        if re.search(r"compression_mode:\s*[\"']?message", _metadata(path), re.IGNORECASE):
            for file in _files_of(path):
                _check_messages(file)
    else:
        _check_file(path)


def _metadata(folder: Path) -> str:
    return (folder / "metadata.yaml").read_text(encoding="utf-8")


def _check_messages(path: Path) -> None:
    """Unfold the compressed messages of an SQLite bag, each as far as it may."""
    try:
        with closing(sqlite3.connect(f"file:{quote(str(path))}?mode=ro", uri=True)) as database:
            for (data,) in database.execute("SELECT data FROM messages"):
                _check_unfolded(path, "a message", b"zstd", bytes(data))
    except (sqlite3.Error, TypeError) as error:
        raise RecordingError(path, "", f"damaged messages ({error})"[:160], "copy the bag again") from None


def _check_unfolded(path: Path, what: str, kind: bytes, data: bytes) -> None:
    """Unfold compressed data as far as they may, without keeping them; a size that they declare may be wrong."""
    limit = int(allowed(path))
    total = 0
    try:
        while data:
            engine = _engine(kind)
            if engine is None:
                return
            total += len(engine.decompress(data, limit - total + 1))
            check_size(path, what, float(total))
            if not engine.eof:
                return
            data = engine.unused_data
    except RecordingError:
        raise
    except Exception as error:  # the engines raise whatever they stumble over
        raise RecordingError(path, "", f"{what} is damaged ({error})"[:160], "copy the bag again") from None


def _engine(kind: bytes) -> Any:
    if kind == b"bz2":
        return bz2.BZ2Decompressor()
    if kind == b"lz4":
        return optional_module("lz4.frame", "reading ROS bags").LZ4FrameDecompressor()
    return _zstd().ZstdDecompressor() if kind == b"zstd" else None


def _zstd() -> Any:
    """Return Python's own module from 3.14 on, before the one that rosbags brings."""
    try:
        return import_module("compression.zstd")
    except ImportError:
        return optional_module("backports.zstd", "reading ROS bags")


def _files_of(folder: Path) -> list[Path]:
    """Return the files that a ROS 2 bag names, all of them in its folder."""
    metadata = folder / "metadata.yaml"
    if not metadata.is_file():
        raise RecordingError(folder, "", "no metadata.yaml of a ROS 2 bag in it", "give the folder of a bag")
    if metadata.stat().st_size > LONGEST_METADATA:
        raise RecordingError(metadata, "", "larger than any metadata of a bag", "copy the bag again")
    try:
        text = metadata.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise RecordingError(metadata, f"byte {error.start}", "not UTF-8 text", "copy the bag again") from None
    if ANCHOR.search(text):
        raise RecordingError(metadata, "", "refers to itself by anchors", "write plain metadata: ros2 bag reindex")
    files: list[Path] = []
    for name in _named(text):
        file = folder / name
        inside = file.resolve().is_relative_to(folder.resolve())
        if not inside or Path(name).is_absolute():
            problem = f"names {name[:80]!r}, which is outside the bag"
            raise RecordingError(metadata, "relative_file_paths", problem, "name files of the bag only")
        file = folder / file.name  # older bags have the folder's name before it
        if file.is_file():
            files.append(file)
    return files


def _named(text: str) -> list[str]:
    """Return the entries of relative_file_paths and the paths of files, in block or flow form."""
    block = re.search(r"relative_file_paths:[ \t]*\n((?:[ \t]*-[^\n]*\n?)+)", text)
    flow = re.search(r"relative_file_paths:[ \t]*\[([^\]]*)\]", text)
    names = list(ENTRY.findall(block[1])) if block else []
    names += flow[1].split(",") if flow else []
    names += re.findall(r"^\s*(?:-\s*)?path:\s*(.+?)\s*$", text, re.MULTILINE)
    return [name.strip().strip("\"'") for name in names if name.strip().strip("\"'")]


def _check_file(path: Path) -> None:
    with path.open("rb") as file:
        start = file.read(len(ROS1))
        if start.startswith(ROS1):
            _check_ros1(path, file)
        elif start.startswith(MCAP):
            file.seek(len(MCAP))
            _check_mcap(path, file)
        elif path.suffix == ".zstd" or start.startswith(b"\x28\xb5\x2f\xfd"):
            file.seek(0)
            _check_zstd(path, file)


def _check_ros1(path: Path, file: BinaryIO) -> None:
    """Unfold every compressed chunk, as far as it may, without keeping it."""
    for fields, size in _ros1_records(path, file):
        if fields.get(b"op") == b"\x05":
            _check_unfolded(path, "a chunk", fields.get(b"compression", b""), file.read(size))


def _ros1_records(path: Path, file: BinaryIO) -> Iterator[tuple[dict[bytes, bytes], int]]:
    end = path.stat().st_size
    while file.tell() + 4 <= end:
        header = file.read(_length(path, file, end))
        fields: dict[bytes, bytes] = {}
        at = 0
        while at + 4 <= len(header):
            (size,) = struct.unpack_from("<I", header, at)
            name, _, value = header[at + 4 : at + 4 + size].partition(b"=")
            fields[name] = value
            at += 4 + size
        size = _length(path, file, end)
        following = file.tell() + size
        yield fields, size
        file.seek(following)


def _length(path: Path, file: BinaryIO, end: int) -> int:
    raw = file.read(4)
    size = struct.unpack("<I", raw)[0] if len(raw) == 4 else 0
    if len(raw) < 4 or size > end - file.tell():
        raise RecordingError(path, f"byte {file.tell()}", "a record longer than the file", "copy the bag again")
    return size


def _check_mcap(path: Path, file: BinaryIO) -> None:
    end = path.stat().st_size
    while file.tell() + 9 <= end:
        opcode, size = struct.unpack("<BQ", file.read(9))
        following = file.tell() + size
        if size > end - file.tell():
            raise RecordingError(path, f"byte {file.tell()}", "a record longer than the file", "copy the bag again")
        if opcode == MCAP_CHUNK and size >= 32:
            start = file.read(32)
            (declared,) = struct.unpack_from("<Q", start, 16)
            check_size(path, "a chunk", float(declared))
            (letters,) = struct.unpack_from("<I", start, 28)
            if letters <= 16:
                kind = file.read(letters)
                (length,) = struct.unpack("<Q", file.read(8))
                if length <= following - file.tell():
                    _check_unfolded(path, "a chunk", kind, file.read(length))
        file.seek(following)


def _check_zstd(path: Path, file: BinaryIO) -> None:
    """Unfold a compressed file piece by piece, as far as it may, without keeping it."""
    zstd = _zstd()
    total = 0.0
    try:
        with zstd.open(file, "rb") as reader:
            while piece := reader.read(1 << 20):
                total += len(piece)
                check_size(path, "", total)
    except (zstd.ZstdError, EOFError) as error:
        raise RecordingError(path, "", f"damaged compression ({error})"[:160], "copy the bag again") from None
