"""Constant rotations between a camera and a gyroscope, and between their worlds, from a recording of both.

A camera with axes M in the sensor and a world W of its own measures C = W ⊗ B ⊗ M where B is the sensor's orientation.
Between two of its times C₁* ⊗ C₂ = M* ⊗ (B₁* ⊗ B₂) ⊗ M, in which W is gone: rotation vectors d = Mᵀ δ, with δ from the
gyroscope less its bias (Park & Martin, IEEE Trans. Robotics and Automation 10(5), 1994, for a robot's hand). Gravity in
the camera's world is where the mean specific force points, north where the mean field does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from bingham.errors import InvalidArgumentError
from bingham.recording import ImuRecording, OrientationRecording
from bingham.rotations import compose, conjugate, from_rotation_vector, rotate, to_rotation, to_rotation_vector

__all__ = ["OrientationAlignment", "align_orientations"]

FloatArray = NDArray[np.float64]
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])

SHORTEST, LONGEST = 0.5, 2.0  # s between the two orientations of a pair
GAP = 0.1  # s without a gyroscope sample that a pair must not span
LARGEST = 2.5  # rad: rotation vectors near π jump
ENOUGH = 10  # pairs
BIWEIGHT = 4.685  # Tukey's: residuals beyond so many deviations count for nothing
ROUNDS = 30
MEDIAN = 1.538  # of the length of three normal numbers, in deviations
LOOSE = 0.1  # rad: residuals that are this large, and half of the rotations, are no noise
FINEST = 1e-3  # rad: no orientations and rates agree better
UNSEEN = np.radians(5.0)  # standard deviation of a mounting that the motion does not show
HINT = "turn camera and sensor together about all their axes for half a minute"


@dataclass(frozen=True, eq=False)
class OrientationAlignment:
    """What makes a camera's orientations those of the sensor in the world of gravity and north.

    q_sensor = world ⊗ q_camera ⊗ mounting*.

    Attributes
    ----------
    mounting : (4,) ndarray
        Camera to sensor axes: v_sensor = R(mounting) v_camera.
    mounting_covariance : (3, 3) ndarray
        Of a small rotation about the sensor's axes, rad².
    world : (4,) ndarray
        Camera's world to the world with z up and, with a magnetometer, y to magnetic north.
    world_std : float
        Standard deviation of its tilt, rad.
    noise : float
        Standard deviation of an orientation about each axis, rad, outliers apart.
    bias : (3,) ndarray
        Mean gyroscope bias, rad/s.
    outliers : float
        Share of pairs of orientations that contradict the gyroscope.
    """

    mounting: FloatArray
    mounting_covariance: FloatArray
    world: FloatArray
    world_std: float
    noise: float
    bias: FloatArray
    outliers: float

    @property
    def mounting_std(self) -> float:
        """Largest standard deviation of the mounting, rad."""
        return float(np.sqrt(np.linalg.eigvalsh(self.mounting_covariance)[-1]))

    def apply(self, orientations: OrientationRecording) -> OrientationRecording:
        """Return the sensor's orientations; those without a covariance get that of `noise`."""
        q = compose(compose(self.world, orientations.orientation), conjugate(self.mounting))
        own = self.noise**2 * np.eye(3)
        c = np.tile(own, (len(q), 1, 1)) if orientations.covariance is None else orientations.covariance
        turn = to_rotation(self.world).as_matrix()
        c = turn @ np.where(np.isnan(c), own, c) @ turn.T
        c = c + self.world_std**2 * np.eye(3)
        return OrientationRecording(
            orientations.name, orientations.time, q, covariance=c, mounting_covariance=self.mounting_covariance
        )


