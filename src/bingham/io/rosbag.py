"""ROS 1 and ROS 2 bags: ``sensor_msgs/Imu`` with ``sensor_msgs/MagneticField`` where there is one.

Message definitions: https://docs.ros.org/en/rolling/p/sensor_msgs (rad/s, m/s², tesla).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io.checks import build, damaged, note, optional_module, time_from_nanoseconds
from bingham.recording import ImuRecording

__all__ = ["read_rosbag"]

IMU, FIELD = "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField"
ABSENT = -1.0  # first entry of a covariance: the driver does not measure this quantity


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
    without one get a row of NaN. The orientations that drivers write into Imu messages are not used.

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
    if stamps not in ("header", "bag"):
        raise InvalidArgumentError("stamps", "'header' or 'bag'", repr(stamps))
    path = Path(path)
    if not path.exists():
        raise RecordingError(path, "", "no such file or folder", "check the path")
    messages, topics = _read(path, {IMU: imu_topic, FIELD: magnetometer_topic}, stamps)
    if not messages[IMU]:
        raise RecordingError(path, f"topic {topics[IMU]}", "has no messages", "name another topic by imu_topic=")

    def place(field: str, index: int) -> str:
        return f"topic {topics[IMU]}, message {index + 1}"

    times, samples = zip(*messages[IMU], strict=True)
    gyroscope, accelerometer = (np.array(values) for values in zip(*samples, strict=True))
    time = time_from_nanoseconds(np.array(times))
    if np.isnan(gyroscope).all():
        raise RecordingError(path, f"topic {topics[IMU]}", "its driver says it has no gyroscope", "name another topic")
    recording = build(
        ImuRecording,
        path,
        place,
        time=time,
        gyroscope=gyroscope,
        accelerometer=None if np.isnan(accelerometer).all() else accelerometer,
        earth_frame=earth_frame,
    )
    if not messages[FIELD]:
        return recording
    stamp, field = (np.array(values) for values in zip(*messages[FIELD], strict=True))
    magnetometer, left = _onto(time, time_from_nanoseconds(stamp), field)
    if left:
        note(f"{path}: topic {topics[FIELD]}: {left} of {len(field)} samples left out: no gyroscope time of their own")
    fields = {name: getattr(recording, name) for name in ("time", "gyroscope", "accelerometer", "earth_frame")}

    def field_place(field: str, index: int) -> str:
        return f"topic {topics[FIELD]}, near {time[index]:.6f} s"

    return build(ImuRecording, path, field_place, magnetometer=magnetometer, **fields)


def _read(
    path: Path, wanted: dict[str, str | None], stamps: str
) -> tuple[dict[str, list[tuple[int, Any]]], dict[str, str]]:
    """Return (stamp in ns, sample) of every message of the chosen topics, and the topics, by type."""
    purpose = "reading ROS bags"
    highlevel = optional_module("rosbags.highlevel", purpose)
    stores = optional_module("rosbags.typesys", purpose)
    messages: dict[str, list[tuple[int, Any]]] = {kind: [] for kind in wanted}
    # Older ROS 2 bags carry no message definitions; these two have not changed since.
    store = stores.get_typestore(stores.Stores.ROS2_HUMBLE)
    try:
        with highlevel.AnyReader([path], default_typestore=store) as bag:
            topics = {kind: _topic(path, bag.connections, kind, asked) for kind, asked in wanted.items()}
            chosen = [c for c in bag.connections if topics.get(c.msgtype) == c.topic]
            for connection, received, data in bag.messages(connections=chosen):
                message = bag.deserialize(data, connection.msgtype)
                header = message.header.stamp
                stamp = received if stamps == "bag" else header.sec * 1_000_000_000 + header.nanosec
                sample = _inertial(message) if connection.msgtype == IMU else _xyz(message.magnetic_field)
                messages[connection.msgtype].append((stamp, sample))
            if (there := sum(map(len, messages.values()))) != (promised := sum(c.msgcount for c in chosen)):
                problem = f"{there} messages, where its index promises {promised}"
                raise RecordingError(path, "", problem, "the bag looks cut off: copy it again")
    except RecordingError:
        raise
    except Exception as error:  # damaged bags make the parser raise whatever it stumbles over
        raise damaged(path, "bag", error, "repair it (rosbag reindex) or copy it again") from error
    return messages, topics


def _topic(path: Path, connections: list[Any], kind: str, asked: str | None) -> str:
    """Choose the topic of a message type: the one asked for, or the only one."""
    there = sorted({c.topic for c in connections if c.msgtype == kind})
    option = "imu_topic" if kind == IMU else "magnetometer_topic"
    if asked is not None:
        if asked not in there:
            known = f"topics of this type: {' '.join(there) or 'none'}"
            raise RecordingError(path, f"topic {asked}", f"no {kind} messages", known)
        return asked
    if len(there) > 1:
        raise RecordingError(path, "", f"several topics of {kind}: {' '.join(there)}", f"choose one by {option}=")
    if not there and kind == IMU:
        every = " ".join(sorted({f"{c.topic} ({c.msgtype})" for c in connections})) or "none"
        raise RecordingError(path, "", f"no topic of {IMU}", f"topics in the bag: {every}")
    return there[0] if there else ""


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def _inertial(message: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Angular velocity and specific force; NaN if the driver marks one as absent."""
    none = (np.nan,) * 3
    gyroscope = none if message.angular_velocity_covariance[0] == ABSENT else _xyz(message.angular_velocity)
    force = none if message.linear_acceleration_covariance[0] == ABSENT else _xyz(message.linear_acceleration)
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
