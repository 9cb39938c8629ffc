"""Long recordings of an inertial sensor piece by piece, so that memory does not grow with their length.

What is usual is told by the first ``HEAD`` rows; everything else is put right as `bingham.io.assemble` does it with the
whole, and counted over all pieces. What cannot be put right without the whole raises `WholeNeededError`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError
from bingham.io.assemble import check_measurable, say_zero_rows, say_zero_samples, zero_rows
from bingham.io.checks import HEAD, Place, build_of_units, check_seconds, repaired
from bingham.io.clock import say_if_rounded
from bingham.io.counts import reject_counts
from bingham.io.running_clock import RunningClock, WholeNeededError
from bingham.io.samples import Plan, like_spreadsheet, plan_of, present
from bingham.io.table import Table, read_batches
from bingham.recording import ImuRecording

__all__ = ["WholeNeededError", "pieces_of_csv", "read_pieces"]

FloatArray = NDArray[np.float64]
SENSORS = ("gyroscope", "accelerometer", "magnetometer")


def read_pieces(path: str | Path, *, rows: int = HEAD, **options: Any) -> Iterator[ImuRecording]:
    r"""Read a long recording of an inertial sensor from a table of text in pieces of so many rows.

    Parameters
    ----------
    path : str or Path
        File.
    rows : int
        Samples in a piece; fewer in the last.
    **options
        Those of `read_csv`, without angles and regularise.

    Yields
    ------
    ImuRecording
        What `read_csv` would read, in parts; each without checks of its own beyond those of rows.

    Warns
    -----
    RepairWarning
        With the last piece, of what was put right in all of them; `read_csv` says the same.

    Raises
    ------
    RecordingError
        As `read_csv`; also if rows have to be looked at together, as those of sensors with clocks of their own.

    Examples
    --------
    >>> import tempfile, bingham
    >>> file = Path(tempfile.mkdtemp()) / "still.csv"
    >>> _ = file.write_text("t,gx,gy,gz,ax,ay,az\n" + "".join(f"{k / 100},0,0,0.1,0,0,9.81\n" for k in range(50)))
    >>> [piece.size for piece in bingham.io.read_pieces(file, rows=20)]
    [20, 20, 10]
    """
    try:
        yield from rechunked(pieces_of_csv(path, **options), rows)
    except WholeNeededError as why:
        raise RecordingError(path, "", f"{why}: not to be read in pieces", "read it as a whole: read_csv") from None


def rechunked(pieces: Iterator[ImuRecording], rows: int) -> Iterator[ImuRecording]:
    """Yield a recording in pieces of the same number of rows."""
    waiting: list[ImuRecording] = []
    size = 0
    for piece in pieces:
        waiting.append(piece)
        size += piece.size
        while size >= rows:
            whole = _joined(waiting)
            yield _part(whole, slice(0, rows))
            size -= rows
            waiting = [_part(whole, slice(rows, None))] if size else []
    if waiting:
        yield _joined(waiting)


def pieces_of_csv(path: str | Path, *, earth_frame: str | None = None, **options: Any) -> Iterator[ImuRecording]:
    """Yield pieces as they come out of the file.

    Raises
    ------
    WholeNeededError
        If rows have to be looked at together.
    """
    plan = plan_of(path, **options)
    known = {"time", *SENSORS}
    if plan.written or plan.meaning.bare or plan.counter is not None or plan.dated or not plan.groups.keys() <= known:
        raise WholeNeededError("more than an inertial sensor with times in numbers")
    if "accelerometer" not in plan.groups:
        raise WholeNeededError("no accelerometer")
    frame = earth_frame or (plan.meaning.preset and plan.meaning.preset.earth_frame) or "ENU"
    mending = _Mending(plan)
    for k, (table, values) in enumerate(_tables(plan)):
        piece = mending.mended(table, values, head=k == 0)
        if not len(piece["time"]):
            continue
        about = {"name": plan.text.path.stem, "earth_frame": frame}
        if mending.checked:
            yield _unchecked(about | piece)
            continue
        mending.checked = True
        if mending.steady:
            say_if_rounded(plan.text.path, piece["time"][:HEAD], "")
        yield build_of_units(ImuRecording, plan.text.path, mending.where, about | piece)
    if not mending.checked:
        raise WholeNeededError("no samples at all")
    mending.finish()


def _tables(plan: Plan) -> Iterator[tuple[Table, dict[str, FloatArray]]]:
    """Yield rows as they are read, the first ``HEAD`` of them at once."""
    kinds = dict.fromkeys(plan.numbers, "number")
    first, waiting, size = 0, list[dict[int, Any]](), 0
    for batch in read_batches(plan.text, plan.layout, kinds):
        waiting.append(batch)
        size += len(next(iter(batch.values())))
        if first or size >= HEAD:
            table = Table(plan.text, plan.layout, _concatenated(waiting), first=first)
            yield table, plan.values(table)
            first, waiting, size = first + size, [], 0
    if waiting:
        table = Table(plan.text, plan.layout, _concatenated(waiting), first=first)
        yield table, plan.values(table)


def _concatenated(batches: list[dict[int, Any]]) -> dict[int, Any]:
    if len(batches) == 1:
        return batches[0]
    return {k: np.concatenate([batch[k] for batch in batches]) for k in batches[0]}


class _Mending:
    """Puts right piece after piece what `bingham.io.assemble` puts right in the whole, and counts."""

    def __init__(self, plan: Plan) -> None:
        self.checked = False
        self.steady = False
        self.where: Place = lambda field, k: ""
        self._plan = plan
        self._path = plan.text.path
        self._read = 0
        self._clock = RunningClock(self._path)
        self._counts: dict[str, tuple[int, int]] = {}

    def mended(self, table: Table, values: dict[str, FloatArray], *, head: bool) -> dict[str, FloatArray]:
        """Return the fields of a piece."""
        place, path = self._plan.place(table), self._path
        if head:
            reject_counts(path, values, self._plan.meaning.found)
        time = self._seconds(table, place, head=head)
        rows = np.arange(len(time))
        self.where = where = lambda field, k: place(field, int(rows[k]))
        base = present(values["gyroscope"])
        self._count("empty", int(np.count_nonzero(~base)), len(base))
        if not base.all():
            if any((present(v) & ~base).any() for v in values.values()):
                raise WholeNeededError("sensors have rows of their own")
            rows = rows[base]
            time, values = time[base], {name: v[base] for name, v in values.items()}
        for name, v in values.items():
            check_measurable(path, where, name, v)
        empty = zero_rows(values["gyroscope"], values["accelerometer"])
        self._count("zero", 0 if empty is None else int(np.count_nonzero(empty)), len(time))
        if empty is not None:
            if empty.all() and head:
                raise WholeNeededError("nothing but zeros")
            rows = rows[~empty]
            time, values = time[~empty], {name: v[~empty] for name, v in values.items()}
        time, kept = self._clock.mended(time, where, head=head)
        if kept is not None:
            rows = rows[kept]
            values = {name: v[kept] for name, v in values.items()}
        self.steady = len(time) > self._clock.enough
        return {"time": time} | {name: self._without_zeros(name, v, head=head) for name, v in values.items()}

    def finish(self) -> None:
        """Say what was put right, over all pieces."""
        for what, (count, size) in self._counts.items():
            if what == "empty" and count:
                repaired(self._path, f"{count} of {size} rows hold no sample, left out")
            elif what == "zero" and count:
                say_zero_rows(self._path, count, size)
        self._clock.finish()
        for what, (count, size) in self._counts.items():
            if what in SENSORS and count:
                say_zero_samples(self._path, what, count, size)

    def _seconds(self, table: Table, place: Place, *, head: bool) -> FloatArray:
        found = self._plan.meaning.found
        rate = self._plan.rate or self._plan.meaning.rate
        size = len(table)
        if rate is not None and ("t" not in found.column or found.column["t"] not in table.columns):
            time = np.arange(self._read, self._read + size) / rate
        else:
            time = table.columns[found.column["t"]] * found.factor["t"]
            if head and "time" not in found.told and like_spreadsheet(time):
                raise WholeNeededError("days of a spreadsheet")
            if head:
                check_seconds(self._path, place, time, inertial=True)
        self._read += size
        return time

    def _without_zeros(self, name: str, values: FloatArray, *, head: bool) -> FloatArray:
        """Take rows of zeros of an accelerometer or magnetometer for missing ones."""
        finite = np.isfinite(values)
        if not finite.all() and (name == "gyroscope" or (finite.any(axis=1) & ~finite.all(axis=1)).any()):
            raise WholeNeededError("rows that are not complete")
        if name == "gyroscope":
            return values
        empty = zero_rows(values)
        self._count(name, 0 if empty is None else int(np.count_nonzero(empty)), len(values))
        if empty is None:
            return values
        if empty.all() and head:
            raise WholeNeededError(f"nothing but zeros of the {name}")
        return np.where(empty[:, None], np.nan, values)

    def _count(self, what: str, count: int, size: int) -> None:
        before = self._counts.get(what, (0, 0))
        self._counts[what] = (before[0] + count, before[1] + size)


def _unchecked(content: dict[str, Any]) -> ImuRecording:
    """Return a recording of rows that have been looked at; what is usual in so few of them is not asked."""
    part = object.__new__(ImuRecording)
    for name in ImuRecording.__dataclass_fields__:
        object.__setattr__(part, name, content.get(name))
    return part


def _content(recording: ImuRecording) -> dict[str, Any]:
    return {name: getattr(recording, name) for name in ImuRecording.__dataclass_fields__}


def _joined(pieces: list[ImuRecording]) -> ImuRecording:
    if len(pieces) == 1:
        return pieces[0]
    parts = [_content(piece) for piece in pieces]
    arrays = {
        name: np.concatenate([part[name] for part in parts])
        for name, value in parts[0].items()
        if isinstance(value, np.ndarray)
    }
    return _unchecked(parts[0] | arrays)


def _part(recording: ImuRecording, rows: slice) -> ImuRecording:
    content = _content(recording)
    arrays = {name: value[rows] for name, value in content.items() if isinstance(value, np.ndarray)}
    return _unchecked(content | arrays)
