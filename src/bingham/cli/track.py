"""``bingham track``: recordings in, orientations with uncertainty out."""

from __future__ import annotations

import glob
import itertools
from enum import StrEnum
from pathlib import Path
from typing import Any

import typer

from bingham.cli.fusion import Align
from bingham.cli.terminal import print_json, progress_bar, say, say_error
from bingham.errors import InvalidArgumentError

__all__ = ["Frame", "register"]

EXAMPLES = """
Examples:

    bingham track walk.mat -o tracks

    bingham track walk.mat --smooth -o smoothed

    sensor | bingham track - --state imu.state | viewer

    bingham track flight.bag --json -o tracks | jq .error_deg

    bingham track flight.bag --bag -o tracks

    bingham track phone.csv --column gx="Gyro X" --unit gyroscope=deg_s -o tracks

    bingham track recordings/ --jobs 4 -o tracks

    bingham track camera.txt --measurement-noise 0.02 --process-noise 0.5 --tum -o tracks

    bingham track gyro.csv camera.txt --fuse --align both -o tracks
"""


# Options without effect on inertial recordings, and on those of orientations.
OF_ORIENTATIONS = ("process_noise", "measurement_noise", "gate")
OF_INERTIAL = ("plain",)


class FigureFormat(StrEnum):
    """File format of figures."""

    png = "png"
    pdf = "pdf"
    svg = "svg"


class Frame(StrEnum):
    """Axes in which a covariance is given."""

    body = "body"
    world = "world"


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    from bingham.cli.reading import takes_reading

    app.command(epilog=EXAMPLES)(takes_reading(track))


