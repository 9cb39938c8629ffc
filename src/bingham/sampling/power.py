"""Powers of rotations: v^s turns about the axis of v by s times its angle (quaternion exponentiation)."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution
from bingham.errors import InvalidArgumentError
from bingham.rotations import conjugate, from_rotation_vector, left_matrix, to_rotation_vector
from bingham.validation import check_number

__all__ = ["power", "power_jacobian", "quaternion_power", "right_jacobian"]

FloatArray = NDArray[np.float64]

# The rule of `_points`: Gauss nodes over the height of a sphere of directions, nodes along each, and their distance in
# standard deviations, at which a sum over a Gaussian density is its integral to 1e-13.
HEIGHTS, NODES, SPACING = 6, 8, 0.8


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
    inner[..., 1:, 1:] = _turned(r, exponent)
    return raised, left_matrix(raised) @ inner @ left_matrix(conjugate(q))


def _turned(r: FloatArray, exponent: float) -> FloatArray:
    """Return J (..., 3, 3): the s-th power takes exp(r) ⊗ exp(δ) to exp(s r) ⊗ exp(J δ) for small δ."""
    return exponent * right_jacobian(exponent * r) @ np.linalg.inv(right_jacobian(r))


def power(distribution: Bingham, exponent: float) -> Bingham:
    """Return the Bingham distribution with the second moment of v^s, v ~ `distribution` (d = 4, single).

    E[v^s (v^s)ᵀ] is a sum over points about the mode, plus P (E[v vᵀ] − Σ w v vᵀ) Pᵀ for what the points lack of the
    second moment, P of `power_jacobian`: s = 1 gives the distribution back. The points depend on the distribution
    alone, not on which axes stand for equal concentrations. Rotations by more than π are those by less the other way
    round: the angles of v must be known to stay below π.

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
    mode, w = distribution.mode, distribution.axis_moments
    # From the mode: (1, 0, 0, 0) is the mode, `axes` (3, 3) by columns the others.
    axes = left_matrix(conjugate(mode))[1:] @ distribution.M[:, :3]
    x, weights = _points(distribution.z[:3], axes)
    r = to_rotation_vector(mode)
    raised = from_rotation_vector(exponent * r)
    y = quaternion_power(x @ left_matrix(mode).T, exponent) @ left_matrix(conjugate(raised)).T
    moment = (y.T * weights) @ y
    lacking = -(x.T * weights) @ x
    lacking[0, 0] += w[3]
    lacking[1:, 1:] += (axes * w[:3]) @ axes.T
    turned = _turned(r, exponent)
    moment[0, 0] += lacking[0, 0]
    moment[1:, 1:] += turned @ lacking[1:, 1:] @ turned.T
    moment = 0.5 * (moment + moment.T)
    return Bingham.from_moment(moment / np.trace(moment)).rotate(left=raised)


@cache
def _directions() -> tuple[FloatArray, FloatArray]:
    """Return directions (n, 3) and weights (n,): means over them are exact for polynomials of degree 2·HEIGHTS − 1."""
    height, weight = np.polynomial.legendre.leggauss(HEIGHTS)
    around = (np.arange(2 * HEIGHTS) + 0.5) * np.pi / HEIGHTS
    h, a = (g.ravel() for g in np.meshgrid(height, around, indexing="ij"))
    radius = np.sqrt(1.0 - h * h)
    return np.column_stack([radius * np.cos(a), radius * np.sin(a), h]), np.repeat(weight, around.size)


def _points(z: FloatArray, axes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return points (m, 4) about the mode (1, 0, 0, 0), and weights (m,), for z (3,) and axes (3, 3) by columns.

    x = (cos α, sin α u) on S³ has the density exp(−κ sin²α) sin²α for an angle α and a direction u, κ = −uᵀ Z u,
    Z = axes diag(z) axesᵀ. Along u nodes at equal distances sum a smooth density of period π, and one that has
    vanished before α = π/2, to high accuracy. u = S e/|S e| with S = (3 − 2 Z)^{-1/2} spreads directions e as a narrow
    Gaussian or the uniform distribution would (du = det S |S e|⁻³ de). S is symmetric: however the axes of equal z are
    turned, it stays the same, and the points with it.
    """
    e, weight = _directions()
    u = e @ ((axes / np.sqrt(3.0 - 2.0 * z)) @ axes.T)
    length = np.sqrt(np.einsum("ni,ni->n", u, u))
    u /= length[:, None]
    kappa = -((u @ axes) ** 2 @ z)
    # κ sin²α reaches the Gaussian's κα² later; for κ < ½ all of the angles matter.
    reach = NODES * SPACING / np.sqrt(2.0 * np.maximum(kappa, 0.5))
    step = np.minimum(reach * (1.0 + 0.25 * reach**2), 0.5 * np.pi) / NODES
    angle = step[:, None] * (np.arange(NODES) + 0.5)
    sine = np.sin(angle)
    weights = ((weight * step / length**3)[:, None] * np.exp(-kappa[:, None] * sine**2) * sine**2).ravel()
    points = np.empty((*angle.shape, 4))
    points[..., 0] = np.cos(angle)
    points[..., 1:] = sine[..., None] * u[:, None]
    return points.reshape(-1, 4), weights / weights.sum()
