"""Timing of short calls: the best of several repeats, which is the one that other processes disturbed least."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any


@dataclass(frozen=True)
class Row:
    """One line of the table: seconds per ``unit``; ``limit``, also in seconds, is what the project asks of itself."""

    topic: str
    what: str
    seconds: float
    unit: str = "call"
    ours: bool = False
    limit: float | None = None
    note: str = ""


def best_of(function: Callable[[], Any], *, per: int = 1, repeats: int = 7, at_least: float = 0.05) -> float:
    """Return the seconds of one of the ``per`` things that a call does.

    A repeat calls the function as often as fills ``at_least`` seconds; the first call, which compiles or fills caches,
    is not timed.
    """
    function()
    calls = 1
    while True:
        took = _seconds(function, calls)
        if took >= at_least or calls >= 1 << 20:
            break
        calls *= 2 if took < 0.1 * at_least else max(2, int(at_least / took) + 1)
    return min(took, *(_seconds(function, calls) for _ in range(repeats - 1))) / (calls * per)


def best_once(function: Callable[[], Any], *, per: int = 1, repeats: int = 3) -> float:
    """Return the seconds of one of the ``per`` things that a slow call does, each repeat a single call."""
    return min(_seconds(function, 1) for _ in range(repeats)) / per


def _seconds(function: Callable[[], Any], calls: int) -> float:
    start = perf_counter()
    for _ in range(calls):
        function()
    return perf_counter() - start
