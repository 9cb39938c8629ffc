"""What `bingham track` says about a track: figures for programs, a table for people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from bingham.cli.result import Result
    from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["Truth", "errors_deg", "print_table", "truth_of"]

FloatArray = NDArray[np.float64]

# Beyond this share of orientations rejected, the reported noise is in question rather than the measurements.
DOUBTFUL_REJECTED = 0.1

# Left factors that carry orientations given against NED or NWU axes to ENU axes.
TO_ENU = {"ENU": (1.0, 0.0, 0.0, 0.0), "NED": (0.0, 0.5**0.5, 0.5**0.5, 0.0), "NWU": (0.5**0.5, 0.0, 0.0, 0.5**0.5)}


class Truth(NamedTuple):
    """True orientations (T, d) at the times of a track, NaN where unknown, and the samples that count, (T,)."""

    orientation: FloatArray
    scored: NDArray[np.bool_]
    heading_offset_rad: float | None


def truth_of(recording: ImuRecording | OrientationRecording, result: Result) -> Truth | None:
    """Return the truth that a recording brings, against the axes of the track, or None.

    Truth on a clock of its own is interpolated, but not over gaps. An inertial recording without magnetometer knows no
    north: its truth is rotated about the vertical by the constant angle that suits best.
    """
    from bingham.metrics import heading_offset
    from bingham.recording import OrientationRecording
    from bingham.rotations import from_rotation_vector

    if isinstance(recording, OrientationRecording):
        if recording.truth is None or not recording.scored.any():
            return None
        return Truth(recording.truth, recording.scored, None)
    if recording.reference is not None:
        orientation, scored = recording.reference, recording.scored
    elif recording.truth is not None:
        orientation, scored = _at(recording.truth, recording.time)
    else:
        return None
    if not scored.any():
        return None
    orientation = _compose_known(TO_ENU[recording.earth_frame], orientation)
    if recording.magnetometer is not None:
        return Truth(orientation, scored, None)
    offset = heading_offset(result.modes[scored], orientation[scored])
    turn = from_rotation_vector([0.0, 0.0, offset])
    return Truth(_compose_known(turn, orientation), scored, offset)


def _compose_known(left: Any, rows: FloatArray) -> FloatArray:
    from bingham.rotations import compose

    return compose(np.asarray(left, dtype=np.float64), rows)


def _at(truth: OrientationRecording, time: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return truth interpolated on the sphere at `time`; NaN outside and inside gaps of over three usual intervals."""
    from bingham.rotations import align_signs

    if truth.size < 2:
        return np.full((len(time), truth.dim), np.nan), np.zeros(len(time), dtype=np.bool_)
    q = align_signs(truth.orientation)
    after = np.clip(np.searchsorted(truth.time, time), 1, truth.size - 1)
    gap = truth.time[after] - truth.time[after - 1]
    share = (time - truth.time[after - 1]) / gap
    mixed = (1 - share)[:, None] * q[after - 1] + share[:, None] * q[after]
    mixed /= np.linalg.norm(mixed, axis=1, keepdims=True)
    inside = (share >= 0) & (share <= 1) & (gap <= 3 * np.median(np.diff(truth.time)))
    counted = truth.score if truth.score is not None else np.ones(truth.size, dtype=np.bool_)
    return np.where(inside[:, None], mixed, np.nan), inside & counted[after - 1] & counted[after]


def errors_deg(estimate: FloatArray, truth: Truth) -> dict[str, float]:
    """Return root mean square errors of orientations (T, d) in degrees; of axes in the plane only the whole error."""
    from bingham.metrics import broad_rmse

    estimate, known = estimate[truth.scored], truth.orientation[truth.scored]
    if estimate.shape[1] == 2:
        angle = np.arctan2(np.abs(estimate[:, 0] * known[:, 1] - estimate[:, 1] * known[:, 0]),
                           np.abs(np.sum(estimate * known, axis=1)))  # fmt: skip
        return {"total_rmse": float(np.degrees(np.sqrt(np.mean(angle**2))))}
    rmse = broad_rmse(estimate, known)
    return {f"{name}_rmse": float(np.degrees(value)) for name, value in rmse._asdict().items()}


def print_table(rows: Sequence[dict[str, Any]]) -> None:
    """Print one line a recording."""
    console = Console()
    if not console.is_terminal:
        console.width = 160  # a pipe has no width; wrapped cells would be of no use to whoever reads it
    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("recording")
    for heading in ("samples", "duration", "µs/sample", "rejected"):
        table.add_column(heading, justify="right")
    compared = any("error_deg" in row for row in rows)
    for heading in ("total", "heading", "inclination") if compared else ():
        table.add_column(heading, justify="right")
    beside = any("measured_error_deg" in row for row in rows)
    if beside:
        table.add_column("measured total", justify="right")
    for row in rows:
        cells = [
            row["recording"],
            str(row["samples"]),
            f"{row['duration_s']:.1f} s",
            f"{row['us_per_sample']:.2f}",
            f"{100 * row['rejected'] / row['samples']:.1f} %",
        ]
        errors, raw = row.get("error_deg", {}), row.get("measured_error_deg", {})
        shown = [errors.get(f"{name}_rmse") for name in ("total", "heading", "inclination") if compared]
        shown += [raw.get("total_rmse")] if beside else []
        cells += ["–" if value is None else f"{value:.2f}°" for value in shown]
        table.add_row(*cells)
    console.print(table)
    if compared:
        console.print("Errors: root mean square against the recording's ground truth.", style="dim")
    if doubtful := [row["recording"] for row in rows if _noise_in_doubt(row)]:
        names = ", ".join(doubtful)
        note = f"Over 10 % rejected: {names}. Larger --measurement-noise or --process-noise? --gate 1 rejects none."
        console.print(note, highlight=False)
    if rotated := [row["recording"] for row in rows if "heading_offset_rad" in row]:
        note = f"No magnetometer: truth rotated about the vertical by one angle to suit: {', '.join(rotated)}."
        console.print(note, style="dim", highlight=False)


def _noise_in_doubt(row: dict[str, Any]) -> bool:
    """Whether so many orientations were rejected that the reported noise must be too small; not of magnetometers."""
    return row["filter"].startswith("first-order") and row["rejected"] > DOUBTFUL_REJECTED * row["samples"]
