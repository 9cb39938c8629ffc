"""``bingham tune``: noise densities of a sensor from a recording, without ground truth."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from bingham.errors import InvalidArgumentError

if TYPE_CHECKING:
    from bingham.filters.tune import Tuning

__all__ = ["register"]

EXAMPLES = """
Examples:

    bingham tune desk.csv

    bingham tune desk.csv --json | jq .gyroscope

    bingham tune desk.csv -o noise
"""

UNITS = {"gyroscope": "rad/s/√Hz", "accelerometer": "m/s²/√Hz", "magnetometer": "per sample, the file's unit"}

PARAMETERS = {
    "gyroscope": "gyroscope_noise_density",
    "accelerometer": "accelerometer_noise_density",
    "magnetometer": "magnetometer_noise",
}


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    from bingham.cli.reading import takes_reading

    app.command(epilog=EXAMPLES)(takes_reading(tune))


def tune(
    recording: Path = typer.Argument(
        ..., metavar="RECORDING", help="An inertial recording, as for track, resting at first.", show_default=False
    ),
    output: Path | None = typer.Option(
        None, "--output", "-o", metavar="FOLDER", help="Draw the profiles of the log-evidence into it."
    ),
    as_json: bool = typer.Option(False, "--json", help="Print one JSON object on standard output."),
    reading: Any = None,
) -> None:
    """Find the noise of gyroscope, accelerometer and magnetometer that makes a recording most probable.

    Gravity and field are taken to be constant, noise to be white: right for simulated sensors and for bodies that turn
    undisturbed. Values into which motion went, or which the recording leaves open, are marked. What is found describes
    white noise: Gyroscope, VectorSensor and simulate_imu take it, ImuFilter and bingham track need none of it. Ground
    truth is not used.
    """
    from bingham.atomic import staged
    from bingham.cli.first_use import announce_compilation
    from bingham.cli.reading import read
    from bingham.filters.tune import UNDETERMINED
    from bingham.filters.tune import tune as search
    from bingham.recording import ImuRecording

    loaded = read(recording, *reading)
    if not isinstance(loaded, ImuRecording):
        raise InvalidArgumentError("RECORDING", "an inertial recording", f"orientations in {recording}")
    announce_compilation()
    show = sys.stderr.isatty()

    def progress(count: int, best: float) -> None:
        if show:
            sys.stderr.write(f"\r{count} evaluations, log-evidence {best:.1f} ")

    tuning = search(loaded, progress=progress)
    if show:
        sys.stderr.write("\n")
    row = describe(loaded.name, tuning)
    if output is not None:
        from bingham.plot.tuning import plot_profiles

        profiles = {name: tuning.profile(name) for name in tuning.relative_error}
        with staged(output) as folder:
            name = f"{loaded.name}.tune.png"
            plot_profiles(profiles, units=UNITS, doubts=tuning.doubts, title=loaded.name).savefig(
                folder / name, dpi=150
            )
        row["files"] = [str(output / name)]
    if as_json:
        typer.echo(json.dumps(row, indent=2, ensure_ascii=False))
        return
    doubts = tuning.doubts
    for name, error in tuning.relative_error.items():
        value = f"{getattr(tuning.noise, name):.4g} {UNITS[name]}  ± {100 * error:.1f} %"
        if not error <= UNDETERMINED:
            typer.echo(f"{name:14} {doubts[name]}")
        else:
            typer.echo(f"{name:14} {value}" + (f"; {doubts[name]}" if name in doubts else ""))
    typer.echo("For simulate_imu, Gyroscope and VectorSensor; ImuFilter and bingham track keep their defaults.")
    usable = [f"{PARAMETERS[n]}={getattr(tuning.noise, n):.4g}" for n in tuning.relative_error if n not in doubts]
    if usable:
        typer.echo(f"    simulate_imu(motion, {', '.join(usable)})")
    if not {"gyroscope", "accelerometer"} & doubts.keys():
        step = loaded.duration_s / (loaded.size - 1)
        gravity = f"VectorSensor([0, 0, 1], concentration={step * (9.81 / tuning.noise.accelerometer) ** 2:.4g})"
        typer.echo(f"    BinghamFilter(Gyroscope(noise_density={tuning.noise.gyroscope:.4g}), {gravity})")
    typer.echo(f"log-evidence {tuning.log_evidence:.1f} after {tuning.evaluations} evaluations")
    for file in row.get("files", []):
        typer.echo(f"Figure: {file}")


def describe(name: str, tuning: Tuning) -> dict[str, Any]:
    """Return what there is to say; an error that the recording leaves open is None."""
    row: dict[str, Any] = {"recording": name}
    for sensor, error in tuning.relative_error.items():
        row[sensor] = getattr(tuning.noise, sensor)
        row[f"{sensor}_relative_error"] = error if error == error else None
    return row | {"doubts": tuning.doubts, "log_evidence": tuning.log_evidence, "evaluations": tuning.evaluations}
