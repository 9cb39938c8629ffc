"""Orientations that a driver or a filter wrote into the ``sensor_msgs/Imu`` messages of a bag."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError
from bingham.io.checks import normalised, time_from_nanoseconds
from bingham.io.rosbag_topics import IMU, is_absent, read_topics

__all__ = ["RosbagOrientation", "read_rosbag_orientation"]


class RosbagOrientation(NamedTuple):
    """Orientations of an Imu topic with what it says about their error.

    ``topic``: where they come from. ``time`` (N,): seconds since the epoch. ``orientation`` (N, 4): (w, x, y, z),
    sensor to world; NaN where absent. ``covariance`` (N, 3, 3): rad², of a small rotation about the fixed axes of the
    world; NaN where unknown or absent.
    """

    topic: str
    time: NDArray[np.float64]
    orientation: NDArray[np.float64]
    covariance: NDArray[np.float64]


def read_rosbag_orientation(
    path: str | Path, *, imu_topic: str | None = None, stamps: Literal["header", "bag"] = "header"
) -> RosbagOrientation:
    """Read the orientations of an Imu topic, its covariances as Imu.msg means them.

    A first entry of −1 (or NaN, REP 145) says that there is no orientation, nothing but zeros that its covariance is
    unknown. A quaternion of zeros is no orientation either. Where both are there, and the covariance is not as wide as
    that of an unknown heading, ``Bingham.from_covariance(orientation, covariance, frame="world")`` is the distribution.

    Parameters
    ----------
    path : str or Path
        ROS 1 ``.bag`` file, folder of a ROS 2 bag, or one ``.db3`` or ``.mcap`` file.
    imu_topic : str, optional
        Topic to read; needed only if the bag has several of ``sensor_msgs/Imu``.
    stamps : {"header", "bag"}
        Time when the sensor measured (message header) or when the message was recorded.

    Raises
    ------
    RecordingError
        If the bag is damaged, the topic is absent or ambiguous, or a quaternion's norm is off by more than 1e-3.
    MissingExtraError
        If the package rosbags is not installed.
    """
    path = Path(path)
    topic = read_topics(path, {IMU: (imu_topic, _orientation)}, stamps)[IMU]

    def place(_: str, index: int) -> str:
        return f"topic {topic.name}, message {index + 1}, orientation"

    quaternions, covariances = (np.array(values) for values in zip(*topic.values, strict=True))
    if (broken := np.isinf(quaternions).any(axis=1)).any():
        raise RecordingError(path, place("", int(np.argmax(broken))), "not finite", "finite numbers are expected")
    return RosbagOrientation(
        topic.name,
        time_from_nanoseconds(np.array(topic.stamps)),
        normalised(path, "orientation", quaternions, place),
        covariances.reshape(-1, 3, 3),
    )


def _orientation(message: Any) -> tuple[tuple[float, ...], NDArray[np.float64]]:
    """Return quaternion (w, x, y, z) and covariance (9,), NaN for what the message leaves open."""
    q = message.orientation
    covariance = np.asarray(message.orientation_covariance, dtype=np.float64)
    nothing = np.full(9, np.nan)
    if is_absent(covariance) or q.w == q.x == q.y == q.z == 0.0:
        return (np.nan,) * 4, nothing
    return (q.w, q.x, q.y, q.z), covariance if covariance.any() else nothing
