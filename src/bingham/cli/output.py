"""The files of a track: CSV to look at, npz to go on from, TUM for other programs, a figure."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

if TYPE_CHECKING:
    from bingham.cli.report import Truth
    from bingham.filters.track import Track
    from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["draw_track", "write_track"]


def write_track(
    folder: Path,
    recording: ImuRecording | OrientationRecording,
    track: Track,
    *,
    frame: Literal["body", "world"],
    tum: bool,
) -> list[str]:
    """Write the files of a track and return their names; planar tracks have no covariance and no TUM file."""
    from bingham.io import write_track_csv, write_track_npz, write_tum

    name, time = recording.name, recording.time
    rotations = track.concentrations.shape[1] == 4
    uncertainty: dict[str, Any] = {}
    if rotations:
        uncertainty = {"covariance": track.covariance(frame=frame), "covariance_frame": frame}
    written = [f"{name}.track.csv", f"{name}.track.npz"]
    write_track_csv(
        folder / written[0],
        time=time,
        modes=track.continuous_modes,
        concentrations=track.concentrations,
        log_evidence=track.log_evidence,
        accepted=track.accepted,
        reason=track.reasons(),
        **uncertainty,
    )
    write_track_npz(
        folder / written[1],
        time=time,
        modes=track.modes,
        matrices=track.matrices,
        concentrations=track.concentrations,
        frames=track.frames,
        log_evidence=track.log_evidence,
        statistic=track.statistic,
        decision=track.decision,
        threshold=track.threshold,
        accepted=track.accepted,
        **uncertainty,
        **_state(track),
    )
    if tum and rotations:
        written.append(f"{name}.tum.txt")
        write_tum(
            folder / written[-1],
            time=time,
            orientation=track.continuous_modes,
            position=getattr(recording, "position", None),
        )
    return written


def draw_track(folder: Path, recording: ImuRecording | OrientationRecording, track: Track, truth: Truth | None) -> str:
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
    if track.concentrations.shape[1] == 2:
        figure = plot_planar_track(recording.time, track, **shown)
    else:
        if inertial:
            shown["world"] = ("east", "north", "up") if recording.magnetometer is not None else ("x", "y", "up")
        figure = plot_track(recording.time, track, **shown)
    name = f"{recording.name}.png"
    figure.savefig(folder / name, dpi=150)
    return name


def _state(track: Track) -> dict[str, Any]:
    """What a filter goes on from: the last law as ``state_z``, ``state_M``, whatever else its state has by name."""
    more = getattr(track, "state", None)
    rest = {f.name: getattr(more, f.name) for f in fields(more)} if is_dataclass(more) else {}
    plain = {f"state_{k}": v for k, v in rest.items() if isinstance(v, (int, float, np.ndarray))}
    return {"state_z": track.final.z, "state_M": track.final.M} | plain
