"""Time stamps as loggers write them: repeated, set back once, out of order by a row, rounded, jittered.

What can be put right without doubt is put right with a warning that counts; the rest is left to the recording type,
which rejects it.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError, Setting
from bingham.io.checks import HEAD, Place, note, repaired

__all__ = [
    "DISPLACED",
    "ENOUGH",
    "FEW_REPEATED",
    "FEW_STEPS",
    "LONGEST_PAUSE",
    "STEPS_PER",
    "Mended",
    "mended_clock",
    "say_if_rounded",
    "say_repeated",
    "say_set_back",
    "usual_step",
]

FloatArray = NDArray[np.float64]

ENOUGH = 20  # samples below which nothing is usual
FEW_REPEATED = 0.2  # share of repeated stamps up to which they are slips; above it the stamps are rounded
FEW_STEPS = 3  # times that a clock is set back, or one in this many:
STEPS_PER = 1000
DISPLACED = 8  # rows by which a sample may be out of order
ROUNDED = 0.2  # of the usual step: a resolution as coarse as this is worth a word
GAP_STEPS, GAP_SECONDS = 5.0, 0.25  # a pause in which a regular clock is not assumed to go on
LONGEST_PAUSE = 1e8  # s, three years: no recording has it, but clocks do that are set after its beginning


class Mended(NamedTuple):
    """Times put right (M,), and the rows that they belong to, None for all in their order."""

    time: FloatArray
    rows: NDArray[np.intp] | None


def mended_clock(path: Path, place: Place, time: FloatArray, *, what: str = "", regularise: bool = False) -> Mended:
    """Return times that increase strictly where it is clear how.

    Parameters
    ----------
    path, place : Path, callable
        For messages; ``place("time", row)`` names a row.
    time : ndarray, shape (N,)
        Seconds as they stand in the file.
    what : str
        What is timed, where a file has several clocks.
    regularise : bool
        Whether to put the times on a straight line between pauses: for arrival times of samples taken regularly.

    Raises
    ------
    RecordingError
        If two stamps are years apart.
    """
    whose = f" of {what}" if what else ""
    rows: NDArray[np.intp] | None = None
    if not np.isfinite(time).all() or len(time) < 2:
        return Mended(time, None)
    steps = np.diff(time)
    if not (steps > 0).all():
        time, rows = _in_order(path, place, time, steps, whose)
        time, kept = _without_repeats(path, time, whose)
        if kept is not None:
            rows = kept if rows is None else rows[kept]
        steps = np.diff(time)
    if len(time) > 1 and steps.max() > LONGEST_PAUSE:
        k = int(np.argmax(steps))
        hint = f"a clock that was set after the beginning? Remove the rows before, {k + 1} of {len(time)}"
        row = k + 1 if rows is None else int(rows[k + 1])
        raise RecordingError(path, place("time", row), f"{steps[k]:.3g} s after the stamp before{whose}", hint)
    if len(time) >= ENOUGH and (steps > 0).all():
        if regularise:
            time = _regular(path, time, steps, whose)
        else:
            say_if_rounded(path, time[:HEAD], whose)
    return Mended(time, rows)


def _in_order(
    path: Path, place: Place, time: FloatArray, steps: FloatArray, whose: str
) -> tuple[FloatArray, NDArray[np.intp] | None]:
    """Sort rows that are out of order by a few places; bridge a clock that was set back."""
    back = np.flatnonzero(steps < 0)
    if not len(back) or len(time) < ENOUGH:
        return time, None
    order = np.argsort(time, kind="stable")
    moved = np.abs(order - np.arange(len(time)))
    if moved.max() <= DISPLACED:
        repaired(path, f"{np.count_nonzero(moved)} rows out of order{whose}, sorted by time")
        return time[order], order
    if len(back) > max(FEW_STEPS, len(time) // STEPS_PER):
        return time, None
    usual = usual_step(time)
    shifts = np.zeros_like(time)
    shifts[back + 1] = usual - steps[back]
    say_set_back(path, place("time", int(back[0]) + 1), whose, len(back), float(-steps[back[0]]), usual)
    return time + np.cumsum(shifts), None


def _without_repeats(path: Path, time: FloatArray, whose: str) -> tuple[FloatArray, NDArray[np.intp] | None]:
    """Drop the later of equal stamps; where they are usual, spread them over the time to the next."""
    steps = np.diff(time)
    repeated = np.flatnonzero(steps == 0)
    if not len(repeated) or (steps < 0).any():
        return time, None
    if len(repeated) <= FEW_REPEATED * len(time):
        say_repeated(path, whose, len(repeated), len(time))
        keep = np.concatenate([[True], steps > 0])
        return time[keep], np.flatnonzero(keep)
    first = np.flatnonzero(np.concatenate([[True], steps > 0]))
    if len(time) < ENOUGH or len(first) < 3:
        return time, None
    counts = np.diff(np.append(first, len(time)))
    pauses = np.diff(time[first])
    each = np.append(pauses / counts[:-1], np.inf)
    usual = float(np.median(each[:-1]))
    each = np.minimum(each, 1.5 * usual)
    each[-1] = min(usual, each[-2])
    within = np.arange(len(time)) - np.repeat(first, counts)
    repaired(
        path,
        f"time stamps{whose} are rounded: usually {np.median(counts):.0f} rows share one, "
        f"{np.median(pauses):.3g} s apart; spread evenly",
    )
    return np.repeat(time[first], counts) + within * np.repeat(each, counts), None


def usual_step(time: FloatArray) -> float:
    """Return the median of the steps forward at the beginning."""
    steps = np.diff(time[:HEAD])
    return float(np.median(steps[steps > 0]))


def say_set_back(path: Path, where: str, whose: str, count: int, by: float, usual: float) -> None:
    """Say that a clock was set back, and how it was bridged."""
    many = f" and {count - 1} times more" if count > 1 else ""
    bridged = f"bridged by the usual step of {usual:.6g} s"
    repaired(path, f"{where}: the clock{whose} was set back by {by:.6g} s{many}; {bridged}")


def say_repeated(path: Path, whose: str, count: int, size: int) -> None:
    """Say how many stamps repeat the one before."""
    repaired(path, f"{count} of {size} time stamps{whose} repeat the one before; these rows left out")


def say_if_rounded(path: Path, time: FloatArray, whose: str) -> None:
    """Warn if the stamps are multiples of something coarse beside the usual step."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    if np.count_nonzero(np.abs(steps - usual) < 0.05 * usual) > 0.9 * len(steps):
        return
    sample = time[: 20 * ENOUGH] - np.floor(time[0])
    spacing = float(np.spacing(np.float32(np.abs(time).max())))
    single = spacing >= ROUNDED * usual and (time.astype(np.float32) == time).all()
    decimals = [r for r in (1.0, 0.1, 0.01, 1e-3, 1e-4) if r >= ROUNDED * usual]
    step = next((r for r in decimals if np.abs(sample / r - np.round(sample / r)).max() < 1e-3), 0.0)
    if single or step:
        rounded = f"time stamps{whose} are rounded to {spacing if single else step:.3g} s"
        usually = f"{rounded}, where the usual step is {usual:.3g} s; "
        note(path, usually, Setting("regularise", True), " puts them on a straight line")


def _regular(path: Path, time: FloatArray, steps: FloatArray, whose: str) -> FloatArray:
    """Return the least-squares line through the times between pauses, lost samples counted where steps show them."""
    usual = float(np.median(steps))
    steady = float(np.subtract(*np.quantile(steps, [0.75, 0.25]))) < 0.3 * usual
    breaks = np.flatnonzero(steps > max(GAP_STEPS * usual, GAP_SECONDS)) + 1
    regular = time.copy()
    for start, stop in zip(np.append(0, breaks), np.append(breaks, len(time)), strict=True):
        if stop - start < ENOUGH:
            continue
        counts = np.maximum(1.0, np.round(steps[start : stop - 1] / usual)) if steady else np.ones(stop - start - 1)
        index = np.concatenate([[0.0], np.cumsum(counts)])
        slope, offset = np.polyfit(index - index.mean(), time[start:stop] - time[start], 1)
        line = time[start] + offset + slope * (index - index.mean())
        if slope > 0 and (start == 0 or line[0] > regular[start - 1]):
            regular[start:stop] = line
    if not (np.diff(regular) > 0).all():
        return time
    repaired(path, f"time stamps{whose} put on a straight line, moved by up to {np.abs(regular - time).max():.3g} s")
    return regular
