"""A robot's loop through four rooms, with odometry and the walls, floors and ceilings it measures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from bingham.distributions.bingham import Bingham
from bingham.surfaces.planar_slam import PlanarMeasurements
from bingham.surfaces.planes import make_plane, observation, to_body

__all__ = ["RoomsRun", "four_rooms"]

FloatArray = NDArray[np.float64]

# Inner faces of the walls: two rooms along x, two along y, 0.2 m of wall between them.
X_WALLS = ((0.0, 4.9), (5.1, 10.0))
Y_WALLS = ((0.0, 3.9), (4.1, 8.0))
CEILING = 2.6
CAMERA_HEIGHT = 1.2


@dataclass(frozen=True, slots=True, eq=False)
class RoomsRun:
    """The truth, in the frame of the first pose, and what was measured.

    rotations (T, 3, 3) body → first body, positions (T, 3) m, planes (P, 4).
    """

    rotations: FloatArray
    positions: FloatArray
    planes: FloatArray
    measurements: PlanarMeasurements


def four_rooms(
    plane_noise: Bingham,
    *,
    poses: int = 48,
    odometry_sigma: tuple[float, float] = (np.deg2rad(1.0), 0.04),
    rng: Any = None,
) -> RoomsRun:
    """Simulate one loop through four rooms; every pose measures the four walls, the floor and the ceiling of its room.

    Parameters
    ----------
    plane_noise : Bingham
        Distribution v of a measured plane π ⊕ v, quaternions with mode at the identity.
    poses : int
        Number of poses on the loop, the first and the last near the same place.
    odometry_sigma : tuple of float
        Standard deviations of a rotation (rad) and a step (m), each axis.
    rng : None, int or numpy.random.Generator
        Passed to ``numpy.random.default_rng``.
    """
    generator = np.random.default_rng(rng)
    phase = np.linspace(0.0, 2.0 * np.pi, poses)
    world = np.stack([5.0 + 2.6 * np.cos(phase), 4.0 + 2.1 * np.sin(phase), np.full(poses, CAMERA_HEIGHT)], axis=1)
    heading = np.arctan2(2.1 * np.cos(phase), -2.6 * np.sin(phase))
    sway = 0.05 * np.sin(5.0 * phase)
    attitude = Rotation.from_euler("ZYX", np.stack([heading, sway, 0.6 * sway[::-1]], axis=1)).as_matrix()
    rotations = attitude[0].T @ attitude
    positions = (world - world[0]) @ attitude[0]

    # Odometry is drawn first, so that the same seed gives the same odometry for every plane noise.
    turn_noise = Rotation.from_rotvec(odometry_sigma[0] * generator.standard_normal((poses - 1, 3))).as_matrix()
    turns = np.swapaxes(rotations[:-1], 1, 2) @ rotations[1:] @ turn_noise
    steps = np.einsum("tji,tj->ti", rotations[:-1], np.diff(positions, axis=0))
    steps += odometry_sigma[1] * generator.standard_normal(steps.shape)

    axes = np.eye(3)
    x_faces = [make_plane(axes[0], c) for pair in X_WALLS for c in pair]
    y_faces = [make_plane(axes[1], c) for pair in Y_WALLS for c in pair]
    planes = to_body(
        attitude[0], world[0], np.array([*x_faces, *y_faces, make_plane(axes[2], 0.0), make_plane(axes[2], CEILING)])
    )
    pose_index: list[int] = []
    plane_index: list[int] = []
    for t in range(poses):
        column, row = int(world[t, 0] > 5.0), int(world[t, 1] > 4.0)
        pose_index += [t] * 6
        plane_index += [2 * column, 2 * column + 1, 4 + 2 * row, 5 + 2 * row, 8, 9]
    seen = [
        observation(to_body(rotations[t], positions[t], planes[k]), plane_noise, rng=generator)
        for t, k in zip(pose_index, plane_index, strict=True)
    ]
    measurements = PlanarMeasurements(
        turns, steps, odometry_sigma, np.array(pose_index), np.array(plane_index), np.array(seen)
    )
    return RoomsRun(rotations, positions, planes, measurements)
