"""Planes as unit 4-vectors and their Bingham measurement model (Kaess 2015; Madaan, Suresh & Kalra 2017, §VI).

π = (n, −δ)/√(1 + δ²) holds the points p with n·p = δ. π and −π are one plane, so planes are axes on S³ and a Bingham
distribution is
a distribution of planes. For the group operations π is read as the quaternion (w, x, y, z) = (π₄, π₁, π₂, π₃): small
deviations are rotation vectors (3,), as in Kaess' minimal representation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.rotations import compose
from bingham.validation import unit_rows

__all__ = ["as_group", "from_group", "gaussian_to_noise", "make_plane", "noise_to_gaussian", "observation",
"plane_angle", "plane_likelihood", "split_plane", "to_body", "to_world"]  # fmt: skip

FloatArray = NDArray[np.float64]


def make_plane(normal: ArrayLike, distance: ArrayLike) -> FloatArray:
    """Return π (..., 4) of the planes n·p = δ, normals (..., 3) of any length, distances δ (...) in m.

    Examples
    --------
    >>> make_plane([0.0, 0.0, 2.0], 0.0)
    array([ 0.,  0.,  1., -0.])
    """
    n = np.asarray(normal, dtype=np.float64)
    n = n / np.linalg.norm(n, axis=-1, keepdims=True)
    delta = np.broadcast_to(np.asarray(distance, dtype=np.float64), n.shape[:-1])[..., None]
    plane = np.concatenate([n, -delta], axis=-1)
    return plane / np.linalg.norm(plane, axis=-1, keepdims=True)


def split_plane(plane: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the normals (..., 3) and distances δ ≥ 0 (...) of planes (..., 4): n points away from the origin."""
    p = np.asarray(plane, dtype=np.float64)
    p = np.where(p[..., 3:] > 0.0, -p, p)
    size = np.linalg.norm(p[..., :3], axis=-1)
    return p[..., :3] / size[..., None], -p[..., 3] / size


def plane_angle(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Return the angle arccos |a·b| (...) in [0, π/2] between planes as axes on S³, in rad, exact when small."""
    p, q = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    dot = np.sum(p * q, axis=-1, keepdims=True)
    return np.arctan2(np.linalg.norm(q - dot * p, axis=-1), np.abs(dot[..., 0]))


def to_body(rotation: ArrayLike, position: ArrayLike, plane: ArrayLike) -> FloatArray:
    """Return the plane (..., 4) in the frame of a pose: π_body ∝ Tᵀ π_world, p_world = R p_body + t.

    rotation R (..., 3, 3), position t (..., 3), plane (..., 4).
    """
    r, t, p = (np.asarray(a, dtype=np.float64) for a in (rotation, position, plane))
    n = p[..., :3]
    body = np.concatenate(
        [np.einsum("...ji,...j->...i", r, n), (p[..., 3] + np.sum(t * n, axis=-1))[..., None]], axis=-1
    )
    return body / np.linalg.norm(body, axis=-1, keepdims=True)


def to_world(rotation: ArrayLike, position: ArrayLike, plane: ArrayLike) -> FloatArray:
    """Return the plane (..., 4) in the world, the inverse of `to_body`."""
    r, t, p = (np.asarray(a, dtype=np.float64) for a in (rotation, position, plane))
    n = np.einsum("...ij,...j->...i", r, p[..., :3])
    world = np.concatenate([n, (p[..., 3] - np.sum(t * n, axis=-1))[..., None]], axis=-1)
    return world / np.linalg.norm(world, axis=-1, keepdims=True)


def as_group(plane: ArrayLike) -> FloatArray:
    """Return the quaternions (π₄, π₁, π₂, π₃) (..., 4) of planes (..., 4)."""
    return np.roll(np.asarray(plane, dtype=np.float64), 1, axis=-1)


def from_group(quaternion: ArrayLike) -> FloatArray:
    """Return the planes (..., 4) of quaternions (..., 4), the inverse of `as_group`."""
    return np.roll(np.asarray(quaternion, dtype=np.float64), -1, axis=-1)


def _check_noise(noise: Bingham) -> None:
    if noise.dim != 4 or noise.shape:
        raise InvalidArgumentError("noise", "a single distribution of quaternions, d = 4", repr(noise))


def observation(
    plane: ArrayLike, noise: Bingham, size: int | None = None, *, rng: np.random.Generator | int | None = None
) -> FloatArray:
    """Return noisy measurements π ⊕ v (size, 4), v ~ `noise`, of a plane (4,) in the sensor's frame."""
    _check_noise(noise)
    return from_group(compose(as_group(unit_rows(plane, 4, "plane")), noise.rvs(size, rng=rng)))


def plane_likelihood(measured: ArrayLike, noise: Bingham) -> Bingham:
    """Return the distribution of the true plane given a measured one z, flat prior: the base one rotated there.

    f(π | z) = exp(πᵀ (z ∘ V₀) Λ₀ (z ∘ V₀)ᵀ π) / F(Λ₀): every axis of the noise distribution, which has its mode at the
    identity quaternion, is multiplied from the left by z (Madaan et al. 2017, §VI). Its `matrix` is the likelihood
    matrix.

    The report's noise acts on the right of the truth; z = π ⊕ v gives π = z ⊕ v*, hence the conjugated axes, which is
    the same distribution when the noise has its mode at the identity.

    Parameters
    ----------
    measured : (4,) array_like
        Measured plane in the sensor's frame.
    noise : Bingham
        Distribution of v, quaternions.
    """
    _check_noise(noise)
    z = as_group(unit_rows(measured, 4, "measured"))
    distribution = noise.inverse().rotate(left=z)
    return Bingham(distribution.z, np.roll(distribution.M, -1, axis=-2))


def noise_to_gaussian(noise: Bingham) -> FloatArray:
    """Return the covariance (3, 3), rad², of the rotation vector of the noise, in the frame of the measured plane."""
    _check_noise(noise)
    return noise.covariance(frame="body")


def gaussian_to_noise(covariance: ArrayLike) -> Bingham:
    """Return the noise distribution with mode at the identity and the tangent-space covariance (3, 3), rad²."""
    return Bingham.from_covariance([1.0, 0.0, 0.0, 0.0], covariance, frame="body")
