"""Powers of rotations: v^s turns about the axis of v by s times its angle (quaternion exponentiation)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution
from bingham.errors import InvalidArgumentError
from bingham.rotations import conjugate, from_rotation_vector, left_matrix, to_rotation_vector
from bingham.sampling.riemannian import RiemannianSampling
from bingham.validation import check_number

__all__ = ["power", "power_jacobian", "quaternion_power", "right_jacobian"]

FloatArray = NDArray[np.float64]

# Points that stand for a distribution whose power is taken.
POINTS = 60


def quaternion_power(v: ArrayLike, exponent: float) -> FloatArray:
    """Return v^s = exp(s log v) (..., 4) for unit quaternions v (..., 4); of ±v the one with an angle in [0, π].

    Examples
    --------
    >>> quaternion_power([0.0, 0.0, 0.0, 1.0], 0.5).round(6)
    array([0.707107, 0.      , 0.      , 0.707107])
    """
    return from_rotation_vector(exponent * to_rotation_vector(v))


def right_jacobian(r: FloatArray) -> FloatArray:
    """Return J (..., 3, 3) with exp(r + δ) ≈ exp(r) ⊗ exp(J δ) for rotation vectors r (..., 3)."""
    square = np.sum(r * r, axis=-1)[..., None, None]
    angle = np.sqrt(square)
    x, y, z = r[..., 0], r[..., 1], r[..., 2]
    o = np.zeros_like(x)
    cross = np.stack([o, -z, y, z, o, -x, -y, x, o], axis=-1).reshape(*x.shape, 3, 3)
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    first = 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    second = np.where(small, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
    return np.eye(3) - first * cross + second * cross @ cross


def power_jacobian(v: ArrayLike, exponent: float) -> tuple[FloatArray, FloatArray]:
    """Return v^s (..., 4) and P (..., 4, 4) with (v + δ)^s ≈ P (v + δ), up to length, for unit v (..., 4), small δ.

    About v, δ is a rotation vector, which the power multiplies by J = s Jᵣ(sφ) Jᵣ(φ)⁻¹, φ = log v and Jᵣ the right
    Jacobian of the rotation group: P = L(v^s) diag(1, J) L(v)ᵀ, the identity for s = 1.
    """
    q = np.asarray(v, dtype=np.float64)
    r = to_rotation_vector(q)
    raised = from_rotation_vector(exponent * r)
    inner = np.zeros((*q.shape, 4))
    inner[..., 0, 0] = 1.0
    inner[..., 1:, 1:] = exponent * right_jacobian(exponent * r) @ np.linalg.inv(right_jacobian(r))
    return raised, left_matrix(raised) @ inner @ left_matrix(conjugate(q))


def power(distribution: Bingham, exponent: float) -> Bingham:
    """Return the Bingham distribution with the second moment of v^s, v ~ `distribution` (d = 4, single).

    E[v^s (v^s)ᵀ] is the mean over deterministic samples with the exact second moment of v (`RiemannianSampling`), so
    that s = 1 gives the distribution back. Rotations by more than π are those by less the other way round: the angles
    of v must be known to stay below π.

    Parameters
    ----------
    distribution : Bingham
        Of unit quaternions.
    exponent : float
        s, finite.

    Examples
    --------
    >>> p = Bingham([-800.0, -800.0, -800.0, 0.0], np.eye(4)[:, ::-1])
    >>> power(p, 0.5).z.round(-1)
    array([-3200., -3200., -3200.,     0.])
    """
    check_distribution(distribution, "distribution")
    check_number(exponent, "exponent", "a finite number")
    if distribution.dim != 4 or distribution.shape:
        raise InvalidArgumentError("distribution", "a single distribution of quaternions, d = 4", repr(distribution))
    if exponent == 1.0:
        return distribution
    x = quaternion_power(RiemannianSampling(POINTS).sample(distribution).points, exponent)
    moment = x.T @ x / POINTS
    return Bingham.from_moment(0.5 * (moment + moment.T))
