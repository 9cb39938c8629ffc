"""The files of a track, written piece by piece: tables to look at, npz to go on from; TUM and a figure at the end."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from bingham.cli.report import Truth
    from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["Files", "Outputs", "Sketch", "draw_track", "joined", "write_pages", "write_tum_of"]


class Outputs(NamedTuple):
    """Which files a track gets and what is in them."""

    csv: bool = True
    npz: bool = True
    parquet: bool = False
    figure: bool = True
    tum: bool = False
    bag: bool = False
    fields: tuple[str, ...] | None = None
    frame: str = "body"
    single: bool = False
    figure_format: str = "png"
    report: bool = False
    rerun: bool = False


class Files:
    """The files of one track that grow piece by piece.

    Parameters
    ----------
    folder : Path
        Where they are written.
    name : str
        Of the recording.
    outputs : Outputs
        Which ones.
    """

    def __init__(self, folder: Path, name: str, outputs: Outputs) -> None:
        from bingham.io.track_csv import CsvTable, ParquetTable
        from bingham.io.track_npz import NpzArchive

        self.names: list[str] = []
        self._outputs = outputs
        self._stack = ExitStack()
        self._tables: list[Any] = []
        self._archive: Any = None
        self._whole: dict[str, Any] = {}
        if outputs.csv:
            self.names.append(f"{name}.track.csv")
            self._tables.append(self._stack.enter_context(CsvTable.open(folder / self.names[-1], outputs.frame)))
        if outputs.parquet:
            self.names.append(f"{name}.track.parquet")
            table = ParquetTable(folder / self.names[-1], outputs.frame, single=outputs.single)
            self._stack.callback(table.close)
            self._tables.append(table)
        if outputs.npz:
            self.names.append(f"{name}.track.npz")
            self._archive = NpzArchive(folder / self.names[-1])

    def __enter__(self) -> Files:
        return self

    def __exit__(self, *_: object) -> None:
        """Let go of what is open; after an error, of a full disk say, without a further one."""
        with suppress(OSError):
            self._stack.close()
        if self._archive is not None:
            self._archive.discard()

    def append(self, time: Any, track: Any) -> None:
        """Write a piece of the track."""
        from bingham.io.track_fields import content_of, table
        from bingham.io.track_npz import reduced

        content = content_of(track) | {"time": time}
        if self._tables:
            columns = table(content, self._outputs.fields, self._outputs.frame)
            for each in self._tables:
                each.append(columns)
        if self._archive is not None:
            stored = reduced(content, single=self._outputs.single)
            rows = {k: v for k, v in stored.items() if isinstance(v, np.ndarray) and v.ndim and len(v) == len(time)}
            self._archive.append(rows)
            self._whole = {name: value for name, value in stored.items() if name not in rows} | _state_of(track)

    def close(self) -> None:
        """Write what belongs at the ends."""
        from bingham.io.track import TRACK

        self._stack.close()
        if self._archive is not None:
            self._archive.close({"format": TRACK, "covariance_frame": self._outputs.frame} | self._whole)


def _state_of(track: Any) -> dict[str, Any]:
    """Return the state to go on from, of filters whose state is a distribution."""
    if not hasattr(track.final, "z"):
        return {}
    state = getattr(track, "state", None)
    rest = {f.name: getattr(state, f.name) for f in fields(state)} if is_dataclass(state) else {}
    plain = {f"state_{k}": v for k, v in rest.items() if isinstance(v, (int, float, np.ndarray))}
    return {"state_z": track.final.z, "state_M": track.final.M, **plain}


@dataclass(frozen=True)
class Sketch:
    """What a figure needs of an inertial track: some of its rows."""

    time: Any
    modes: Any
    rotation_covariance: Any

    def __len__(self) -> int:
        return len(self.time)

    def covariance(self, *, frame: str) -> Any:
        """Return covariances (T, 3, 3), world axes."""
        from bingham.filters.imu_track import bounded

        assert frame == "world"
        return bounded(self.rotation_covariance)


def drawn_curves(modes: Any, rotation_covariance: Any) -> tuple[Any, ...]:
    """Return the curves (T,) that a figure draws, as far as their extremes matter: angles, variances of both kinds."""
    from bingham.rotations import yaw_pitch_roll

    heading, inclination = rotation_covariance[:, 2, 2], rotation_covariance[:, 0, 0] + rotation_covariance[:, 1, 1]
    return *yaw_pitch_roll(modes).T, heading, inclination


def joined(pieces: Sequence[Any]) -> Any:
    """Return pieces of a track as one."""
    if len(pieces) == 1:
        return pieces[0]
    last = pieces[-1]
    arrays = {
        field.name: np.concatenate([getattr(piece, field.name) for piece in pieces])
        for field in fields(last)
        if isinstance(value := getattr(last, field.name), np.ndarray) and value.ndim and len(value) == len(last)
    }
    return replace(last, **arrays)


def write_tum_of(folder: Path, recording: Any, time: Any, track: Any) -> str:
    """Write a TUM trajectory and return its file's name."""
    from bingham.io import write_tum

    name = f"{recording.name}.tum.txt"
    write_tum(folder / name, time=time, orientation=track.modes, position=getattr(recording, "position", None))
    return name


