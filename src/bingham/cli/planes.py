"""``bingham planes``: the planes of a depth image or a point cloud."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import typer

from bingham.cli.reading import PARAMETERS
from bingham.errors import InvalidArgumentError, RecordingError

__all__ = ["register"]

CAMERA = ("fx", "fy", "cx", "cy")
FARTHEST = 1e6  # no sensor measures further, m
MANY_METRES = 300.0  # usual coordinates of rooms, streets and scans in metres are smaller
MOST_BEHIND = 0.02  # share of an image's points with z ≤ 0

EXAMPLES = """
Examples:

    bingham planes scene.npz

    bingham planes depth.png --intrinsics 525,525,319.5,239.5 -o planes

    bingham planes cloud.pcd --json | jq .planes[].normal
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command(epilog=EXAMPLES)(planes)


def planes(
    file: Path = typer.Argument(
        ...,
        metavar="FILE",
        help="PCD or PLY; npz with xyz or xyz_mm (H, W, 3) or (n, 3), or depth or depth_mm (H, W) and fx, fy, cx, cy; "
        "npy alike; PNG of 16 bits; text with x y z a row.",
        show_default=False,
    ),
    intrinsics: str | None = typer.Option(
        None, metavar="FX,FY,CX,CY", help="Depth images: focal lengths and principal point, pixels."
    ),
    scale: float | None = typer.Option(
        None, help="Metres of a unit; unless given, 0.001 for depth images of integers, else 1.", show_default=False
    ),
    min_share: float = typer.Option(0.01, help="Planes with less of the points are left out."),
    seed: int = typer.Option(
        0, min=0, help="Of the random starts in the search for directions; another one seldom changes the planes."
    ),
    max_size: float | None = PARAMETERS["max_size"][1],
    output: Path | None = typer.Option(None, "--output", "-o", metavar="FOLDER", help="Figure and labels go there."),
    as_json: bool = typer.Option(False, "--json", help="Print one JSON object on standard output."),
) -> None:
    """Find planes: normal, distance and covariance, in the frame of the camera or the cloud.

    A plane holds the points p with normal·p = distance; its normal points to the camera. Parallel planes are apart.
    """
    import numpy as np

    from bingham.atomic import staged
    from bingham.cli.first_use import announce_compilation
    from bingham.cli.terminal import say
    from bingham.io.bounds import bounded
    from bingham.surfaces.extraction import find_planes

    with bounded(max_size):
        points = _points(file, intrinsics, scale)
    shape, points = points.shape[:-1], _in_view(file, points)
    announce_compilation()
    try:
        found = find_planes(points, min_share=min_share, rng=seed)
    except InvalidArgumentError as error:
        if error.argument != "points":
            raise
        raise RecordingError(file, "", f"{error.got} points", f"{error.expected} are needed") from None
    row: dict[str, Any] = {
        "file": file.name,
        "points": int(np.isfinite(points).all(axis=-1).sum()),
        "explained": float(np.mean(found.label[np.isfinite(points).all(axis=-1)] >= 0)),
        "planes": [
            {
                "normal": plane.normal.tolist(),
                "distance_m": plane.distance,
                "vector": plane.vector.tolist(),
                "covariance_rad2": plane.covariance.tolist(),
                "normal_std_deg": plane.normal_std_deg,
                "distance_std_m": plane.distance_std,
                "count": plane.count,
                "rms_m": plane.residual,
            }
            for plane in found.planes
        ],
    }
    if output is not None:
        with staged(output) as folder:
            row["files"] = [str(output / name) for name in (f"{file.stem}.planes.npy", f"{file.stem}.planes.png")]
            np.save(folder / f"{file.stem}.planes.npy", found.label.reshape(shape))
            from bingham.plot.planes import plot_planes

            plot_planes(points, found).savefig(folder / f"{file.stem}.planes.png", dpi=150)
    if as_json:
        say(json.dumps(row, indent=2, ensure_ascii=False))
        return
    count, share = len(found.planes), 100.0 * row["explained"]
    lines = [f"{row['file']}: {row['points']} points, {share:.0f} % on {count} plane{'s' if count != 1 else ''}"]
    lines.append(
        f"{'no.':>4} {'points':>8}  {'normal':<25} {'± °':>7}  {'distance, m':>11} {'± mm':>6}  {'rms, mm':>7}"
    )
    for k, plane in enumerate(found.planes):
        normal = " ".join(f"{x:+.4f}" for x in plane.normal)
        lines.append(f"{k:>4} {plane.count:>8}  {normal:<25} {plane.normal_std_deg:7.3f}  {plane.distance:11.4f} "
                     f"{1e3 * plane.distance_std:6.2f}  {1e3 * plane.residual:7.2f}")  # fmt: skip
    say("\n".join(lines + [f"file {name}" for name in row.get("files", [])]))


