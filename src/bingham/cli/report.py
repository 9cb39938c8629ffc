"""What `bingham track` says about a track: figures for programs, a table for people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from bingham.cli.terminal import clean

if TYPE_CHECKING:
    from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["Truth", "errors_deg", "print_table", "truth_of"]

FloatArray = NDArray[np.float64]

# Recordings of which details are printed, too.
DETAILED = 10

# Beyond this share of orientations rejected, the reported noise is in question rather than the measurements.
DOUBTFUL_REJECTED = 0.1

# Left factors that carry orientations given against NED or NWU axes to ENU axes.
TO_ENU = {"ENU": (1.0, 0.0, 0.0, 0.0), "NED": (0.0, 0.5**0.5, 0.5**0.5, 0.0), "NWU": (0.5**0.5, 0.0, 0.0, 0.5**0.5)}


class Truth(NamedTuple):
    """True orientations (T, d) at the times of a track, NaN where unknown, and the samples that count, (T,)."""

    orientation: FloatArray
    scored: NDArray[np.bool_]
    heading_offset_rad: float | None


def truth_of(recording: ImuRecording | OrientationRecording, modes: FloatArray) -> Truth | None:
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
    offset = heading_offset(modes[scored], orientation[scored])
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


def print_table(rows: Sequence[dict[str, Any]], *, verbose: bool = False) -> None:
    """Print a line for each recording, then what was read of it and what is doubtful."""
    console = Console(markup=False, highlight=False)
    if not console.is_terminal:
        console.width = 200  # a pipe has no width; wrapped cells would be of no use to whoever reads it
    compared = any("error_deg" in row for row in rows)
    beside = any("measured_error_deg" in row for row in rows)
    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("recording")
    headings = ["samples", "duration", "rate", "gaps", *["µs/sample"] * verbose, "rejected"]
    headings += ["heading ±", "inclination ±"] if any(_widths(row) for row in rows) else ["angle ±"]
    headings += ["total", "heading", "inclination"] * compared + ["measured total"] * beside
    for heading in headings:
        table.add_column(heading, justify="right", no_wrap=True)
    for row in rows:
        cells = [clean(row["recording"]), str(row["samples"]), f"{row['duration_s']:.1f} s"]
        cells += [f"{row['rate_hz']:.4g} Hz" if row["rate_hz"] else "–", _gaps(row["gaps"])]
        if verbose:
            cells.append(_or_dash(row.get("us_per_sample"), "{:.2f}"))
        cells.append(f"{100 * row['rejected'] / row['samples']:.1f} %")
        median = row["median_deviation_deg"]
        names = ("heading", "inclination") if "heading ±" in headings else ("angle",)
        cells += [_or_dash(median.get(name), "{:.2f}°") for name in names]
        errors, raw = row.get("error_deg", {}), row.get("measured_error_deg", {})
        shown = [errors.get(f"{name}_rmse") for name in ("total", "heading", "inclination") if compared]
        shown += [raw.get("total_rmse")] if beside else []
        table.add_row(*cells, *[_or_dash(value, "{:.2f}°") for value in shown])
    console.print(table)
    if len(rows) <= DETAILED:
        for row in rows:
            console.print(f"{clean(row['recording'])}: {_details(row)}")
    console.print("±: median reported standard deviation.", style="dim")
    if compared:
        console.print("Errors: root mean square against the recording's ground truth.", style="dim")
    if doubtful := [row["recording"] for row in rows if _noise_in_doubt(row)]:
        names = ", ".join(doubtful)
        note = f"Over 10 % rejected: {names}. Larger --measurement-noise or --process-noise? --gate 1 rejects none."
        console.print(clean(note))
    if rotated := [row["recording"] for row in rows if "heading_offset_rad" in row]:
        note = f"No magnetometer: truth rotated about the vertical by one angle to suit: {', '.join(rotated)}."
        console.print(clean(note), style="dim")


def _widths(row: dict[str, Any]) -> bool:
    return "heading" in row["median_deviation_deg"]


def _or_dash(value: float | None, form: str) -> str:
    return "–" if value is None else form.format(value)


def _gaps(gaps: dict[str, Any]) -> str:
    return f"{gaps['count']}, up to {gaps['longest_s']:.3g} s" if gaps["count"] else "none"


def _details(row: dict[str, Any]) -> str:
    """Return sensors read, bias found, deviations at the end and warnings."""
    said = [", ".join(row["sensors"])]
    if bias := row.get("bias_deg_s"):
        width = max(row["bias_std_deg_s"].values())
        said.append(f"gyroscope bias {', '.join(f'{bias[a]:.3f}' for a in 'xyz')} °/s (± {width:.2g})")
    final = [f"{name} ± {value:.2f}°" for name, value in row["final_deviation_deg"].items() if value is not None]
    said += [f"at the end {', '.join(final)}"] if final else []
    if (relative := row.get("relative_heading_std_deg")) is not None:
        said.append(f"heading since the start ± {relative:.2f}°")
    if seen := row.get("orientations"):
        said.append(_fusion(seen))
    if row.get("warnings"):
        said.append(f"{len(row['warnings'])} warning{'s' * (len(row['warnings']) > 1)}")
    return "; ".join(said)


def _fusion(seen: dict[str, Any]) -> str:
    """Return what became of the orientations beside the gyroscope, and the rotations found."""
    text = f"{seen['used']} of {seen['count']} orientations used, {seen['rejected']} rejected"
    if (noise := seen.get("noise_deg")) is not None:
        text += f", their noise {noise:.2f}°"
    for name in ("mounting", "world"):
        if (q := seen.get(f"{name}_wxyz")) is not None:
            text += f", {name} ({', '.join(f'{x:.4f}' for x in q)}) ± {seen[f'{name}_std_deg']:.2f}°"
    return text


def _noise_in_doubt(row: dict[str, Any]) -> bool:
    """Whether so many orientations were rejected that the reported noise must be too small; not of magnetometers."""
    return row["filter"].startswith("first-order") and row["rejected"] > DOUBTFUL_REJECTED * row["samples"]
