"""What a table of a track may hold: groups of columns, each made of what the filter gave."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.errors import InvalidArgumentError

if TYPE_CHECKING:
    from bingham.filters.imu_track import ImuTrack
    from bingham.filters.track import Track

__all__ = ["DEFAULT_FIELDS", "FIELDS", "PER_ROW", "Column", "content_of", "covariance_of", "deviations", "table"]

FloatArray = NDArray[np.float64]
Content = Mapping[str, Any]


class Column(NamedTuple):
    """A column: its name, decimals (or −(significant digits)) of its numbers as text, and its rows."""

    name: str
    digits: int
    values: NDArray[Any]


# Shapes of a row of what has one for each time; d is the dimension.
PER_ROW: dict[str, tuple[Any, ...]] = {
    **dict.fromkeys(("time", "rest", "log_evidence", "accepted", "reason", "decision", "nis"), ()),
    **dict.fromkeys(("magnetometer_code", "magnetometer_statistic", "relative_heading_std"), ()),
    **dict.fromkeys(("modes", "concentrations"), ("d",)),
    **dict.fromkeys(("frames", "matrices"), ("d", "d")),
    **dict.fromkeys(("covariance", "rotation_covariance"), (3, 3)),
    "rotation_covariance_upper": (6,),
    **dict.fromkeys(("bias", "bias_std"), (3,)),
}


def content_of(track: Track[Any] | ImuTrack | Mapping[str, Any]) -> dict[str, Any]:
    """Return the arrays of a track by name, without those that follow from others; a mapping is taken as it is.

    Raises
    ------
    InvalidArgumentError
        If it is no track.
    """
    from bingham.filters.imu_track import ImuTrack
    from bingham.filters.track import BinghamTrack, Track

    if isinstance(track, Mapping):
        return dict(track)
    if isinstance(track, ImuTrack):
        names = ["time", "modes", "rotation_covariance", "bias", "bias_std", "rest", "log_evidence"]
        names += ["magnetometer_code", "magnetometer_statistic", "relative_heading_std"]
        return {name: getattr(track, name) for name in names} | {"state": track.final.to_json()}
    if isinstance(track, Track):  # pyright: ignore[reportUnnecessaryIsInstance]
        names = ["time", "modes", "log_evidence", "nis", "decision", "threshold"]
        names += ["concentrations", "frames"] if isinstance(track, BinghamTrack) and track.states is not None else []
        return {name: getattr(track, name) for name in names}
    raise InvalidArgumentError("track", "a Track, an ImuTrack or what read_track gives", type(track).__name__)


def covariance_of(content: Content, frame: str) -> FloatArray | None:
    """Return covariances (T, 3, 3), rad², body or world axes, NaN where undefined; None for axes in the plane."""
    from bingham.distributions.bingham import Bingham
    from bingham.filters.imu_track import bounded
    from bingham.rotations import rotate

    modes = np.asarray(content["modes"])
    if "rotation_covariance" in content:
        world = bounded(np.asarray(content["rotation_covariance"]))
    elif content.get("covariance") is not None and content.get("covariance_frame") == frame:
        return np.asarray(content["covariance"])
    elif "frames" in content and modes.shape[1] == 4:
        distributions = Bingham.from_spectrum(content["concentrations"], content["frames"])
        return distributions.covariance(frame=frame, undefined="nan")  # type: ignore[arg-type]
    else:
        return None
    if frame == "world":
        return world
    to_world = np.stack([rotate(modes, axis) for axis in np.eye(3)], axis=-1)
    return np.swapaxes(to_world, -1, -2) @ world @ to_world


def deviations(content: Content) -> dict[str, FloatArray]:
    """Return standard deviations, rad, (T,): heading and inclination of rotations, the angle of axes in the plane."""
    from bingham.filters.imu_track import UNIFORM_INCLINATION, UNIFORM_VARIANCE

    modes = np.asarray(content["modes"])
    if modes.shape[1] == 2:
        if content.get("concentrations") is None:
            return {}
        from scipy.special import ive

        # A Bingham axis in the plane is a von Mises angle of twice the size, κ = −z₁/2.
        half = -np.asarray(content["concentrations"])[:, 0] / 2
        with np.errstate(divide="ignore"):
            return {"angle": 0.5 * np.sqrt(-2 * np.log(ive(1, half) / ive(0, half)))}
    c = content["rotation_covariance"] if "rotation_covariance" in content else covariance_of(content, "world")
    if c is None:
        return {}
    return {
        "heading": np.sqrt(np.minimum(c[:, 2, 2], UNIFORM_VARIANCE)),
        "inclination": np.sqrt(np.minimum(c[:, 0, 0] + c[:, 1, 1], UNIFORM_INCLINATION)),
    }


def _quaternion(content: Content, _: str) -> list[Column]:
    modes = np.asarray(content["modes"])
    names = ["ux", "uy"] if modes.shape[1] == 2 else ["qw", "qx", "qy", "qz"]
    return [Column(name, 9, modes[:, k]) for k, name in enumerate(names)]


def _euler(content: Content, _: str) -> list[Column]:
    modes = np.asarray(content["modes"])
    if modes.shape[1] == 2:
        return [Column("angle_deg", 6, np.degrees(np.arctan2(modes[:, 1], modes[:, 0])) % 180)]
    w, x, y, z = modes.T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - x * z), -1, 1))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return [Column(f"{n}_deg", 6, np.degrees(a)) for n, a in (("roll", roll), ("pitch", pitch), ("yaw", yaw))]


def _deviation(content: Content, _: str) -> list[Column]:
    return [Column(f"{name}_std_deg", -6, np.degrees(values)) for name, values in deviations(content).items()]


def _vector(key: str) -> Callable[[Content, str], list[Column]]:
    def columns(content: Content, _: str) -> list[Column]:
        if content.get(key) is None:
            return []
        return [Column(f"{key}_{a}_rad_s", -7, np.asarray(content[key])[:, k]) for k, a in enumerate("xyz")]

    return columns


def _covariance(content: Content, frame: str) -> list[Column]:
    c = covariance_of(content, frame)
    if c is None:
        return []
    return [Column(f"cov_{'xyz'[i]}{'xyz'[j]}", -8, c[:, i, j]) for i, j in zip(*np.triu_indices(3), strict=True)]


def _concentrations(content: Content, _: str) -> list[Column]:
    from bingham.filters.tangent import distribution_of_covariance

    z = content.get("concentrations")
    if z is None and "rotation_covariance" in content:
        known = np.isfinite(content["modes"][:, 0])
        z = np.full((len(known), 4), np.nan)
        z[known] = distribution_of_covariance(content["modes"][known], content["rotation_covariance"][known]).z
    return [] if z is None else [Column(f"z{k + 1}", -10, np.asarray(z)[:, k]) for k in range(np.shape(z)[1])]


def _evidence(content: Content, _: str) -> list[Column]:
    values = content.get("log_evidence")
    return [] if values is None else [Column("log_evidence", -10, np.asarray(values))]


def _decision(content: Content, _: str) -> list[Column]:
    from bingham.filters.imu_track import MAGNETOMETER_CODES

    if "magnetometer_code" in content:
        code = np.asarray(content["magnetometer_code"])
        rejected = np.isin(code, (2, 3, 4))
        words = np.array(["" if c not in (2, 3, 4) else w for c, w in MAGNETOMETER_CODES.items()])
        statistic = Column("magnetometer_statistic", -6, np.asarray(content["magnetometer_statistic"]))
        return [statistic, Column("accepted", 0, ~rejected), Column("reason", 0, words[code])]
    if "decision" in content:
        size = len(content["decision"])
        decisions, values = (np.asarray(content[name]).reshape(size, -1) for name in ("decision", "nis"))
        rejected, missing = (decisions == 0).any(axis=1), (decisions == -1).all(axis=1)
        reason = np.where(rejected, "rejected", np.where(missing, "missing", ""))
        names = ["nis"] if values.shape[1] == 1 else [f"nis_{k + 1}" for k in range(values.shape[1])]
        nis = [Column(name, -6, values[:, k]) for k, name in enumerate(names)]
        return [*nis, Column("accepted", 0, ~rejected & ~missing), Column("reason", 0, reason)]
    names = [name for name in ("accepted", "reason") if content.get(name) is not None]
    return [Column(name, 0, np.asarray(content[name])) for name in names]


def _relative_heading(content: Content, _: str) -> list[Column]:
    std = content.get("relative_heading_std")
    if std is None or not len(std) or not np.isfinite(std[-1]):
        return []
    angle = 2 * np.arctan2(content["modes"][:, 3], content["modes"][:, 0])
    angle -= 2 * np.pi * np.round(angle / (2 * np.pi))
    return [
        Column("relative_heading_deg", 6, np.degrees(angle)),
        Column("relative_heading_std_deg", -6, np.degrees(np.asarray(std))),
    ]


def _rest(content: Content, _: str) -> list[Column]:
    return [Column("rest", 0, np.asarray(content["rest"]))] if "rest" in content else []


# What --fields and fields= choose from; a function gives no columns where a track has no such thing.
FIELDS: dict[str, Callable[[Content, str], list[Column]]] = {
    "quaternion": _quaternion,
    "euler": _euler,
    "deviation": _deviation,
    "bias": _vector("bias"),
    "bias_std": _vector("bias_std"),
    "covariance": _covariance,
    "concentrations": _concentrations,
    "relative_heading": _relative_heading,
    "evidence": _evidence,
    "rest": _rest,
    "decision": _decision,
}
DEFAULT_FIELDS = ("quaternion", "euler", "deviation", "bias")


def table(content: Content, fields: Sequence[str] | None, frame: str) -> list[Column]:
    """Return the time and the columns of these fields, the default ones where there is no choice.

    Raises
    ------
    InvalidArgumentError
        If there is no such field, or the track does not have one that is asked for.
    """
    columns = [Column("time_s", 9, np.asarray(content["time"], dtype=np.float64))]
    for name in DEFAULT_FIELDS if fields is None else fields:
        if name not in FIELDS:
            raise InvalidArgumentError("fields", f"some of {', '.join(FIELDS)}", name)
        found = FIELDS[name](content, frame)
        if not found and fields is not None:
            raise InvalidArgumentError("fields", "what the track has", name, "leave it out")
        columns += found
    return columns