def align_orientations(recording: ImuRecording, *, mounting: bool = True, world: bool = True) -> OrientationAlignment:
    """Find the constant rotations between a recording's orientations and its sensors.

    Parameters
    ----------
    recording : ImuRecording
        With orientations; with an accelerometer too for `world`.
    mounting : bool
        Whether the camera's axes are to be found; the sensor's otherwise.
    world : bool
        Whether the camera's world is to be levelled and, with a magnetometer, turned to north.

    Returns
    -------
    OrientationAlignment
        ``amended(recording, orientations=found.apply(recording.orientations))`` goes into `ImuFilter`.

    Raises
    ------
    InvalidArgumentError
        If there are too few orientations, they do not turn as the gyroscope does, or the motion does not show the
        mounting.

    Examples
    --------
    >>> from bingham.recording import amended
    >>> from bingham.rotations import compose, from_rotation_vector
    >>> from bingham.simulate import simulate_imu, simulate_tumbling
    >>> r = simulate_imu(simulate_tumbling(60.0, 100.0, rng=0), rng=1)
    >>> seen = compose(r.reference[::50], from_rotation_vector([0.3, -0.2, 0.5]))
    >>> found = align_orientations(amended(r, orientations=(r.time[::50], seen)), world=False)
    >>> bool(abs(found.mounting - from_rotation_vector([0.3, -0.2, 0.5])).max() < 0.01)
    True
    """
    seen = recording.orientations
    if seen is None:
        raise InvalidArgumentError(
            "recording", "one with orientations", recording.name, "ImuRecording(orientations=...)"
        )
    if world and recording.accelerometer is None:
        raise InvalidArgumentError("world", "False without accelerometer", True, "gravity shows where up is")
    inside = (seen.time >= recording.time[0]) & (seen.time <= recording.time[-1])
    time, camera = seen.time[inside], seen.orientation[inside]
    first, second = _pairs(time, recording.time)
    if len(first) < ENOUGH:
        expected = f"at least {ENOUGH} pairs of orientations {SHORTEST} to {LONGEST} s apart beside the gyroscope"
        raise InvalidArgumentError("orientations", expected, len(first), HINT)
    d = to_rotation_vector(compose(conjugate(camera[first]), camera[second]))
    bias, matrix = np.zeros(3), np.eye(3)
    delta, weight, scale, covariance = d, np.ones(len(d)), 1.0, np.eye(6)
    for count in range(ROUNDS):
        integrated = _integrated(recording, bias)
        at = _at(recording, integrated, time, bias)
        delta = to_rotation_vector(compose(conjugate(at[first]), at[second]))
        if count == 0:
            weight = _alike(d, delta)
            if mounting:
                matrix = _wahba(delta, d, weight)
        residual = d - delta @ matrix  # rows (Mᵀ δ)ᵀ
        weight, scale = _biweights(residual, delta, d)
        step, covariance = _newton(residual, delta, matrix, weight, scale, time[second] - time[first], mounting)
        matrix = matrix @ to_rotation(from_rotation_vector(step[:3])).as_matrix()
        bias = bias + step[3:]
        if np.abs(step).max() < 1e-7:
            break
    outliers = float(np.mean(weight == 0.0))
    if scale > LOOSE and MEDIAN * scale > 0.5 * float(np.median(np.linalg.norm(delta, axis=1))):
        hint = "is a clock shifted, a quaternion in another order, or the orientation world to body?"
        got = f"usually {np.degrees(MEDIAN * scale):.0f}° off in {SHORTEST} s"
        raise InvalidArgumentError("orientations", "rotations as the gyroscope's", got, hint)
    axes = IDENTITY
    if mounting:
        axes = Rotation.from_matrix(matrix).as_quat(scalar_first=True)
        if np.sqrt(np.linalg.eigvalsh(covariance[:3, :3])[-1]) > UNSEEN:
            raise InvalidArgumentError(
                "orientations", "a motion that shows the mounting", "rotations about one axis", HINT
            )
    around = matrix @ covariance[:3, :3] @ matrix.T if mounting else np.zeros((3, 3))
    level, level_std = IDENTITY, 0.0
    if world:
        level, level_std = _level(recording, _integrated(recording, bias), time, compose(camera, conjugate(axes)), bias)
    return OrientationAlignment(axes, around, level, level_std, scale / np.sqrt(2.0), bias, outliers)