def write_pages(
    folder: Path,
    recording: ImuRecording | OrientationRecording,
    time: Any,
    track: Any,
    truth: Truth | None,
    outputs: Outputs,
    summary: dict[str, str],
    said: list[str],
) -> list[str]:
    """Write the report page and the log for Rerun, where asked for, and return their files' names.

    `said` are the warnings of reader and filter.
    """
    from bingham.report import write_report, write_rerun
    from bingham.report.page import rejected_samples

    names: list[str] = []
    covariance = track.covariance(frame="world")
    if outputs.report:
        known: dict[str, Any] = {} if truth is None else {"truth": truth.orientation, "scored": truth.scored}
        known |= {key: getattr(track, key) for key in ("bias", "bias_std") if hasattr(track, key)}
        known |= {
            "world": world_of(recording),
            "warnings": list(dict.fromkeys(said)),
            "rejected": rejected_samples(track, time),
        }
        names.append(f"{recording.name}.html")
        write_report(folder / names[-1], time, track.modes, covariance, title=recording.name, summary=summary, **known)
    if outputs.rerun:
        names.append(f"{recording.name}.rrd")
        write_rerun(folder / names[-1], time, track.modes, covariance, title=recording.name)
    return names


def world_of(recording: ImuRecording | OrientationRecording) -> tuple[str, str, str]:
    """Return the names of the world's axes: only a magnetometer tells where north is."""
    if not hasattr(recording, "magnetometer"):
        return ("x", "y", "z")
    return ("east", "north", "up") if getattr(recording, "magnetometer", None) is not None else ("x", "y", "up")


def draw_track(
    folder: Path,
    recording: ImuRecording | OrientationRecording,
    time: Any,
    track: Any,
    truth: Truth | None,
    form: str = "png",
) -> str:
    """Draw the figure of a track and return its file's name."""
    from bingham.plot.planar_track import plot_planar_track
    from bingham.plot.track import plot_track
    from bingham.recording import ImuRecording

    inertial = isinstance(recording, ImuRecording)
    shown: dict[str, Any] = {
        "truth": None if truth is None else truth.orientation,
        "scored": None if truth is None else truth.scored,
        "measured": None if inertial else recording.orientation,
        "title": recording.name,
    }
    if track.modes.shape[1] == 2:
        figure = plot_planar_track(time, track.distributions, **shown)
    else:
        shown["world"] = world_of(recording)
        if truth is not None and truth.heading_offset_rad is not None:
            angle = degrees(truth.heading_offset_rad)
            shown["note"] = f"no magnetometer: the truth is rotated by {angle:.1f}° about the vertical to suit"
        figure = plot_track(time, track.modes, track.covariance(frame="world"), **shown)
    name = f"{recording.name}.{form}"
    figure.savefig(folder / name, dpi=150)
    return name