def track(
    context: typer.Context,
    recordings: list[str] = typer.Argument(
        ...,
        metavar="RECORDING",
        help="Files recognised by content: bingham formats lists what can be read. "
        "Folders and patterns stand for all recordings in them. - alone follows standard input.",
        show_default=False,
    ),
    output: Path | None = typer.Option(
        None, "--output", "-o", metavar="FOLDER", help="Where tracks and figures go.", show_default=False
    ),
    as_json: bool = typer.Option(False, "--json", help="Print JSON on standard output: an object, or a list."),
    verbose: bool = typer.Option(False, "--verbose", "-v", help="Tell the filter's time for a sample, too."),
    fields: str | None = typer.Option(
        None,
        metavar="A,B,...",
        help="Columns of CSV and Parquet: quaternion, euler, deviation, bias, bias_std, covariance, concentrations, "
        "relative_heading, evidence, rest, decision; the first four, those there are, unless given.",
    ),
    csv: bool = typer.Option(True, help="Write NAME.track.csv."),
    npz: bool = typer.Option(True, help="Write NAME.track.npz."),
    parquet: bool = typer.Option(False, "--parquet", help="Write NAME.track.parquet; needs pyarrow."),
    float32: bool = typer.Option(False, "--float32", help="Numbers in npz and Parquet of half the size; not times."),
    frame: Frame = typer.Option(Frame.body, help="Axes of the covariances, named in the files."),
    tum: bool = typer.Option(False, "--tum", help="Write TUM trajectories too."),
    bag: bool = typer.Option(
        False, "--bag", help="Bags: write a copy with orientation and covariance as a further topic, sensor_msgs/Imu."
    ),
    figure: bool = typer.Option(True, help="Draw a figure of each track."),
    figure_format: FigureFormat = typer.Option(FigureFormat.png, help="Format of the figures."),
    report: bool = typer.Option(False, "--report", help="Write NAME.html, one page to look at: body, curves, summary."),
    rerun: bool = typer.Option(False, "--rerun", help="Write NAME.rrd for the Rerun viewer."),
    jobs: int = typer.Option(1, min=1, help="Several recordings: processes on this machine."),
    scheduler: str | None = typer.Option(
        None, metavar="ADDRESS", help="Several recordings: Dask scheduler whose workers track them, in place of --jobs."
    ),
    fail_fast: bool = typer.Option(
        False, "--fail-fast", help="Several recordings: end at the first that cannot be tracked, with nothing written."
    ),
    fresh: bool = typer.Option(False, "--fresh", help="Several recordings: track again what is done already."),
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
    calibration: Path | None = typer.Option(
        None, "--calibration", metavar="FILE", help="IMU: the magnetometer's, as bingham calibrate writes it."
    ),
    fuse: bool = typer.Option(
        False,
        "--fuse",
        help="Two recordings, inertial and of orientations (camera, motion capture): one track of both.",
    ),
    align: Align = typer.Option(
        Align.none,
        help="With --fuse: find the constant rotation between camera and sensor, between their worlds, or both.",
    ),
    plain: bool = typer.Option(False, "--plain", help="IMU: the simple filter, without gyroscope bias."),
    spin: bool = typer.Option(
        False,
        "--spin",
        help="Orientations: follow the spin, too, and print it: axis, revolutions a second, covariance.",
    ),
    reading: Any = None,
) -> None:
    """Filter recordings of an IMU, or of noisy orientations, into orientations with uncertainty.

    Writes, for every recording, NAME.track.csv (time, quaternion, Euler angles, deviations of heading and inclination,
    gyroscope bias), NAME.track.npz (every bit, the state to go on from) and NAME.png into the folder: all of them, or
    none if it cannot be tracked. Tracks are compared with ground truth where a recording has it. With --bag a ROS bag
    comes back as NAME.track (ROS 2) or NAME.track.bag (ROS 1), its topics untouched.

    Of several recordings each one's files appear as it is finished, and summary.csv lists all; those that cannot be
    tracked are named at the end (exit code 1). The same command again passes over what is done and unchanged.

    With - in place of recordings, lines "gyr|acc|mag TIME X Y Z" (rad/s, m/s²) are read from standard input and each is
    answered by a line of JSON; lines that make no sense are reported, skipped and counted.
    """
    from bingham.cli.filtering import FilterOptions
    from bingham.cli.first_use import announce_compilation
    from bingham.cli.given import given_options, reject_options
    from bingham.cli.many import expanded, named
    from bingham.cli.output import Outputs
    from bingham.cli.reading import gathered
    from bingham.cli.settings import Settings

    given = given_options(context)
    if "-" in recordings:
        from bingham.cli.stream import track_stream

        if len(recordings) > 1:
            raise InvalidArgumentError("RECORDING", "- alone", " ".join(recordings))
        options_of_files = tuple(given.keys() - {"recordings", "state"})
        reject_options(given, options_of_files, "recordings in files", "- (standard input, which only takes --state)")
        announce_compilation()
        track_stream(state)
        return
    if spin:
        from bingham.cli.spin import track_spin

        noise = measurement_noise if "measurement_noise" in given else None
        others = tuple(
            given.keys() - {"recordings", "output", "as_json", "figure", "measurement_noise", "reading", "spin"}
        )
        reject_options(given, others, "a track without --spin", "--spin")
        track_spin(recordings, output, as_json=as_json, figure=figure, format=reading[0], reading=reading[1],
                   measurement_noise=noise)  # fmt: skip
        return
    if output is None:
        raise InvalidArgumentError("--output", "a folder for the tracks", "none", "add -o FOLDER")
    if state is not None:
        raise InvalidArgumentError("--state", "standard input to follow", f"{recordings[0]}", "use it with -")
    format, reading = reading
    orientation_topic = reading.pop("orientation_topic", None)
    if orientation_topic is not None and not bag:
        raise InvalidArgumentError("--topic", "--bag beside orientation=", orientation_topic)
    chosen = None if fields is None else tuple(name.strip() for name in fields.split(","))
    _check_fields(chosen)
    if not (csv or npz or parquet or tum or bag or figure or report or rerun):
        raise InvalidArgumentError("--no-npz", "something to write", "none of the files", "leave one --no-… out")
    other = None
    if fuse:
        from bingham.cli.fusion import beside

        reject_options(given, ("process_noise", "gate", "plain", "bag", "jobs", "scheduler"), "no --fuse", "--fuse")
        noise = measurement_noise if "measurement_noise" in given else None
        if noise is not None and not 0.0 < noise < 1.0:
            raise InvalidArgumentError("--measurement-noise", "rad, above 0 and below 1", noise)
        inertial, other = beside(recordings, format, reading, align, noise)
        recordings = [inertial]
    else:
        reject_options(given, ("align",), "--fuse", "no --fuse")
    settings = Settings(
        format=format,
        reading=reading,
        filtering=FilterOptions(process_noise, measurement_noise, gate, plain, smooth),
        outputs=Outputs(
            csv, npz, parquet, figure, tum, bag, chosen, frame.value, float32, figure_format.value, report, rerun
        ),
        orientation_topic=orientation_topic,
        calibration=calibration,
        beside=other,
    )
    found = named(gathered(expanded(recordings), reading))
    if bag:
        from bingham.cli.bag import check_bags

        check_bags(found, output)
    if scheduler is not None:
        reject_options(given, ("jobs",), "no --scheduler, whose workers do the runs", scheduler)
    if jobs == 1 and scheduler is None:
        announce_compilation()
    if len(found) == 1 and (len(recordings) == 1 or "beside" in reading) and not glob.has_magic(recordings[0]):
        reject_options(given, ("jobs", "scheduler", "fail_fast", "fresh"), "several recordings", recordings[0])
        ((name, path),) = found.items()
        rows = [_track_alone(path, name, output, settings, given)]
        _report(rows, output, as_json=as_json, verbose=verbose, alone=True)
        return
    rows, errors = _track_all(found, output, settings, jobs, scheduler, fail_fast, fresh)
    kinds = [row["filter"].startswith("first-order") for row in rows]
    if rows and not any(kinds):
        _without_effect(given, OF_ORIENTATIONS, "orientations")
    if rows and all(kinds):
        _without_effect(given, OF_INERTIAL, "an inertial sensor")
    _report(rows, output, as_json=as_json, verbose=verbose, alone=False)
    if errors:
        say_error(f"{len(errors)} of {len(found)} recordings could not be tracked:")
        for error in errors.values():
            say_error(error)
        raise typer.Exit(1)


