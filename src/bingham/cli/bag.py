"""``bingham track --bag``: the filtered orientations in a copy of the bag they come from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import InvalidArgumentError, RecordingError

__all__ = ["bag_name", "check_bags", "world_covariance", "write_bag"]

FloatArray = NDArray[np.float64]


def bag_name(path: Path, name: str) -> str:
    """Return what the copy of a bag is called: a file for ROS 1, a folder for ROS 2."""
    return f"{name}.track" + (".bag" if path.suffix == ".bag" else "")


def check_bags(recordings: Mapping[str, Path], output: Path) -> None:
    """Reject recordings that are no bags, and copies that would take the place of a recording or of anything else.

    Raises
    ------
    InvalidArgumentError, RecordingError
        Naming the file.
    """
    from bingham.io import detect_format

    there = {path.resolve() for path in recordings.values()}
    for name, path in recordings.items():
        if detect_format(path) != "rosbag":
            raise InvalidArgumentError("--bag", "ROS bags only", f"{path}", "leave --bag out")
        copy = output / bag_name(path, name)
        if copy.resolve() in there:
            raise RecordingError(copy, "", f"the copy of {path} would replace a recording", "choose another --output")
        if copy.is_dir() and not (copy / "metadata.yaml").is_file():
            raise RecordingError(copy, "", "a folder that is no bag is in the way", "choose another --output")


def write_bag(
    folder: Path,
    path: Path,
    name: str,
    time: FloatArray,
    track: Any,
    reading: Mapping[str, Any],
    topic: str | None,
) -> str:
    """Write the bag and return its name; of `time` (N,) the track has the last rows, and before there is nothing."""
    from bingham.io import write_rosbag

    write_rosbag(
        folder / bag_name(path, name),
        path,
        time=time,
        orientation=_late(track.modes, len(time)),
        covariance=_late(world_covariance(track), len(time)),
        bias=_late(getattr(track, "bias", None), len(time)),
        bias_std=_late(getattr(track, "bias_std", None), len(time)),
        imu_topic=reading.get("imu_topic"),
        topic=topic,
    )
    return bag_name(path, name)


def _late(rows: Any, size: int) -> Any:
    """Return `size` rows, those before the given ones NaN."""
    if rows is None:
        return None
    return np.concatenate([np.full((size - len(rows), *rows.shape[1:]), np.nan), rows])


def world_covariance(track: Any) -> FloatArray:
    """Return covariances (T, 3, 3), world axes, rad², finite: an angle that may be anything has the variance π²/3.

    Where a distribution has no one mode (a girdle: heading unknown; uniform), its covariance about the orientation
    reported.
    """
    from bingham.filters.imu_track import UNIFORM_VARIANCE
    from bingham.filters.tangent import covariance_of_distribution

    covariance = np.array(track.covariance(frame="world"))
    for k in np.flatnonzero(np.isnan(covariance[:, 0, 0])):
        values, axes = np.linalg.eigh(covariance_of_distribution(track.distributions[int(k)]))
        covariance[k] = axes * np.minimum(values, UNIFORM_VARIANCE) @ axes.T
    return covariance
