"""Named arrays of a binary file, with the name of the field in everything that goes wrong."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError
from bingham.io import checks
from bingham.io.assemble import Stream, inertial_recording
from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["Fields"]

R = TypeVar("R", ImuRecording, OrientationRecording)


@dataclass(frozen=True, slots=True, eq=False)
class Fields:
    """Arrays of a file under their names.

    Parameters
    ----------
    path : Path
        The file, for messages.
    content : mapping of str to array_like
        Its fields.
    """

    path: Path
    content: Mapping[str, Any]

    def array(self, name: str) -> NDArray[Any]:
        """Return a field as it is."""
        if name not in self.content:
            there = " ".join(k for k in self.content if not k.startswith("_")) or "none"
            raise RecordingError(self.path, f"field {name}", "is missing", f"fields in the file: {there}")
        return np.asarray(self.content[name])

    def as_numbers(self, name: str) -> NDArray[np.float64]:
        """Return a real numeric field as float64."""
        values = self.array(name)
        if values.dtype.kind not in "biuf":
            raise RecordingError(self.path, f"field {name}", f"of type {values.dtype}", "numbers are expected")
        with np.errstate(invalid="ignore", over="ignore"):  # what does not fit is infinite, which is looked for
            return values.astype(np.float64)

    def rows(self, name: str, width: int | None) -> NDArray[np.float64]:
        """Return a field of shape (N, width), or (N,) if `width` is None."""
        values = self.as_numbers(name)
        if width is None and values.ndim == 2 and 1 in values.shape:
            values = values.ravel()  # MATLAB knows no vectors
        tail = () if width is None else (width,)
        if not values.ndim or values.shape[1:] != tail:
            expected = "(N,)" if width is None else f"(N, {width})"
            raise RecordingError(self.path, f"field {name}", f"of shape {values.shape}", f"expected shape {expected}")
        if not len(values):
            raise RecordingError(self.path, f"field {name}", "has no samples", "record or copy the file again")
        return values

    def quaternions(self, name: str) -> NDArray[np.float64]:
        """Return a field of unit quaternions, shape (N, 4), rounding fixed, rows of NaN kept."""
        return checks.normalised(self.path, name, self.rows(name, 4), self.place)

    def place(self, name: str, index: int) -> str:
        """Name a row of a field."""
        return f"field {name}, index {index}"

    def flags(self, name: str) -> NDArray[np.bool_]:
        """Return a field of 0 and 1, shape (N,)."""
        values = self.rows(name, None)
        if (wrong := ~np.isin(values, (0, 1))).any():
            k = int(np.argmax(wrong))
            raise RecordingError(self.path, self.place(name, k), f"is {values[k]:g}", "expected 0 or 1")
        return values == 1

    def positive(self, name: str) -> float:
        """Return a field of one positive finite number."""
        value = self.finite(name)
        if value <= 0:
            raise RecordingError(self.path, f"field {name}", f"is {value:g}", "expected one positive number")
        return value

    def finite(self, name: str) -> float:
        """Return a field of one finite number."""
        values = self.as_numbers(name).ravel()
        if values.shape != (1,) or not np.isfinite(values[0]):
            got = f"is {values[0]}" if values.size == 1 else f"has {values.size} numbers"
            raise RecordingError(self.path, f"field {name}", got, "expected one finite number")
        return float(values[0])

    def build(self, kind: type[R], names: Mapping[str, str], **values: Any) -> R:
        """Make a recording; `names` tells which field of the file each field of the recording came from."""
        size = np.size(values["time"])
        for field, value in values.items():
            if isinstance(value, np.ndarray) and len(np.atleast_1d(value)) != size:
                got = f"{len(np.atleast_1d(value))} rows beside {size} times"
                raise RecordingError(self.path, f"field {names.get(field, field)}", got, "copy the file again")
        return checks.build(kind, self.path, self._places(names), **values)

    def inertial(self, names: Mapping[str, str], *, regularise: bool = False, **values: Any) -> ImuRecording:
        """Make an inertial recording, its clock put right; `names` as for `build`."""
        time, gyroscope = values.pop("time"), values.pop("gyroscope")
        sensors = {"gyroscope": gyroscope} | {
            s: values.pop(s) for s in ("accelerometer", "magnetometer") if s in values
        }
        rows = {name: values.pop(name) for name in ("reference", "score") if values.get(name) is not None}
        for field, value in (sensors | rows).items():
            if value is not None and len(value) != len(time):
                got = f"{len(value)} rows beside {len(time)} times"
                raise RecordingError(self.path, f"field {names.get(field, field)}", got, "copy the file again")
        streams = {name: Stream(time, value) for name, value in sensors.items() if value is not None}
        place = self._places(names)
        return inertial_recording(self.path, place, streams, rows, regularise=regularise, units=False, **values)

    def _places(self, names: Mapping[str, str]) -> checks.Place:
        return lambda field, k: self.place(names.get(field, field), k)
