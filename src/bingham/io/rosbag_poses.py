"""Orientations in bags that are no ``sensor_msgs/Imu``: poses, odometry and transforms, with their covariances.

A covariance of a pose is 6×6, row by row: x, y, z, rotations about the fixed axes x, y, z (geometry_msgs
PoseWithCovariance.msg); zeros mean that it is unknown. A topic of transforms holds many pairs of frames:
``/tf:map.base`` names one, as in evo.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bingham.errors import RecordingError, Setting
from bingham.io.assemble import orientation_recording
from bingham.io.checks import normalised, note, time_from_nanoseconds
from bingham.io.rosbag_topics import collect, xyz
from bingham.recording import OrientationRecording

__all__ = ["POSES", "pose_topics", "read_poses"]

TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
# What a topic of ground truth is called.
TOPIC = Setting("pose_topic")
OTHER = ("name another by ", TOPIC)
TRUTH = re.compile(r"ground_?truth|truth|(?:^|[/_])gt(?:[/_]|$)|vicon|mocap|optitrack", re.IGNORECASE)
POSES = (
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/TransformStamped",
    *TRANSFORMS,
)


def pose_topics(bag: Any) -> list[str]:
    """Return the topics of a bag that hold orientations, static transforms left out."""
    return sorted({c.topic for c in bag.connections if c.msgtype in POSES and not c.topic.endswith("tf_static")})


def read_poses(
    path: Path, bag: Any, asked: str | None, stamps: str, *, regularise: bool = False
) -> OrientationRecording:
    """Read the orientations of a topic, or of a pair of frames ``/tf:parent.child``."""
    there = pose_topics(bag)
    topic, _, frames = (asked or "").partition(":")
    if asked is not None and topic not in there:
        raise RecordingError(path, f"topic {topic}", "holds no poses", f"topics that do: {' '.join(there) or 'none'}")
    if asked is None:
        topic = _plain(path, bag, there)
    kind = next(c.msgtype for c in bag.connections if c.topic == topic)
    if kind in TRANSFORMS:
        frames = frames or _only_pair(path, bag, topic)
    taken = collect(path, bag, {topic: _taker(kind, frames)}, stamps)[topic]
    if not taken.stamps:
        problem = f"no transform {frames}" if frames else "has no messages"
        raise RecordingError(path, f"topic {topic}", problem, OTHER)

    def place(_: str, index: int) -> str:
        return f"topic {topic}, message {index + 1}"

    quaternions, positions, covariances = (np.array(part, dtype=np.float64) for part in zip(*taken.values, strict=True))
    empty = ~quaternions.any(axis=1)
    if empty.any():
        note(path, f"topic {topic}: {np.count_nonzero(empty)} quaternions of zeros: no orientations, left out")
    if empty.all():
        raise RecordingError(path, f"topic {topic}", "holds no orientations, only zeros", OTHER)
    if (broken := ~np.isfinite(quaternions).all(axis=1)).any():
        raise RecordingError(path, place("", int(np.argmax(broken))), "orientation not finite", "remove the message")
    rows = {
        "time": time_from_nanoseconds(np.array(taken.stamps))[~empty],
        "orientation": normalised(path, "orientation", quaternions[~empty], place),
        "position": positions[~empty],
    }
    known = covariances[~empty].reshape(-1, 3, 3)
    if np.isfinite(known[:, 0, 0]).any():
        rows["covariance"] = known
    return orientation_recording(path, place, rows, regularise=regularise)


def _plain(path: Path, bag: Any, there: list[str]) -> str:
    """Return the only topic, the only one that is neither of many frames nor called the truth, or the only content."""
    frames = {c.topic for c in bag.connections if c.msgtype in TRANSFORMS}
    stamped = [topic for topic in there if topic not in frames] or there
    measured = [topic for topic in stamped if not TRUTH.search(topic)] or stamped
    if len(measured) > 1 and not _are_equal(bag, measured):
        raise RecordingError(path, "", f"several topics of poses: {' '.join(there)}", ("choose one by ", TOPIC))
    if len(there) > 1:
        others = " ".join(topic for topic in there if topic != measured[0])
        note(path, f"topic {measured[0]} taken for the poses; others by ", TOPIC, f": {others}")
    return measured[0]


def _are_equal(bag: Any, topics: list[str]) -> bool:
    """Whether topics hold the same messages, as relays make them."""
    content: dict[str, list[bytes]] = {topic: [] for topic in topics}
    for connection, _, data in bag.messages(connections=[c for c in bag.connections if c.topic in content]):
        content[connection.topic].append(bytes(data))
    first, *others = content.values()
    return all(other == first for other in others)


def _taker(kind: str, frames: str) -> Callable[[Any], Any]:
    unknown = np.full(9, np.nan)

    def take(message: Any) -> Any:
        covariance = unknown
        if kind in TRANSFORMS:
            pair = next((t for t in message.transforms if _pair(t) == frames), None)
            if pair is None:
                return None
            rotation, position = pair.transform.rotation, pair.transform.translation
        elif kind.endswith("TransformStamped"):
            rotation, position = message.transform.rotation, message.transform.translation
        elif kind.endswith("PoseStamped"):
            rotation, position = message.pose.orientation, message.pose.position
        else:
            rotation, position = message.pose.pose.orientation, message.pose.pose.position
            block = np.asarray(message.pose.covariance, dtype=np.float64).reshape(6, 6)[3:, 3:]
            if np.isfinite(block).all() and (np.diagonal(block) > 0.0).all():
                covariance = block.ravel()
        return (rotation.w, rotation.x, rotation.y, rotation.z), xyz(position), covariance

    return take


def _pair(transform: Any) -> str:
    return f"{transform.header.frame_id.lstrip('/')}.{transform.child_frame_id.lstrip('/')}"


def _only_pair(path: Path, bag: Any, topic: str) -> str:
    """Return the only pair of frames of a topic of transforms."""
    pairs: set[str] = set()
    chosen = [c for c in bag.connections if c.topic == topic]
    for connection, _, data in bag.messages(connections=chosen):
        pairs |= {_pair(t) for t in bag.deserialize(data, connection.msgtype).transforms}
    if len(pairs) != 1:
        hint = ("choose one: ", Setting("pose_topic", f"{topic}:PARENT.CHILD"))
        raise RecordingError(path, f"topic {topic}", f"pairs of frames: {' '.join(sorted(pairs)[:20]) or 'none'}", hint)
    return pairs.pop()
