"""Residuals of plane measurements with exact Jacobians, and GTSAM factors made of them.

A pose is (R, t), p_world = R p_body + t, moved on the right by Exp(ω, v) as GTSAM's ``Pose3``. A plane is the
quaternion q of `planes.as_group`, moved on the right by exp(η/2) as ``Rot3``, which has no sign either: Kaess' minimal
representation.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.errors import MissingExtraError
from bingham.rotations import right_matrix
from bingham.surfaces.planes import as_group, noise_to_gaussian, plane_likelihood

__all__ = ["BinghamResidual", "GaussianResidual", "Linearised", "plane_factor"]

FloatArray = NDArray[np.float64]


IDENTITY = np.eye(4)


class Linearised(NamedTuple):
    """Residual e (3,), −log-likelihood = ½ eᵀe + const, with ∂e/∂(ω, v) (3, 6) and ∂e/∂η (3, 3)."""

    error: FloatArray
    pose_jacobian: FloatArray
    plane_jacobian: FloatArray


def _predicted(
    rotation: FloatArray, position: FloatArray, quaternion: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the plane in the body frame (4,) = h, ∂h/∂(ω, v) (4, 6) and ∂h/∂η (4, 3).

    b = Tᵀ π. A step ξ = (ω, v) of the pose gives δb = (n × ω, n·v), n the normal part of b; one of the plane gives
    δπ = ½ q ⊗ (0, η). h = b/|b|, δh = (I − h hᵀ) δb / |b|.
    """
    w, x, y, z = quaternion
    transposed = np.zeros((4, 4))
    transposed[:3, :3], transposed[3, :3], transposed[3, 3] = rotation.T, position, 1.0
    body = transposed @ np.array([x, y, z, w])
    size = math.sqrt(body @ body)
    h = body / size
    a, b, c, _ = body
    by_pose = np.array([[0.0, -c, b, 0, 0, 0], [c, 0.0, -a, 0, 0, 0], [-b, a, 0.0, 0, 0, 0], [0, 0, 0, a, b, c]])
    by_plane = transposed @ np.array([[w, -z, y], [z, w, -x], [-y, x, w], [-x, -y, -z]])
    tangent = (IDENTITY - h[:, None] * h) / size
    return h, tangent @ by_pose, tangent @ (0.5 * by_plane)


class BinghamResidual:
    """e_i = √(2|λᵢ|) vᵢᵀ h(pose, plane): ½ eᵀe is −log of the Bingham likelihood of `plane_likelihood`, exactly.

    The residual is linear in the predicted plane h and its square does not know the sign of h.
    """

    def __init__(self, measured: FloatArray, noise: Bingham) -> None:
        distribution = plane_likelihood(measured, noise)
        self._rows = np.sqrt(-2.0 * distribution.z[:3])[:, None] * distribution.M[:, :3].T

    def __call__(self, rotation: FloatArray, position: FloatArray, quaternion: FloatArray) -> Linearised:
        """Return the residual at rotation (3, 3), position (3,) and plane quaternion (4,)."""
        h, by_pose, by_plane = _predicted(rotation, position, quaternion)
        return Linearised(self._rows @ h, self._rows @ by_pose, self._rows @ by_plane)


class GaussianResidual:
    """e = Σ^{−1/2} log(h* ⊕ z), the tangent-space Gaussian of Kaess (2015) with the noise's covariance."""

    def __init__(self, measured: FloatArray, noise: Bingham) -> None:
        # r = h* ⊗ z is linear in h, whose order (n, d) is rotated round to the quaternion's (d, n).
        right = right_matrix(as_group(measured)) @ np.diag([1.0, -1.0, -1.0, -1.0])
        self._linear = np.roll(right, -1, axis=1)
        self._whiten = np.linalg.cholesky(np.linalg.inv(noise_to_gaussian(noise))).T

    def __call__(self, rotation: FloatArray, position: FloatArray, quaternion: FloatArray) -> Linearised:
        """Return the residual at rotation (3, 3), position (3,) and plane quaternion (4,)."""
        h, by_pose, by_plane = _predicted(rotation, position, quaternion)
        r = self._linear @ h
        # r and −r are one deviation: the shorter turn.
        linear, r = (-self._linear, -r) if r[0] < 0.0 else (self._linear, r)
        w, v = r[0], r[1:]
        s = math.sqrt(v @ v)
        angle = 2.0 * math.atan2(s, w)
        # ω = (angle/s) v; as r stays of unit length, ∂angle = 2 (w ∂s − s ∂w).
        factor = angle / s if s > 1e-8 else 2.0
        unit = v / s if s > 1e-8 else np.zeros(3)
        by_r = np.empty((3, 4))
        by_r[:, 0] = -2.0 * v
        by_r[:, 1:] = factor * IDENTITY[:3, :3] + (2.0 * w - factor) * unit[:, None] * unit
        chain = self._whiten @ by_r @ linear
        return Linearised(self._whiten @ (factor * v), chain @ by_pose, chain @ by_plane)


def plane_factor(pose_key: int, plane_key: int, residual: Callable[..., Linearised]) -> Any:
    """Return a ``gtsam.CustomFactor`` of a plane seen from a pose, between a ``Pose3`` and a ``Rot3`` variable.

    The ``Rot3`` is the plane's quaternion (`planes.as_group`). `residual` is a `BinghamResidual` or a
    `GaussianResidual`; its unit covariance is the factor's noise model.

    Raises
    ------
    MissingExtraError
        Without GTSAM.
    """
    try:
        import gtsam
    except ImportError as error:
        raise MissingExtraError("gtsam", "slam", "a plane factor") from error

    def evaluate(_: Any, values: Any, jacobians: list[FloatArray] | None) -> FloatArray:
        pose = values.atPose3(pose_key)
        q = values.atRot3(plane_key).toQuaternion()
        at = residual(pose.rotation().matrix(), np.asarray(pose.translation()), np.array([q.w(), q.x(), q.y(), q.z()]))
        if jacobians is not None:
            jacobians[0] = np.asfortranarray(at.pose_jacobian)
            jacobians[1] = np.asfortranarray(at.plane_jacobian)
        return at.error

    return gtsam.CustomFactor(gtsam.noiseModel.Unit.Create(3), [pose_key, plane_key], evaluate)
