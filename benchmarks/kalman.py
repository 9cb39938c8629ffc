"""A quaternion Kalman filter in plain NumPy, written as one would write it, to time the object API against.

The error is a small rotation vector in the body frame; the state is a unit quaternion and its 3×3 covariance.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class State(NamedTuple):
    """Mean quaternion (4,) and covariance (3, 3), rad²."""

    q: np.ndarray
    covariance: np.ndarray


def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the Hamilton product p ⊗ q."""
    a, b, c, d = p
    w, x, y, z = q
    return np.array(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ]
    )


def exponential(v: np.ndarray) -> np.ndarray:
    """Return the quaternion of the rotation vector v."""
    half = 0.5 * np.linalg.norm(v)
    s = 0.5 if half < 1e-8 else 0.5 * np.sin(half) / half
    return np.array([np.cos(half), *(s * v)])


def logarithm(q: np.ndarray) -> np.ndarray:
    """Return the rotation vector, of at most half a rotation, of the quaternion q."""
    if q[0] < 0.0:
        q = -q
    n = np.linalg.norm(q[1:])
    return 2.0 * q[1:] if n < 1e-8 else 2.0 * np.arctan2(n, q[0]) / n * q[1:]


def checked(q: np.ndarray) -> np.ndarray:
    """Return q normalised, after the checks that a library has to make."""
    q = np.asarray(q, dtype=float)
    if q.shape != (4,):
        raise ValueError(f"expected shape (4,), got {q.shape}")
    n = np.linalg.norm(q)
    if not abs(n - 1.0) < 1e-6:
        raise ValueError(f"expected a unit quaternion, got norm {n}")
    return q / n


def predict(state: State, noise: np.ndarray) -> State:
    """Identity motion: the covariance grows by noise (3, 3)."""
    return State(state.q, state.covariance + noise)


def update(state: State, z: np.ndarray, noise: np.ndarray) -> tuple[State, float]:
    """Return the posterior of the measured orientation z and the log-evidence of the innovation."""
    z = checked(z)
    conjugate = state.q * np.array([1.0, -1.0, -1.0, -1.0])
    innovation = logarithm(product(conjugate, z))
    s = state.covariance + noise
    inverse = np.linalg.inv(s)
    gain = state.covariance @ inverse
    q = product(state.q, exponential(gain @ innovation))
    left = np.eye(3) - gain
    covariance = left @ state.covariance @ left.T + gain @ noise @ gain.T
    evidence = -0.5 * (innovation @ inverse @ innovation + np.linalg.slogdet(2.0 * np.pi * s)[1])
    return State(q / np.linalg.norm(q), 0.5 * (covariance + covariance.T)), evidence
