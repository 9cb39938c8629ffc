"""What every reader shares: turning a broken contract into an error that names file, place and hint."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from bingham.errors import (
    InvalidArgumentError,
    MissingExtraError,
    RecordingError,
    RecordingWarning,
    RepairWarning,
    Setting,
)
from bingham.recording import (
    LONG_GYROSCOPE_STEP,
    NEVER_SECONDS,
    Doubt,
    ImuRecording,
    OrientationRecording,
    RowError,
    as_seconds,
    doubts,
)
from bingham.rotations import align_signs

__all__ = [
    "Place",
    "RecordingWarning",
    "build",
    "build_of_units",
    "check_seconds",
    "existing",
    "jitter",
    "narrowest",
    "normalised",
    "note",
    "optional_module",
    "repaired",
    "time_from_nanoseconds",
]

# Where a file keeps row `index` of a recording's field: (field, index) -> "line 12, columns gx gy gz".
Place = Callable[[str, int], str]

R = TypeVar("R", ImuRecording, OrientationRecording)

# Rows from which is told what is usual in a file: so that pieces of it and the whole are treated alike.
HEAD = 100_000
# Text files round quaternions to as few as four decimals; a wrong column order is much further off.
QUATERNION_TOLERANCE = 2e-3  # four numbers cut off after three decimals
# Deviations up to this are float32 rounding and not worth a warning; up to the next, float64 rounding.
SINGLE_ROUNDING = 1e-6
DOUBLE_ROUNDING = 1e-12
# Nor are deviations up to this share of the scatter: they add its square, a hundredth, to the variance.
HARMLESS = 0.1


def note(of: str | Path, *said: str | Setting) -> None:
    """Warn the user about a recording."""
    warnings.warn(RecordingWarning(str(of), *said), stacklevel=3)


def repaired(of: str | Path, *said: str | Setting) -> None:
    """Warn the user that something in a recording was put right; an error where the caller wants none of that."""
    warnings.warn(RepairWarning(str(of), *said), stacklevel=3)


def existing(path: str | Path, *, folder: bool = False) -> Path:
    """Return `path` if it is a file (or a folder) that holds something.

    Raises
    ------
    RecordingError
        If it does not exist, is of the other kind or is empty.
    """
    path = Path(path)
    try:
        path.stat()
        there = True
    except (FileNotFoundError, NotADirectoryError):
        there = False
    except PermissionError as error:
        hint = "check path and permissions"
        raise RecordingError(path, "", f"cannot be read: {error.strerror}", hint) from None
    except (OSError, ValueError) as error:  # a name too long, a zero byte in it, a loop of links
        raise RecordingError(path, "", f"no such file or folder ({error})"[:120], "check the path") from None
    if not there:
        raise RecordingError(path, "", "no such file or folder", "check the path")
    if folder != path.is_dir():
        got, wanted = ("a file", "a folder") if folder else ("a folder", "a file")
        raise RecordingError(path, "", f"{got}, where {wanted} is expected", f"give the path of {wanted}")
    if not folder and path.stat().st_size == 0:
        raise RecordingError(path, "", "the file is empty", "record or copy it again")
    return path


def build(kind: type[R], path: Path, place: Place, **fields: Any) -> R:
    """Make a recording named after its file; what the recording type rejects becomes a `RecordingError`."""
    return build_of_units(kind, path, place, fields, units=False)


def build_of_units(kind: type[R], path: Path, place: Place, fields: Mapping[str, Any], *, units: bool = True) -> R:
    """Do the same for a reader with an argument `units`, by which a doubtful unit can be named."""
    arguments: dict[str, Any] = {"name": path.stem, **fields}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RecordingWarning)  # said below, of the file
            recording = kind(**arguments)
    except RowError as error:
        hint = _state(error.doubt) if units and error.doubt else error.hint
        raise RecordingError(path, place(error.argument, error.index), error.problem, hint) from None
    except InvalidArgumentError as error:
        raise RecordingError(path, "", str(error), "check that the file is complete") from None
    if isinstance(recording, ImuRecording):
        for doubt in doubts(recording):
            said = _state(doubt) if units and doubt.units else [f"{doubt.question} {doubt.hint}"]
            note(path, f"{doubt.quantity}: ", *said)
    return recording


def check_seconds(path: Path, place: Place, time: NDArray[np.float64], *, inertial: bool) -> None:
    """Raise an error that names the unit if times whose unit nobody told cannot be seconds."""
    try:
        as_seconds(time, longest_step=LONG_GYROSCOPE_STEP if inertial else None)
    except RowError as error:
        hint = _state(error.doubt) if error.doubt else error.hint
        refuted = np.abs(time) >= NEVER_SECONDS
        index = int(np.argmax(refuted)) if refuted.any() else error.index
        raise RecordingError(path, place("time", index), error.problem, hint) from None


def _state(doubt: Doubt) -> list[str | Setting]:
    first, *others = (Setting("units", {doubt.quantity: unit}) for unit in doubt.units)
    return [f"{doubt.question} State the unit: ", first, *(part for other in others for part in (", or ", other))]


def damaged(path: Path, kind: str, error: Exception, hint: str = "copy or download it again") -> RecordingError:
    """Say in one line what somebody else's parser stumbled over."""
    reason = next(iter(str(error).splitlines()), "")[:120] or type(error).__name__
    return RecordingError(path, "", f"not a readable {kind} ({reason})", hint)


