"""Text files: what may be one, its first lines, and all of its lines one after another, numbered."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from bingham.errors import RecordingError
from bingham.io.checks import existing

__all__ = ["LONGEST_LINE", "TextFile", "is_utf16", "opened_text"]

HEAD = 256 * 1024  # bytes that are looked at to find out what a file is
LONGEST_LINE = 1_000_000  # characters; no logger has a tenth of it
# Degree, micro and superscript two are all that loggers write in Latin-1; other bytes that are no UTF-8 are damage.
LATIN = b"\xb0\xb5\xb2"


def is_utf16(start: bytes) -> bool:
    """Whether a file that starts so is UTF-16 text: its mark is there, or every other byte is zero."""
    even, odd = start[::2], start[1::2]
    zero_beside_text = len(start) > 3 and ((all(even) and not any(odd)) or (all(odd) and not any(even)))
    return start.startswith((b"\xff\xfe", b"\xfe\xff")) or zero_beside_text


@dataclass(frozen=True, slots=True)
class TextFile:
    """A text file that was looked at, not yet read.

    Parameters
    ----------
    path : Path
        The file.
    encoding : str
        "utf-8-sig" or "latin-1".
    head : list of (int, str)
        Its first lines that are not blank, without their ends, numbered from 1.
    complete : bool
        Whether these are all lines.
    """

    path: Path
    encoding: str
    head: list[tuple[int, str]]
    complete: bool

    def lines(self) -> Iterator[tuple[int, str]]:
        """Yield the lines that are not blank, numbered from 1.

        Raises
        ------
        RecordingError
            If a line is longer than a million characters, holds a zero byte or is no text.
        """
        with self.path.open(encoding=self.encoding, errors="strict", newline=None) as file:
            number = 0
            while True:
                try:
                    line = file.readline(LONGEST_LINE + 1)
                except UnicodeDecodeError:
                    raise RecordingError(
                        self.path, f"after line {number}", "not UTF-8 text", "copy or export it again as UTF-8"
                    ) from None
                if not line:
                    return
                number += 1
                if len(line) > LONGEST_LINE:
                    problem = f"a line of more than {LONGEST_LINE} characters"
                    raise RecordingError(self.path, f"line {number}", problem, "give a table, one sample a line")
                if "\0" in line:
                    raise RecordingError(self.path, f"line {number}", "not text but binary", "copy it again")
                if line.strip():
                    yield number, line.rstrip("\n")


def opened_text(path: str | Path) -> TextFile:
    """Look at a text file.

    Raises
    ------
    RecordingError
        If the file is absent, empty, or its beginning is no text.
    """
    path = existing(path)
    with path.open("rb") as file:
        start = file.read(HEAD + 1)
    complete = len(start) <= HEAD
    if is_utf16(start[:16]):
        raise RecordingError(path, "", "UTF-16 text", "save it as UTF-8, as iconv -f UTF-16 -t UTF-8 does")
    if b"\0" in start:
        raise RecordingError(path, f"byte {start.index(0)}", "not text but binary", "give a text file")
    encoding, text = _decoded(path, start, complete)
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if not complete:
        lines.pop()  # cut in two
    head = [(k, line) for k, line in enumerate(lines, 1) if line.strip()]
    if not head:
        if complete:
            raise RecordingError(path, "", "the file is empty", "record or copy it again")
        raise RecordingError(path, "", f"its first {HEAD} bytes are no lines of text", "give a text file")
    return TextFile(path, encoding, head, complete)


def _decoded(path: Path, start: bytes, complete: bool) -> tuple[str, str]:
    start = start.removeprefix(codecs.BOM_UTF8)
    try:
        return "utf-8-sig", codecs.getincrementaldecoder("utf-8")().decode(start, final=complete)
    except UnicodeDecodeError as error:
        if not (set(start) - set(LATIN)) & set(range(128, 256)):
            return "latin-1", start.decode("latin-1")
        raise RecordingError(path, f"byte {error.start}", "not UTF-8 text", "give a text file in UTF-8") from None
