"""Estimates as ``sensor_msgs/Imu``.

What the numbers of a message mean:

* ``orientation``: x, y, z, w, rotates vectors of the sensor into the world (REP 145), which is east, north, up
  (REP 103).
* ``orientation_covariance``: rad², row by row, of a small rotation about the *fixed* axes x, y, z of the world, as
  REP 103 has it for covariances of rotations; a change of the sensor's frame leaves it alone (imu_transformer does).
  The last entry so is the variance of the heading whatever the tilt. −1 in the first entry: no orientation.
* ``angular_velocity``: as measured, less the filter's bias; a known covariance grows by the bias's.
* ``linear_acceleration``, −1 for "not measured" and zeros for "covariance unknown": as in the input.

Sources: Imu.msg; REP 103, REP 145 (https://ros.org/reps); ros-perception/imu_pipeline#15.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError
from bingham.io.checks import time_from_nanoseconds
from bingham.io.rosbag_topics import ABSENT, is_absent, xyz

__all__ = ["Estimates"]

FloatArray = NDArray[np.float64]


class Estimates(NamedTuple):
    """What was estimated, a row for each time; NaN where it is unknown.

    ``row``: the row of each time, s. ``orientation`` (N, 4): (w, x, y, z), sensor to world. ``covariance`` (N, 3, 3):
    world, rad². ``bias``, ``bias_std`` (N, 3): of the gyroscope, rad/s.
    """

    row: dict[float, int]
    orientation: FloatArray
    covariance: FloatArray
    bias: FloatArray
    bias_std: FloatArray

    @classmethod
    def checked(
        cls,
        time: ArrayLike,
        orientation: ArrayLike,
        covariance: ArrayLike,
        bias: ArrayLike | None,
        bias_std: ArrayLike | None,
    ) -> Estimates:
        """Return the arrays of `write_rosbag`, found to fit together."""
        row = {t: k for k, t in enumerate(np.asarray(time, dtype=np.float64).ravel().tolist())}
        n = len(row)
        nothing = np.full((n, 3), np.nan)
        shapes = {"orientation": (n, 4), "covariance": (n, 3, 3), "bias": (n, 3), "bias_std": (n, 3)}
        given = (orientation, covariance, nothing if bias is None else bias, nothing if bias_std is None else bias_std)
        arrays = [np.asarray(values, dtype=np.float64) for values in given]
        for (name, shape), values in zip(shapes.items(), arrays, strict=True):
            if values.shape != shape:
                raise InvalidArgumentError(name, f"shape {shape}, a row for each time", f"shape {values.shape}")
        there = np.isfinite(arrays[0]).all(axis=1)
        _every(
            "orientation",
            np.isnan(arrays[0]).all(axis=1) | (np.abs(np.linalg.norm(arrays[0], axis=1) - 1.0) <= 1e-6),
            "unit quaternions, or NaN in the whole row",
            arrays[0],
        )
        finite = np.isfinite(arrays[1]).all(axis=(1, 2)) & (np.einsum("nii->ni", arrays[1]) > 0.0).all(axis=1)
        _every("covariance", finite | ~there, "finite, positive variances where there is an orientation", arrays[1])
        return cls(row, *arrays)

    def __contains__(self, stamp: Any) -> bool:
        return _seconds(stamp) in self.row

    def fill(self, message: Any, stamp: int, types: Any) -> Any:
        """Return the Imu message with the estimate of its time in it."""
        k = self.row[_seconds(stamp)]
        quaternion, vector = types["geometry_msgs/msg/Quaternion"], types["geometry_msgs/msg/Vector3"]
        if np.isfinite(self.orientation[k]).all():
            w, x, y, z = self.orientation[k].tolist()
            covariance = self.covariance[k].ravel()
        else:
            w, x, y, z = 1.0, 0.0, 0.0, 0.0
            covariance = np.array([ABSENT, *[0.0] * 8])
        rate, rate_covariance = message.angular_velocity, np.array(message.angular_velocity_covariance, dtype=float)
        if np.isfinite(self.bias[k]).all() and not is_absent(rate_covariance):
            rate = vector(*(np.array(xyz(rate)) - self.bias[k]).tolist())
            if rate_covariance.any() and np.isfinite(self.bias_std[k]).all():
                rate_covariance += np.diag(self.bias_std[k] ** 2).ravel()
        return replace(
            message,
            orientation=quaternion(x=x, y=y, z=z, w=w),
            orientation_covariance=covariance,
            angular_velocity=rate,
            angular_velocity_covariance=rate_covariance,
        )


def _every(name: str, right: NDArray[np.bool_], expected: str, values: FloatArray) -> None:
    if not right.all():
        k = int(np.argmin(right))
        raise InvalidArgumentError(name, expected, f"{values[k].tolist()} at index {k}")


def _seconds(stamp: int) -> float:
    return float(time_from_nanoseconds(np.array([stamp]))[0])
