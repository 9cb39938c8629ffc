"""``bingham calibrate``: hard and soft iron of a magnetometer, for ``bingham track --calibration``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from bingham.errors import InvalidArgumentError, RecordingError

if TYPE_CHECKING:
    from bingham.recording import ImuRecording

__all__ = ["calibrated", "register"]

EXAMPLES = """
Examples:

    bingham calibrate turned.csv -o magnetometer.json

    bingham track walk.csv --calibration magnetometer.json -o out
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    from bingham.cli.reading import takes_reading

    app.command(epilog=EXAMPLES)(takes_reading(calibrate))


def calibrate(
    recording: Path = typer.Argument(
        ...,
        metavar="RECORDING",
        help="An inertial recording with magnetometer that turns about all axes.",
        show_default=False,
    ),
    output: Path = typer.Option(
        Path("magnetometer.json"), "--output", "-o", metavar="FILE", help="Where the calibration is written."
    ),
    as_json: bool = typer.Option(False, "--json", help="Print the calibration on standard output, too."),
    reading: Any = None,
) -> None:
    """Fit the magnetometer's offset (hard iron) and axes (soft iron) and write them to a file.

    The samples of a magnetometer that turns in a constant field lie on an ellipsoid; the calibration makes it a sphere
    about the origin. Turn the sensor slowly about all its axes for half a minute, away from iron.
    """
    from bingham.atomic import replaced
    from bingham.cli.reading import read
    from bingham.filters.imu_calibration import calibrate_magnetometer
    from bingham.recording import ImuRecording

    format, given = reading
    loaded = read(recording, format, given)
    if not isinstance(loaded, ImuRecording):
        raise InvalidArgumentError("RECORDING", "an inertial recording", f"{recording}, orientations")
    with replaced(output) as path:  # first: a place that cannot be written costs no work
        found = calibrate_magnetometer(loaded)
        path.write_text(found.to_json(), encoding="utf-8")
    if as_json:
        typer.echo(json.dumps(json.loads(found.to_json())))
        return
    x, y, z = found.offset
    typer.echo(f"offset {x:.5g}, {y:.5g}, {z:.5g}; strength varies by {100 * found.residual:.2g} % after calibration")
    typer.echo(f"wrote {output}; use it: bingham track RECORDING --calibration {output}")


def calibrated(recording: ImuRecording, path: Path) -> ImuRecording:
    """Return the recording with its magnetometer calibrated by the file at `path`."""
    from bingham.filters.imu_calibration import MagnetometerCalibration
    from bingham.recording import amended

    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise RecordingError(path, "", f"cannot be read: {error}", "bingham calibrate writes such files") from None
    found = MagnetometerCalibration.from_json(text)
    if recording.magnetometer is None:
        raise InvalidArgumentError("--calibration", "a recording with magnetometer", recording.name)
    return amended(recording, magnetometer=found.apply(recording.magnetometer))
