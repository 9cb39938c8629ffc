"""Tracks, the output of a filter: CSV to look at, npz to go on from."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.atomic import replaced
from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io.checks import existing
from bingham.io.fields import Fields
from bingham.io.npz import load_archive, save_archive
from bingham.recording import OrientationRecording

if TYPE_CHECKING:
    from bingham.filters.imu_track import ImuTrack
    from bingham.filters.track import BinghamTrack

__all__ = ["read_track", "write_track_csv", "write_track_npz"]

TRACK = "bingham-track-1"
PER_STEP = {"matrices", "covariance", "concentrations", "log_evidence", "accepted", "reason"}
MODES = {2: ["ux", "uy"], 4: ["qw", "qx", "qy", "qz"]}
ABOUT = {
    2: "axes in the plane: unit vectors, of which ux, uy and -ux, -uy are the same",
    4: "quaternions: Hamilton, scalar first, body to world",
}


def write_track_csv(
    path: str | Path,
    *,
    time: ArrayLike,
    modes: ArrayLike,
    covariance: ArrayLike | None = None,
    covariance_frame: str | None = None,
    concentrations: ArrayLike | None = None,
    log_evidence: ArrayLike | None = None,
    accepted: ArrayLike | None = None,
    reason: ArrayLike | None = None,
) -> None:
    """Write a track as CSV, whole or not at all.

    Comment lines state conventions, frames and units; then come the columns ``time_s, qw, qx, qy, qz, cov_xx, cov_xy,
    cov_xz, cov_yy, cov_yz, cov_zz, z1 … zd, log_evidence, accepted, reason``, those that are given. `read_csv` takes
    such a file as a recording of orientations.

    Parameters
    ----------
    path : str or Path
        File to write or replace.
    time : array_like, shape (T,)
        Seconds.
    modes : array_like, shape (T, d)
        Most probable orientations, d = 2 or 4; quaternions (w, x, y, z), body to world.
    covariance : array_like, shape (T, 3, 3), optional
        Of a small rotation vector, rad²; NaN, an empty cell, where undefined. An angle that may be anything has the
        variance π²/3 where a filter knows which angle that is.
    covariance_frame : {"body", "world"}
        Frame of the rotation vector; required with `covariance`.
    concentrations : array_like, shape (T, d), optional
        Ascending, the last 0.
    log_evidence : array_like, shape (T,), optional
        Log of the predictive density of the step's measurements.
    accepted : array_like of bool, shape (T,), optional
        What the gate decided.
    reason : array_like of str, shape (T,), optional
        Why.
    """
    names, values = ["time_s"], [_array("time", time, (None,))]
    size = len(values[0])
    modes = _array("modes", modes, (size, None))
    if modes.shape[1] not in MODES:
        raise InvalidArgumentError("modes", "shape (T, 2) or (T, 4)", f"shape {modes.shape}")
    names += MODES[modes.shape[1]]
    values += [*modes.T]
    about = [f"bingham track; {ABOUT[modes.shape[1]]}"]
    if covariance is not None:
        if covariance_frame not in ("body", "world"):
            raise InvalidArgumentError("covariance_frame", "'body' or 'world'", repr(covariance_frame))
        covariance = _array("covariance", covariance, (size, 3, 3))
        upper = list(zip(*np.triu_indices(3), strict=True))
        names += [f"cov_{'xyz'[i]}{'xyz'[j]}" for i, j in upper]
        values += [covariance[:, i, j] for i, j in upper]
        about.append(f"covariance: of a small rotation vector, rad^2, frame: {covariance_frame}; empty: undefined;")
        about.append("an angle that may be anything, as the heading at the start, has the variance pi^2/3 = 3.29")
    if concentrations is not None:
        concentrations = _array("concentrations", concentrations, (size, modes.shape[1]))
        names += [f"z{k + 1}" for k in range(modes.shape[1])]
        values += [*concentrations.T]
        about.append("z: concentrations, ascending; the mode belongs to the last, which is 0")
        if modes.shape[1] == 2:
            about.append("standard deviation of the angle, where small: 1 / sqrt(-2 z1) rad")
    if log_evidence is not None:
        names.append("log_evidence")
        values.append(_array("log_evidence", log_evidence, (size,)))
        about.append("log_evidence: log of the predictive density of the measurements of the row")
    rows: list[list[str]] = [
        ["" if value != value else repr(value) for value in row] for row in np.column_stack(values).tolist()
    ]
    if accepted is not None:
        names.append("accepted")
        for row, flag in zip(rows, _labels("accepted", accepted, size), strict=True):
            row.append(str(int(flag)))
    if reason is not None:
        names.append("reason")
        for row, text in zip(rows, _labels("reason", reason, size), strict=True):
            row.append(" ".join(str(text).split()))
    with replaced(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {line}\n" for line in about)
        csv.writer(file, lineterminator="\n").writerows([names, *rows])


def write_track_npz(
    path: str | Path,
    track: BinghamTrack | ImuTrack | None = None,
    *,
    time: ArrayLike | None = None,
    modes: ArrayLike | None = None,
    matrices: ArrayLike | None = None,
    **more: ArrayLike | str | None,
) -> None:
    """Write a track with its full state, whole or not at all; `read_track` gives back the same bits.

    Parameters
    ----------
    path : str or Path
        File to write or replace.
    track : Track or ImuTrack, optional
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
        own = _content(track)
        own_time, own_modes = own.pop("time"), own.pop("modes")
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
    save_archive(path, content | {name: None if value is None else _plain(name, value) for name, value in more.items()})


