"""``bingham track -``: sensor samples on standard input, orientations on standard output as they come."""

from __future__ import annotations

import math
import sys
import time as clock
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TextIO

import numpy as np

from bingham.cli.stream_input import Stop, blocks, lines_of
from bingham.errors import BinghamError, InvalidArgumentError
from bingham.filters.imu_track import UNIFORM_INCLINATION, UNIFORM_VARIANCE
from bingham.recording import NEVER_SECONDS

if TYPE_CHECKING:
    from bingham.filters.imu_events import ImuStream

__all__ = ["Follower", "follow", "track_stream"]

GYROSCOPE, ACCELEROMETER, MAGNETOMETER = "gyroscope", "accelerometer", "magnetometer"
SENSORS = {
    "gyr": GYROSCOPE, GYROSCOPE: GYROSCOPE, "acc": ACCELEROMETER, ACCELEROMETER: ACCELEROMETER,
    "mag": MAGNETOMETER, MAGNETOMETER: MAGNETOMETER,
}  # fmt: skip

NUMBERS = {GYROSCOPE: 0, ACCELEROMETER: 1, MAGNETOMETER: 2}

# Seconds after which the state is saved anew: what a killed process may lose.
SAVE_EVERY_S = 1.0
# A clock that jumps by more than this is believed only when it is confirmed, s.
JUMP_S = 10.0
# So many lines of one sensor in a row, in order but far behind the last one used, say that the clock was set back.
SET_BACK_LINES = 10
# No sensor reads more, rad/s, m/s², or any unit of a field.
LARGEST = {GYROSCOPE: 1e4, ACCELEROMETER: 1e6, MAGNETOMETER: 1e9}
FORM = "gyr|acc|mag TIME X Y Z"


def track_stream(state: Path | None) -> None:
    """Answer standard input line by line until it ends; go on from `state` and keep it up to date."""
    from bingham.cli.stream_state import opened

    follower = Follower(opened(state), state, sys.stderr)
    with Stop() as stop:
        follow(follower, lines_of(blocks(stop)), sys.stdout.buffer, stop)
    used = f"{follower.used} {'sample' if follower.used == 1 else 'samples'} used"
    skipped = f"{follower.skipped} {'line' if follower.skipped == 1 else 'lines'} skipped"
    follower.say(f"{used}, {skipped}")


def follow(follower: Follower, batches: Iterable[list[bytes]], out: BinaryIO, stop: Stop | None = None) -> None:
    """Answer batches of lines ``SENSOR TIME X Y Z``, each batch as soon as it is there.

    SENSOR is gyr (rad/s), acc (m/s²) or mag (any unit); fields are parted by blanks or commas; empty lines and lines
    that begin with ``#`` are passed over in silence. Each sample used is answered by a line of JSON. The state is saved
    when its answers are out, at the end too, whatever ends it.
    """
    saved = -math.inf
    try:
        for lines in batches:
            answers: list[str] = []
            for line in lines:
                answer = follower.take(line)
                if answer:
                    answers.append(answer)
                if stop is not None and stop.wanted:  # between samples: none is half applied
                    break
            answers += follower.flush()
            if answers:
                _write(out, "".join(answers).encode("ascii"))
            if answers and clock.monotonic() - saved >= SAVE_EVERY_S:
                follower.save()
                saved = clock.monotonic()
            if stop is not None and stop.wanted:
                return
    finally:
        follower.save()


def _write(out: BinaryIO, answers: bytes) -> None:
    """Write all of it: a buffered file drops the rest of a long write that a signal interrupts."""
    raw: Any = getattr(out, "raw", out)
    left = memoryview(answers)
    while left:
        left = left[raw.write(left) :]


