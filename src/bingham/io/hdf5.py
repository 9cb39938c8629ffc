"""Arrays of HDF5 files, read by another process, which a damaged file cannot take along with this one."""

from __future__ import annotations

import atexit
import json
import math
import os
import subprocess
import sys
import threading
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import MissingExtraError, RecordingError
from bingham.io.bounds import allowed, check_size
from bingham.io.checks import damaged

__all__ = ["read_hdf5"]

PROGRAM = Path(__file__).with_name("hdf5_child.py")
# Seconds that a file may take: a damaged one can send h5py round in circles.
PATIENCE = 9.0
SLOWEST = 2e6  # bytes of a file read in a second
FAREWELL = 0.5  # seconds to end by itself

# What the other process says of a field → problem and hint.
WORDS = {
    "links": ("links elsewhere, not necessarily into this file", "give the file with the data"),
    "group": ("is no array", "numbers are expected"),
    "elsewhere": ("keeps its numbers in another file", "give a file that holds its data"),
}


def read_hdf5(path: Path, names: tuple[str, ...]) -> dict[str, NDArray[Any]]:
    """Return the named arrays and attributes that a file has at its top.

    The process that reads is started with the first file and serves those that follow.

    Raises
    ------
    RecordingError
        If the file is damaged, or an array lies elsewhere, is of no numbers or larger than is plausible.
    MissingExtraError
        If h5py is not installed.
    """
    if find_spec("h5py") is None:
        raise MissingExtraError("h5py", "io", "reading HDF5 files")
    with _lock:
        return _reader_of_this_process().read(path, names)


class _Reader:
    """The other process."""

    def __init__(self) -> None:
        self.owner = os.getpid()
        self._process: subprocess.Popen[bytes] | None = None

    def read(self, path: Path, names: tuple[str, ...]) -> dict[str, NDArray[Any]]:
        """Ask for the arrays of a file."""
        question = {"path": os.path.abspath(path), "names": names, "limit": min(allowed(path), 1e18)}
        process = self._process = self._process or self._started()
        assert process.stdin is not None and process.stdout is not None
        late = threading.Event()
        timer = threading.Timer(PATIENCE + path.stat().st_size / SLOWEST, _give_up, (process, late))
        timer.start()
        try:
            process.stdin.write(json.dumps(question).encode("ascii") + b"\n")
            process.stdin.flush()
            return _answer(path, process.stdout)
        except (EOFError, OSError) as error:
            code = self.stop()
            reason = "reading it does not end" if late.is_set() else f"reading it ended the reader, code {code}"
            raise damaged(path, "HDF5 file", ValueError(reason)) from error
        except RecordingError:
            raise
        except BaseException:  # interrupted: what it still says answers no question
            self.stop()
            raise
        finally:
            timer.cancel()

    def _started(self) -> subprocess.Popen[bytes]:
        pipe = subprocess.PIPE
        return subprocess.Popen(
            [sys.executable, "-P", str(PROGRAM)], stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL
        )

    def stop(self) -> int:
        """End the process and return its exit code."""
        process, self._process = self._process, None
        if process is None or self.owner != os.getpid():
            return 0
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                with suppress(OSError):
                    stream.close()
        try:
            return process.wait(FAREWELL)
        except subprocess.TimeoutExpired:
            process.kill()
            return process.wait()


def _give_up(process: subprocess.Popen[bytes], late: threading.Event) -> None:
    late.set()
    process.kill()


def _answer(path: Path, stdout: IO[bytes]) -> dict[str, NDArray[Any]]:
    content: dict[str, NDArray[Any]] = {}
    while True:
        line = stdout.readline()
        if not line.endswith(b"\n"):
            raise EOFError
        if line == b"\n":
            return content
        said = json.loads(line)
        if "name" not in said:
            raise _refused(path, said)
        dtype, shape = np.dtype(said["dtype"]), tuple(said["shape"])
        raw = bytearray(dtype.itemsize * math.prod(shape))
        if raw and stdout.readinto(raw) != len(raw):  # pyright: ignore[reportAttributeAccessIssue]
            raise EOFError
        content[said["name"]] = np.frombuffer(raw, dtype=dtype).reshape(shape)


def _refused(path: Path, said: dict[str, Any]) -> RecordingError:
    if "damaged" in said:
        return damaged(path, "HDF5 file", ValueError(said["damaged"]))
    place = f"field {said['field']}"
    if "size" in said:
        check_size(path, place, said["size"])
    if "type" in said:
        return RecordingError(path, place, f"of type {said['type']}", "numbers are expected")
    problem, hint = next(words for key, words in WORDS.items() if key in said)
    return RecordingError(path, place, problem, hint)


_lock = threading.Lock()
_reader = _Reader()


def _reader_of_this_process() -> _Reader:
    """Return the reader, a new one after a fork: its pipes are the parent's."""
    global _reader
    if _reader.owner != os.getpid():
        _reader = _Reader()
    return _reader


atexit.register(lambda: _reader.stop())