def read_track(path: str | Path) -> dict[str, Any]:
    """Return what `write_track_npz` was given: ``write_track_npz(copy, **read_track(path))`` makes an equal file.

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
    if modes.ndim == 2 and modes.dtype.kind == "f":
        modes[: int(np.argmin(np.isnan(modes).all(axis=1)))] = np.eye(1, modes.shape[1])
    Fields(path, content).build(OrientationRecording, names, time=content["time"], orientation=modes)
    for name in PER_STEP & content.keys():
        if content[name].shape[:1] != content["time"].shape:
            got = f"of shape {content[name].shape} beside {len(content['time'])} times"
            raise RecordingError(path, f"field {name}", got, "write the track again")
    return {k: str(v) if v.dtype.kind == "U" and not v.ndim else v for k, v in content.items()}


def _content(track: BinghamTrack | ImuTrack) -> dict[str, Any]:
    from bingham.filters.imu_track import ImuTrack
    from bingham.filters.track import BinghamTrack

    names = ["time", "modes", "log_evidence"]
    if isinstance(track, ImuTrack):
        names += ["bias", "bias_std"]
        more = {"covariance": track.covariance(frame="world"), "covariance_frame": "world"}
        more["state"] = track.final.to_json()
    elif isinstance(track, BinghamTrack):  # pyright: ignore[reportUnnecessaryIsInstance]
        names += ["concentrations", "frames", "nis", "decision"]
        more = {}
    else:
        raise InvalidArgumentError("track", "a Track or ImuTrack", type(track).__name__, "give arrays by name")
    return {name: getattr(track, name) for name in names} | more


def _array(name: str, values: ArrayLike | None, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != len(shape) or any(want not in (None, have) for want, have in zip(shape, array.shape, strict=True)):
        expected = ", ".join("any" if n is None else str(n) for n in shape)
        raise InvalidArgumentError(name, f"shape ({expected})", f"shape {array.shape}")
    return array


def _labels(name: str, values: ArrayLike, size: int) -> list[Any]:
    labels = np.asarray(values)
    if labels.shape != (size,):
        raise InvalidArgumentError(name, f"shape ({size},)", f"shape {labels.shape}")
    return labels.tolist()


def _plain(name: str, values: ArrayLike | str) -> NDArray[Any]:
    array = np.asarray(values)
    if array.dtype.kind not in "biufU":
        raise InvalidArgumentError(name, "an array of numbers, booleans or texts", f"type {array.dtype}")
    return array
