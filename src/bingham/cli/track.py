"""``bingham track``: recordings in, orientations with uncertainty out."""

from __future__ import annotations

import itertools
import json
import sys
from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from time import perf_counter, thread_time
from typing import TYPE_CHECKING, Any, NamedTuple

import typer

from bingham.errors import InvalidArgumentError

if TYPE_CHECKING:
    from bingham.cli.filtering import FilterOptions

__all__ = ["Frame", "register"]

EXAMPLES = """
Examples:

    bingham track walk.mat -o tracks

    bingham track walk.mat --smooth -o smoothed

    sensor | bingham track - --state imu.state | viewer

    bingham track flight.bag --json -o tracks | jq .error_deg

    bingham track flight.bag --bag -o tracks

    bingham track phone.csv --column gx="Gyro X" --unit gyroscope=deg_s -o tracks

    bingham track camera.txt --measurement-noise 0.02 --process-noise 0.5 --tum -o tracks
"""


# Options without effect on inertial recordings.
OF_ORIENTATIONS = ("process_noise", "measurement_noise", "gate")


class Frame(StrEnum):
    """Axes in which a covariance is given."""

    body = "body"
    world = "world"


class Settings(NamedTuple):
    """What to do with every recording."""

    format: str | None
    reading: dict[str, Any]
    filtering: FilterOptions
    frame: Frame
    tum: bool
    bag: bool
    orientation_topic: str | None
    figure: bool


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command(epilog=EXAMPLES)(track)


def track(
    context: typer.Context,
    recordings: list[Path] = typer.Argument(
        ...,
        metavar="RECORDING",
        help="CSV with named columns, TUM, EuRoC, BROAD .mat/.hdf5, npz, ROS 1 or 2 bag; recognised by content. "
        "- alone follows standard input.",
        show_default=False,
    ),
    output: Path | None = typer.Option(
        None, "--output", "-o", metavar="FOLDER", help="Where tracks and figures go.", show_default=False
    ),
    as_json: bool = typer.Option(False, "--json", help="Print JSON on standard output: an object, or a list."),
    frame: Frame = typer.Option(Frame.body, help="Axes of the covariances, named in the files."),
    tum: bool = typer.Option(False, "--tum", help="Write TUM trajectories too."),
    bag: bool = typer.Option(
        False, "--bag", help="Bags: write a copy with orientation and covariance as a further topic, sensor_msgs/Imu."
    ),
    figure: bool = typer.Option(True, help="Draw a figure of each track."),
    process_noise: float = typer.Option(
        0.3, metavar="RAD/√S", help="Orientations: how fast the body turns; higher follows faster, smooths less."
    ),
    measurement_noise: float = typer.Option(
        0.04, metavar="RAD", help="Orientations: standard deviation of a measurement about each axis."
    ),
    gate: float = typer.Option(
        0.999, metavar="P", help="Orientations: share of regular measurements to let through; 1 rejects none."
    ),
    smooth: bool = typer.Option(False, "--smooth", help="Estimate every orientation from the whole recording."),
    state: Path | None = typer.Option(
        None, metavar="FILE", help="With -: go on from this state if it is there, and keep it up to date."
    ),
    plain: bool = typer.Option(False, "--plain", help="IMU: the simple filter, without gyroscope bias."),
    format: str | None = typer.Option(None, help="csv, tum, euroc, broad, npz or rosbag, instead of recognition."),
    column: list[str] = typer.Option([], metavar="NAME=COLUMN", help="CSV: what the file calls a column."),
    unit: list[str] = typer.Option([], metavar="QUANTITY=UNIT", help="CSV: a unit its columns do not tell."),
    topic: list[str] = typer.Option(
        [],
        metavar="KIND=TOPIC",
        help="Bags: which topic to read, imu= or magnetometer=; orientation=: which one --bag adds.",
    ),
) -> None:
    """Filter recordings of an IMU, or of noisy orientations, into orientations with uncertainty.

    Writes, for every recording, NAME.track.csv (time, quaternion, covariance, concentrations, log-evidence, decisions
    of the gate), NAME.track.npz (the full state) and NAME.png into the folder: all of them, or none if anything fails.
    Tracks are compared with ground truth where a recording has it. µs/sample is processor time of the filter alone.
    With --bag a ROS bag comes back as NAME.track (ROS 2) or NAME.track.bag (ROS 1), its topics untouched.

    With - in place of recordings, lines "gyr|acc|mag TIME X Y Z" (rad/s, m/s²) are read from standard input and each is
    answered by a line of JSON; lines that make no sense are reported, skipped and counted.
    """
    from bingham.atomic import staged
    from bingham.cli.filtering import FilterOptions
    from bingham.cli.first_use import announce_compilation
    from bingham.cli.given import given_options, reject_options
    from bingham.cli.reading import name_of, options
    from bingham.cli.report import print_table

    given = given_options(context)
    if "-" in map(str, recordings):
        from bingham.cli.stream import track_stream

        if len(recordings) > 1:
            raise InvalidArgumentError("RECORDING", "- alone", " ".join(map(str, recordings)))
        options_of_files = tuple(given.keys() - {"recordings", "state"})
        reject_options(given, options_of_files, "recordings in files", "- (standard input, which only takes --state)")
        announce_compilation()
        track_stream(state)
        return
    if output is None:
        raise InvalidArgumentError("--output", "a folder for the tracks", "none", "add -o FOLDER")
    if state is not None:
        raise InvalidArgumentError("--state", "standard input to follow", f"{recordings[0]}", "use it with -")
    reading = options(column, unit, topic)
    orientation_topic = reading.pop("orientation_topic", None)
    if orientation_topic is not None and not bag:
        raise InvalidArgumentError("--topic", "--bag beside orientation=", orientation_topic)
    settings = Settings(
        format=format,
        reading=reading,
        filtering=FilterOptions(process_noise, measurement_noise, gate, plain, smooth),
        frame=frame,
        tum=tum,
        bag=bag,
        orientation_topic=orientation_topic,
        figure=figure,
    )
    names = [name_of(path) for path in recordings]
    if repeated := sorted({name for name in names if names.count(name) > 1}):
        raise InvalidArgumentError("RECORDING", "files of different names", repeated[0], "run them one by one")
    if bag:
        from bingham.cli.bag import check_bags

        check_bags(recordings, output)
    announce_compilation()
    with staged(output) as folder:
        rows = [track_one(path, folder, settings, step) for path, step in progress(recordings, 5 if figure else 4)]
        if not any(row["filter"].startswith("first-order") for row in rows):
            reject_options(given, OF_ORIENTATIONS, "a recording of orientations", "inertial ones alone")
        elif plain and all(row["filter"].startswith("first-order") for row in rows):
            reject_options(given, ("plain",), "an inertial recording", "orientations alone")
    for row in rows:
        row["files"] = [str(output / name) for name in row["files"]]
    if as_json:
        typer.echo(json.dumps(rows if len(rows) > 1 else rows[0], indent=2, ensure_ascii=False))
    else:
        print_table(rows)
        typer.echo(f"Files: {output}")


