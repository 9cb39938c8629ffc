"""``bingham simulate``: recordings for people without data, with known truth."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from bingham.errors import InvalidArgumentError

if TYPE_CHECKING:
    from bingham.recording import ImuRecording, OrientationRecording
    from bingham.simulate import Motion

__all__ = ["register"]

EXAMPLES = """
Examples:

    bingham simulate tumbling -o tumbling.npz

    bingham simulate precession --sensor orientation --noise 0.05 -o precession.csv

    bingham simulate tumbling --duration 600 --bias 0.01 --no-magnetometer --seed 7 -o drift.npz
"""

# Arguments of the simulation → options.
OPTIONS = {
    "duration_s": "--duration",
    "rate_hz": "--rate",
    "rest_s": "--rest",
    "jitter": "--jitter",
    "drop_probability": "--drop",
}
# All samples are in memory at once, in arrays of some 40 numbers a sample.
MOST_SAMPLES = 5_000_000
LONGEST_DEFAULT_REST = 5.0


class MotionKind(StrEnum):
    """Motions of a rigid body."""

    tumbling = "tumbling"
    precession = "precession"


class Sensor(StrEnum):
    """What watches the motion."""

    imu = "imu"
    orientation = "orientation"


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command(epilog=EXAMPLES)(simulate)


def simulate(
    context: typer.Context,
    motion: MotionKind = typer.Argument(
        ..., help="A free body turning over again and again, or a spinning top.", show_default=False
    ),
    output: Path = typer.Option(
        ..., "--output", "-o", metavar="FILE", help="Recording to write: .npz, or .csv to look at.", show_default=False
    ),
    sensor: Sensor = typer.Option(Sensor.imu, help="An inertial and magnetic unit, or one that measures orientations."),
    duration: float = typer.Option(60.0, metavar="S", help="Duration, rests included."),
    rate: float = typer.Option(100.0, metavar="HZ", help="Sampling rate."),
    rest: float | None = typer.Option(
        None,
        metavar="S",
        help="Rest before and after the motion, each; 5 unless given, at most a quarter of the duration.",
        show_default=False,
    ),
    jitter: float = typer.Option(0.0, metavar="0…0.5", help="Irregularity of sample times, share of the interval."),
    drop: float = typer.Option(0.0, metavar="P", help="Chance that a sample is missing."),
    noise: float = typer.Option(0.05, metavar="RAD", help="Orientation: standard deviation about each axis."),
    bias: float = typer.Option(0.0, metavar="RAD/S", help="IMU: constant bias of each gyroscope axis."),
    magnetometer: bool = typer.Option(True, help="IMU: with or without a magnetometer."),
    seed: int = typer.Option(0, min=0, help="Same seed, same recording."),
) -> None:
    """Simulate a recording with known truth, to be read by `bingham track`."""
    import numpy as np

    from bingham import io, simulate
    from bingham.cli.filtering import orientation_noise
    from bingham.cli.first_use import announce_compilation
    from bingham.cli.given import given_options, reject_options
    from bingham.cli.wording import in_options
    from bingham.recording import amended

    given = given_options(context)
    if sensor is Sensor.imu:
        reject_options(given, ("noise",), "--sensor orientation", "an inertial unit")
    else:
        reject_options(given, ("bias", "magnetometer"), "an inertial unit", "--sensor orientation")
    writers: dict[str, Any] = {".npz": io.write_npz, ".csv": io.write_csv}
    if output.suffix not in writers:
        raise InvalidArgumentError("--output", "a file ending in .npz or .csv", output.name)
    if duration * rate > MOST_SAMPLES:
        longest = f"at most {MOST_SAMPLES:,} samples, {MOST_SAMPLES / rate:g} s at {rate:g} Hz"
        raise InvalidArgumentError("--duration", longest, duration, "simulate several recordings, or lower --rate")
    if not np.isfinite(bias):
        raise InvalidArgumentError("--bias", "a finite number, rad/s", bias)
    announce_compilation()
    rest = min(LONGEST_DEFAULT_REST, duration / 4) if rest is None else rest
    timing: dict[str, Any] = {"rest_s": rest, "jitter": jitter, "drop_probability": drop, "rng": seed}
    bodies = {
        MotionKind.tumbling: simulate.simulate_tumbling,
        MotionKind.precession: simulate.simulate_precession,
    }
    with in_options(OPTIONS):
        moved: Motion = bodies[motion](duration, rate, **timing)
    recording: ImuRecording | OrientationRecording
    if sensor is Sensor.imu:
        recording = simulate.simulate_imu(moved, gyroscope_bias=[bias] * 3, magnetometer=magnetometer, rng=seed + 1)
    else:
        distribution = orientation_noise("--noise", noise, 4)
        recording = simulate.simulate_orientations(moved, distribution, rng=seed + 1)
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidArgumentError(
            "--output", "a file in a folder that can be made", f"{output}: {error.strerror}"
        ) from None
    writers[output.suffix](output, amended(recording, name=output.stem))
    typer.echo(f"{output}: {motion.value}, {recording.size} samples, {recording.duration_s:.1f} s, with truth")
