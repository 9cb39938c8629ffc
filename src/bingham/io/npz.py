"""``.npz`` archives: whole recordings and tracks, every bit of every number kept."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np

from bingham.atomic import replaced
from bingham.errors import RecordingError
from bingham.io.bounds import check_size
from bingham.io.checks import damaged, existing, note
from bingham.io.fields import Fields
from bingham.io.registry import Format
from bingham.io.trial import trial
from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["Archive", "load_archive", "load_array", "read_npz", "save_archive", "write_npz"]

# The archive's field `format` says which of these it holds; archives without it hold somebody else's arrays.
IMU, ORIENTATIONS = "bingham-imu-1", "bingham-orientations-1"

LONGEST_TEXT = 16_384  # bytes

ORIENTATION_FIELDS = ("time", "orientation", "position", "truth", "score")
BESIDE_FIELDS = ("time", "orientation", "covariance")
IMU_FIELDS = ("time", "gyroscope", "accelerometer", "magnetometer", "reference", "score")


def read_npz(path: str | Path) -> ImuRecording | OrientationRecording:
    """Read a recording written by `write_npz`, or the plain arrays that `bingham.io.trial` lists.

    Parameters
    ----------
    path : str or Path
        Archive.

    Returns
    -------
    ImuRecording or OrientationRecording
        What the fields of the archive make.

    Raises
    ------
    RecordingError
        If the archive is damaged or a field is missing or malformed.
    """
    path = existing(path)
    content = Archive(path)
    if "format" not in content:
        return trial(path, content)
    kind = _text(path, content, "format")
    fields = Fields(path, content)
    if kind == ORIENTATIONS:
        values = {"orientation": fields.as_numbers("orientation")} | _present(fields, ORIENTATION_FIELDS)
        return fields.build(OrientationRecording, {}, name=_text(path, content, "name"), **values)
    if kind != IMU:
        raise RecordingError(path, "field format", f"is {kind!r}", f"a recording has {IMU!r} or {ORIENTATIONS!r}")
    truth = None
    if "truth_time" in content:
        names = {name: f"truth_{name}" for name in ORIENTATION_FIELDS}
        values = _present(fields, ORIENTATION_FIELDS, "truth_")
        truth = fields.build(OrientationRecording, names, name=_text(path, content, "truth_name"), **values)
    orientations = None
    if "beside_time" in content:
        names = {name: f"beside_{name}" for name in BESIDE_FIELDS}
        values = _present(fields, BESIDE_FIELDS, "beside_")
        orientations = fields.build(OrientationRecording, names, name=_text(path, content, "beside_name"), **values)
    known = ("format", "name", "earth_frame", "truth_name", *IMU_FIELDS, *(f"truth_{n}" for n in ORIENTATION_FIELDS))
    known += ("beside_name", *(f"beside_{n}" for n in BESIDE_FIELDS))
    if unknown := [name for name in content if name not in known]:
        note(path, f"unknown fields left out: {', '.join(unknown)}; known: {' '.join(IMU_FIELDS)}")
    values = {"gyroscope": fields.as_numbers("gyroscope")} | _present(fields, IMU_FIELDS)
    about = {"name": _text(path, content, "name"), "earth_frame": _text(path, content, "earth_frame"), "truth": truth}
    about["orientations"] = orientations
    return fields.build(ImuRecording, {}, **about, **values)


def write_npz(path: str | Path, recording: ImuRecording | OrientationRecording) -> None:
    """Write a recording, whole or not at all; `read_npz` gives back the same bits.

    Parameters
    ----------
    path : str or Path
        File to write or replace.
    recording : ImuRecording or OrientationRecording
        What to write.
    """
    content: dict[str, Any] = {"name": recording.name}
    if isinstance(recording, ImuRecording):
        content |= {"format": IMU, "earth_frame": recording.earth_frame}
        content |= {name: getattr(recording, name) for name in IMU_FIELDS}
        if recording.truth is not None:
            content["truth_name"] = recording.truth.name
            content |= {f"truth_{name}": getattr(recording.truth, name) for name in ORIENTATION_FIELDS}
        if (seen := recording.orientations) is not None:
            content["beside_name"] = seen.name
            content |= {f"beside_{name}": getattr(seen, name) for name in BESIDE_FIELDS}
    else:
        content |= {"format": ORIENTATIONS} | {name: getattr(recording, name) for name in ORIENTATION_FIELDS}
    save_archive(path, content)


class Archive(Mapping[str, Any]):
    """Arrays of an npz archive, each read when it is asked for; nothing in them is executed.

    Parameters
    ----------
    path : Path
        File.

    Raises
    ------
    RecordingError
        If it is no such archive; when an array is asked for that is damaged, of objects, or larger than plausible.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        with path.open("rb") as file:
            if file.read(4) != b"PK\x03\x04":
                raise RecordingError(path, "", "not an npz archive", "save named arrays by numpy.savez")
        try:
            with zipfile.ZipFile(path) as archive:
                names = [info.filename for info in archive.infolist()]
        except Exception as error:  # zipfile raises whatever it stumbles over
            raise damaged(path, "npz archive", error) from error
        if not any(name.endswith(".npy") for name in names):
            if "[Content_Types].xml" in names:
                raise RecordingError(path, "", "a spreadsheet", "save it as CSV")
            problem = f"a zip archive of {', '.join(names[:3]) or 'nothing'}, not of arrays"
            raise RecordingError(path, "", problem, "unpack it and give what is in it")
        self._members = {name.removesuffix(".npy"): name for name in names if name.endswith(".npy")}
        self._read: dict[str, Any] = {}

    def __iter__(self) -> Iterator[str]:
        return iter(self._members)

    def __len__(self) -> int:
        return len(self._members)

    def __getitem__(self, name: str) -> Any:
        if name not in self._read:
            if name not in self._members:
                raise KeyError(name)
            self._read[name] = self._array(name)
        return self._read[name]

    def _array(self, name: str) -> Any:
        others = sum(getattr(values, "nbytes", 0) for values in self._read.values())
        try:
            with zipfile.ZipFile(self._path) as archive:
                return _checked(self._path, f"field {name}", lambda: archive.open(self._members[name]), others)
        except RecordingError:
            raise
        except Exception as error:  # NumPy and zipfile raise whatever they stumble over
            raise damaged(self._path, "npz archive", error) from error