def _track_alone(path: Path, name: str, output: Path, settings: Any, given: dict[str, str]) -> dict[str, Any]:
    """Track one recording; an option that would do nothing for its kind is a mistake."""
    from bingham.cli.tracking import track_one

    def check(orientations: bool) -> None:
        from bingham.cli.given import reject_options

        if orientations:
            reject_options(given, OF_INERTIAL, "an inertial recording", "orientations alone")
        else:
            names = OF_ORIENTATIONS if settings.beside is None else ()
            reject_options(given, names, "a recording of orientations", "inertial ones alone")

    with progress_bar(4) as show:
        steps = itertools.count()
        return track_one(path, name, output, settings, lambda what: show(next(steps), f"{name}: {what}"), check)


def _track_all(
    found: dict[str, Path], output: Path, settings: Any, jobs: int, scheduler: str | None, fail_fast: bool, fresh: bool
) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """Track many recordings; an interruption says how many are done."""
    from bingham.atomic import staged, sweep
    from bingham.cli.ending import Terminated
    from bingham.cli.many import track_many
    from bingham.cli.wording import in_options

    done = 0

    def show_one(count: int, name: str) -> None:
        nonlocal done
        done = count
        show(count, name)

    how: dict[str, Any] = {"jobs": jobs, "scheduler": scheduler, "show": show_one}
    with progress_bar(len(found)) as show, in_options({"scheduler": "--scheduler", "jobs": "--jobs"}):
        if fail_fast:
            with staged(output) as folder:
                rows, errors = track_many(found, folder, settings, fail_fast=True, fresh=True, **how)
            for row in rows:
                row["files"] = [str(output / Path(name).name) for name in row["files"]]
            return rows, errors
        try:
            return track_many(found, output, settings, fresh=fresh, **how)
        except (KeyboardInterrupt, Terminated) as end:
            number = getattr(end, "number", 2)
            sweep(output)
            what = "interrupted" if number == 2 else "terminated"
            say_error(f"{what}; {done} of {len(found)} recordings are done; the same command continues from there")
            raise typer.Exit(128 + number) from None


def _report(rows: list[dict[str, Any]], output: Path, *, as_json: bool, verbose: bool, alone: bool) -> None:
    for row in rows:
        for warning in row["warnings"]:
            say_error(f"warning: {warning}")
    if as_json:
        print_json(rows[0] if alone else rows)
    elif rows:
        from bingham.cli.report import print_table

        print_table(rows, verbose=verbose)
        if same := sum(row.get("unchanged", False) for row in rows):
            say(f"{same} of {len(rows)} unchanged since an earlier run; --fresh tracks them again")
        say(f"Files: {output}")


def _without_effect(given: dict[str, str], names: tuple[str, ...], needed: str) -> None:
    for name in names:
        if name in given:
            say_error(f"warning: {given[name]} had no effect: no recording of {needed}")


def _check_fields(chosen: tuple[str, ...] | None) -> None:
    if chosen is None:
        return
    from bingham.io.track_fields import FIELDS

    for name in chosen:
        if name not in FIELDS:
            raise InvalidArgumentError("--fields", f"some of {', '.join(FIELDS)}", name)
