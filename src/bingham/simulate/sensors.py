"""Sensors that watch a motion: an inertial and magnetic unit, and one that measures orientations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.errors import InvalidArgumentError
from bingham.recording import ImuRecording, OrientationRecording
from bingham.simulate.motion import Motion

if TYPE_CHECKING:
    from bingham.distributions.bingham import Bingham

__all__ = ["simulate_imu", "simulate_orientations"]

GRAVITY = 9.81


def simulate_imu(
    motion: Motion,
    *,
    gyroscope_noise_density: float = 1.7e-4,
    gyroscope_bias: ArrayLike = (0.0, 0.0, 0.0),
    gyroscope_bias_walk: float = 0.0,
    accelerometer_noise_density: float = 2e-3,
    magnetometer_noise: float = 0.5,
    field_strength: float = 49.0,
    field_dip_rad: float = 1.17,
    magnetometer: bool = True,
    rng: np.random.Generator | int | None = None,
) -> ImuRecording:
    """What an IMU at the centre of the motion reads, world axes ENU.

    With Δ the time since the sample before and R = R(q) from body to world

    - gyroscope: log(q₋* ⊗ q) / Δ, the mean rate over Δ as strapdown electronics deliver it, + bias
      + density · n / √Δ;
    - accelerometer: Rᵀ (0, 0, 9.81) + density · n / √Δ;
    - magnetometer: Rᵀ strength (0, cos dip, −sin dip) + noise · n.

    n is standard normal. The first sample takes Δ of the second and the instantaneous rate.

    Parameters
    ----------
    motion : Motion
        True motion, at least 2 samples.
    gyroscope_noise_density : float
        rad/s/√Hz.
    gyroscope_bias : array_like, shape (3,)
        At the start, rad/s.
    gyroscope_bias_walk : float
        Density of the bias's random walk, rad/s²/√Hz.
    accelerometer_noise_density : float
        m/s²/√Hz.
    magnetometer_noise : float
        Standard deviation of a sample, unit of `field_strength`.
    field_strength : float
        Strength of the magnetic field, any unit (the default is µT).
    field_dip_rad : float
        Dip of the field below the horizon, rad.
    magnetometer : bool
        False leaves the magnetometer out.
    rng : Generator or int, optional
        Source of randomness, or its seed.

    Returns
    -------
    ImuRecording
        With the motion as ``reference``, scored while it moves.

    Raises
    ------
    InvalidArgumentError
        If a noise is negative or a shape does not fit.

    Examples
    --------
    >>> from bingham.simulate import simulate_tumbling
    >>> recording = simulate_imu(simulate_tumbling(2.0, 100.0), rng=1)
    >>> recording.gyroscope.shape, bool(abs(recording.accelerometer[0, 2] - 9.81) < 0.1)
    ((201, 3), True)
    """
    for name, value in (
        ("gyroscope_noise_density", gyroscope_noise_density),
        ("gyroscope_bias_walk", gyroscope_bias_walk),
        ("accelerometer_noise_density", accelerometer_noise_density),
        ("magnetometer_noise", magnetometer_noise),
    ):
        if not 0 <= value < np.inf:
            raise InvalidArgumentError(name, "a number ≥ 0", value)
    start = np.asarray(gyroscope_bias, dtype=np.float64)
    if start.shape != (3,):
        raise InvalidArgumentError("gyroscope_bias", "shape (3,)", f"shape {start.shape}")
    if len(motion.time) < 2:
        raise InvalidArgumentError("motion", "at least 2 samples", len(motion.time))
    rng = np.random.default_rng(rng)
    size = len(motion.time)
    root = np.sqrt(np.diff(motion.time, prepend=2 * motion.time[0] - motion.time[1]))[:, None]

    def white(density: float) -> NDArray[np.float64]:
        return density * rng.standard_normal((size, 3)) / root

    attitude = Rotation.from_quat(motion.orientation, scalar_first=True)
    rate = (attitude[:-1].inv() * attitude[1:]).as_rotvec() / root[1:] ** 2
    rate = np.concatenate([motion.angular_velocity[:1], rate])
    walk = gyroscope_bias_walk * root * rng.standard_normal((size, 3))
    walk[0] = 0
    gyroscope = rate + start + np.cumsum(walk, axis=0) + white(gyroscope_noise_density)
    to_body = attitude.inv()
    accelerometer = to_body.apply([0.0, 0.0, GRAVITY]) + white(accelerometer_noise_density)
    field = None
    if magnetometer:
        direction = np.array([0.0, np.cos(field_dip_rad), -np.sin(field_dip_rad)])
        field = to_body.apply(field_strength * direction) + magnetometer_noise * rng.standard_normal((size, 3))
    return ImuRecording(
        name=motion.name,
        time=motion.time,
        gyroscope=gyroscope,
        accelerometer=accelerometer,
        magnetometer=field,
        reference=motion.orientation,
        score=motion.moving,
    )


def simulate_orientations(
    motion: Motion, noise: Bingham, *, rng: np.random.Generator | int | None = None
) -> OrientationRecording:
    """Orientations measured with Bingham noise in the body frame: z = x ⊕ v, v ~ `noise` (Kurz et al. 2014, eq. 49).

    Parameters
    ----------
    motion : Motion
        True motion.
    noise : Bingham
        Distribution of v on the quaternions, its mode the identity for a sensor without an offset.
    rng : Generator or int, optional
        Source of randomness, or its seed.

    Returns
    -------
    OrientationRecording
        Measurements (w, x, y, z) with the motion as ``truth``, scored while it moves; signs carry no meaning.

    Raises
    ------
    InvalidArgumentError
        If the noise is not four-dimensional.
    """
    if noise.dim != 4:
        raise InvalidArgumentError("noise", "a Bingham distribution on quaternions (dim 4)", f"dim {noise.dim}")
    sample = noise.rvs(len(motion.time), rng=np.random.default_rng(rng))
    truth = Rotation.from_quat(motion.orientation, scalar_first=True)
    measured = truth * Rotation.from_quat(sample, scalar_first=True)
    return OrientationRecording(
        name=motion.name,
        time=motion.time,
        orientation=measured.as_quat(scalar_first=True),
        truth=motion.orientation,
        score=motion.moving,
    )
