"""A rendered room: planar rectangles seen by a pinhole depth camera, with the noise of a structured-light sensor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["DepthCamera", "DepthView", "Rectangle", "axial_noise", "box", "corridor", "random_room", "render"]

FloatArray = NDArray[np.float64]


class Rectangle(NamedTuple):
    """Centre (3,), half edges u and v (3,), m, world frame with z up; its normal u × v is the side that is seen."""

    centre: FloatArray
    u: FloatArray
    v: FloatArray

    @property
    def normal(self) -> FloatArray:
        """Unit normal (3,)."""
        n = np.cross(self.u, self.v)
        return n / np.linalg.norm(n)


@dataclass(frozen=True)
class DepthCamera:
    """Pinhole camera: focal lengths and principal point in pixels, image size, and its pose in the world.

    `rotation` (3, 3) has the camera's x (right), y (down) and z (forward) axes as columns; `position` (3,) in m.
    """

    rotation: FloatArray
    position: FloatArray
    width: int = 640
    height: int = 480
    focal: float = 525.0

    @property
    def intrinsics(self) -> tuple[float, float, float, float]:
        """The tuple fx, fy, cx, cy."""
        return self.focal, self.focal, 0.5 * (self.width - 1), 0.5 * (self.height - 1)

    @classmethod
    def looking(cls, position: Any, target: Any, **size: Any) -> DepthCamera:
        """Return a camera at `position` (3,) looking at `target` (3,), upright."""
        p = np.asarray(position, dtype=np.float64)
        forward = np.asarray(target, dtype=np.float64) - p
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        return cls(np.stack([right, np.cross(forward, right), forward], axis=1), p, **size)


class DepthView(NamedTuple):
    """An image: noisy depth (H, W) in m, 0 = no data; the true depth; label (H, W) of the rectangle seen, −1 = none;
    and the rectangles' normals (P, 3) in the camera's frame."""  # noqa: D205, D209

    depth: FloatArray
    true_depth: FloatArray
    label: NDArray[np.int64]
    normals: FloatArray


def axial_noise(depth: FloatArray) -> FloatArray:
    """Return a Kinect's standard deviation of depth, m: 0.0012 + 0.0019 (z − 0.4)² (Nguyen, Izadi & Lovell 2012)."""
    return 0.0012 + 0.0019 * (depth - 0.4) ** 2


def box(centre: Any, size: Any, *, inside: bool = False, turn: float = 0.0) -> list[Rectangle]:
    """Return the six faces of a box of edges `size` (3,) m, rotated about z by `turn` rad."""
    c, half = np.asarray(centre, dtype=np.float64), 0.5 * np.asarray(size, dtype=np.float64)
    cos, sin = np.cos(turn), np.sin(turn)
    axes = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    faces: list[Rectangle] = []
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for sign in (1.0, -1.0):
            u, v = half[j] * axes[j], half[k] * axes[k]
            if (sign < 0.0) != inside:
                u, v = v, u
            faces.append(Rectangle(c + sign * half[i] * axes[i], u, v))
    return faces


def corridor() -> tuple[list[Rectangle], DepthCamera]:
    """Return a room with both long walls in view, a cabinet, a rotated box, a leaning board, and a camera in it."""
    scene = box([2.5, 0.0, 1.3], [6.0, 2.6, 2.6], inside=True)
    scene += box([3.6, -0.95, 0.5], [0.8, 0.6, 1.0])
    scene += box([4.2, 0.85, 0.35], [0.7, 0.7, 0.7], turn=np.deg2rad(38.0))
    lean = np.deg2rad(35.0)
    up = np.array([np.sin(lean), 0.0, np.cos(lean)])
    scene.append(Rectangle(np.array([4.9, -0.35, 0.75]), 0.75 * up, np.array([0.0, 0.35, 0.0])))
    return scene, DepthCamera.looking([0.3, 0.1, 1.5], [4.0, -0.05, 0.95])


def random_room(rng: Any = None, **size: Any) -> tuple[list[Rectangle], DepthCamera]:
    """Return a room of random size with one to three boxes in it, and a camera in it (``size`` as `DepthCamera`)."""
    g = np.random.default_rng(rng)
    room = g.uniform([3.5, 2.4, 2.4], [7.0, 5.0, 3.2])
    scene = box([0.5 * room[0] - 0.5, 0.0, 0.5 * room[2]], room, inside=True)
    for _ in range(g.integers(1, 4)):
        edges = g.uniform(0.4, 1.0, 3)
        side = 0.5 * room[1] - 0.6
        place = [g.uniform(1.8, room[0] - 1.2), g.uniform(-side, side), 0.5 * edges[2]]
        scene += box(place, edges, turn=g.uniform(0.0, 1.5))
    position = [0.0, g.uniform(-0.5, 0.5), g.uniform(1.0, 1.8)]
    return scene, DepthCamera.looking(position, [4.0, g.uniform(-1.0, 1.0), g.uniform(0.4, 1.4)], **size)


def render(
    scene: list[Rectangle], camera: DepthCamera, *, noise: float = 1.0, missing: float = 0.01, rng: Any = None
) -> DepthView:
    """Ray-cast the scene; add Gaussian depth noise of `noise` times `axial_noise` and lose a share `missing` of pixels.

    Surfaces seen at more than 80° from their normal give no data, as with a structured-light sensor.
    """
    generator = np.random.default_rng(rng)
    fx, fy, cx, cy = camera.intrinsics
    v, u = np.indices((camera.height, camera.width))
    rays = np.stack([(u - cx) / fx, (v - cy) / fy, np.ones(u.shape)], axis=-1)
    depth = np.full(u.shape, np.inf)
    label = np.full(u.shape, -1, dtype=np.int64)
    grazing = np.zeros(u.shape, dtype=bool)
    length = np.linalg.norm(rays, axis=-1)
    normals = np.array([face.normal @ camera.rotation for face in scene])
    for k, face in enumerate(scene):
        centre, a, b = ((vector @ camera.rotation) for vector in (face.centre - camera.position, face.u, face.v))
        slope = rays @ normals[k]
        with np.errstate(divide="ignore", invalid="ignore"):
            z = (centre @ normals[k]) / slope
            point = rays * z[..., None] - centre
            hit = (slope < 0.0) & (z > 0.0) & (z < depth)
            hit &= (np.abs(point @ a) <= a @ a) & (np.abs(point @ b) <= b @ b)
        depth[hit] = z[hit]
        label[hit] = k
        grazing[hit] = (-slope < np.cos(np.deg2rad(80.0)) * length)[hit]
    true_depth = np.where(label >= 0, depth, 0.0)
    noisy = true_depth + noise * axial_noise(true_depth) * generator.standard_normal(depth.shape)
    lost = grazing | (label < 0) | (generator.random(depth.shape) < missing) | (noisy <= 0.0)
    return DepthView(np.where(lost, 0.0, noisy), true_depth, label, normals)
