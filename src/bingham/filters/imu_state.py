"""The inertial filter's state: all it knows, to be saved and continued from."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import InvalidArgumentError
from bingham.kernels.imu_model import STATE

__all__ = ["FAULTS", "TOLD", "ImuState"]

FloatArray = NDArray[np.float64]

FAULTS = (
    "gyroscope samples rejected",
    "accelerometer samples rejected",
    "magnetometer samples rejected",
    "rows of zeros taken for no samples",
    "clipped gyroscope samples",
    "frozen gyroscope samples",
    "repeated gyroscope samples",
    "gaps",
    "restarts after a lost attitude",
    "contradictions between gyroscope and accelerometer",
    "orientations rejected",
)
# What is wrong with samples; the rest is what the filter made of it.
TOLD = FAULTS[:7]


@dataclass(frozen=True, eq=False)
class ImuState:
    """Everything the filter knows; continuing from it gives the identical track of an unbroken run.

    Attributes
    ----------
    values : (1,) ndarray
        Structured array with one record, see ``kernels.imu_model.STATE`` for its fields.
    """

    values: NDArray[Any]

    @classmethod
    def zeros(cls) -> ImuState:
        """Return a state whose fields are all zero."""
        return cls(np.zeros(1, dtype=STATE))

    @property
    def record(self) -> Any:
        """The fields by name, ``state.record["bias"]``; writing to it changes the state."""
        return self.values[0]

    @property
    def last(self) -> FloatArray:
        """Times (4,), s, of the last sample of gyroscope, accelerometer, magnetometer, orientations; NaN before it."""
        return self.record["last"].copy()

    @property
    def newest(self) -> FloatArray:
        """Times as `last` has them, or of samples that wait to be confirmed: later ones must follow these."""
        times, kept = self.last, np.full(2, np.nan)
        kept[self.record["held"] > 0] = self.record["held_time"][self.record["held"] > 0]
        times[:2] = np.fmax(times[:2], kept)
        if self.record["blank"] > 0:
            times[0] = np.fmax(times[0], self.record["blank_time"])
        return times

    @property
    def covariance(self) -> FloatArray:
        """Covariance (11, 11) of the errors of orientation, velocity, gyroscope and accelerometer bias."""
        return self.record["covariance"].copy()

    def without_times(self) -> ImuState:
        """Return a copy that goes on with any clock: what follows is taken as the next sample."""
        state = self.copy()
        state.record["last"] = np.nan
        state.record["blank"] = state.record["held"] = 0  # samples kept back have times, too
        return state

    @property
    def started(self) -> bool:
        """Whether there is an estimate: the first accelerometer sample, or orientation, has come."""
        return bool(self.record["phase"] > 0)

    @property
    def faults(self) -> dict[str, int]:
        """How often each kind of fault was met so far."""
        return dict(zip(FAULTS, self.record["faults"].tolist(), strict=True))

    def copy(self) -> ImuState:
        """Return an independent copy."""
        return ImuState(self.values.copy())

    def begin(self, seen: ImuState) -> None:
        """Take over what the first sample shows (`ImuFilter.start`, `start_seen`), in place."""
        for name in ("orientation", "phase", "swing_power", "speed_power", "covariance", "unknown_heading"):
            self.values[name] = seen.values[name]

    def to_json(self) -> str:
        """Return the state as JSON, a field each, null for NaN; `from_json` restores it bit for bit."""
        return json.dumps({name: _plain(self.record[name].tolist()) for name in STATE.names or ()}, allow_nan=False)

    @classmethod
    def from_json(cls, text: str) -> ImuState:
        """Return the state that `to_json` wrote.

        Raises
        ------
        InvalidArgumentError
            If the text is no such state: a field is missing, of another shape, or holds what the filter never writes.
        """
        try:
            content = json.loads(text)
        except (ValueError, TypeError) as error:
            raise InvalidArgumentError("text", "a state written by to_json", f"{error}") from None
        missing = [name for name in STATE.names or () if not isinstance(content, dict) or name not in content]
        if missing:
            got = f"JSON without {', '.join(missing[:3])}" + ", …" * (len(missing) > 3)
            raise InvalidArgumentError("text", "a state written by to_json", got)
        state = cls.zeros()
        for name in STATE.names or ():
            kind, shape = STATE[name].base, STATE[name].shape
            try:
                value = np.array(content[name], dtype=np.float64).astype(kind)
            except (ValueError, TypeError, OverflowError) as error:
                raise InvalidArgumentError(name, "numbers written by to_json", f"{error}") from None
            if value.shape != shape:
                raise InvalidArgumentError(name, f"shape {shape}", value.shape, "use the version that wrote it")
            if not np.isfinite(value).all() and name not in ("last", "statistic"):
                raise InvalidArgumentError(name, "finite numbers", "NaN or infinity", "the state is damaged")
            state.values[name] = value
        q, p = state.record["orientation"], state.record["covariance"]
        if state.record["phase"] != 0 and abs(float(q @ q) - 1.0) > 1e-6:
            raise InvalidArgumentError("orientation", "a unit quaternion", q.tolist(), "the state is damaged")
        if np.any(np.diagonal(p) < 0.0):
            raise InvalidArgumentError("covariance", "variances ≥ 0", "a negative one", "the state is damaged")
        return state


def _plain(value: Any) -> Any:
    """Replace what JSON has no number for by null."""
    if isinstance(value, list):
        return [_plain(v) for v in value]
    return value if not isinstance(value, float) or np.isfinite(value) else None
