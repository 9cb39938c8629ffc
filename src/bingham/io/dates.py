"""Dates and times of day as loggers write them, as seconds."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

import numpy as np
from numpy.typing import NDArray

__all__ = ["is_date", "seconds_of_dates"]

NAMES = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
MONTHS = {name: number for number, name in enumerate(NAMES, 1)}
CLOCK = r"(?P<h>\d{1,2}):(?P<min>\d\d)(?::(?P<s>\d\d)(?:[.,:](?P<part>\d{1,9}))?)?\s*(?P<noon>[AaPp]\.?[Mm]\.?)?"
ZONE = r"\s*(?P<zone>Z|UTC|GMT|[-+]\d\d:?\d\d|[-+]\d\d)?"
FORMS = [
    # 2024-03-01T10:00:00.010+01:00, 2024/03/01 10:00:00
    re.compile(rf"(?P<y>\d{{4}})[-/.](?P<m>\d\d?)[-/.](?P<d>\d\d?)(?:[T _]\s*{CLOCK}{ZONE})?", re.ASCII),
    # 01-Mar-2024 10:00:00.010
    re.compile(
        rf"(?P<d>\d\d?)[-/. ](?P<name>[A-Za-z]{{3,9}})[-/. ,]+(?P<y>\d{{4}})(?:[T ,_]\s*{CLOCK}{ZONE})?", re.ASCII
    ),
    # Mar 1, 2024 10:00:00 PM
    re.compile(rf"(?P<name>[A-Za-z]{{3,9}})\.? (?P<d>\d\d?),? (?P<y>\d{{4}})(?:[T ,_]\s*{CLOCK}{ZONE})?", re.ASCII),
    # 01/03/2024 10:00:00: day and month either way round; see `seconds_of_dates`
    re.compile(rf"(?P<d>\d\d?)[-/.](?P<m>\d\d?)[-/.](?P<y>\d{{4}})(?:[T ,_]\s*{CLOCK}{ZONE})?", re.ASCII),
    # 10:00:00.010
    re.compile(rf"{CLOCK}{ZONE}", re.ASCII),
]
DAY = 86400.0
LIKE_DATE = re.compile(r"\d{1,4}[-/.]\w{1,9}[-/.]\d{2,4}|\d{1,2}:\d\d|[A-Za-z]{3,9}\.? \d{1,2},? \d{4}", re.ASCII)


def is_date(cell: str) -> bool:
    """Whether a cell holds a date or a time of day."""
    return len(cell) <= 64 and bool(LIKE_DATE.match(cell)) and _match(cell) is not None


def seconds_of_dates(cells: Sequence[str]) -> NDArray[np.float64] | int:
    """Return dates as seconds since 1970 (UTC unless they name a zone), times of day as seconds since midnight.

    A time of day that falls back by more than half a day is of the next day. Where day and month could be either way
    round the day comes first, unless a second number above 12 says otherwise.

    Returns
    -------
    ndarray, shape (N,), or int
        Seconds, NaN for empty cells; or the index of the first cell that is no date.
    """
    swapped = any((f := FORMS[3].fullmatch(c.strip())) and int(f["m"]) > 12 for c in (*cells[:1000], *cells[-1:]))
    times = np.empty(len(cells))
    of_day = False
    cache: dict[str, datetime] = {}
    for k, raw in enumerate(cells):
        cell = raw.strip()
        if not cell:
            times[k] = np.nan
            continue
        found = _match(cell)
        if found is None:
            return k
        try:
            times[k], clock_only = _seconds(found, swapped, cache)
        except (ValueError, OverflowError):
            return k
        of_day |= clock_only
    if of_day:
        with np.errstate(invalid="ignore"):
            times[1:] += DAY * np.cumsum(np.diff(times) < -DAY / 2)
    return times


def _match(cell: str) -> re.Match[str] | None:
    return next((found for form in FORMS if (found := form.fullmatch(cell.strip()))), None)


def _seconds(found: re.Match[str], swapped: bool, cache: dict[str, datetime]) -> tuple[float, bool]:
    part = found.groupdict()
    hour, minute, second = (int(part.get(name) or 0) for name in ("h", "min", "s"))
    if part.get("noon"):
        hour = hour % 12 + 12 * (part["noon"][0] in "pP")
    if hour > 23 or minute > 59 or second > 60:
        raise ValueError
    seconds = 3600.0 * hour + 60.0 * minute + second + float(f"0.{part.get('part') or 0}")
    zone = part.get("zone") or ""
    if zone[:1] in "+-" and zone:
        digits = zone[1:].replace(":", "").ljust(4, "0")
        seconds -= (-1.0 if zone[0] == "-" else 1.0) * (3600.0 * int(digits[:2]) + 60.0 * int(digits[2:]))
    if "y" not in part:
        return seconds, True
    key = f"{part['y']} {part.get('m')} {part.get('name')} {part['d']}"
    if key not in cache:
        if name := part.get("name"):
            month, day = MONTHS.get(name[:3].lower(), 0), int(part["d"])
        else:
            month, day = int(part["m"]), int(part["d"])
            if swapped and found.re is FORMS[3]:
                month, day = day, month
        cache[key] = datetime(int(part["y"]), month, day, tzinfo=UTC)
    return (cache[key] - datetime(1970, 1, 1, tzinfo=UTC)) / timedelta(seconds=1) + seconds, False
