"""A copy of a ROS bag with filtered orientations, as ``sensor_msgs/Imu``, next to the topics of the input."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from numpy.typing import ArrayLike

from bingham.atomic import replaced
from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io.rosbag_copy import Copy
from bingham.io.rosbag_message import Estimates
from bingham.io.rosbag_topics import IMU, opened, stamp_of, topic_named

__all__ = ["SUFFIX", "write_rosbag"]

SUFFIX = "/bingham"  # of the topic written, after the name of the topic filtered


def write_rosbag(
    path: str | Path,
    source: str | Path,
    *,
    time: ArrayLike,
    orientation: ArrayLike,
    covariance: ArrayLike,
    bias: ArrayLike | None = None,
    bias_std: ArrayLike | None = None,
    imu_topic: str | None = None,
    topic: str | None = None,
    stamps: Literal["header", "bag"] = "header",
) -> None:
    """Write a bag that holds all of `source`, byte by byte, and a topic of filtered orientations; whole or not at all.

    The version of ROS, the storage and its compression are those of `source`; a ROS 2 bag of several files becomes one
    of one file. Each message of the Imu topic is followed by one with the same header (stamp, frame_id) and time of
    recording.

    Parameters
    ----------
    path : str or Path
        File (ROS 1, ``.bag``) or folder (ROS 2) to write, or a bag to replace.
    source : str or Path
        The bag that was filtered; it is only read.
    time : array_like, shape (N,)
        Times of the estimates as `read_rosbag` gave them; every message of the Imu topic has one.
    orientation : array_like, shape (N, 4)
        Unit quaternions (w, x, y, z), sensor to world; NaN where there is no estimate.
    covariance : array_like, shape (N, 3, 3)
        Of a small rotation about the axes of the world, rad², finite where there is an estimate.
    bias, bias_std : array_like, shape (N, 3), optional
        Of the gyroscope, rad/s, and its standard deviation; NaN where unknown.
    imu_topic : str, optional
        Topic that was filtered; needed only if the bag has several of ``sensor_msgs/Imu``.
    topic : str, optional
        Topic to write; the Imu topic's name with ``/bingham`` after it unless given.
    stamps : {"header", "bag"}
        Which time of a message `time` is.

    Raises
    ------
    RecordingError
        If `source` cannot be read, a message has no estimate, the topic exists, or nothing can be written at `path`.
    InvalidArgumentError
        If arrays do not fit together.
    MissingExtraError
        If the package rosbags is not installed.
    """
    path, source = Path(path), Path(source)
    rows = Estimates.checked(time, orientation, covariance, bias, bias_std)
    with opened(source) as bag:
        _check_target(path, source, ros2=bag.is2)
        name = topic_named(source, bag.connections, IMU, imu_topic)
        topic = f"{name.rstrip('/')}{SUFFIX}" if topic is None else topic
        if any(c.topic == topic for c in bag.connections):
            raise RecordingError(source, f"topic {topic}", "is in the bag already", "give the new topic another name")
        with replaced(path, folder=bag.is2) as temporary, Copy(bag, source, temporary) as copy:
            for connection, received, data in bag.messages():
                copy.write(connection, received, data)
                if (connection.topic, connection.msgtype) == (name, IMU):
                    message = bag.deserialize(data, IMU)
                    stamp = stamp_of(message, received, stamps)
                    if stamp not in rows:
                        place = f"topic {name}, stamp {stamp} ns"
                        raise RecordingError(source, place, "no estimate of this time", "filter the same bag and topic")
                    filled = rows.fill(message, stamp, bag.typestore.types)
                    copy.write(copy.like(connection, topic), received, copy.serialised(filled))


def _check_target(path: Path, source: Path, *, ros2: bool) -> None:
    if (path.suffix == ".bag") == ros2:
        expected = "a folder without the ending .bag for ROS 2" if ros2 else "a file NAME.bag for ROS 1"
        raise InvalidArgumentError("path", expected, f"{path}")
    if not path.parent.is_dir():
        raise RecordingError(path, "", "its folder does not exist", "create the folder first")
    here, there = path.resolve(), source.resolve()
    if here == there or here in there.parents or there in here.parents:
        raise RecordingError(path, "", "is the bag that is read", "write to another place")
    if path.exists() and (ros2 != path.is_dir() or (ros2 and not (path / "metadata.yaml").is_file())):
        raise RecordingError(path, "", "something that is no bag is in the way", "give another name")
