"""Recordings in ROS 1 and ROS 2 bags: ``sensor_msgs/Imu`` and ``MagneticField``, or orientations of poses."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError, Setting
from bingham.io.assemble import Stream, inertial_recording
from bingham.io.checks import existing, note, time_from_nanoseconds
from bingham.io.registry import Format
from bingham.io.rosbag_poses import pose_topics, read_poses
from bingham.io.rosbag_topics import FIELD, IMU, OTHER_TOPIC, Topic, collect, is_absent, opened, topic_named, xyz
from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["read_rosbag"]

FloatArray = NDArray[np.float64]
VECTOR = "geometry_msgs/msg/Vector3Stamped"


def read_rosbag(
    path: str | Path,
    *,
    imu_topic: str | None = None,
    gyroscope_topic: str | None = None,
    accelerometer_topic: str | None = None,
    magnetometer_topic: str | None = None,
    pose_topic: str | None = None,
    stamps: Literal["header", "bag"] = "header",
    regularise: bool = False,
    earth_frame: str = "ENU",
) -> ImuRecording | OrientationRecording:
    """Read the inertial sensor of a bag, or the orientations of a bag without one.

    Samples of a sensor with a topic of its own are carried to the nearest gyroscope time, at most one usual interval
    away; times without one get a row of NaN. The orientations that drivers write into Imu messages are not used here,
    see `read_rosbag_orientation`.

    Parameters
    ----------
    path : str or Path
        ROS 1 ``.bag`` file, folder of a ROS 2 bag, or one ``.db3`` or ``.mcap`` file.
    imu_topic, magnetometer_topic : str, optional
        Topics to read; needed only if the bag has several of the type.
    gyroscope_topic, accelerometer_topic : str, optional
        Two topics of ``sensor_msgs/Imu`` that hold one sensor each; found by their names or contents where these tell.
    pose_topic : str, optional
        Topic of poses (PoseStamped, PoseWithCovarianceStamped, Odometry, TransformStamped) or ``/tf:parent.child``;
        without an Imu topic the only one there is.
    stamps : {"header", "bag"}
        Time when the sensor measured (message header) or when the message was recorded.
    regularise : bool
        Put times on a straight line between pauses: for samples taken regularly and stamped on arrival.
    earth_frame : str
        World axes to name in the recording (REP 103: ENU).

    Returns
    -------
    ImuRecording or OrientationRecording
        Times since the epoch; magnetic field in tesla; covariances of poses where they are known.

    Warns
    -----
    RepairWarning
        If messages of zeros were left out, or time stamps put right.
    RecordingWarning
        If samples found no gyroscope time of their own.

    Raises
    ------
    RecordingError
        If the bag is damaged, or a topic is absent or ambiguous.
    MissingExtraError
        If the package rosbags is not installed.
    """
    path = Path(path)
    existing(path, folder=path.is_dir())
    asked = (imu_topic, gyroscope_topic, accelerometer_topic, magnetometer_topic)
    with opened(path) as bag:
        imus = {c.topic for c in bag.connections if c.msgtype == IMU}
        if pose_topic is not None or (not imus and pose_topics(bag) and not any(asked)):
            return read_poses(path, bag, pose_topic, stamps, regularise=regularise)
        rate, force = _imu_topics(path, bag, imu_topic, gyroscope_topic, accelerometer_topic)
        field, taken = _field_topic(path, bag, magnetometer_topic)
        takes: dict[str, Any] = {name: _inertial for name in (rate, force) if name}
        takes |= {field: taken} if field else {}
        topics = collect(path, bag, takes, stamps)
    return _recording(path, topics, rate, force, field, regularise=regularise, earth_frame=earth_frame)


def _recording(
    path: Path, topics: dict[str, Topic], rate: str, force: str, field: str, *, regularise: bool, earth_frame: str
) -> ImuRecording:
    samples: dict[str, FloatArray] = {}
    times: dict[str, FloatArray] = {}
    for name, topic in topics.items():
        if not topic.stamps and name != field:
            raise RecordingError(path, f"topic {name}", "has no messages", OTHER_TOPIC)
        samples[name] = np.array(topic.values, dtype=np.float64).reshape(len(topic.stamps), -1)
        times[name] = time_from_nanoseconds(np.array(topic.stamps, dtype=np.int64))
    gyroscope = samples[rate][:, :3]
    if np.isnan(gyroscope).all():
        raise RecordingError(path, f"topic {rate}", "its driver says it has no gyroscope", "name another topic")
    streams = {"gyroscope": Stream(times[rate], gyroscope)}
    at = {"gyroscope": rate}
    if force and not np.isnan(samples[force][:, 3:]).all():
        streams["accelerometer"], at["accelerometer"] = Stream(times[force], samples[force][:, 3:]), force
    if field and topics[field].stamps:
        streams["magnetometer"], at["magnetometer"] = Stream(times[field], samples[field]), field

    def place(quantity: str, index: int) -> str:
        return f"topic {at.get(quantity, rate)}, message {index + 1}"

    return inertial_recording(path, place, streams, regularise=regularise, units=False, earth_frame=earth_frame)


def _imu_topics(
    path: Path, bag: Any, imu: str | None, gyroscope: str | None, accelerometer: str | None
) -> tuple[str, str]:
    """Return the topics of gyroscope and accelerometer, mostly the same; the latter "" if there is none."""
    there = sorted({c.topic for c in bag.connections if c.msgtype == IMU})
    if imu is not None or (len(there) < 2 and gyroscope is None and accelerometer is None):
        both = topic_named(path, bag.connections, IMU, imu)
        return both, both if accelerometer is None else topic_named(path, bag.connections, IMU, accelerometer)
    if gyroscope is None or accelerometer is None:
        rates = [name for name in there if re.search("gyr|angular|rate", name, re.IGNORECASE)]
        forces = [name for name in there if re.search("acc", name, re.IGNORECASE)]
        if len(there) == 2 and not (len(rates) == len(forces) == 1):
            rates, forces = _by_content(bag, there)
        if len(rates) == 1:
            gyroscope = gyroscope or rates[0]
        if len(forces) == 1:
            accelerometer = accelerometer or forces[0]
    if gyroscope is None:
        problem = f"several topics of {IMU}: {' '.join(there)}"
        one, rate, force = (Setting(f"{kind}_topic") for kind in ("imu", "gyroscope", "accelerometer"))
        raise RecordingError(path, "", problem, ("choose one by ", one, ", or ", rate, " and ", force))
    names = [topic_named(path, bag.connections, IMU, name) for name in (gyroscope, accelerometer or gyroscope)]
    return names[0], names[1]


def _field_topic(path: Path, bag: Any, asked: str | None) -> tuple[str, Callable[[Any], Any]]:
    """Return the topic of the magnetometer, "" if there is none, and what to take from a message.

    Older drivers send ``geometry_msgs/Vector3Stamped``: taken if the topic is asked for or its name says so.
    """
    vectors = sorted({c.topic for c in bag.connections if c.msgtype == VECTOR})
    if asked is None and not any(c.msgtype == FIELD for c in bag.connections):
        named = [name for name in vectors if re.search("mag", name, re.IGNORECASE)]
        if len(named) == 1:
            note(path, f"topic {named[0]} of {VECTOR}: taken for the magnetometer")
            asked = named[0]
    if asked in vectors:
        return str(asked), lambda message: xyz(message.vector)
    return topic_named(path, bag.connections, FIELD, asked), lambda message: xyz(message.magnetic_field)


def _by_content(bag: Any, topics: list[str]) -> tuple[list[str], list[str]]:
    """Return which of the topics hold rates and no forces, and the reverse, by their first messages."""
    rates: list[str] = []
    forces: list[str] = []
    for name in topics:
        rate = force = False
        chosen = [c for c in bag.connections if c.topic == name]
        for _, (connection, _, data) in zip(range(20), bag.messages(connections=chosen), strict=False):
            gyroscope, accelerometer = np.nan_to_num(_inertial(bag.deserialize(data, connection.msgtype))).reshape(2, 3)
            rate, force = rate or bool(gyroscope.any()), force or bool(accelerometer.any())
        if rate != force:
            (rates if rate else forces).append(name)
    return rates, forces


def _inertial(message: Any) -> tuple[float, ...]:
    """Angular velocity and specific force; NaN if the driver marks one as absent."""
    none = (np.nan,) * 3
    gyroscope = none if is_absent(message.angular_velocity_covariance) else xyz(message.angular_velocity)
    force = none if is_absent(message.linear_acceleration_covariance) else xyz(message.linear_acceleration)
    return (*gyroscope, *force)


FORMAT = Format(
    name="rosbag",
    title="ROS bag",
    expects="ROS 1 bag, ROS 2 folder, ``.db3`` or ``.mcap`` with ``sensor_msgs/Imu`` (in two topics, too) and "
    "``MagneticField`` or Vector3Stamped; or with PoseStamped, PoseWithCovarianceStamped, Odometry, TransformStamped "
    "or tf",
    functions=("read_rosbag", "read_rosbag_orientation", "write_rosbag"),
    read=read_rosbag,
    signatures=(b"#ROSBAG V", b"SQLite format 3\0", b"\x89MCAP"),
    folder=lambda path: (path / "metadata.yaml").is_file(),
)