def load_array(path: Path) -> Any:
    """Return the array of an npy file, its declared size compared with that of the file first."""
    try:
        return _checked(path, "array", lambda: path.open("rb"))
    except (RecordingError, OSError):
        raise
    except Exception as error:
        raise damaged(path, "npy file", error) from error


def _checked(path: Path, place: str, opened: Callable[[], IO[bytes]], others: float = 0.0) -> Any:
    """Read an array of no objects, after a look at the size that its header declares."""
    with opened() as file:
        version = np.lib.format.read_magic(file)
        read_header = np.lib.format.read_array_header_1_0
        shape, _, dtype = (read_header if version == (1, 0) else np.lib.format.read_array_header_2_0)(file)
    if dtype.hasobject:
        raise RecordingError(path, place, "holds objects", "numbers are expected")
    check_size(path, place, float(math.prod(shape) * max(dtype.itemsize, 8) + others))
    with opened() as file:
        return np.lib.format.read_array(file, allow_pickle=False)


def load_archive(path: Path) -> dict[str, Any]:
    """Return all arrays of an archive."""
    return dict(Archive(path))


def save_archive(path: str | Path, content: Mapping[str, Any]) -> None:
    """Write the arrays that are not None, whole or not at all."""
    with replaced(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **{name: value for name, value in content.items() if value is not None})


def _present(fields: Fields, names: tuple[str, ...], prefix: str = "") -> dict[str, Any]:
    """Fields of a recording that the archive has; the recording type checks their shapes."""
    there: dict[str, Any] = {"time": fields.as_numbers(prefix + "time")}
    for name in names:
        if (own := prefix + name) in fields.content and name != "time":
            there[name] = fields.flags(own) if name == "score" else fields.as_numbers(own)
    return there


def _text(path: Path, content: Mapping[str, Any], name: str) -> str:
    """Return a field of text, "" where it is absent."""
    values = content.get(name)
    if values is None:
        return ""
    if values.dtype.kind not in "US" or values.size != 1 or values.nbytes > LONGEST_TEXT:
        raise RecordingError(path, f"field {name}", "is no text", "copy the file again")
    try:
        return str(values.ravel()[0] if values.dtype.kind == "U" else values.ravel()[0].decode("utf-8"))
    except (ValueError, SystemError, UnicodeError):
        raise RecordingError(path, f"field {name}", "is damaged text", "copy the file again") from None


FORMAT = Format(
    name="npz",
    title="npz",
    expects="arrays by name, see `Arrays of an npz file`_; also what `write_npz` writes",
    functions=("read_npz", "write_npz"),
    read=read_npz,
    signatures=(b"PK\x03\x04",),
)
