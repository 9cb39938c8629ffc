"""Inertial recordings in ROS 1 and ROS 2 bags: ``sensor_msgs/Imu``, and ``sensor_msgs/MagneticField`` if there."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError
from bingham.io.checks import build, note, time_from_nanoseconds
from bingham.io.rosbag_topics import FIELD, IMU, is_absent, read_topics, xyz
from bingham.recording import ImuRecording

__all__ = ["read_rosbag"]


def read_rosbag(
    path: str | Path,
    *,
    imu_topic: str | None = None,
    magnetometer_topic: str | None = None,
    stamps: Literal["header", "bag"] = "header",
    earth_frame: str = "ENU",
) -> ImuRecording:
    """Read the inertial sensor of a bag.

    A magnetometer sample is put at the nearest gyroscope time, at most one median gyroscope interval away; times
    without one get a row of NaN. The orientations that drivers write into Imu messages are not used here, see
    `read_rosbag_orientation`.

    Parameters
    ----------
    path : str or Path
        ROS 1 ``.bag`` file, folder of a ROS 2 bag, or one ``.db3`` or ``.mcap`` file.
    imu_topic, magnetometer_topic : str, optional
        Topics to read; needed only if the bag has several of the type.
    stamps : {"header", "bag"}
        Time when the sensor measured (message header) or when the message was recorded.
    earth_frame : str
        World axes to name in the recording (REP 103: ENU).

    Returns
    -------
    ImuRecording
        Times since the epoch; magnetic field in tesla.

    Warns
    -----
    RecordingWarning
        If magnetometer samples found no gyroscope time of their own.

    Raises
    ------
    RecordingError
        If the bag is damaged, a topic is absent or ambiguous, or times are not strictly increasing.
    MissingExtraError
        If the package rosbags is not installed.
    """
    path = Path(path)
    topics = read_topics(
        path,
        {IMU: (imu_topic, _inertial), FIELD: (magnetometer_topic, lambda message: xyz(message.magnetic_field))},
        stamps,
    )
    imu, magnetic = topics[IMU], topics[FIELD]

    def place(field: str, index: int) -> str:
        return f"topic {imu.name}, message {index + 1}"

    gyroscope, accelerometer = (np.array(values) for values in zip(*imu.values, strict=True))
    time = time_from_nanoseconds(np.array(imu.stamps))
    if np.isnan(gyroscope).all():
        raise RecordingError(path, f"topic {imu.name}", "its driver says it has no gyroscope", "name another topic")
    recording = build(
        ImuRecording,
        path,
        place,
        time=time,
        gyroscope=gyroscope,
        accelerometer=None if np.isnan(accelerometer).all() else accelerometer,
        earth_frame=earth_frame,
    )
    if not magnetic.stamps:
        return recording
    field = np.array(magnetic.values)
    magnetometer, left = _onto(time, time_from_nanoseconds(np.array(magnetic.stamps)), field)
    if left:
        note(f"{path}: topic {magnetic.name}: {left} of {len(field)} samples left out: no gyroscope time of their own")
    fields = {name: getattr(recording, name) for name in ("time", "gyroscope", "accelerometer", "earth_frame")}

    def field_place(field: str, index: int) -> str:
        return f"topic {magnetic.name}, near {time[index]:.6f} s"

    return build(ImuRecording, path, field_place, magnetometer=magnetometer, **fields)


def _inertial(message: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Angular velocity and specific force; NaN if the driver marks one as absent."""
    none = (np.nan,) * 3
    gyroscope = none if is_absent(message.angular_velocity_covariance) else xyz(message.angular_velocity)
    force = none if is_absent(message.linear_acceleration_covariance) else xyz(message.linear_acceleration)
    return gyroscope, force


def _onto(
    time: NDArray[np.float64], stamp: NDArray[np.float64], samples: NDArray[np.float64]
) -> tuple[NDArray[np.float64], int]:
    """Put samples at the nearest of the gyroscope times; return the rows and how many samples found none."""
    rows = np.full((len(time), samples.shape[1]), np.nan)
    reach = np.median(np.diff(time)) if len(time) > 1 else 0.0
    after = np.clip(np.searchsorted(time, stamp), 1, len(time) - 1) if len(time) > 1 else np.zeros(len(stamp), np.intp)
    before = np.maximum(after - 1, 0)
    nearest = np.where(np.abs(time[before] - stamp) <= np.abs(time[after] - stamp), before, after)
    distance = np.abs(time[nearest] - stamp)
    near = distance <= reach
    # The closest sample is written last and so wins a time that several samples are nearest to.
    order = np.argsort(-distance[near], kind="stable")
    rows[nearest[near][order]] = samples[near][order]
    return rows, len(stamp) - len(np.unique(nearest[near]))
