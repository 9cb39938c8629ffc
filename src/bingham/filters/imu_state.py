"""The inertial filter's state: all it knows, to be saved and continued from."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from bingham.errors import InvalidArgumentError
from bingham.kernels import imu_state as at

__all__ = ["ImuState"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ImuState:
    """Everything the filter knows; continuing from it gives the identical track of an unbroken run.

    Attributes
    ----------
    values : (94,) ndarray
        State vector, see `kernels.imu_state`.
    covariance : (12, 12) ndarray
        Covariance of the errors of orientation, velocity, gyroscope bias and accelerometer bias.
    last : (3,) ndarray
        Times of the last gyroscope, accelerometer and magnetometer samples, s; NaN before the first.
    """

    values: FloatArray
    covariance: FloatArray
    last: FloatArray

    @property
    def started(self) -> bool:
        """Whether the first accelerometer sample has come."""
        return bool(self.values[at.ALIGNED] > 0.0)

    def copy(self) -> ImuState:
        """Return an independent copy."""
        return ImuState(self.values.copy(), self.covariance.copy(), self.last.copy())

    def begin(self, seen: ImuState) -> None:
        """Take over what the first accelerometer sample shows (`ImuFilter.start`), in place."""
        for slot in (*range(at.Q, at.Q + 4), at.ALIGNED, at.SWING_POWER):
            self.values[slot] = seen.values[slot]
        self.covariance[:] = seen.covariance

    def to_json(self) -> str:
        """Return the state as text; `from_json` restores it bit for bit."""
        return json.dumps({f.name: getattr(self, f.name).tolist() for f in fields(self)})

    @classmethod
    def from_json(cls, text: str) -> ImuState:
        """Return the state that `to_json` wrote.

        Raises
        ------
        InvalidArgumentError
            If the text is no such state.
        """
        shapes = {"values": (at.STATE_SIZE,), "covariance": (at.ERROR_SIZE, at.ERROR_SIZE), "last": (3,)}
        try:
            content = json.loads(text)
        except (ValueError, TypeError) as error:
            raise InvalidArgumentError("text", "a state written by to_json", f"{error}") from None
        missing = [name for name in shapes if not isinstance(content, dict) or name not in content]
        if missing:
            raise InvalidArgumentError("text", "a state written by to_json", f"JSON without {', '.join(missing)}")
        try:
            arrays = {name: np.array(content[name], dtype=np.float64) for name in shapes}
        except (ValueError, TypeError) as error:
            raise InvalidArgumentError("text", "a state written by to_json", f"{error}") from None
        for name, shape in shapes.items():
            if arrays[name].shape != shape:
                raise InvalidArgumentError(name, f"shape {shape}", arrays[name].shape, "use the version that wrote it")
        return cls(**arrays)