def _points(file: Path, intrinsics: str | None, scale: float | None) -> Any:
    """Return points (H, W, 3) or (n, 3) in m, NaN without data."""
    import numpy as np

    from bingham.io.checks import note
    from bingham.io.fields import Fields
    from bingham.io.points import read_points
    from bingham.surfaces.normals import back_project
    from bingham.validation import check_number

    camera = None if intrinsics is None else _numbers(intrinsics)
    if scale is not None:
        check_number(scale, "--scale", "metres of a unit, > 0", above=0.0)
    fields = Fields(file, read_points(file))
    there = fields.content
    for name, unit in (("xyz", 1.0), ("xyz_mm", 1e-3), ("points", 1.0)):
        if name in there:
            points = fields.as_numbers(name) * (unit if scale is None else scale)
            if points.ndim not in (2, 3) or points.shape[-1] != 3:
                raise RecordingError(file, f"field {name}", f"of shape {points.shape}", "(H, W, 3) or (n, 3) is meant")
            points[~((points != 0.0).any(axis=-1) & (np.abs(points) < FARTHEST).all(axis=-1))] = np.nan
            if not np.isfinite(points).all(axis=-1).any():
                raise RecordingError(
                    file, f"field {name}", "no point that is finite, not 0 0 0 and nearer than 1e6 m",
                    "far from the origin, as in a map's coordinates? Subtract an offset",
                )  # fmt: skip
            usual = float(np.nanmedian(np.abs(points)))
            if scale is None and unit == 1.0 and usual > MANY_METRES:
                note(file.name, f"coordinates are usually {usual:.0f}: taken for metres; of millimetres --scale 0.001")
            return points
    depth = next((name for name in ("depth_mm", "depth") if name in there), None)
    if depth is None:
        known = " ".join(there) or "none"
        raise RecordingError(file, "", f"neither points nor a depth image; fields: {known}", "name them xyz or depth")
    if camera is None and all(name in there for name in CAMERA):
        camera = (fields.positive("fx"), fields.positive("fy"), fields.finite("cx"), fields.finite("cy"))
    if camera is None:
        raise InvalidArgumentError("--intrinsics", "FX,FY,CX,CY of the camera", "none", "a depth image needs them")
    image = fields.as_numbers(depth)
    if image.ndim != 2:
        raise RecordingError(file, f"field {depth}", f"of shape {image.shape}", "an image (H, W) is meant")
    whole = fields.array(depth).dtype.kind in "iu"
    image *= scale if scale is not None else 1e-3 if whole or depth == "depth_mm" else 1.0
    image[~(image < FARTHEST)] = np.nan
    return back_project(image, *camera)


def _in_view(file: Path, points: Any) -> Any:
    """Return the points as they are, or as a loose cloud if they are organised but not seen along z: a scanner's."""
    import numpy as np

    from bingham.io.checks import note

    known = np.isfinite(points).all(axis=-1)
    behind = points[known][:, 2] <= 0.0
    if points.ndim == 2 or np.mean(behind) <= MOST_BEHIND:
        return points
    share = 100.0 * np.mean(behind)
    note(file.name, f"{share:.0f} % of the points have z ≤ 0, which no camera along z sees: taken as a loose cloud")
    return points.reshape(-1, 3)


def _numbers(text: str) -> tuple[float, ...]:
    try:
        camera = tuple(float(part) for part in text.split(","))
    except ValueError:
        camera = ()
    if len(camera) != 4 or not all(map(math.isfinite, camera)) or not camera[0] > 0.0 or not camera[1] > 0.0:
        raise InvalidArgumentError("--intrinsics", "four numbers FX,FY,CX,CY", repr(text))
    return camera
