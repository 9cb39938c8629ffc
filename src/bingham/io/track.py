"""Tracks, the output of a filter, as npz to go on from; as tables to look at: `track_csv`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io.checks import existing
from bingham.io.fields import Fields
from bingham.io.npz import load_archive, save_archive
from bingham.io.track_fields import PER_ROW, content_of
from bingham.io.track_npz import expanded, reduced
from bingham.recording import OrientationRecording

if TYPE_CHECKING:
    from bingham.filters.imu_track import ImuTrack
    from bingham.filters.track import Track

__all__ = ["TRACK", "read_track", "write_track_npz"]

TRACK = "bingham-track-1"
# What the uncertainty is told by, and more than any of it can be.
UNCERTAINTY = {"rotation_covariance", "rotation_covariance_upper", "covariance", "concentrations", "frames", "matrices"}
LARGEST = 1e100


def write_track_npz(
    path: str | Path,
    track: Track[Any] | ImuTrack | Mapping[str, Any] | None = None,
    *,
    time: ArrayLike | None = None,
    modes: ArrayLike | None = None,
    matrices: ArrayLike | None = None,
    **more: ArrayLike | str | None,
) -> None:
    """Write a track with its full state, atomically; `read_track` gives back the same bits.

    Parameters
    ----------
    path : str or Path
        File to write or replace.
    track : Track, ImuTrack or mapping, optional
        Where everything comes from that is not given by name. Of a `Track`: ``concentrations`` and ``frames``, whose
        last rows ``Bingham.from_spectrum`` makes the distribution to go on from, of an `ImuTrack`: ``state``, for
        `ImuState.from_json`.
    time : array_like, shape (T,)
        Seconds; needed with a track that has none.
    modes : array_like, shape (T, d)
        Most probable orientations; needed without a track.
    matrices : array_like, shape (T, d, d), optional
        Parameters of the distributions.
    **more
        Any further array or text of the track, as ``log_evidence``, ``covariance``, ``covariance_frame``,
        ``concentrations``, ``accepted``, ``reason``, and the state to go on from (``state_z``, ``state_M``).
    """
    if track is not None:
        own = content_of(track)
        own_time, own_modes = own.pop("time", None), own.pop("modes", None)
        time, modes = own_time if time is None else time, own_modes if modes is None else modes
        more = own | more
    for name, value in (("time", time), ("modes", modes)):
        if value is None:
            raise InvalidArgumentError(
                name, "an array", "None", f"give {name}=" + (", or a track" if track is None else "")
            )
    modes = _array("modes", modes, (None, None))
    size, dim = modes.shape
    content: dict[str, Any] = {"format": TRACK, "time": _array("time", time, (size,)), "modes": modes}
    if matrices is not None:
        content["matrices"] = _array("matrices", matrices, (size, dim, dim))
    content |= {name: None if value is None else _plain(name, value) for name, value in more.items()}
    save_archive(path, reduced(content))


def read_track(path: str | Path) -> dict[str, Any]:
    """Return what `write_track_npz` was given, and what follows from it: ``covariance``, ``matrices`` from z and M.

    ``write_track_npz(copy, **read_track(path))`` makes an equal file.

    Parameters
    ----------
    path : str or Path
        Archive.

    Returns
    -------
    dict of str to ndarray or str
        Texts as ``str``, everything else as arrays.

    Raises
    ------
    RecordingError
        If the archive is damaged, holds no track, or its fields do not fit together.
    """
    path = existing(path)
    content = load_archive(path)
    kind = str(content.pop("format", "absent"))
    if kind != TRACK or not {"time", "modes"} <= content.keys():
        raise RecordingError(path, "field format", f"is {kind!r}", f"a track has {TRACK!r}, time and modes")
    # A track is a recording of its modes and obeys the same rules; it may begin before its first estimate.
    names = {"orientation": "modes"}
    modes = np.array(content["modes"])
    if modes.ndim == 2 and modes.shape[0] and modes.dtype.kind == "f":
        modes[: int(np.argmin(np.isnan(modes).all(axis=1)))] = np.eye(1, modes.shape[1])
    fields = Fields(path, content)
    fields.build(OrientationRecording, names, time=content["time"], orientation=modes)
    for name in PER_ROW.keys() & content.keys():
        expected = (len(modes), *(modes.shape[1] if n == "d" else n for n in PER_ROW[name]))
        by_sensor = name in ("decision", "nis") and content[name].ndim == 2  # (T, n) where there are n sensors
        if (content[name].shape[:1] if by_sensor else content[name].shape) != expected:
            got = f"of shape {content[name].shape}, not {expected}"
            raise RecordingError(path, f"field {name}", got, "write the track again")
    for name in UNCERTAINTY & content.keys():
        values = fields.as_numbers(name)
        if (size := float(np.max(np.abs(values), initial=0.0, where=~np.isnan(values)))) > LARGEST:
            raise RecordingError(path, f"field {name}", f"has a value of size {size:g}", "write the track again")
    content = expanded(content)
    return {
        k: str(v) if isinstance(v, np.ndarray) and v.dtype.kind == "U" and not v.ndim else v for k, v in content.items()
    }


def _array(name: str, values: ArrayLike | None, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != len(shape) or any(want not in (None, have) for want, have in zip(shape, array.shape, strict=True)):
        expected = ", ".join("any" if n is None else str(n) for n in shape)
        raise InvalidArgumentError(name, f"shape ({expected})", f"shape {array.shape}")
    return array


def _plain(name: str, values: ArrayLike | str) -> NDArray[Any]:
    array = np.asarray(values)
    if array.dtype.kind not in "biufU":
        raise InvalidArgumentError(name, "an array of numbers, booleans or texts", f"type {array.dtype}")
    return array
