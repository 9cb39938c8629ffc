"""The files of a track: CSV to look at, npz to go on from, TUM for other programs, a figure."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from bingham.cli.report import Truth
    from bingham.cli.result import Result
    from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["draw_track", "write_track"]


def write_track(
    folder: Path,
    recording: ImuRecording | OrientationRecording,
    result: Result,
    *,
    frame: Literal["body", "world"],
    tum: bool,
) -> list[str]:
    """Write the files of a track and return their names; planar ones have no covariance, and never `tum`."""
    from bingham.io import write_track_csv, write_track_npz, write_tum
    from bingham.rotations import align_signs

    name, distributions = recording.name, result.distributions
    both: dict[str, Any] = {
        "time": recording.time,
        "concentrations": distributions.z,
        "log_evidence": result.log_evidence,
        "accepted": result.accepted,
    }
    if result.covariance is not None:
        both |= {"covariance": result.covariance(frame), "covariance_frame": frame}
    unbroken = align_signs(result.modes)
    written = [f"{name}.track.csv", f"{name}.track.npz"]
    write_track_csv(folder / written[0], modes=unbroken, reason=result.reasons, **both)
    write_track_npz(
        folder / written[1],
        modes=result.modes,
        matrices=distributions.matrix,
        frames=distributions.M,
        **both,
        **result.more,
    )
    if tum:
        written.append(f"{name}.tum.txt")
        position = getattr(recording, "position", None)
        write_tum(folder / written[-1], time=recording.time, orientation=unbroken, position=position)
    return written


def draw_track(
    folder: Path, recording: ImuRecording | OrientationRecording, result: Result, truth: Truth | None
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
    if result.covariance is None:
        figure = plot_planar_track(recording.time, result.distributions, **shown)
    else:
        if inertial:
            shown["world"] = ("east", "north", "up") if recording.magnetometer is not None else ("x", "y", "up")
        if truth is not None and truth.heading_offset_rad is not None:
            turn = degrees(truth.heading_offset_rad)
            shown["note"] = f"no magnetometer: the truth is rotated by {turn:.1f}° about the vertical to suit"
        figure = plot_track(recording.time, result.distributions, covariance=result.covariance("world"), **shown)
    name = f"{recording.name}.png"
    figure.savefig(folder / name, dpi=150)
    return name
