"""Messages of a bag's topics, and what the covariances of ``sensor_msgs/Imu`` say about them.

Imu.msg: a first entry of −1 says that the driver does not measure the quantity (REP 145 has NaN instead), nothing but
zeros that its covariance is unknown. Message definitions: https://docs.ros.org/en/rolling/p/sensor_msgs.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bingham.errors import InvalidArgumentError, RecordingError, Setting
from bingham.io.checks import damaged, note, optional_module
from bingham.io.rosbag_check import check_bag

__all__ = [
    "ABSENT",
    "FIELD",
    "IMU",
    "Topic",
    "collect",
    "is_absent",
    "opened",
    "read_topics",
    "stamp_of",
    "topic_named",
    "xyz",
]

IMU, FIELD = "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField"
OTHER_TOPIC = ("name another topic by ", Setting("imu_topic"))
ABSENT = -1.0  # first entry of a covariance: the driver does not measure this quantity


class Topic(NamedTuple):
    """Messages of one topic: its name, stamps in ns, and what was taken from each message."""

    name: str
    stamps: list[int]
    values: list[Any]


def read_topics(
    path: Path,
    wanted: Mapping[str, tuple[str | None, Callable[[Any], Any]]],
    stamps: str,
) -> dict[str, Topic]:
    """Return the messages of one topic of each type.

    Parameters
    ----------
    path : Path
        ROS 1 ``.bag`` file, folder of a ROS 2 bag, or one ``.db3`` or ``.mcap`` file.
    wanted : mapping of str to (str or None, callable)
        Message type → the topic, None for the only one there is, and what to take from a message. Only Imu is required.
    stamps : {"header", "bag"}
        Which time of a message to give.
    """
    with opened(path) as bag:
        names = {kind: topic_named(path, bag.connections, kind, asked) for kind, (asked, _) in wanted.items()}
        takes = {name: wanted[kind][1] for kind, name in names.items() if name}
        there = collect(path, bag, takes, stamps)
    topics = {kind: there.get(name, Topic(name, [], [])) for kind, name in names.items()}
    if IMU in topics and not topics[IMU].stamps:
        raise RecordingError(path, f"topic {names[IMU]}", "has no messages", OTHER_TOPIC)
    return topics


def collect(path: Path, bag: Any, takes: Mapping[str, Callable[[Any], Any]], stamps: str) -> dict[str, Topic]:
    """Return the messages of topics of an open bag.

    Parameters
    ----------
    path, bag : Path, rosbags.highlevel.AnyReader
        The bag.
    takes : mapping of str to callable
        Topic → what to take from a message; a message of which it takes None is left out.
    stamps : {"header", "bag"}
        Which time of a message to give; drivers that leave all headers' stamps equal get the bag's.
    """
    if stamps not in ("header", "bag"):
        raise InvalidArgumentError("stamps", "'header' or 'bag'", repr(stamps))
    chosen = [c for c in bag.connections if c.topic in takes]
    times: dict[str, list[tuple[int, int]]] = {name: [] for name in takes}
    values: dict[str, list[Any]] = {name: [] for name in takes}
    there = 0
    for connection, received, data in bag.messages(connections=chosen):
        there += 1
        message = bag.deserialize(data, connection.msgtype)
        taken = takes[connection.topic](message)
        if taken is not None:
            values[connection.topic].append(taken)
            times[connection.topic].append((received, stamp_of(message, received, "header")))
    if there != (promised := sum(c.msgcount for c in chosen)):
        problem = f"{there} messages, where its index promises {promised}"
        raise RecordingError(path, "", problem, "the bag looks cut off: copy it again")
    topics: dict[str, Topic] = {}
    for name, both in times.items():
        which = 0 if stamps == "bag" else 1
        if which and len(both) > 1 and len({header for _, header in both}) == 1:
            note(path, f"topic {name}: all stamps of its headers are equal; times of recording taken")
            which = 0
        topics[name] = Topic(name, [pair[which] for pair in both], values[name])
    return topics


@contextmanager
def opened(path: Path) -> Generator[Any]:
    """Open a bag as ``rosbags.highlevel.AnyReader``; what its parser stumbles over becomes a `RecordingError`."""
    purpose = "reading ROS bags"
    highlevel = optional_module("rosbags.highlevel", purpose)
    stores = optional_module("rosbags.typesys", purpose)
    if not path.exists():
        raise RecordingError(path, "", "no such file or folder", "check the path")
    check_bag(path)
    # Older ROS 2 bags carry no message definitions; those of sensor_msgs have not changed since.
    store = stores.get_typestore(stores.Stores.ROS2_HUMBLE)
    try:
        with highlevel.AnyReader([path], default_typestore=store) as bag:
            yield bag
    except (RecordingError, InvalidArgumentError):
        raise
    except Exception as error:  # damaged bags make the parser raise whatever it stumbles over
        raise damaged(path, "bag", error, "repair it (rosbag reindex) or copy it again") from error


def topic_named(path: Path, connections: list[Any], kind: str, asked: str | None) -> str:
    """Choose the topic of a message type: the one asked for, or the only one; empty if there is none and need be none.

    Raises
    ------
    RecordingError
        If it is not there, there are several, or there is none of Imu.
    """
    there = sorted({c.topic for c in connections if c.msgtype == kind})
    setting = Setting("imu_topic" if kind == IMU else "magnetometer_topic")
    if asked is not None:
        if asked not in there:
            known = f"topics of this type: {' '.join(there) or 'none'}"
            raise RecordingError(path, f"topic {asked}", f"no {kind} messages", known)
        return asked
    if len(there) > 1:
        raise RecordingError(path, "", f"several topics of {kind}: {' '.join(there)}", ("choose one by ", setting))
    if not there and kind == IMU:
        every = " ".join(sorted({f"{c.topic} ({c.msgtype})" for c in connections})) or "none"
        raise RecordingError(path, "", f"no topic of {IMU}", f"topics in the bag: {every}")
    return there[0] if there else ""


def stamp_of(message: Any, received: int, stamps: str) -> int:
    """Return when a message was measured (its header) or recorded, ns."""
    header = getattr(message, "header", None)
    if header is None:  # TFMessage: each transform has its own
        transforms = getattr(message, "transforms", None)
        header = transforms[0].header if transforms else None
    if stamps == "bag" or header is None:
        return received
    return header.stamp.sec * 1_000_000_000 + header.stamp.nanosec


def is_absent(covariance: Any) -> bool:
    """Return whether a message's covariance (9,) says that its quantity is not measured."""
    return bool(covariance[0] == ABSENT or np.isnan(covariance[0]))


def xyz(vector: Any) -> tuple[float, float, float]:
    """Return a geometry_msgs/Vector3 as numbers."""
    return vector.x, vector.y, vector.z