def jitter(rows: NDArray[np.float64]) -> float:
    """Return the scatter of unit vectors (n, d) in time, signs aside, rad: the median second difference over √6.

    Independent errors of variance σ² have second differences of variance 6σ², a steady motion has none.
    """
    if len(rows) < 3:
        return 0.0
    return float(np.median(np.linalg.norm(np.diff(align_signs(rows), 2, axis=0), axis=1)) / np.sqrt(6.0))


def narrowest(rows: NDArray[np.float64]) -> float:
    """Return the scatter of unit vectors (n, d) along the axis where they have least, rad: √ of the least moment."""
    return float(np.sqrt(max(np.linalg.eigvalsh(rows.T @ rows / max(len(rows), 1))[0], 0.0)))


def normalised(
    path: Path,
    name: str,
    rows: NDArray[np.float64],
    place: Place,
    *,
    rounding: float = SINGLE_ROUNDING,
    scatter: Callable[[NDArray[np.float64]], float] = jitter,
) -> NDArray[np.float64]:
    """Return rows q/‖q‖ if |‖q‖ − 1| ≤ 2e-3; rows of NaN stay, rows exact to 1e-12 are left as they are.

    Warns
    -----
    RecordingWarning
        If a deviation is beyond what the format's `rounding` explains and a tenth of the rows' `scatter` (unless told
        `jitter`), naming the largest.

    Raises
    ------
    RecordingError
        If a deviation exceeds 2e-3.
    """
    with np.errstate(over="ignore"):
        norm = np.linalg.norm(rows, axis=1)
    deviation = np.nan_to_num(np.abs(norm - 1), nan=0.0)
    if not deviation.size or deviation.max() <= DOUBLE_ROUNDING:
        return rows
    worst = int(np.argmax(deviation))
    largest = deviation[worst]
    if largest > QUATERNION_TOLERANCE:
        raise RecordingError(
            path,
            place(name, worst),
            f"norm {norm[worst]:.6g}",
            f"unit norm within {QUATERNION_TOLERANCE:g} is expected: divide each row by its norm if lengths mean "
            "nothing, otherwise check the columns and their order",
        )
    rows = rows / norm[:, None]
    if largest > rounding:
        spread = scatter(rows[np.isfinite(norm)])
        if largest > HARMLESS * spread:
            far = f"rows normalised; largest deviation from unit norm {largest:.2g} at {place(name, worst)}"
            note(path, f"{far}, where rows scatter by {spread:.2g} rad: rounding matters, export more decimals")
    return rows


def time_from_nanoseconds(stamps: NDArray[np.int64]) -> NDArray[np.float64]:
    """Seconds from integer nanoseconds, rounded once (2.4e-7 s for stamps since 1970)."""
    whole, rest = np.divmod(stamps, 1_000_000_000)
    return whole + rest * 1e-9


def optional_module(name: str, purpose: str) -> Any:
    """Import a module of the extra ``io``; if it is absent say how to install it."""
    try:
        return import_module(name)
    except ImportError:
        raise MissingExtraError(name.partition(".")[0], "io", purpose) from None
