"""Standard input, output and error as the command line uses them: the one place that prints."""

from __future__ import annotations

import codecs
import contextlib
import io
import json
import os
import sys
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

__all__ = ["clean", "discard_output", "open_streams", "print_json", "progress_bar", "say", "say_error", "unexpected"]

# What stands for signs that a terminal does not have.
ASCII = {
    "°": "deg", "µ": "u", "±": "+/-", "–": "-", "—": "-", "−": "-", "…": "...", "→": "->", "×": "x", "√": "sqrt",
    "²": "^2", "³": "^3", "·": "*", "σ": "sigma", "≤": "<=", "≥": ">=", "π": "pi", "‘": "'", "’": "'",
}  # fmt: skip


def _replacement(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeEncodeError)
    return "".join(ASCII.get(c, "?") for c in error.object[error.start : error.end]), error.end


def open_streams() -> str:
    """Make the three streams safe to use; return the name of one that is closed and needed, or an empty string."""
    codecs.register_error("bingham", _replacement)
    closed = {0: sys.stdin is None, 1: sys.stdout is None, 2: sys.stderr is None}
    for number in range(3):
        with contextlib.suppress(OSError):
            os.fstat(number)
            continue
        # Otherwise the next file to be opened would be taken for the stream.
        os.dup2(os.open(os.devnull, os.O_RDWR), number)
    if closed[2]:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="bingham")
    return "standard output" if closed[1] else ""


def discard_output() -> None:
    """Let what is still to be written to standard output, which takes nothing more, vanish."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def clean(text: str) -> str:
    """Return text that leaves a terminal as it is: control characters as escapes, lines as they are."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c == "\n" else c.encode("unicode_escape", "surrogatepass").decode()
                   for c in text)  # fmt: skip


def say(text: str) -> None:
    """Print lines on standard output."""
    print(clean(text))  # noqa: T201


def say_error(text: str) -> None:
    """Print a line of the program's own on standard error, if that takes it."""
    with contextlib.suppress(OSError, ValueError):
        sys.stderr.write(f"bingham: {clean(text)}\n")
        sys.stderr.flush()


def unexpected(error: Exception) -> str:
    """Return a line about an error that nobody has foreseen; BINGHAM_TRACEBACK=1 lets it pass instead."""
    if os.environ.get("BINGHAM_TRACEBACK"):
        raise error
    what = " ".join(str(error).split())[:300]
    return f"unexpected {type(error).__name__}: {what}; please report it; BINGHAM_TRACEBACK=1 shows where"


def print_json(value: Any) -> None:
    """Print a value as JSON, valid on any terminal: numbers that JSON does not know become null."""
    text = json.dumps(_finite(value), indent=2, ensure_ascii=False, allow_nan=False)
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except UnicodeError:
        text = json.dumps(_finite(value), indent=2, allow_nan=False)
    print(text)  # noqa: T201


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not -1e999 < value < 1e999 else value


@contextmanager
def progress_bar(total: int | None, *, quiet: bool = False) -> Generator[Any]:
    """Give a function ``show(done, what="", total=None)`` that moves a bar with the time left.

    The bar is on standard error, and only if that is a terminal.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda done, what="", total=None: None
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=total)

        def show(done: float, what: str = "", total: float | None = None) -> None:
            more: dict[str, Any] = {} if total is None else {"total": total}
            bar.update(task, completed=done, description=escape(clean(what)), **more)

        yield show
