"""Reading a recording as the command line was told to."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bingham.errors import InvalidArgumentError

if TYPE_CHECKING:
    from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["name_of", "options", "read"]

# Argument of a reader → option of the command line that sets it.
OPTIONS = {
    "columns": "--column",
    "units": "--unit",
    "imu_topic": "--topic imu=TOPIC",
    "magnetometer_topic": "--topic magnetometer=TOPIC",
}


def options(column: list[str], unit: list[str], topic: list[str]) -> dict[str, Any]:
    """Return what NAME=VALUE options say to a reader."""
    topics = {f"{kind}_topic": name for kind, name in _pairs("--topic", topic).items()}
    if wrong := topics.keys() - OPTIONS.keys() - {"orientation_topic"}:
        raise InvalidArgumentError("--topic", "imu=TOPIC or magnetometer=TOPIC", wrong.pop().removesuffix("_topic"))
    given = {"columns": _pairs("--column", column), "units": _pairs("--unit", unit), **topics}
    return {name: value for name, value in given.items() if value}


def read(path: Path, format: str | None, given: Mapping[str, Any]) -> ImuRecording | OrientationRecording:
    """Read a recording, named after its file; a file that cannot be read ends in an error alone, without warnings.

    Raises
    ------
    RecordingError
        If the file is not as its format promises.
    InvalidArgumentError
        If an option has no meaning for the format.
    """
    from bingham.cli.wording import in_options, worded
    from bingham.io import detect_format, read_recording
    from bingham.io.detect import READERS
    from bingham.recording import amended

    kind = detect_format(path) if format is None else format
    if kind in READERS:
        known = inspect.signature(READERS[kind]).parameters
        if strange := [name for name in given if name not in known]:
            raise InvalidArgumentError(
                OPTIONS[strange[0]].split()[0], "a format that has such", f"{path}, format {kind}"
            )
    with warnings.catch_warnings(record=True) as caught, in_options(OPTIONS | {"format": "--format"}):
        warnings.simplefilter("always")
        recording = read_recording(path, format=kind, **given)
    for warning in caught:
        warnings.warn_explicit(
            worded(str(warning.message), OPTIONS), warning.category, warning.filename, warning.lineno
        )
    return amended(recording, name=name_of(path))


def name_of(path: Path) -> str:
    """Return what a recording and its files are called, whatever name the recording itself holds.

    Of files and folders inside an EuRoC sequence that is the name of the sequence.
    """
    from bingham.io.euroc import sequence_name

    path = path.resolve()
    if (sequence := sequence_name(path)) is not None:
        return sequence
    return path.name if path.is_dir() else path.stem


def _pairs(option: str, values: list[str]) -> dict[str, str]:
    for value in values:
        if not all(value.partition("=")[::2]):
            raise InvalidArgumentError(option, "NAME=VALUE", repr(value))
    return {name: text for name, _, text in (value.partition("=") for value in values)}
