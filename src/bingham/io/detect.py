"""Read a recording of any supported format; the content of the file decides, not its name."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bingham.errors import BinghamError, InvalidArgumentError, RecordingError, RepairWarning, Setting, words
from bingham.io.bounds import bounded
from bingham.io.checks import existing
from bingham.io.formats import FORMATS, supported
from bingham.io.text import is_utf16, opened_text
from bingham.io.together import is_split, read_together
from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["detect_format", "read_recording", "readable"]

LONGEST_SIGNATURE = 16


def read_recording(
    path: str | Path | Sequence[str | Path],
    *,
    format: str | None = None,
    strict: bool = False,
    max_size: float | None = None,
    **options: Any,
) -> ImuRecording | OrientationRecording:
    """Read a recording of any supported format.

    Parameters
    ----------
    path : str or Path, or sequence of them
        File, or folder of a ROS 2 bag, EuRoC or KITTI sequence, or of files of one sensor each; or several such files.
    format : str, optional
        Format, if its recognition is not to be trusted: a name that ``bingham formats`` lists.
    strict : bool
        Make an error of everything that would be put right with a `RepairWarning`.
    max_size : float, optional
        Bytes to which the file may unfold; more than its size makes plausible is an error without it.
    **options
        Passed to the reader of the format.

    Returns
    -------
    ImuRecording or OrientationRecording
        The recording, named after its file.

    Raises
    ------
    RecordingError
        If the format is not recognised, the file not as its format promises, or repaired although `strict`.
    InvalidArgumentError
        If the format is unknown or has no such option.
    """
    several = not isinstance(path, str | Path)
    first = Path(next(iter(path))) if several else Path(path)
    with warnings.catch_warnings(), bounded(max_size), readable(first):
        if strict:
            warnings.simplefilter("error", RepairWarning)
        try:
            if several or (format is None and is_split(first)):
                return read_together([Path(p) for p in path] if several else [first], **options)
            return _reader(first, format, options)(first, **options)
        except RepairWarning as warning:
            name, *said = warning.args
            hint = ("leave ", Setting("strict", True), " out to have it put right")
            raise RecordingError(name, "", words(said), hint) from None


@contextmanager
def readable(path: Path) -> Generator[None]:
    """Let what the system says of a file be an error of the recording."""
    try:
        yield
    except OSError as error:
        if isinstance(error, BinghamError):
            raise
        hint = "check permissions, and that the disk is there"
        raise RecordingError(error.filename or path, "", f"cannot be read: {error.strerror}", hint) from None


def _reader(path: Path, format: str | None, options: dict[str, Any]) -> Any:
    if format is None:
        format = detect_format(path)
    elif format not in FORMATS:
        raise InvalidArgumentError("format", f"one of {', '.join(FORMATS)}", repr(format))
    read = FORMATS[format].read
    known = [name for name in inspect.signature(read).parameters if name != "path"]
    if strange := next((name for name in options if name not in known), None):
        those = [part for name in known for part in (" ", Setting(name))]
        raise InvalidArgumentError(strange, (f"a format that has such; {format} has", *(those or [" none"])), f"{path}")
    return read


def detect_format(path: str | Path) -> str:
    """Return the key of the format of a file or folder, as `read_recording` takes it.

    Raises
    ------
    RecordingError
        If it is none of the supported ones.
    """
    path = Path(path)
    if path.is_dir():
        for name, known in FORMATS.items():
            if known.folder is not None and known.folder(path):
                return name
        problem = "a folder that is neither a ROS 2 bag, nor an EuRoC or KITTI sequence, nor one of a file a sensor"
        raise RecordingError(path, "", problem, supported())
    existing(path)
    with path.open("rb") as file:
        start = file.read(LONGEST_SIGNATURE)
    for name, known in FORMATS.items():
        if start.startswith(known.signatures):
            return name
    if is_utf16(start):
        opened_text(path)  # which says so
    try:
        head = [line for _, line in opened_text(path).head[:1000]]
    except RecordingError as error:
        raise RecordingError(path, error.place, "no known format", supported()) from None
    for name, known in FORMATS.items():
        if known.text is not None and name != "csv" and known.text(head):
            return name
    if any(len(line) > 2 and any(c in line for c in ",;\t|") for line in head) or _is_table(head):
        return "csv"
    raise RecordingError(path, "line 1", "no known format", supported())


def _is_table(head: list[str]) -> bool:
    """Whether the last lines of a beginning are cells between white space, as many in each."""
    rows = [line.split() for line in head[-3:]]
    return len(rows) > 1 and len(rows[-1]) > 2 and len({len(row) for row in rows[-2:]}) == 1
