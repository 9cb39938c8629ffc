"""One recording: read, filter, compare, write and draw, piece by piece where its length asks for it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import Any

from bingham.cli.filtering import Filtering, fitted, rows_of
from bingham.cli.settings import Settings
from bingham.cli.source import Source, in_pieces, opened, opened_whole
from bingham.cli.thinned import Peaks, Thinned, merged
from bingham.errors import InvalidArgumentError, RecordingWarning
from bingham.io.checks import note
from bingham.io.running_clock import WholeNeededError

__all__ = ["track_one"]

# Samples that a figure is drawn of, evenly, where there is no truth to compare all of them with; beside them the
# extremes of its curves in stretches of time that are narrower than a pixel, too few to make gaps of what is between.
DRAWN, STRETCHES = 250_000, 4000


def track_one(
    path: Path,
    name: str,
    folder: Path,
    settings: Settings,
    step: Callable[[str], None] = lambda _: None,
    check: Callable[[bool], None] = lambda _: None,
) -> dict[str, Any]:
    """Write the files of one recording into a folder, all or none; return what there is to say about it."""
    from bingham.atomic import staged

    started = perf_counter()
    step("reading")
    with _collected() as said, staged(folder) as temporary:
        try:
            row = _track(path, name, temporary, settings, opened(path, name, settings), step, check, said)
        except WholeNeededError:
            said.clear()
            for file in temporary.iterdir():
                file.unlink()
            row = _track(path, name, temporary, settings, opened_whole(path, name, settings), step, check, said)
    row["files"] = [str(folder / file) for file in row["files"]]
    row["warnings"] = list(dict.fromkeys(said))
    row["wall_s"] = perf_counter() - started
    return row


@contextmanager
def _collected() -> Generator[list[str]]:
    """Give a list that warnings of the block are put into, as texts; before an error of the block they are shown."""
    said: list[str] = []
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.showwarning = lambda message, *_, **__: said.append(str(message))
            yield said
    except Exception:
        for text in dict.fromkeys(said):
            warnings.warn(text, RecordingWarning, stacklevel=2)
        raise


def _track(
    path: Path,
    name: str,
    folder: Path,
    settings: Settings,
    source: Source,
    step: Callable[[str], None],
    check: Callable[[bool], None],
    said: list[str],
) -> dict[str, Any]:
    from bingham.cli.calibrate import calibrated
    from bingham.cli.output import Files, Sketch, draw_track, drawn_curves, joined, write_pages, write_tum_of
    from bingham.cli.report import truth_of
    from bingham.cli.summary import Summary
    from bingham.filters.imu_check import RecordingCheck
    from bingham.recording import ImuRecording, OrientationRecording

    outputs, first = settings.outputs, source.first
    if outputs.tum and isinstance(first, OrientationRecording) and first.dim != 4:
        raise InvalidArgumentError("--tum", "orientations in space", f"{path}, axes in the plane", "leave --tum out")
    if (outputs.report or outputs.rerun) and isinstance(first, OrientationRecording) and first.dim != 4:
        raise InvalidArgumentError("--report", "orientations in space", f"{path}, axes in the plane", "leave it out")
    check(isinstance(first, OrientationRecording))
    options = fitted(settings.filtering, first)
    compared = source.whole is not None and (
        first.truth is not None or (isinstance(first, ImuRecording) and first.reference is not None)
    )
    entire = outputs.tum or outputs.bag or outputs.report or options.plain or not isinstance(first, ImuRecording)
    keep = compared or outputs.tum or outputs.bag or outputs.figure or outputs.report or outputs.rerun
    filtering, summary, checked = Filtering(options), Summary(source.usual_step), RecordingCheck()
    kept: list[Any] = []
    sketched, peaks = Thinned(None if compared else DRAWN), Peaks(STRETCHES)
    step("filtering")
    with Files(folder, name, outputs) as files:
        for piece in in_pieces(source, options):
            if isinstance(piece, ImuRecording):
                piece = piece if settings.calibration is None else calibrated(piece, settings.calibration)
                checked.add(piece)
            part, track = filtering.run(piece)
            if part is None:
                continue
            if keep and entire:
                kept.append(track)
            elif keep:
                rows = track.time, track.modes, track.rotation_covariance
                sketched.add(*rows)
                if not compared:
                    peaks.add(drawn_curves(*rows[1:]), *rows)
            files.append(part.time, track)
            summary.add(part, track)
        filtering.finish(name)
        for finding in checked.findings():
            note(name, f"{finding.name}: {finding.message}")
        step("writing")
        files.close()
    if summary.doubt:
        note(name, summary.doubt)
    row: dict[str, Any] = {"recording": name, "file": str(path), "filter": filtering.name, **summary.row()}
    if "orientations" in row:
        row["orientations"] |= source.said
    row["us_per_sample"] = 1e6 * filtering.seconds / summary.samples
    row["files"] = files.names
    if keep:
        chosen: Any = slice(None)
        if entire:
            track = joined(kept)
        elif compared:
            track = Sketch(*sketched.arrays())
        else:
            chosen, *arrays = merged(sketched, peaks)
            track = Sketch(*arrays)
        kept.clear()
        recording = first
        if source.whole is not None:
            recording = rows_of(rows_of(first, slice(first.size - summary.samples, None)), chosen)
        time = recording.time if entire else track.time
        truth = truth_of(recording, track.modes) if compared else None
        if truth is not None:
            row |= _errors(recording, track.modes, truth)
        if outputs.tum:
            row["files"].append(write_tum_of(folder, recording, time, track))
        if outputs.bag:
            from bingham.cli.bag import write_bag

            topic = settings.orientation_topic
            row["files"].append(write_bag(folder, path, name, first.time, track, settings.reading, topic))
        if outputs.figure:
            step("drawing")
            row["files"].append(draw_track(folder, recording, time, track, truth, outputs.figure_format))
        if outputs.report or outputs.rerun:
            shown = {"samples": f"{row['samples']}", "duration": f"{row['duration_s']:.1f} s", "filter": row["filter"]}
            spread = {f"{key} ±, median": v for key, v in row["median_deviation_deg"].items() if v is not None}
            errors = {key.replace("_", " "): v for key, v in row.get("error_deg", {}).items()}
            shown |= {key: f"{value:.2f}°" for key, value in (spread | errors).items()}
            row["files"] += write_pages(folder, recording, time, track, truth, outputs, shown, said)
    return row


def _errors(recording: Any, modes: Any, truth: Any) -> dict[str, Any]:
    from bingham.cli.report import errors_deg

    row: dict[str, Any] = {"error_deg": errors_deg(modes, truth)}
    if (measured := getattr(recording, "orientation", None)) is not None:
        row["measured_error_deg"] = errors_deg(measured, truth)
    if truth.heading_offset_rad is not None:
        row["heading_offset_rad"] = truth.heading_offset_rad
    return row
