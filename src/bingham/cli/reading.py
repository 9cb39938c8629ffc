"""Reading a recording as the command line was told to: the options of every command that reads, in one place."""

from __future__ import annotations

import functools
import inspect
import warnings
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_type_hints

import typer

from bingham.errors import InvalidArgumentError

if TYPE_CHECKING:
    from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["OPTIONS", "gathered", "name_of", "options", "read", "read_pieces", "takes_reading"]

TOPICS = ("imu", "gyroscope", "accelerometer", "magnetometer", "pose")
# Argument of a reader → option of the command line that sets it.
OPTIONS = {
    "format": "--format",
    "columns": "--column",
    "units": "--unit",
    **{f"{kind}_topic": f"--topic {kind}=TOPIC" for kind in TOPICS},
    "rate": "--rate",
    "angles": "--as",
    "regularise": "--regularise",
    "strict": "--strict",
    "max_size": "--max-size",
}

# What `takes_reading` adds to a command, in the order of its help.
PARAMETERS: dict[str, tuple[Any, Any]] = {
    "format": (
        str | None,
        typer.Option(None, help="Format, as bingham formats lists them, not recognised."),
    ),
    "column": (list[str], typer.Option([], metavar="NAME=COLUMN", help="Text: what the file calls a column.")),
    "columns": (
        str | None,
        typer.Option(None, metavar="A,B,...", help="Text without names: those of all its columns, - to leave one out."),
    ),
    "unit": (
        list[str],
        typer.Option([], metavar="QUANTITY=UNIT", help="Text: a unit, or a step as time=100us, accelerometer=1/4096g."),
    ),
    "rate": (float | None, typer.Option(None, metavar="HZ", help="Sampling rate of a file without times.")),
    "as_angles": (
        str | None,
        typer.Option(None, "--as", metavar="KIND", help="Text: orientations are angles, as roll-pitch-yaw, euler-ZXZ."),
    ),
    "regularise": (
        bool,
        typer.Option(False, "--regularise", help="Put time stamps on straight lines: for stamps of arrival."),
    ),
    "strict": (bool, typer.Option(False, "--strict", help="Make an error of everything that would be put right.")),
    "max_size": (
        float | None,
        typer.Option(None, metavar="BYTES", help="Memory a file may unfold to, where that is more than usual."),
    ),
    "topic": (
        list[str],
        typer.Option(
            [],
            metavar="KIND=TOPIC",
            help=f"Bags: which topic to read, {'=, '.join(TOPICS)}=; orientation=: which one --bag adds.",
        ),
    ),
}


