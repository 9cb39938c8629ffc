"""Motions of a rigid body about its centre of mass: free tumbling and steady precession."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from bingham.errors import ConvergenceError, InvalidArgumentError
from bingham.simulate.motion import Motion, phases, sample_times

__all__ = ["simulate_precession", "simulate_tumbling"]

# Energy and angular momentum are conserved to about 1e-10 over 200 s with this.
RELATIVE_TOLERANCE = 1e-12


def simulate_tumbling(
    duration_s: float,
    rate_hz: float,
    *,
    inertia: ArrayLike = (1.0, 2.0, 3.0),
    angular_velocity: ArrayLike = (0.02, 1.5, 0.02),
    initial: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    rest_s: float = 0.0,
    jitter: float = 0.0,
    drop_probability: float = 0.0,
    rng: np.random.Generator | int | None = None,
) -> Motion:
    """Free rigid body: J ω' = (J ω) × ω, q' = ½ q ⊗ (0, ω).

    Rotation about the axis of intermediate inertia, the default, is unstable: the body turns over again and again.

    Parameters
    ----------
    duration_s : float
        Duration, rest phases included.
    rate_hz : float
        Sampling rate.
    inertia : array_like, shape (3,) or (3, 3)
        Principal moments or tensor in the body frame, kg m²; positive definite (only ratios matter).
    angular_velocity : array_like, shape (3,)
        At the start of the motion, body frame, rad/s.
    initial : array_like, shape (4,)
        Orientation (w, x, y, z) at the start.
    rest_s : float
        Rest before and after the motion, s each.
    jitter : float
        Largest displacement of a sample time, as a fraction of the sampling interval, below 0.5.
    drop_probability : float
        Chance that a sample is missing.
    rng : Generator or int, optional
        Source of randomness, or its seed.

    Returns
    -------
    Motion
        At the times that are left.

    Raises
    ------
    InvalidArgumentError
        If an argument is out of its range.

    Examples
    --------
    >>> motion = simulate_tumbling(10.0, 100.0, inertia=(2, 2, 1), rest_s=1.0)
    >>> motion.orientation.shape, motion.angular_velocity[0].tolist(), int(motion.moving.sum())
    ((1001, 4), [0.0, 0.0, 0.0], 801)
    """
    time = sample_times(duration_s, rate_hz, jitter, drop_probability, rng)
    tensor = np.asarray(inertia, dtype=np.float64)
    tensor = np.diag(tensor) if tensor.shape == (3,) else tensor
    if tensor.shape != (3, 3) or not np.allclose(tensor, tensor.T) or not (np.linalg.eigvalsh(tensor) > 0).all():
        raise InvalidArgumentError("inertia", "3 positive moments or a positive definite 3×3 tensor", inertia)
    inverse = np.linalg.inv(tensor)
    start = _vector("angular_velocity", angular_velocity, 3)
    attitude = _unit("initial", initial)

    def derivative(_: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
        w, x, y, z, a, b, c = state.tolist()
        k, l, m = (tensor @ state[4:]).tolist()
        rate = inverse @ (l * c - m * b, m * a - k * c, k * b - l * a)
        # q ⊗ (0, ω) / 2
        turn = (-x * a - y * b - z * c, w * a + y * c - z * b, w * b + z * a - x * c, w * c + x * b - y * a)
        return np.array([*(0.5 * t for t in turn), *rate])

    moving, elapsed = phases(time, duration_s, rest_s)
    instants, where = np.unique(elapsed, return_inverse=True)
    solution = solve_ivp(
        derivative,
        (0.0, instants[-1]),
        np.concatenate([attitude, start]),
        method="DOP853",
        t_eval=instants,
        rtol=RELATIVE_TOLERANCE,
        atol=RELATIVE_TOLERANCE,
    )
    if not solution.success:
        raise ConvergenceError(f"Euler's equations could not be integrated: {solution.message}", solution.t[-1:])
    state = solution.y.T[where]
    orientation = state[:, :4] / np.linalg.norm(state[:, :4], axis=1, keepdims=True)
    return Motion("tumbling", time, orientation, np.where(moving[:, None], state[:, 4:], 0.0), moving)


def simulate_precession(
    duration_s: float,
    rate_hz: float,
    *,
    spin: float = 2.0,
    precession: float = 0.3,
    tilt_rad: float = 0.6,
    rest_s: float = 0.0,
    jitter: float = 0.0,
    drop_probability: float = 0.0,
    rng: np.random.Generator | int | None = None,
) -> Motion:
    """Steady precession: q(t) = exp(½ p t k) ⊗ exp(½ tilt i) ⊗ exp(½ s t k), i and k the x and z units.

    The body spins about its z axis, which goes round the vertical: the pattern of the synthetic experiment of Madaan,
    Suresh & Kalra (2017, section IV.B), where spin and precession are given as rates too.

    Parameters
    ----------
    duration_s : float
        Duration, rest phases included.
    rate_hz : float
        Sampling rate.
    spin : float
        Rate s about the body's z axis, rad/s.
    precession : float
        Rate p of that axis about the vertical, rad/s.
    tilt_rad : float
        Angle between the two axes, rad.
    rest_s : float
        Rest before and after the motion, s each.
    jitter : float
        Largest displacement of a sample time, as a fraction of the sampling interval, below 0.5.
    drop_probability : float
        Chance that a sample is missing.
    rng : Generator or int, optional
        Source of randomness, or its seed.

    Returns
    -------
    Motion
        At the times that are left.

    Raises
    ------
    InvalidArgumentError
        If an argument is out of its range.

    Examples
    --------
    >>> motion = simulate_precession(4.0, 50.0, spin=1.0, precession=0.0, tilt_rad=0.0)
    >>> motion.angular_velocity[7].tolist()
    [0.0, 0.0, 1.0]
    """
    time = sample_times(duration_s, rate_hz, jitter, drop_probability, rng)
    moving, elapsed = phases(time, duration_s, rest_s)
    turns = np.multiply.outer(elapsed, [0.0, 0.0, 1.0])
    tilt = Rotation.from_rotvec([tilt_rad, 0.0, 0.0])
    orientation = Rotation.from_rotvec(precession * turns) * tilt * Rotation.from_rotvec(spin * turns)
    vertical = orientation.inv().apply([0.0, 0.0, 1.0])
    angular_velocity = precession * vertical + np.array([0.0, 0.0, spin])
    quaternion = orientation.as_quat(scalar_first=True)
    return Motion("precession", time, quaternion, np.where(moving[:, None], angular_velocity, 0.0), moving)


def _vector(name: str, values: ArrayLike, size: int) -> NDArray[np.float64]:
    vector = np.asarray(values, dtype=np.float64)
    if vector.shape != (size,) or not np.isfinite(vector).all():
        raise InvalidArgumentError(name, f"{size} finite numbers", values)
    return vector


def _unit(name: str, values: ArrayLike) -> NDArray[np.float64]:
    quaternion = _vector(name, values, 4)
    norm = np.linalg.norm(quaternion)
    if abs(norm - 1) > 1e-6:
        raise InvalidArgumentError(name, "a unit quaternion (w, x, y, z)", values, "normalise it")
    return quaternion / norm