class Follower:
    """Feeds lines to a stream and answers them.

    Parameters
    ----------
    stream : ImuStream
        What the samples are given to.
    state : Path or None
        File that `save` keeps up to date.
    stderr : file
        Where skipped lines are reported.

    Attributes
    ----------
    used, skipped : int
        Lines whose sample was used, and lines that were not.
    """

    def __init__(self, stream: ImuStream, state: Path | None, stderr: TextIO) -> None:
        self._stream = stream
        self._state = state
        self._stderr = stderr
        self._line = 0
        self._newest = max((t for t in stream.state.newest.tolist() if t == t), default=math.nan)
        self._ahead: dict[str, float] = {}
        self._behind: dict[str, tuple[int, float]] = {}
        self._queue: list[tuple[float, ...]] = []
        self._ready: list[str] = []
        self.used = self.skipped = 0

    def take(self, line: bytes) -> str:
        """Return the answer to a line, an empty text if there is none or if `flush` gives it.

        Before the first estimate samples are given to the stream one by one, afterwards all of a batch at once.
        """
        self._line += 1
        text = line.strip()
        if not text or text.startswith(b"#"):
            return ""
        try:
            time = self._feed(text)
        except BinghamError as error:
            self.skipped += 1
            self.say(f"line {self._line} skipped: {error}")
            return ""
        self.used += 1
        return self._answer(time) if not self._queue else ""

    def flush(self) -> list[str]:
        """Return the answers to the lines since the last call that `take` has not given."""
        ready, self._ready = self._ready, []
        if not self._queue:
            return ready
        from bingham.kernels.imu_live import follow

        rows = np.array(self._queue)
        self._queue.clear()
        out = np.empty((len(rows), 7))
        stream = self._stream
        sensors = rows[:, 0].astype(np.int64)
        follow(stream._state.values, stream._parameters, stream._work, sensors, np.ascontiguousarray(rows[:, 1:]), out)
        return ready + [
            _line(time, q, tilt, north, resting > 0)
            for time, (*q, tilt, north, resting) in zip(rows[:, 1].tolist(), out.tolist(), strict=True)
        ]

    def save(self) -> None:
        """Write the state, if it is kept."""
        if self._state is not None:
            from bingham.atomic import replaced

            with replaced(self._state) as path:
                path.write_text(self._stream.state.to_json(), encoding="utf-8")

    def say(self, text: str) -> None:
        """Report on standard error, if that takes it: it is no reason to end."""
        from bingham.cli.terminal import clean

        try:
            self._stderr.write(f"bingham: {clean(text)}\n")
            self._stderr.flush()
        except (OSError, ValueError):
            pass

    def _feed(self, text: bytes) -> float:
        """Give one line to the stream and return its time."""
        name, *numbers = text.replace(b",", b" ").split() or [b""]
        sensor = SENSORS.get(name.decode("ascii", "replace").lower())
        if sensor is None or len(numbers) != 4:
            raise _wrong(text, FORM)
        if b"_" in text or not text.isascii():  # Python takes 1_000 and foreign digits for numbers
            raise _wrong(text, "four numbers after the sensor, in ASCII")
        try:
            time, x, y, z = map(float, numbers)
        except ValueError:
            raise _wrong(text, "four numbers after the sensor") from None
        if not abs(time) < NEVER_SECONDS:
            raise _wrong(text, "TIME in seconds", "is it in nano- or milliseconds?")
        largest = LARGEST[sensor]
        if not (abs(x) <= largest and abs(y) <= largest and abs(z) <= largest):
            raise _wrong(text, f"finite numbers of a {sensor}, at most {largest:g}")
        if time > self._newest + JUMP_S:
            self._jump_ahead(sensor, time)
        elif time < self._newest - JUMP_S:
            self._far_behind(sensor, time)
        elif self._ahead or self._behind:
            self._ahead.pop(sensor, None)
            self._behind.pop(sensor, None)
        if self._queue or self._stream.started:
            self._stream._step(NUMBERS[sensor], time)
            self._queue.append((NUMBERS[sensor], time, x, y, z))
        else:
            getattr(self._stream, sensor)(time, (x, y, z))
        if not time <= self._newest:
            self._newest = time
        return time

    def _jump_ahead(self, sensor: str, time: float) -> None:
        """Raise an error unless the sensor's line before has shown the same jump: one alone is a glitch."""
        held = self._ahead.get(sensor, math.inf)
        self._ahead[sensor] = time
        if not 0.0 < time - held < JUMP_S:
            hint = "taken as a gap if the sensor's next line agrees"
            raise InvalidArgumentError("TIME", f"at most {JUMP_S:g} s after {self._newest!r}", time, hint)
        self._ahead.clear()

    def _far_behind(self, sensor: str, time: float) -> None:
        """Raise an error, unless many lines in order say that the clock was set back: then follow it."""
        from bingham.filters.imu_events import ImuStream

        count, before = self._behind.get(sensor, (0, -math.inf))
        count = count + 1 if time > before else 1
        self._behind[sensor] = (count, time)
        if count < SET_BACK_LINES:
            hint = f"a clock that was set back is followed after {SET_BACK_LINES} lines of the sensor in order"
            raise InvalidArgumentError("TIME", f"at most {JUMP_S:g} s before {self._newest!r}", time, hint)
        self.say(f"line {self._line}: the clock was set back by {self._newest - time:.6g} s; followed from here")
        self._ready = self.flush()
        state = self._stream.state
        self._stream = ImuStream(state=state.without_times())
        self._newest = time
        self._ahead.clear()
        self._behind.clear()

    def _answer(self, time: float) -> str:
        stream = self._stream
        if not stream.started:
            return _line(time, None, 0.0, 0.0, stream.at_rest)
        q, c = stream._reported()
        return _line(time, q.tolist(), c[0, 0] + c[1, 1], c[2, 2], stream.at_rest)


def _line(time: float, q: list[float] | None, tilt: float, north: float, rest: bool) -> str:
    """Return a line of JSON; numbers are written as Python does, which JSON reads."""
    orientation = inclination = heading = "null"
    if q is not None and math.isfinite(q[0] + q[1] + q[2] + q[3] + tilt + north):
        orientation = str(q)
        inclination = repr(math.degrees(math.sqrt(min(tilt, UNIFORM_INCLINATION))))
        heading = repr(math.degrees(math.sqrt(min(north, UNIFORM_VARIANCE))))
    return (
        f'{{"time": {time!r}, "orientation": {orientation}, "inclination_std_deg": {inclination}, '
        f'"heading_std_deg": {heading}, "rest": {"true" if rest else "false"}}}\n'
    )


def _wrong(text: bytes, expected: str, hint: str = "") -> InvalidArgumentError:
    return InvalidArgumentError("", expected, repr(text[:60].decode("utf-8", "backslashreplace")), hint)
