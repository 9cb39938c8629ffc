"""``bingham track GYROSCOPE CAMERA --fuse``: orientations of one file beside the inertial recording of the other."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from bingham.errors import InvalidArgumentError

if TYPE_CHECKING:
    from bingham.filters.orientation_alignment import OrientationAlignment
    from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["Align", "Beside", "beside", "fused"]

# Beyond so many deviations, and this angle in rad, a rotation that nobody asked for is worth a word.
DEVIATIONS, NOTED = 5.0, 0.05


class Align(StrEnum):
    """Which constant rotations between camera and sensor are found."""

    none = "none"
    mounting = "mounting"
    world = "world"
    both = "both"


class Beside(NamedTuple):
    """What goes beside an inertial recording."""

    orientations: OrientationRecording
    align: Align
    noise: float | None  # rad, where the user gives it


def beside(
    paths: list[str], format: str | None, reading: Mapping[str, Any], align: Align, noise: float | None
) -> tuple[str, Beside]:
    """Return the inertial file of two and the orientations of the other; options of reading go where they fit."""
    from bingham.recording import ImuRecording, OrientationRecording

    if len(paths) != 2:
        expected = "two recordings, an inertial one and one of orientations"
        raise InvalidArgumentError(
            "--fuse", expected, f"{len(paths)}", "bingham track gyro.csv camera.txt --fuse -o out"
        )
    if format is not None:
        raise InvalidArgumentError("--format", "none beside --fuse, as two files differ", format, "leave it out")
    second = _read(Path(paths[1]), reading)
    inertial, camera = paths[0], second
    if isinstance(second, ImuRecording):
        inertial, camera = paths[1], _read(Path(paths[0]), reading)
    if not isinstance(camera, OrientationRecording):
        raise InvalidArgumentError("--fuse", "one recording of orientations", "two inertial ones")
    if camera.dim != 4:
        raise InvalidArgumentError("--fuse", "orientations in space", f"{camera.name}, axes in the plane")
    return inertial, Beside(camera, align, noise)


def _read(path: Path, reading: Mapping[str, Any]) -> ImuRecording | OrientationRecording:
    from bingham.cli.reading import read

    try:
        return read(path, None, reading)
    except InvalidArgumentError:
        if not reading:
            raise
    return read(path, None, {})  # the options are those of the other file


def fused(recording: ImuRecording | OrientationRecording, other: Beside) -> tuple[ImuRecording, dict[str, Any]]:
    """Return the inertial recording with the orientations beside it, and what there is to say about them."""
    import numpy as np

    from bingham.filters.orientation_alignment import align_orientations
    from bingham.recording import ImuRecording, amended

    camera, noise = other.orientations, other.noise
    if not isinstance(recording, ImuRecording):
        hint = "bingham track gyro.csv camera.txt --fuse"
        raise InvalidArgumentError("--fuse", "one inertial recording", "two of orientations", hint)
    whole = amended(recording, orientations=camera)
    level = recording.accelerometer is not None
    mounting = other.align in (Align.mounting, Align.both)
    world = other.align in (Align.world, Align.both)
    if world and not level:
        hint = "without gravity the world is the camera's: --align mounting"
        raise InvalidArgumentError("--align", "none or mounting without accelerometer", other.align.value, hint)
    if mounting or world:
        found = align_orientations(whole, mounting=mounting, world=world)
        return _aligned(whole, found, noise, mounting, world)
    try:
        found = align_orientations(whole, world=level)
    except InvalidArgumentError:  # too short, or too little motion, to say anything
        return (whole if noise is None else _with_noise(whole, noise)), {}
    _doubt(whole, found)
    noise = noise if noise is not None else found.noise
    return _with_noise(whole, noise), {"noise_deg": float(np.degrees(noise))}


def _aligned(
    whole: ImuRecording, found: OrientationAlignment, noise: float | None, mounting: bool, world: bool
) -> tuple[ImuRecording, dict[str, Any]]:
    """Return the recording with orientations of the sensor, and the rotations found."""
    from math import degrees

    from bingham.recording import amended

    own = whole if noise is None else _with_noise(whole, noise)
    assert own.orientations is not None
    row: dict[str, Any] = {"noise_deg": degrees(found.noise if noise is None else noise)}
    if mounting:
        row |= {"mounting_wxyz": found.mounting.tolist(), "mounting_std_deg": degrees(found.mounting_std)}
    if world:
        row |= {"world_wxyz": found.world.tolist(), "world_std_deg": degrees(found.world_std)}
    return amended(whole, orientations=found.apply(own.orientations)), row


def _with_noise(recording: ImuRecording, noise: float) -> ImuRecording:
    """Return the recording with the same deviation, rad, of all orientations that bring no covariance of their own."""
    import numpy as np

    from bingham.recording import amended, with_covariance

    seen = recording.orientations
    assert seen is not None
    if seen.covariance is not None:
        return recording
    return amended(recording, orientations=with_covariance(seen, noise**2 * np.eye(3), "world"))


def _doubt(recording: ImuRecording, found: OrientationAlignment) -> None:
    """Say so if camera and sensor, or their worlds, are plainly rotated against each other."""
    import numpy as np

    from bingham.io.checks import note
    from bingham.rotations import to_rotation_vector

    for what, q, std, option in (
        ("camera and sensor", found.mounting, found.mounting_std, "mounting"),
        ("their worlds", found.world, found.world_std, "world"),
    ):
        angle = float(np.linalg.norm(to_rotation_vector(q)))
        if angle > max(NOTED, DEVIATIONS * std):
            degrees = f"{np.degrees(angle):.1f}°"
            note(recording.name, f"{what} are rotated by {degrees} against each other: --align {option}?")
