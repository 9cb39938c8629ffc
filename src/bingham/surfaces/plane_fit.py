"""Least-squares planes of points with the noise of a sensor, and their covariance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.rotations import compose, conjugate
from bingham.surfaces.planes import as_group, make_plane

__all__ = ["FINEST", "WITHIN", "Plane", "fit_covariance", "fit_plane", "plane_of"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Points of a plane lie within so many standard deviations of it.
WITHIN = 3.0
# Standard deviation of a point across its surface is not taken for less, m.
FINEST = 1e-3
# Blocks along each side of a plane whose residuals are looked at together.
BLOCKS = 8


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """Plane n·p = δ, seen from the side its normal points to.

    Parameters
    ----------
    normal : ndarray, shape (3,)
        n, unit, towards the camera.
    distance : float
        δ in m, ≤ 0 where the camera is on the normal's side.
    covariance : ndarray, shape (3, 3)
        Of the rotation vector of π as a group element, body frame (`planes.gaussian_to_noise` takes it), rad².
    count : int
        Points.
    residual : float
        Root mean square distance of the points, m.
    """

    normal: FloatArray
    distance: float
    covariance: FloatArray
    count: int
    residual: float

    @property
    def vector(self) -> FloatArray:
        """π (4,), see `make_plane`."""
        return make_plane(self.normal, self.distance)

    @property
    def normal_std_deg(self) -> float:
        """Largest standard deviation of the normal's direction, degrees, from the covariance."""
        jacobian = _differences(lambda q: _split(q)[:3], as_group(self.vector))
        across = jacobian @ self.covariance @ jacobian.T
        return float(np.degrees(np.sqrt(max(np.linalg.eigvalsh(across)[-1], 0.0))))

    @property
    def distance_std(self) -> float:
        """Standard deviation of δ, m."""
        jacobian = _differences(lambda q: _split(q)[3:], as_group(self.vector))
        return float(np.sqrt(max((jacobian @ self.covariance @ jacobian.T)[0, 0], 0.0)))


def fit_plane(points: FloatArray, sigma: FloatArray, organised: bool) -> FloatArray:
    """Return (n, δ) (4,), n towards the camera: 1/z is affine in the image (organised), else total least squares."""
    keep = np.ones(len(points), dtype=bool)
    plane = np.zeros(4)
    for _ in range(4):
        p, s = points[keep], sigma[keep]
        if organised:
            rays = p / p[:, 2:]
            theta = np.linalg.lstsq(rays, 1.0 / p[:, 2], rcond=None)[0]
            size = float(np.linalg.norm(theta))
            plane = np.append(-theta / size, -1.0 / size)
        else:
            w = 1.0 / s**2
            centre = w @ p / w.sum()
            normal = np.linalg.eigh(((p - centre).T * w) @ (p - centre))[1][:, 0]
            normal = -normal if normal @ centre > 0.0 else normal
            plane = np.append(normal, normal @ centre)
        distance = np.abs(points @ plane[:3] - plane[3])
        trimmed = distance < WITHIN * np.maximum(sigma, 1.5 * np.median(distance))
        if trimmed.sum() < 10 or np.array_equal(trimmed, keep):
            break
        keep = trimmed
    return plane


def plane_of(points: FloatArray, plane: FloatArray, organised: bool, count: int) -> Plane:
    """Return the plane of ``count`` points with the covariance of its least-squares fit to some of them."""
    residual = points @ plane[:3] - plane[3]
    if organised:
        rays = points / points[:, 2:]
        theta = -plane[:3] / -plane[3]
        left = 1.0 / points[:, 2] - rays @ theta
        covariance = fit_covariance(rays, left, rays[:, :2])

        def group(t: FloatArray) -> FloatArray:
            size = np.linalg.norm(t)
            return as_group(make_plane(-t / size, -1.0 / size))

    else:
        # (e₁, e₂, δ): two small rotations of the normal and the distance.
        u = np.linalg.svd(plane[None, :3])[2][1:]
        design = np.column_stack([points @ u.T, -np.ones(len(points))])
        covariance = fit_covariance(design, residual, design[:, :2])
        theta = np.array([0.0, 0.0, plane[3]])

        def group(t: FloatArray) -> FloatArray:
            return as_group(make_plane(plane[:3] + t[0] * u[0] + t[1] * u[1], t[2]))

    origin = group(theta)
    steps = 1e-6 * np.maximum(1.0, np.abs(theta))
    jacobian = np.stack(
        [_rotation(group(theta + h * e), origin) / h for h, e in zip(steps, np.eye(3), strict=True)], axis=1
    )
    rms = float(np.sqrt(np.mean(residual**2)))
    across = np.asarray(jacobian @ covariance @ jacobian.T, dtype=np.float64)
    return Plane(plane[:3].copy(), float(plane[3]), across, count, rms)


def fit_covariance(design: FloatArray, residual: FloatArray, place: FloatArray) -> FloatArray:
    """Return the covariance of a least-squares fit whose residuals may go together where places (n, 2) are near.

    That of independent residuals, s² (XᵀX)⁻¹, times what sums over blocks of places show them to be short of (never
    less than 1): neighbours err together where a sensor rounds, where a surface is bent, or where two pass for one.
    """
    information = design.T @ design
    variance = float(residual @ residual) / max(len(residual) - 3, 1)
    low, high = place.min(axis=0), place.max(axis=0)
    cell = np.minimum((BLOCKS * (place - low) / np.maximum(high - low, 1e-12)).astype(np.int64), BLOCKS - 1)
    block = cell @ [BLOCKS, 1]
    sums = np.stack([np.bincount(block, x, BLOCKS**2) for x in (design * residual[:, None]).T], axis=1)
    # Σ over blocks of gᵀ (XᵀX)⁻¹ g is s² times the number of parameters where residuals are independent.
    excess = float(np.sum(sums * np.linalg.solve(information, sums.T).T)) / (variance * design.shape[1] + 1e-300)
    return max(excess, 1.0) * variance * np.linalg.inv(information)


def _rotation(q: FloatArray, origin: FloatArray) -> FloatArray:
    e = compose(conjugate(origin), q)
    return 2.0 * e[1:] * (1.0 if e[0] >= 0.0 else -1.0)


def _split(q: FloatArray) -> FloatArray:
    size = np.linalg.norm(q[1:])
    return np.append(q[1:] / size, -q[0] / size)


def _differences(function: Any, q: FloatArray) -> FloatArray:
    """Return ∂f/∂e (m, 3) of f(q ⊗ exp(e/2)) at e = 0."""
    h = 1e-6
    moved = [compose(q, np.append(1.0, 0.5 * h * e)) for e in np.eye(3)]
    return np.stack([(function(m / np.linalg.norm(m)) - function(q)) / h for m in moved], axis=1)
