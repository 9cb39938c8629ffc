"""``.npz`` archives: whole recordings and tracks, every bit of every number kept."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bingham.atomic import replaced
from bingham.errors import RecordingError
from bingham.io.checks import damaged, existing, note
from bingham.io.fields import Fields
from bingham.io.trial import trial
from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["load_archive", "read_npz", "save_archive", "write_npz"]

# The archive's field `format` says which of these it holds; archives without it hold somebody else's arrays.
IMU, ORIENTATIONS = "bingham-imu-1", "bingham-orientations-1"

ORIENTATION_FIELDS = ("time", "orientation", "position", "truth", "score")
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
    content = load_archive(path)
    if "format" not in content:
        return trial(path, content)
    kind = str(content["format"])
    fields = Fields(path, content)
    if kind == ORIENTATIONS:
        return fields.build(
            OrientationRecording, {}, name=_text(content, "name"), **_present(fields, ORIENTATION_FIELDS)
        )
    if kind != IMU:
        raise RecordingError(path, "field format", f"is {kind!r}", f"a recording has {IMU!r} or {ORIENTATIONS!r}")
    truth = None
    if "truth_time" in content:
        names = {name: f"truth_{name}" for name in ORIENTATION_FIELDS}
        values = _present(fields, ORIENTATION_FIELDS, "truth_")
        truth = fields.build(OrientationRecording, names, name=_text(content, "truth_name"), **values)
    known = ("format", "name", "earth_frame", "truth_name", *IMU_FIELDS, *(f"truth_{n}" for n in ORIENTATION_FIELDS))
    if unknown := [name for name in content if name not in known]:
        note(f"{path}: unknown fields left out: {', '.join(unknown)}; known: {' '.join(IMU_FIELDS)}")
    values = _present(fields, IMU_FIELDS)
    about = {"name": _text(content, "name"), "earth_frame": _text(content, "earth_frame"), "truth": truth}
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
    else:
        content |= {"format": ORIENTATIONS} | {name: getattr(recording, name) for name in ORIENTATION_FIELDS}
    save_archive(path, content)


def load_archive(path: Path) -> dict[str, Any]:
    """Return all arrays of an archive; nothing in it is executed."""
    with path.open("rb") as file:
        if file.read(4) != b"PK\x03\x04":
            raise RecordingError(path, "", "not an npz archive", "save named arrays by numpy.savez")
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except Exception as error:  # NumPy and zipfile raise whatever they stumble over
        raise damaged(path, "npz archive", error) from error


def save_archive(path: str | Path, content: Mapping[str, Any]) -> None:
    """Write the arrays that are not None, whole or not at all."""
    with replaced(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **{name: value for name, value in content.items() if value is not None})


def _present(fields: Fields, names: tuple[str, ...], prefix: str = "") -> dict[str, Any]:
    """Fields of a recording that the archive has; the recording type checks their shapes."""
    there = {name: fields.array(prefix + name) for name in names if prefix + name in fields.content}
    return {"time": fields.array(prefix + "time")} | there


def _text(content: Mapping[str, Any], name: str) -> str:
    return str(content.get(name, ""))
