"""``bingham track -``: sensor samples on standard input, orientations on standard output as they come."""

from __future__ import annotations

import json
import math
import signal
import sys
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, TextIO

from bingham.errors import BinghamError, InvalidArgumentError, RecordingError
from bingham.recording import NEVER_SECONDS

if TYPE_CHECKING:
    from bingham.filters.imu_events import ImuStream

__all__ = ["follow", "track_stream"]

SENSORS = {
    "gyr": "gyroscope", "gyroscope": "gyroscope", "acc": "accelerometer", "accelerometer": "accelerometer",
    "mag": "magnetometer", "magnetometer": "magnetometer",
}  # fmt: skip

# Seconds of the sensor's time after which the state is saved anew: what a killed process may lose.
SAVE_EVERY_S = 1.0


def track_stream(state: Path | None) -> None:
    """Answer standard input line by line until it ends; go on from `state` and keep it up to date."""
    stream = _open(state)
    with _stoppable():
        answered, garbage = follow(stream, sys.stdin, sys.stdout, sys.stderr, state)
    samples, lines = ("sample" if answered == 1 else "samples"), ("line" if garbage == 1 else "lines")
    sys.stderr.write(f"bingham: {answered} {samples} used, {garbage} {lines} skipped\n")


def follow(
    stream: ImuStream, lines: Iterable[str], out: TextIO, complaints: TextIO, state: Path | None
) -> tuple[int, int]:
    """Feed lines ``SENSOR TIME X Y Z`` to a stream; return how many were used and how many skipped.

    SENSOR is gyr (rad/s), acc (m/s²) or mag (any unit); fields are parted by blanks or commas; empty lines and lines
    that begin with ``#`` are passed over in silence. Each sample used is answered by a line of JSON.
    """
    answered = garbage = 0
    saved = -math.inf
    try:
        for number, line in enumerate(lines, 1):
            text = line.strip()
            if not text or text.startswith("#"):
                continue
            try:
                time = _feed(stream, text)
            except BinghamError as error:
                garbage += 1
                complaints.write(f"bingham: line {number} skipped: {error}\n")
                continue
            answered += 1
            out.write(_answer(stream, time) + "\n")
            out.flush()
            if state is not None and not saved <= time < saved + SAVE_EVERY_S:
                _save(stream, state)
                saved = time
    except _Stop:
        pass
    finally:
        if state is not None:
            _save(stream, state)
    return answered, garbage


def _feed(stream: ImuStream, text: str) -> float:
    """Give one line to the stream and return its time."""
    sensor, *numbers = text.replace(",", " ").split()
    if sensor.lower() not in SENSORS or len(numbers) != 4:
        raise InvalidArgumentError("line", "gyr|acc|mag TIME X Y Z", repr(text[:60]))
    try:
        time, *vector = map(float, numbers)
    except ValueError:
        raise InvalidArgumentError("line", "four numbers after the sensor", repr(text[:60])) from None
    if abs(time) >= NEVER_SECONDS:
        raise InvalidArgumentError("line", "TIME in seconds", repr(text[:60]), "is it in nano- or milliseconds?")
    getattr(stream, SENSORS[sensor.lower()])(time, vector)
    return time


def _answer(stream: ImuStream, time: float) -> str:
    q = stream.orientation.tolist() if stream.started else None
    return json.dumps(
        {
            "time": time,
            "orientation": q,
            "inclination_std_deg": math.degrees(stream.inclination_std) if q else None,
            "heading_std_deg": math.degrees(stream.heading_std) if q else None,
            "rest": stream.at_rest,
        }
    )


def _open(state: Path | None) -> ImuStream:
    """Return a stream that goes on from a saved state, or a new one where there is none yet."""
    from bingham.filters.imu_events import ImuStream
    from bingham.filters.imu_state import ImuState

    if state is None or not state.exists():
        return ImuStream()
    try:
        return ImuStream(state=ImuState.from_json(state.read_text(encoding="utf-8")))
    except OSError as error:
        raise RecordingError(state, "", f"cannot be read: {error.strerror}", "give another --state") from None
    except (UnicodeDecodeError, InvalidArgumentError):
        problem = "not a state that this version saved, or damaged"
        raise RecordingError(state, "", problem, "remove the file to start anew") from None


def _save(stream: ImuStream, state: Path) -> None:
    from bingham.atomic import replaced

    with replaced(state) as path:
        path.write_text(stream.state.to_json(), encoding="utf-8")


class _Stop(Exception):
    """The process was asked to end."""


@contextmanager
def _stoppable() -> Generator[None]:
    """Turn SIGTERM and SIGINT into an orderly end, so that the state is saved."""

    def stop(_: int, __: FrameType | None) -> None:
        raise _Stop

    before = {number: signal.signal(number, stop) for number in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