def _pairs(time: FloatArray, samples: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return pairs of orientations that are near in time, with samples of the gyroscope all the way between."""
    second = np.searchsorted(time, time + SHORTEST - 1e-9)
    first = np.flatnonzero(second < len(time))
    second = second[first]
    short = time[second] - time[first] <= LONGEST
    steps = np.diff(samples)
    missing = np.concatenate([[0], np.cumsum(steps > max(GAP, 5.0 * float(np.median(steps))))])
    i, j = (np.clip(np.searchsorted(samples, time[k]), 0, len(samples) - 1) for k in (first, second))
    whole = short & (missing[i] == missing[j])
    return first[whole], second[whole]


def _integrated(recording: ImuRecording, bias: FloatArray) -> FloatArray:
    """Return the product (N, 4) of the gyroscope's rotations up to each sample, by doubling."""
    steps = np.diff(recording.time, prepend=recording.time[0])
    q = from_rotation_vector((recording.gyroscope - bias) * steps[:, None])
    span = 1
    while span < len(q):
        q[span:] = compose(q[:-span], q[span:])
        span *= 2
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def _at(recording: ImuRecording, integrated: FloatArray, time: FloatArray, bias: FloatArray) -> FloatArray:
    """Return the integrated rotation at other times (M, 4), with the rate of the sample after them."""
    after = np.clip(np.searchsorted(recording.time, time), 0, recording.size - 1)
    before = np.maximum(after - 1, 0)
    ahead = (time - recording.time[before])[:, None]
    return compose(integrated[before], from_rotation_vector((recording.gyroscope[after] - bias) * ahead))


def _alike(d: FloatArray, delta: FloatArray) -> FloatArray:
    """Return weights 1 where the angles, which no mounting changes, are alike."""
    difference = np.linalg.norm(d, axis=1) - np.linalg.norm(delta, axis=1)
    return (np.abs(difference) <= max(BIWEIGHT * 1.4826 * float(np.median(np.abs(difference))), 1e-9)).astype(float)


def _wahba(delta: FloatArray, d: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the rotation matrix M with the least Σ w |δ − M d|²."""
    u, _, vt = np.linalg.svd(np.einsum("n,ni,nj->ij", weight, delta, d))
    return u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt


def _biweights(residual: FloatArray, delta: FloatArray, d: FloatArray) -> tuple[FloatArray, float]:
    """Return Tukey's weights and the deviation of a residual about each axis."""
    size = np.linalg.norm(residual, axis=1)
    usable = (np.linalg.norm(delta, axis=1) < LARGEST) & (np.linalg.norm(d, axis=1) < LARGEST)
    scale = max(float(np.median(size[usable])) / MEDIAN if usable.any() else 1.0, 1e-9)
    share = size / (BIWEIGHT * scale)
    return np.where(usable & (share < 1.0), (1.0 - share**2) ** 2, 0.0), scale


def _newton(
    residual: FloatArray, delta: FloatArray, matrix: FloatArray, weight: FloatArray, scale: float, spans: FloatArray,
    mounting: bool,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Return the Gauss–Newton step of mounting (camera axes) and bias (6,), and the covariance of both."""
    turned = delta @ matrix
    jacobian = np.zeros((len(delta), 3, 6))
    if mounting:  # d ≈ Exp(−m) Mᵀδ: the residual changes by (Mᵀδ) × m
        x, y, z = turned.T
        jacobian[:, 0, 1], jacobian[:, 0, 2] = -z, y
        jacobian[:, 1, 0], jacobian[:, 1, 2] = z, -x
        jacobian[:, 2, 0], jacobian[:, 2, 1] = -y, x
    half = to_rotation(from_rotation_vector(0.5 * delta)).as_matrix()
    jacobian[:, :, 3:] = -spans[:, None, None] * (matrix.T @ half)
    normal = np.einsum("n,nki,nkj->ij", weight, jacobian, jacobian)
    free = slice(0, 6) if mounting else slice(3, 6)
    inverse = np.zeros((6, 6))
    # A ridge far below what a motion shows keeps what it does not show where it was.
    inverse[free, free] = np.linalg.inv(normal[free, free] + 1e-9 * np.eye(6)[free, free])
    step = inverse @ np.einsum("n,nki,nk->i", weight, jacobian, residual)
    return step, max(scale, FINEST) ** 2 * inverse


def _level(
    recording: ImuRecording, integrated: FloatArray, time: FloatArray, body: FloatArray, bias: FloatArray
) -> tuple[FloatArray, float]:
    """Return the rotation of the camera's world to one with z up, y north if a field shows it, and its deviation."""
    to_camera = compose(body, conjugate(_at(recording, integrated, time, bias)))
    forces = _means(recording.time, integrated, recording.accelerometer, time, to_camera)
    up, spread = _robust_mean(forces)
    level = _shortest(up / np.linalg.norm(up), np.array([0.0, 0.0, 1.0]))
    if recording.magnetometer is not None:
        fields = _means(recording.time, integrated, recording.magnetometer, time, compose(level, to_camera))
        east, north, _ = _robust_mean(fields)[0]
        level = compose(from_rotation_vector(np.array([0.0, 0.0, np.arctan2(east, north)])), level)
    return level, spread / float(np.linalg.norm(up))


def _means(t: FloatArray, integrated: FloatArray, rows: Any, time: FloatArray, to_camera: FloatArray) -> FloatArray:
    """Return mean vectors (K, 3) between orientations, in the camera's world; each held by the gyroscope."""
    known = np.isfinite(rows[:, 0])
    held = rotate(integrated[known], rows[known])
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(held, axis=0)])
    edge = np.searchsorted(t[known], time)
    count = np.diff(edge)
    some = (count > 0) & (np.diff(time) < LONGEST)
    means = np.diff(total[edge], axis=0)[some] / count[some, None]
    return rotate(to_camera[:-1][some], means)


def _robust_mean(rows: FloatArray) -> tuple[FloatArray, float]:
    """Return Tukey's mean of vectors (K, 3) and its deviation about each axis."""
    if len(rows) < ENOUGH:
        raise InvalidArgumentError("orientations", f"at least {ENOUGH} beside accelerometer samples", len(rows), HINT)
    mean, scale, weight = np.median(rows, axis=0), 1.0, np.ones(len(rows))
    for _ in range(ROUNDS):
        size = np.linalg.norm(rows - mean, axis=1)
        scale = max(float(np.median(size)) / MEDIAN, 1e-12)
        weight = np.maximum(1.0 - (size / (BIWEIGHT * scale)) ** 2, 0.0) ** 2
        mean = weight @ rows / weight.sum()
    return mean, scale / float(np.sqrt(weight.sum()))


def _shortest(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the rotation by the smallest angle that takes the unit vector a to b."""
    axis, cosine = np.cross(a, b), float(a @ b)
    if cosine < -1.0 + 1e-12:
        return np.array([0.0, 1.0, 0.0, 0.0])
    q = np.concatenate([[1.0 + cosine], axis])
    return q / np.linalg.norm(q)
