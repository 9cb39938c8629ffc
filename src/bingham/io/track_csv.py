"""Tracks as tables: CSV for people and other programs, Parquet for data frames; written piece by piece."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

from bingham.atomic import replaced
from bingham.errors import InvalidArgumentError, MissingExtraError
from bingham.io.track_fields import PER_ROW, Column, content_of, table

if TYPE_CHECKING:
    from bingham.filters.imu_track import ImuTrack
    from bingham.filters.track import Track

__all__ = ["CsvTable", "ParquetTable", "write_track_csv"]

Frame = Literal["body", "world"]

# Lines that are formatted at once.
BLOCK = 4096

ABOUT = {
    "qw": "q: quaternion, Hamilton, scalar first, body to world; the signs are the filter's",
    "ux": "axes in the plane: unit vectors, of which ux, uy and -ux, -uy are the same",
    "roll_deg": "roll, pitch, yaw: body to world, intrinsic z, y', x''",
    "heading_std_deg": "heading_std_deg, inclination_std_deg: standard deviations; an unknown heading has 103.9",
    "bias_x_rad_s": "bias: of the gyroscope, body axes",
    "cov_xx": "cov: of a small rotation vector, rad^2, frame: {frame}; empty: undefined; unknown angles have pi^2/3",
    "z1": "z: concentrations, ascending; the mode belongs to the last, which is 0",
    "log_evidence": "log_evidence: log of the predictive density of the measurements of the row",
}


def write_track_csv(
    path: str | Path,
    track: Track[Any] | ImuTrack | Mapping[str, Any],
    *,
    fields: Sequence[str] | None = None,
    frame: Frame = "world",
) -> None:
    """Write a track as CSV, atomically: ``time_s`` and the columns of the chosen fields.

    Comment lines name conventions, frames and units. Times, unit vectors have 9 decimals, degrees 6, other numbers 6 to
    10 significant digits; the npz file keeps every bit. `read_csv` takes such a file as a recording of orientations.

    Parameters
    ----------
    path : str or Path
        File to write or replace.
    track : Track, ImuTrack or mapping
        What a filter returned, with times, or arrays by name as `read_track` gives them; ``time`` and ``modes`` at
        least.
    fields : sequence of str, optional
        Some of quaternion, euler (roll, pitch, yaw), deviation (of heading and inclination), bias, bias_std,
        covariance, concentrations, evidence, rest, decision (of gate or magnetometer, with the reason); quaternion,
        euler, deviation and bias, those that there are, unless given. Axes in the plane have ux, uy and their angle.
    frame : {"world", "body"}
        Axes of the covariance.

    Raises
    ------
    InvalidArgumentError
        If it is no track, or has no such field.
    RecordingError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile, bingham
    >>> prior = bingham.Bingham([-50.0, -50.0, -50.0, 0.0], np.eye(4)[:, [1, 2, 3, 0]])
    >>> track = bingham.BinghamFilter(prior, prior).run(prior, prior.mode[None], times=[0.5])
    >>> file = Path(tempfile.mkdtemp()) / "one.csv"
    >>> bingham.io.write_track_csv(file, track, fields=["quaternion"])
    >>> print(file.read_text().splitlines()[-1])
    0.5,1,0,0,0
    """
    content = _checked(content_of(track))
    columns = table(content, fields, _frame(frame))
    with replaced(path) as temporary, CsvTable.open(temporary, frame) as file:
        file.append(columns)


class CsvTable:
    """A CSV file that grows by rows of the same columns."""

    def __init__(self, file: BinaryIO, frame: str) -> None:
        self._file = file
        self._frame = frame
        self._names: list[str] = []

    @classmethod
    @contextmanager
    def open(cls, path: Path, frame: str) -> Generator[CsvTable]:
        """Write at `path`, with the frame of the covariance."""
        with path.open("wb") as file:
            yield cls(file, frame)

    def append(self, columns: Sequence[Column]) -> None:
        """Write rows; before the first ones what the columns mean and their names."""
        if not self._names:
            self._names = [column.name for column in columns]
            lines = [ABOUT[name].format(frame=self._frame) for name in self._names if name in ABOUT]
            text = "".join(f"# {line}\n" for line in ["bingham track", *lines]) + ",".join(self._names) + "\n"
            self._file.write(text.encode())
        from bingham.kernels.decimal import LONGEST, TENS, write_rows

        numbers = [column for column in columns if column.values.dtype.kind != "U"]
        codes, words, ends = _coded([column for column in columns if column.values.dtype.kind == "U"])
        digits = np.array([column.digits for column in numbers])
        size = len(columns[0].values)
        longest = int(np.max(np.diff(ends), initial=0)) + 2
        out = np.empty(min(size, BLOCK) * (LONGEST * len(numbers) + longest), dtype=np.uint8)
        for first in range(0, size, BLOCK):
            rows = slice(first, first + BLOCK)
            values = np.column_stack([column.values[rows] for column in numbers]).astype(np.float64, copy=False)
            length = write_rows(np.ascontiguousarray(values), digits, TENS, codes[rows], words, ends, out)
            self._file.write(out[:length].data)


class ParquetTable:
    """A Parquet file that grows by rows of the same columns."""

    def __init__(self, path: Path, frame: str, *, single: bool = False) -> None:
        try:
            import pyarrow as arrow
            import pyarrow.parquet as parquet
        except ImportError as error:
            raise MissingExtraError("pyarrow", "io", "writing Parquet") from error
        self._arrow, self._parquet = arrow, parquet
        self._path, self._frame, self._single = path, frame, single
        self._writer: Any = None

    def append(self, columns: Sequence[Column]) -> None:
        """Write rows; the frame of the covariance and what columns mean is in the metadata."""
        arrays = {column.name: self._cell(column) for column in columns}
        about = {name: ABOUT[name].format(frame=self._frame) for name in arrays if name in ABOUT}
        rows = self._arrow.table(arrays).replace_schema_metadata(about)
        if self._writer is None:
            self._writer = self._parquet.ParquetWriter(self._path, rows.schema, compression="zstd")
        self._writer.write_table(rows)

    def close(self) -> None:
        """Write what belongs at the end."""
        if self._writer is not None:
            self._writer.close()

    def _cell(self, column: Column) -> NDArray[Any]:
        single = self._single and column.name != "time_s" and column.values.dtype == np.float64
        return column.values.astype(np.float32) if single else column.values


def _coded(texts: Sequence[Column]) -> tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.int64]]:
    """Return codes, words and their ends of a column of texts, empty ones where there is none."""
    if not texts:
        return np.empty(0, np.int64), np.empty(0, np.uint8), np.zeros(1, np.int64)
    found, codes = np.unique(texts[0].values, return_inverse=True)
    words = [_quoted(str(text)).encode() for text in found]
    ends = np.concatenate([[0], np.cumsum([len(word) for word in words])])
    return codes.astype(np.int64), np.frombuffer(b"".join(words), dtype=np.uint8).copy(), ends.astype(np.int64)


def _quoted(text: str) -> str:
    text = " ".join(text.split())
    return '"' + text.replace('"', '""') + '"' if set(text) & set(',"') else text


def _frame(frame: str) -> str:
    if frame not in ("body", "world"):
        raise InvalidArgumentError("frame", "'body' or 'world'", repr(frame))
    return frame


def _checked(content: dict[str, Any]) -> dict[str, Any]:
    """Return what is given by name as arrays that fit together."""
    for name in ("time", "modes"):
        if content.get(name) is None:
            raise InvalidArgumentError(name, "an array", "None", "filter with times=, or give it by name")
    size = len(np.asarray(content["time"]))
    modes = np.shape(content["modes"])
    if len(modes) != 2 or modes[1] not in (2, 4):
        raise InvalidArgumentError("modes", "shape (T, 2) or (T, 4)", f"shape {modes}")
    for name, value in content.items():
        if value is None or name not in PER_ROW:
            continue
        expected = (size, *(modes[1] if n == "d" else n for n in PER_ROW[name]))
        if np.shape(value) != expected:
            raise InvalidArgumentError(name, f"shape {expected}, a row for each time", f"shape {np.shape(value)}")
    if content.get("covariance") is not None and content.get("covariance_frame") not in ("body", "world"):
        raise InvalidArgumentError("covariance_frame", "'body' or 'world'", repr(content.get("covariance_frame")))
    return content
