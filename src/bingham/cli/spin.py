"""``bingham track --spin``: orientation and spin of a turning body from measured orientations."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bingham.errors import InvalidArgumentError

if TYPE_CHECKING:
    from bingham.filters.spin import SpinTrack
    from bingham.recording import OrientationRecording

__all__ = ["track_spin"]

COLUMNS = ("time_s", "qw", "qx", "qy", "qz", "wx_rad_s", "wy_rad_s", "wz_rad_s")
AXES = ("x", "y", "z")


def track_spin(
    recordings: Sequence[str],
    output: Path | None,
    *,
    as_json: bool,
    figure: bool,
    format: str | None,
    reading: dict[str, Any],
    measurement_noise: float | None,
) -> None:
    """Print the spin of each recording at its end and, given a folder, write NAME.spin.csv and NAME.spin.png."""
    from bingham.atomic import staged
    from bingham.cli.first_use import announce_compilation
    from bingham.cli.reading import read
    from bingham.cli.terminal import say
    from bingham.recording import OrientationRecording

    announce_compilation()
    rows: list[dict[str, Any]] = []
    for path in map(Path, recordings):
        recording = read(path, format, reading)
        if not isinstance(recording, OrientationRecording) or recording.dim != 4:
            hint = "an inertial recording has its rates in it: track it without --spin"
            raise InvalidArgumentError("--spin", "measured orientations in space", f"{path}", hint)
        row, track = _spin(recording, measurement_noise)
        if output is not None:
            with staged(output) as folder:
                row["files"] = [str(output / name) for name in _write(folder, recording.name, track, figure)]
        rows.append(row)
    if as_json:
        say(json.dumps(rows[0] if len(rows) == 1 else rows, indent=2, ensure_ascii=False))
        return
    for row in rows:
        say(_told(row))


def _spin(recording: OrientationRecording, measurement_noise: float | None) -> tuple[dict[str, Any], SpinTrack]:
    from bingham.filters.spin import spin_prior, tuned_spin_filter

    t, z = recording.time, recording.orientation
    spin_filter = tuned_spin_filter(z, t, measurement_noise=measurement_noise)
    track = spin_filter.run(spin_prior(z, t), z, t)
    final = track.final
    covariance = final.covariance[3:, 3:]
    size = float(np.linalg.norm(final.rate))
    axis = final.rate / size if size > 0.0 else final.rate
    across = (np.eye(3) - np.outer(axis, axis)) @ covariance @ (np.eye(3) - np.outer(axis, axis))
    row = {
        "recording": recording.name,
        "samples": recording.size,
        "duration_s": recording.duration_s,
        "filter": "spin",
        "measurement_noise_rad": float(np.asarray(spin_filter.measurement_noise)),
        "spin_walk_rad_s_per_root_s": spin_filter.spin_walk,
        "log_evidence": float(track.log_evidence.sum()),
        "spin": {
            "frame": "world",
            "time_s": float(t[-1]),
            "axis": axis.tolist(),
            "revolutions_per_s": size / (2.0 * np.pi),
            "rate_rad_s": final.rate.tolist(),
            "covariance_rad2_s2": covariance.tolist(),
            "axis_std_deg": float(np.degrees(np.sqrt(np.linalg.eigvalsh(across)[-1]) / size)) if size > 0.0 else None,
            "revolutions_per_s_std": float(np.sqrt(axis @ covariance @ axis)) / (2.0 * np.pi),
        },
        "orientation": {
            "frame": "world",
            "wxyz": final.orientation.tolist(),
            "covariance_rad2": final.covariance[:3, :3].tolist(),
        },
    }
    return row, track


def _write(folder: Path, name: str, track: SpinTrack, figure: bool) -> list[str]:
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    names = [f"orientation_cov_{AXES[i]}{AXES[j]}_rad2" for i, j in pairs]
    names += [f"rate_cov_{AXES[i]}{AXES[j]}_rad2_s2" for i, j in pairs]
    parts = [track.covariances[:, i, j] for i, j in pairs] + [track.covariances[:, i + 3, j + 3] for i, j in pairs]
    table = np.column_stack([track.time, track.modes, track.rates, *parts, track.log_evidence, track.nis])
    header = ",".join([*COLUMNS, *names, "log_evidence", "nis"])
    lines = [header, *(",".join("" if np.isnan(x) else f"{x:.17g}" for x in row) for row in table)]
    (folder / f"{name}.spin.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    if not figure:
        return [f"{name}.spin.csv"]
    from bingham.plot.spin import plot_spin

    plot_spin(track).savefig(folder / f"{name}.spin.png", dpi=150)
    return [f"{name}.spin.csv", f"{name}.spin.png"]


def _told(row: dict[str, Any]) -> str:
    spin = row["spin"]
    axis = " ".join(f"{x:+.4f}" for x in spin["axis"])
    doubt = "" if spin["axis_std_deg"] is None else f" (± {spin['axis_std_deg']:.2g}°)"
    lines = [
        f"{row['recording']}: {row['samples']} samples in {row['duration_s']:.3g} s",
        f"  axis, world frame       {axis}{doubt}",
        f"  revolutions a second    {spin['revolutions_per_s']:.5g} ± {spin['revolutions_per_s_std']:.2g}",
        "  covariance, (rad/s)²    " + "; ".join(" ".join(f"{x:.3g}" for x in r) for r in spin["covariance_rad2_s2"]),
        f"  learned                 measurement noise {np.degrees(row['measurement_noise_rad']):.3g}°, "
        f"random walk of the rate {row['spin_walk_rad_s_per_root_s']:.3g} rad/s/√s",
    ]
    return "\n".join(lines + [f"  file                    {name}" for name in row.get("files", [])])
