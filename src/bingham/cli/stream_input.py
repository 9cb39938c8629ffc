"""Standard input in blocks as they come, until it ends or the process is asked to."""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from collections.abc import Iterable, Iterator
from contextlib import suppress
from types import FrameType
from typing import Any

from bingham.errors import RecordingError

__all__ = ["LONGEST_LINE", "Stop", "blocks", "lines_of"]

BLOCK = 1 << 16
# No line of a sensor is longer; the rest of one that is is not kept.
LONGEST_LINE = 4096


class Stop:
    """Takes note of SIGTERM, SIGINT and SIGHUP, however many come, instead of breaking into a sample."""

    def __init__(self) -> None:
        self.wanted = False
        self._before: dict[int, Any] = {}
        self.awake, self._wake = os.pipe()

    def __enter__(self) -> Stop:
        if threading.current_thread() is threading.main_thread():
            for name in ("SIGTERM", "SIGINT", "SIGHUP"):
                if (number := getattr(signal, name, None)) is not None:
                    self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            # Once asked to end, the process does: a second signal changes nothing.
            signal.signal(number, signal.SIG_IGN if self.wanted else handler)
        os.close(self.awake)
        os.close(self._wake)

    def _note(self, _: int, __: FrameType | None) -> None:
        if not self.wanted:
            self.wanted = True
            os.write(self._wake, b"!")


def blocks(stop: Stop) -> Iterator[bytes]:
    """Yield what comes on standard input, as soon as something comes.

    Raises
    ------
    RecordingError
        If standard input is closed or cannot be read.
    """
    try:
        source = sys.stdin.fileno()
        while not stop.wanted:
            with suppress(ValueError, OSError):  # no system can wait for everything
                select.select([source, stop.awake], [], [])
            if stop.wanted:
                return
            block = os.read(source, BLOCK)
            if not block:
                return
            yield block
    except (OSError, ValueError, AttributeError) as error:
        problem = getattr(error, "strerror", None) or "closed"
        raise RecordingError("standard input", "", f"cannot be read: {problem}", "pipe samples into it") from None


def lines_of(source: Iterable[bytes]) -> Iterator[list[bytes]]:
    """Yield whole lines, all those of a block at once; of an endless line no more is kept than `LONGEST_LINE`."""
    rest = b""
    for block in source:
        *lines, tail = block.split(b"\n")
        if lines:
            lines[0] = rest + lines[0]
            rest = b""
            yield lines
        rest = (rest + tail)[: LONGEST_LINE + 1]
    if rest:
        yield [rest]
