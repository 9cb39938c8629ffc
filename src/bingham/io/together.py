"""Several files of one recording, a sensor each, as telephones and body-worn loggers write them."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bingham.errors import RecordingError, RecordingWarning
from bingham.io.assemble import Stream, inertial_recording
from bingham.io.checks import note
from bingham.io.columns import SENSORS
from bingham.io.csv import read_samples
from bingham.io.meaning import WORDS, sensor_of_name
from bingham.io.words import joined
from bingham.recording import ImuRecording

__all__ = ["is_split", "read_together", "together"]

NEAR_ONE = (0.7, 1.4)  # m/s², what an accelerometer in g usually seems to measure
WITHOUT_GRAVITY = 5.0  # m/s², an accelerometer that usually measures less has gravity taken off
SAME_TIME = 1e-3  # s
TEXT = (".csv", ".txt", ".tsv")
# Of a file's name: words that tell the sensor or its rate and so differ between files of one recording.
OF_SENSOR = re.compile(
    rf"(?:^|_)(?:total_?|linear_?|user_?)?(?:{'|'.join(WORDS.values())}|orientation|gravity|quaternion)"
    r"(?:_uncalibrated)?(?=_|$)|_[\d_]+hz(?=_|$)"
)


def is_split(path: Path) -> bool:
    """Whether a folder holds files of one sensor each, of one recording."""
    return path.is_dir() and len(_parts(path)) > 0


def together(paths: Iterable[str | Path]) -> list[tuple[str, list[Path]]]:
    """Gather files of one recording, by what their names have in common but the sensor.

    Returns
    -------
    list of (str, list of Path)
        Name and files of each recording, in the order given; most have one file.
    """
    groups: dict[tuple[Path, str], list[Path]] = {}
    for path in map(Path, paths):
        sensor = sensor_of_name(path) if path.suffix.lower() in TEXT else None
        known = sensor is not None or (path.suffix.lower() in TEXT and _without_sensor(path) != joined(path.stem))
        key = (path.parent, _without_sensor(path)) if known else (path, "")
        groups.setdefault(key, []).append(path)
    recordings: list[tuple[str, list[Path]]] = []
    for (folder, common), files in groups.items():
        sensors = [sensor_of_name(path) for path in files]
        if len(files) > 1 and sensors.count("gyroscope") == 1:
            recordings.append((common or folder.resolve().name, files))
        else:
            recordings += [(path.stem, [path]) for path in files]
    return recordings


def read_together(
    paths: Sequence[Path], *, name: str | None = None, regularise: bool = False, **options: Any
) -> ImuRecording:
    """Read files of one sensor each, or the folder that holds them, as one recording.

    Parameters
    ----------
    paths : sequence of Path
        Files of one recording, one of them of the gyroscope; or one folder.
    name : str, optional
        Name of the recording.
    regularise : bool
        See `read_csv`; so are the other options, which hold for all files that have such columns.

    Raises
    ------
    RecordingError
        If none has a gyroscope, or two have the same sensor.
    """
    files = _parts(paths[0]) if len(paths) == 1 and paths[0].is_dir() else list(paths)
    streams: dict[str, Stream] = {}
    source: dict[str, Any] = {}
    frame = None
    earth_frame = options.pop("earth_frame", None)
    for path in _wanted(files):
        samples = read_samples(path, alone=False, **_fitting(path, options))
        for sensor, stream in samples.streams.items():
            if sensor in streams:
                raise RecordingError(path, "", f"a second file of the {sensor}", f"the first is {source[sensor].path}")
            streams[sensor], source[sensor] = stream, samples
        frame = frame or samples.earth_frame
    if "accelerometer" in streams:
        streams["accelerometer"] = _with_gravity(files, streams["accelerometer"], options)
    if "gyroscope" not in streams:
        there = " ".join(p.name for p in files)
        raise RecordingError(files[0].parent, "", f"no file of a gyroscope among {there}", "give it too")
    base = source["gyroscope"]

    def place(field: str, index: int) -> str:
        where = source.get(field, base)
        said = where.place(field, index)
        return said if where is base else f"{where.path.name}: {said}"

    return inertial_recording(
        base.path,
        place,
        streams,
        base.rows if "reference" in base.rows else {},
        regularise=regularise,
        earth_frame=earth_frame or frame or "ENU",
        name=name or together(files)[0][0],
    )


def _with_gravity(files: Sequence[Path], force: Stream, options: dict[str, Any]) -> Stream:
    """Add gravity, if a file of it was written at the same times, to an accelerometer that has it taken off."""
    gravity = next((path for path in files if re.search("(^|_)gravity(_|$)", joined(path.stem))), None)
    usual = float(np.median(np.linalg.norm(force.values[np.isfinite(force.values[:, 0])], axis=1)))
    if not usual < WITHOUT_GRAVITY:
        return force
    if gravity is None:
        if not NEAR_ONE[0] < usual < NEAR_ONE[1]:  # else it is in g
            said = f"accelerometer usually {usual:.2g} m/s², as with gravity taken off"
            note(files[0].parent, f"{said}: export the total acceleration, or gravity too")
        return force
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordingWarning)
        found = read_samples(gravity, alone=False, **_fitting(gravity, options)).streams.get("accelerometer")
    if found is None or found.time.shape != force.time.shape or np.abs(found.time - force.time).max() > SAME_TIME:
        return force
    note(gravity, "added to the accelerometer, which has gravity taken off")
    return Stream(force.time, force.values + found.values)


def _fitting(path: Path, options: dict[str, Any]) -> dict[str, Any]:
    """Return the options of columns that a file has: those of a sensor are not in the files of the others."""
    from bingham.io.layout import find_layout
    from bingham.io.text import opened_text

    columns = options.get("columns")
    if not isinstance(columns, dict):
        return options
    names = find_layout(opened_text(path)).names
    return {**options, "columns": {name: theirs for name, theirs in columns.items() if theirs in names}}


def _wanted(files: Sequence[Path]) -> list[Path]:
    """Return the files of sensors; what a device made of them is left out."""
    sensors = {path: sensor_of_name(path) for path in files}
    wanted = [path for path in files if sensors[path] in SENSORS]
    totals = [p for p in wanted if sensors[p] == "accelerometer" and re.search(r"total", p.stem, re.IGNORECASE)]
    if totals:  # Sensor Logger's other accelerometer has gravity taken off
        wanted = [p for p in wanted if sensors[p] != "accelerometer" or p in totals]
    calibrated = [p for p in wanted if not re.search("uncalibrated", p.stem, re.IGNORECASE)]
    wanted = [p for p in wanted if p in calibrated or sensors[p] not in {sensors[c] for c in calibrated}]
    left = [p.name for p in files if p not in wanted]
    if left:
        note(files[0].parent, f"left out, of no sensor or gravity taken off: {' '.join(left)}")
    return wanted or list(files)


def _parts(folder: Path) -> list[Path]:
    """Return the files of a folder that are of one recording, empty if it is none."""
    files = sorted(p for p in folder.iterdir() if p.is_file() and p.suffix.lower() in TEXT)[:100]
    recordings = [group for _, group in together(files) if len(group) > 1]
    if len(recordings) == 1:
        return recordings[0]
    lone = [p for p in files if sensor_of_name(p) == "gyroscope"]
    return lone if len(lone) == 1 and len(files) == 1 else []


def _without_sensor(path: Path) -> str:
    return OF_SENSOR.sub("", joined(path.stem)).strip("_")