def track_one(path: Path, folder: Path, settings: Settings, step: Any) -> dict[str, Any]:
    """Read, filter, compare, write and draw one recording; return what there is to say about it."""
    from bingham.cli.filtering import begun, note, prepare
    from bingham.cli.output import draw_track, write_track
    from bingham.cli.reading import read
    from bingham.cli.report import errors_deg, truth_of
    from bingham.recording import OrientationRecording

    started = perf_counter()
    step("reading")
    whole = read(path, settings.format, settings.reading)
    if settings.tum and isinstance(whole, OrientationRecording) and whole.dim != 4:
        raise InvalidArgumentError("--tum", "orientations in space", f"{path}, axes in the plane", "leave --tum out")
    recording = begun(whole, settings.filtering)
    step("filtering")
    prepared = prepare(recording, settings.filtering)
    before = thread_time()
    filtered = prepared.run()
    filtered_s = thread_time() - before
    result = prepared.result(filtered)
    if doubt := result.doubt:
        note(f"{recording.name}: {doubt}")
    row: dict[str, Any] = {
        "recording": recording.name,
        "samples": recording.size,
        "duration_s": recording.duration_s,
        "wall_s": 0.0,
        "us_per_sample": 1e6 * filtered_s / recording.size,
        "filter": prepared.name,
        "rejected": int(result.rejected.sum()),
        "log_evidence": float(result.log_evidence.sum()),
    }
    step("comparing")
    truth = truth_of(recording, result)
    measured = recording.orientation if isinstance(recording, OrientationRecording) else None
    if truth is not None:
        row["error_deg"] = errors_deg(result.modes, truth)
        if measured is not None:
            row["measured_error_deg"] = errors_deg(measured, truth)
        if truth.heading_offset_rad is not None:
            row["heading_offset_rad"] = truth.heading_offset_rad
    step("writing")
    row["files"] = write_track(folder, recording, result, frame=settings.frame.value, tum=settings.tum)
    if settings.bag:
        from bingham.cli.bag import write_bag

        row["files"].append(write_bag(folder, path, whole.time, result, settings.reading, settings.orientation_topic))
    if settings.figure:
        step("drawing")
        row["files"].append(draw_track(folder, recording, result, truth))
    row["wall_s"] = perf_counter() - started
    return row


def progress(recordings: list[Path], steps: int) -> Any:
    """Yield each recording with a function that shows its next step on a bar, on stderr if that is a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    shown = sys.stderr.isatty()
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=not shown) as bar:
        task = bar.add_task("", total=steps * len(recordings))
        for count, path in enumerate(recordings):
            done = itertools.count(steps * count)

            def step(what: str, name: str = path.name, done: Iterator[int] = done) -> None:
                bar.update(task, completed=next(done), description=f"{name}: {what}")

            yield path, step
