"""One recording: read, filter, compare, write and draw, piece by piece where its length asks for it."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

from bingham.cli.output import Outputs
from bingham.errors import InvalidArgumentError, RecordingWarning

if TYPE_CHECKING:
    from bingham.cli.filtering import FilterOptions

__all__ = ["Settings", "track_one"]

# Samples that a figure is drawn of at most, where there is no truth to compare all of them with.
DRAWN = 250_000


class Settings(NamedTuple):
    """What to do with every recording."""

    format: str | None
    reading: dict[str, Any]
    filtering: FilterOptions
    outputs: Outputs
    orientation_topic: str | None = None
    calibration: Path | None = None


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
    with _collected() as said, staged(folder) as temporary:
        row = _track(path, name, temporary, settings, step, check)
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
    step: Callable[[str], None],
    check: Callable[[bool], None],
) -> dict[str, Any]:
    from bingham.cli.filtering import Filtering, fitted, note, pieces_of, renamed, rows_of
    from bingham.cli.output import Files, Sketch, draw_track, joined, write_pages, write_tum_of
    from bingham.cli.reading import read
    from bingham.cli.report import truth_of
    from bingham.cli.summary import Summary
    from bingham.recording import ImuRecording, OrientationRecording

    outputs = settings.outputs
    step("reading")
    whole = renamed(read(path, settings.format, settings.reading), name)
    if isinstance(whole, ImuRecording):
        from bingham.filters.imu_check import check_recording

        if settings.calibration is not None:
            from bingham.cli.calibrate import calibrated

            whole = calibrated(whole, settings.calibration)
        for finding in check_recording(whole):
            note(f"{name}: {finding.name}: {finding.message}")
    _release()
    if outputs.tum and isinstance(whole, OrientationRecording) and whole.dim != 4:
        raise InvalidArgumentError("--tum", "orientations in space", f"{path}, axes in the plane", "leave --tum out")
    if (outputs.report or outputs.rerun) and isinstance(whole, OrientationRecording) and whole.dim != 4:
        raise InvalidArgumentError("--report", "orientations in space", f"{path}, axes in the plane", "leave it out")
    check(isinstance(whole, OrientationRecording))
    options = fitted(settings.filtering, whole)
    compared = whole.truth is not None or (isinstance(whole, ImuRecording) and whole.reference is not None)
    entire = outputs.tum or outputs.bag or outputs.report or options.plain or not isinstance(whole, ImuRecording)
    thinned = 1 if compared or entire else max(1, -(-whole.size // DRAWN))
    keep = compared or outputs.tum or outputs.bag or outputs.figure or outputs.report or outputs.rerun
    step("filtering")
    filtering, summary = Filtering(options), Summary()
    kept: list[Any] = []
    with Files(folder, name, outputs) as files:
        for piece in pieces_of(whole, options):
            part, track = filtering.run(piece)
            if part is None:
                continue
            if keep:
                kept.append(track if entire else Sketch.of(track, slice(-summary.samples % thinned, None, thinned)))
            files.append(part.time, track)
            summary.add(part, track)
        filtering.finish(name)
        step("writing")
        files.close()
    if summary.doubt:
        note(f"{name}: {summary.doubt}")
    row: dict[str, Any] = {"recording": name, "file": str(path), "filter": filtering.name, **summary.row()}
    row["us_per_sample"] = 1e6 * filtering.seconds / summary.samples
    row["files"] = files.names
    if keep:
        track = joined(kept)
        kept.clear()
        recording = rows_of(whole, slice(whole.size - summary.samples, None, thinned))
        truth = truth_of(recording, track.modes) if compared else None
        if truth is not None:
            row |= _errors(recording, track.modes, truth)
        if outputs.tum:
            row["files"].append(write_tum_of(folder, recording, recording.time, track))
        if outputs.bag:
            from bingham.cli.bag import write_bag

            topic = settings.orientation_topic
            row["files"].append(write_bag(folder, path, name, whole.time, track, settings.reading, topic))
        if outputs.figure:
            step("drawing")
            row["files"].append(draw_track(folder, recording, recording.time, track, truth, outputs.figure_format))
        if outputs.report or outputs.rerun:
            shown = {"samples": f"{row['samples']}", "duration": f"{row['duration_s']:.1f} s", "filter": row["filter"]}
            shown |= {key.replace("_", " "): f"{value:.2f}°" for key, value in row.get("error_deg", {}).items()}
            row["files"] += write_pages(folder, recording, recording.time, track, truth, outputs, shown)
    return row


def _release() -> None:
    """Give back what the reader of text keeps for files to come: as much as the file was."""
    if (arrow := sys.modules.get("pyarrow")) is not None:
        arrow.default_memory_pool().release_unused()


def _errors(recording: Any, modes: Any, truth: Any) -> dict[str, Any]:
    from bingham.cli.report import errors_deg

    row: dict[str, Any] = {"error_deg": errors_deg(modes, truth)}
    if (measured := getattr(recording, "orientation", None)) is not None:
        row["measured_error_deg"] = errors_deg(measured, truth)
    if truth.heading_offset_rad is not None:
        row["heading_offset_rad"] = truth.heading_offset_rad
    return row
