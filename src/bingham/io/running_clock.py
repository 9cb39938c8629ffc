"""`mended_clock` for times that come piece by piece: what it would do with all of them, decided by those so far."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bingham.io.checks import Place
from bingham.io.clock import (
    DISPLACED,
    ENOUGH,
    FEW_REPEATED,
    FEW_STEPS,
    LONGEST_PAUSE,
    STEPS_PER,
    Mended,
    say_repeated,
    say_set_back,
    usual_step,
)

__all__ = ["RunningClock", "WholeNeededError"]

FloatArray = NDArray[np.float64]


class WholeNeededError(Exception):
    """Rows of a recording have to be looked at together."""


class RunningClock:
    """Bridges a clock that is set back, and drops the later of equal stamps.

    Parameters
    ----------
    path : Path
        For messages.
    """

    enough = ENOUGH - 1

    def __init__(self, path: Path) -> None:
        self._path = path
        self._usual = np.nan
        self._raw = np.zeros(0)  # the last stamps as they stand in the file
        self._last = -np.inf
        self._shift = 0.0
        self._size = self._set_back = self._repeated = 0
        self._first: tuple[str, float] = ("", 0.0)

    def mended(self, time: FloatArray, place: Place, *, head: bool) -> Mended:
        """Return times that increase on from those before, and the rows that they belong to, None for all.

        Raises
        ------
        WholeNeededError
            If they do not, and how to put them right only the whole tells.
        """
        if not np.isfinite(time).all():
            raise WholeNeededError("times that are no numbers")
        if head and len(time) > 1 and (np.diff(time) > 0).any():
            self._usual = usual_step(time)
        self._size += len(time)
        if not len(time):
            return Mended(time, None)
        raw = np.concatenate([self._raw, time])
        time = self._bridged(raw, len(self._raw), place)
        self._raw = raw[-DISPLACED - 1 :].copy()
        steps = np.diff(time, prepend=self._last if np.isfinite(self._last) else time[0] - 1.0)
        if steps.max() > LONGEST_PAUSE or steps.min() < 0:
            raise WholeNeededError("times that are out of order")
        kept = None
        if not steps.all():
            kept = np.flatnonzero(steps)
            self._repeated += len(time) - len(kept)
            time = time[kept]
        if len(time):
            self._last = float(time[-1])
        return Mended(time, kept)

    def finish(self) -> None:
        """Say what was put right.

        Raises
        ------
        WholeNeededError
            If there is too much of it for slips.
        """
        if self._set_back > max(FEW_STEPS, self._size // STEPS_PER) or (self._set_back and self._size < ENOUGH):
            raise WholeNeededError("times that are out of order")
        if self._repeated > FEW_REPEATED * self._size:
            raise WholeNeededError("rounded time stamps")
        if self._set_back:
            say_set_back(self._path, self._first[0], "", self._set_back, self._first[1], self._usual)
        if self._repeated:
            say_repeated(self._path, "", self._repeated, self._size)

    def _bridged(self, raw: FloatArray, before: int, place: Place) -> FloatArray:
        """Return the stamps after those of earlier pieces, a clock that is set back bridged by the usual step."""
        steps = np.diff(raw)
        back = np.flatnonzero(steps < 0)
        back = back[back >= before - 1]
        if not len(back):
            return raw[before:] + self._shift if self._shift else raw[before:]
        if not self._set_back:
            k = int(back[0])
            # By fewer rows it could be rows out of order, which are sorted.
            if k < DISPLACED or raw[k + 1] >= raw[k - DISPLACED]:
                raise WholeNeededError("rows out of order")
            self._first = (place("time", k + 1 - before), float(-steps[k]))
        self._set_back += len(back)
        shifts = np.zeros_like(raw)
        shifts[0] = self._shift
        shifts[back + 1] = self._usual - steps[back]
        total = np.cumsum(shifts)
        self._shift = float(total[-1])
        return (raw + total)[before:]
