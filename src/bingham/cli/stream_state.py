"""State files of streams: read with suspicion, for whatever is in them is what the filter will believe."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bingham.errors import BinghamError, RecordingError
from bingham.recording import NEVER_SECONDS

if TYPE_CHECKING:
    from bingham.filters.imu_events import ImuStream

__all__ = ["opened"]

# Bytes that no state exceeds.
LARGEST = 1 << 20
# Beyond these rounding is no explanation.
ASYMMETRY, NEGATIVE, OFF_UNIT = 1e-6, 1e-6, 1e-3
# No entry of a state is larger.
LARGEST_NUMBER = 1e15
HINT = "give another --state, or remove the file to start anew"


def opened(path: Path | None) -> ImuStream:
    """Return a stream that goes on from a saved state, or a new one where there is none yet.

    Raises
    ------
    RecordingError
        If the file is no state that makes sense; it is left as it is.
    """
    from bingham.filters.imu_events import ImuStream
    from bingham.filters.imu_state import ImuState

    if path is None:
        return ImuStream()
    try:
        if path.stat().st_size > LARGEST:
            raise RecordingError(path, "", f"larger than {LARGEST} bytes: no state", HINT)
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        _check_place(path)
        return ImuStream()
    except OSError as error:
        raise RecordingError(path, "", f"cannot be read: {error.strerror}", "give another --state") from None
    except UnicodeDecodeError:
        raise RecordingError(path, "", _NO_STATE, HINT) from None
    try:
        state = ImuState.from_json(text)
        problem = _problem(state)
        if not problem:
            return ImuStream(state=state)
    except (BinghamError, ValueError, TypeError, KeyError, ArithmeticError, RecursionError, MemoryError):
        problem = _NO_STATE
    raise RecordingError(path, "", problem, HINT)


_NO_STATE = "not a state that this version saved, or damaged"


def _check_place(path: Path) -> None:
    """Raise an error now, not after the first second of samples, if no state can be written there."""
    from bingham.atomic import replaced

    class Enough(Exception):
        pass

    try:
        with replaced(path):
            raise Enough
    except Enough:
        pass


def _problem(state: Any) -> str:
    """Return what is wrong with a state, or an empty text."""
    for name in state.values.dtype.names:
        values = np.asarray(state.record[name], dtype=np.float64)
        if np.abs(values[~np.isnan(values)]).max(initial=0.0) > LARGEST_NUMBER:
            return f"{name} holds numbers that no state has"
    newest = state.newest[~np.isnan(state.newest)]
    if np.abs(newest).max(initial=0.0) >= NEVER_SECONDS:
        return "its last sample is not in seconds"
    if not state.started:
        return ""
    c = np.asarray(state.covariance)
    scale = np.sqrt(np.abs(np.diagonal(c)))
    if (np.diagonal(c) <= 0.0).any():
        return "its variances are not positive"
    relative = c / np.outer(scale, scale)
    if np.abs(relative - relative.T).max() > ASYMMETRY or np.linalg.eigvalsh(relative).min() < -NEGATIVE:
        return "its covariance is not positive definite"
    from bingham.filters.imu_events import ImuStream

    if not abs(float(np.linalg.norm(ImuStream(state=state).orientation)) - 1.0) < OFF_UNIT:
        return "its orientation is no unit quaternion"
    return ""
