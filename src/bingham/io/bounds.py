"""How much memory a file may ask for: what it declares is compared with its size before anything is taken."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from bingham.errors import InvalidArgumentError, RecordingError, Setting

__all__ = ["allowed", "bounded", "check_size"]

# Recordings compress to a tenth at best; files of constants further, but such are small.
ALWAYS = 128 * 1024 * 1024
TIMES = 20
_given: ContextVar[float | None] = ContextVar("max_size", default=None)


@contextmanager
def bounded(max_size: float | None) -> Generator[None]:
    """Allow files read in the block to unfold to `max_size` bytes; None: what their size makes plausible."""
    if max_size is not None and not max_size > 0:
        raise InvalidArgumentError("max_size", "a number of bytes", max_size)
    token = _given.set(max_size)
    try:
        yield
    finally:
        _given.reset(token)


def allowed(path: Path) -> float:
    """Return the bytes to which a file may unfold: 128 MB and 20 times its size, unless the caller allows more."""
    given = _given.get()
    return given if given is not None else ALWAYS + TIMES * path.stat().st_size


def check_size(path: Path, place: str, size: float) -> None:
    """Raise an error if something in a file unfolds to more bytes than is allowed."""
    if not size <= (limit := allowed(path)):
        problem = f"{_readable(size)} of memory, which a file of {_readable(path.stat().st_size)} should not need"
        enough = Setting("max_size", float(f"{1.1 * size:.2g}"))
        hint = ("if it is right, allow it: ", enough, f", above the limit of {_readable(limit)}")
        raise RecordingError(path, place, problem, hint)


def _readable(size: float) -> str:
    for unit in ("bytes", "kB", "MB", "GB"):
        if size < 1000:
            return f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:.3g} TB"