def takes_reading(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of reading to a command.

    The command has an argument ``reading``; it gets the format and what is passed to `read`:
    ``(format, dict of options)``.
    """
    signature = inspect.signature(command)
    hints = get_type_hints(command)
    own = [parameter for parameter in signature.parameters.values() if parameter.name != "reading"]
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        for name, (kind, default) in PARAMETERS.items()
    ]

    @functools.wraps(command)
    def wrapper(**given: Any) -> Any:
        values = {name: given.pop(name) for name in PARAMETERS}
        format = values.pop("format")
        return command(reading=(format, options(**values)), **given)

    keywords = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints.get(p.name, Any)) for p in own]
    wrapper.__signature__ = inspect.Signature([*keywords, *added])  # type: ignore[attr-defined]
    wrapper.__annotations__ = {p.name: p.annotation for p in [*keywords, *added]}
    del wrapper.__wrapped__  # or typer would look at the command behind it
    return wrapper


def options(
    column: Sequence[str] = (),
    unit: Sequence[str] = (),
    topic: Sequence[str] = (),
    *,
    columns: str | None = None,
    rate: float | None = None,
    as_angles: str | None = None,
    regularise: bool = False,
    strict: bool = False,
    max_size: float | None = None,
) -> dict[str, Any]:
    """Return what the options of the command line say to `read`."""
    topics = {f"{kind}_topic": name for kind, name in _pairs("--topic", topic).items()}
    if wrong := topics.keys() - OPTIONS.keys() - {"orientation_topic"}:
        expected = ", ".join(f"{kind}=TOPIC" for kind in TOPICS)
        raise InvalidArgumentError("--topic", expected, wrong.pop().removesuffix("_topic"))
    named: Any = _pairs("--column", column)
    if columns is not None:
        if named:
            raise InvalidArgumentError("--columns", "one of --columns and --column", "both")
        named = [name.strip() for name in columns.split(",")]
    given = {
        "columns": named,
        "units": _pairs("--unit", unit),
        **topics,
        "rate": rate,
        "angles": as_angles,
        "regularise": regularise,
        "strict": strict,
        "max_size": max_size,
    }
    return {name: value for name, value in given.items() if value}


def read(path: Path, format: str | None, given: Mapping[str, Any]) -> ImuRecording | OrientationRecording:
    """Read a recording, named after its file; a file that cannot be read ends in an error alone, without warnings.

    Parameters
    ----------
    path : Path
        File or folder.
    format : str, optional
        Format, if its recognition is not to be trusted.
    given : mapping
        What `options` returns, and `gathered` adds.

    Raises
    ------
    RecordingError
        If the file is not as its format promises.
    InvalidArgumentError
        If an option has no meaning for the format.
    """
    from bingham.cli.filtering import renamed
    from bingham.io import read_recording

    beside = given.get("beside", {}).get(str(path), [])
    options = {name: value for name, value in given.items() if name != "beside"}
    with _worded():
        recording = read_recording([path, *beside] if beside else path, format=format, **options)
    return renamed(recording, name_of(path))


def read_pieces(path: Path, given: Mapping[str, Any], rows: int) -> Iterator[ImuRecording]:
    """Read a recording from a table of text in pieces of so many rows; see `bingham.io.pieces`."""
    from bingham.io.bounds import bounded
    from bingham.io.detect import readable
    from bingham.io.pieces import pieces_of_csv, rechunked

    options = {name: value for name, value in given.items() if name not in ("beside", "max_size")}
    pieces = rechunked(pieces_of_csv(path, **options), rows)
    while True:
        with _worded(), bounded(given.get("max_size")), readable(path):
            piece = next(pieces, None)
        if piece is None:
            return
        yield piece


@contextmanager
def _worded() -> Generator[None]:
    """Let errors and warnings of the block speak of options."""
    from bingham.cli.wording import in_options, worded

    with warnings.catch_warnings(record=True) as caught, in_options(OPTIONS):
        warnings.simplefilter("always")
        yield
    for warning in caught:
        warnings.warn_explicit(worded(warning.message, OPTIONS), warning.category, warning.filename, warning.lineno)


def gathered(paths: Sequence[Path], given: dict[str, Any]) -> list[Path]:
    """Return one file of each recording; of files of one sensor each that belong together the gyroscope's.

    The others are put into `given`, from which `read` takes them.
    """
    from bingham.io.meaning import sensor_of_name
    from bingham.io.together import together

    first: list[Path] = []
    for _, files in together(paths):
        main = next((path for path in files if sensor_of_name(path) == "gyroscope"), files[0])
        first.append(main)
        if len(files) > 1:
            given.setdefault("beside", {})[str(main)] = [path for path in files if path != main]
    return first


def name_of(path: Path) -> str:
    """Return what a recording and its files are called, whatever name the recording itself holds.

    Of files and folders inside an EuRoC sequence that is the name of the sequence.
    """
    from bingham.io.euroc import sequence_name

    path = path.resolve()
    if (sequence := sequence_name(path)) is not None:
        return sequence
    return path.name if path.is_dir() else path.stem


def _pairs(option: str, values: Sequence[str]) -> dict[str, str]:
    for value in values:
        if not all(value.partition("=")[::2]):
            raise InvalidArgumentError(option, "NAME=VALUE", repr(value))
    return {name: text for name, _, text in (value.partition("=") for value in values)}
