"""Timing of short calls: the best of several repeats, which is the one that other processes disturbed least.

Processor time, unless ``clock`` says otherwise: on a machine that does something else too it is the fairer one. All
libraries are held to one thread (see `run`), so that on an idle machine it equals the time on the wall.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import process_time
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


def best_of(
    function: Callable[[], Any],
    *,
    per: int = 1,
    repeats: int = 7,
    at_least: float = 0.05,
    clock: Callable[[], float] = process_time,
) -> float:
    """Return the seconds of one of the ``per`` things that a call does.

    A repeat calls the function as often as fills ``at_least`` seconds; the first call, which compiles or fills caches,
    is not timed.
    """
    function()
    calls = 1
    while True:
        took = _seconds(function, calls, clock)
        if took >= at_least or calls >= 1 << 20:
            break
        calls *= 2 if took < 0.1 * at_least else max(2, int(at_least / took) + 1)
    return min(took, *(_seconds(function, calls, clock) for _ in range(repeats - 1))) / (calls * per)


def best_once(function: Callable[[], Any], *, per: int = 1, repeats: int = 3) -> float:
    """Return the seconds of one of the ``per`` things that a slow call does, each repeat a single call."""
    return min(_seconds(function, 1, process_time) for _ in range(repeats)) / per


def _seconds(function: Callable[[], Any], calls: int, clock: Callable[[], float]) -> float:
    start = clock()
    for _ in range(calls):
        function()
    return clock() - start
