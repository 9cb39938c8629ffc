"""Unit normals of depth images, organised clouds and loose point clouds, rotated towards the viewer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import uniform_filter
from scipy.spatial import KDTree

from bingham.errors import InvalidArgumentError

__all__ = ["Normals", "back_project", "cloud_normals", "organised_normals", "window_axes"]

FloatArray = NDArray[np.float64]

# A window with fewer valid pixels than this share says nothing.
LEAST_SHARE = 0.3


class Normals(NamedTuple):
    """Unit normals (..., 3) towards the viewer, NaN where undefined, and the residual (...) of the plane fits.

    The residual is the standard deviation from the fitted plane: of the inverse depth (1/m) for organised clouds, of
    the distance (m) for loose ones.
    """

    normals: FloatArray
    residual: FloatArray


def back_project(depth: ArrayLike, fx: float, fy: float, cx: float, cy: float) -> FloatArray:
    """Return points (H, W, 3) of a depth image (H, W) in m; 0 or NaN is no data.

    Camera frame: x right, y down, z forward.
    Pixel (row v, column u) sees along ((u − cx)/fx, (v − cy)/fy, 1).
    """
    z = np.array(depth, dtype=np.float64)
    if z.ndim != 2:
        raise InvalidArgumentError("depth", "an image (H, W)", z.shape)
    z[~(z > 0.0)] = np.nan
    v, u = np.indices(z.shape)
    return np.stack([(u - cx) / fx * z, (v - cy) / fy * z, z], axis=-1)


def organised_normals(points: ArrayLike, *, radius: int = 5) -> Normals:
    """Return normals of an organised cloud by fitting planes in windows of (2 radius + 1)² pixels.

    A plane n·p = δ is affine in the image, 1/z = a x/z + b y/z + c with n ∝ (a, b, c), and a depth camera's noise is
    about constant in 1/z: an ordinary least-squares fit. Each pixel takes, of the nine windows that reach it (centred
    on it or shifted by `radius`), the one that fits best, so that edges and corners stay sharp (Kuwahara's idea).

    Parameters
    ----------
    points : (H, W, 3) array_like
        Metres, camera frame, z forward; NaN, infinity or z ≤ 0 is no data.
    radius : int
        Half width of a window in pixels.
    """
    p = np.asarray(points, dtype=np.float64)
    if p.ndim != 3 or p.shape[-1] != 3:
        raise InvalidArgumentError("points", "an organised cloud (H, W, 3)", p.shape)
    if radius < 1:
        raise InvalidArgumentError("radius", "at least one pixel", radius)
    valid = np.all(np.isfinite(p), axis=-1) & (p[..., 2] > 0.0)
    z = np.where(valid, p[..., 2], 1.0)
    x, y, rho = np.where(valid, p[..., 0] / z, 0.0), np.where(valid, p[..., 1] / z, 0.0), np.where(valid, 1.0 / z, 0.0)
    mask = valid.astype(np.float64)

    def mean(image: FloatArray) -> FloatArray:
        return uniform_filter(image, 2 * radius + 1, mode="constant")

    share = mean(mask)
    enough = share > LEAST_SHARE
    n = np.where(enough, share, 1.0)
    mx, my, mr = mean(x) / n, mean(y) / n, mean(rho) / n
    xx, xy, yy = mean(x * x) / n - mx * mx, mean(x * y) / n - mx * my, mean(y * y) / n - my * my
    xr, yr, rr = mean(x * rho) / n - mx * mr, mean(y * rho) / n - my * mr, mean(rho * rho) / n - mr * mr
    det = xx * yy - xy * xy
    enough &= det > 1e-6 * (xx + yy) ** 2
    det = np.where(enough, det, 1.0)
    a, b = (xr * yy - yr * xy) / det, (yr * xx - xr * xy) / det
    normal = np.stack([a, b, mr - a * mx - b * my], axis=-1)
    residual = np.where(enough, np.sqrt(np.maximum(rr - a * xr - b * yr, 0.0)), np.inf)
    best, chosen = _best_of_windows(normal, residual, radius)
    usable = valid & np.isfinite(chosen)
    # 1/z > 0 means n·p = 1 > 0: the fitted n points away from the camera.
    best /= -np.where(usable, np.linalg.norm(best, axis=-1), 1.0)[..., None]
    return Normals(np.where(usable[..., None], best, np.nan), np.where(usable, chosen, np.nan))


def _best_of_windows(normal: FloatArray, residual: FloatArray, radius: int) -> tuple[FloatArray, FloatArray]:
    """Return for every pixel the fit with the smallest residual among the windows centred 0 or ± radius away."""
    best, chosen = np.array(normal), np.array(residual)
    h, w = residual.shape
    for dv in (-radius, 0, radius):
        for du in (-radius, 0, radius):
            if dv == du == 0:
                continue
            to = (slice(max(0, -dv), min(h, h - dv)), slice(max(0, -du), min(w, w - du)))
            at = (slice(max(0, dv), min(h, h + dv)), slice(max(0, du), min(w, w + du)))
            better = residual[at] < chosen[to]
            chosen[to] = np.where(better, residual[at], chosen[to])
            best[to] = np.where(better[..., None], normal[at], best[to])
    return best, chosen


def cloud_normals(points: ArrayLike, *, neighbours: int = 20, viewpoint: ArrayLike = (0.0, 0.0, 0.0)) -> Normals:
    """Return normals of a loose cloud: the smallest principal axis of each point's nearest neighbours.

    Parameters
    ----------
    points : (n, 3) array_like
        Metres, finite.
    neighbours : int
        Number of nearest points, the point itself included; at least 3.
    viewpoint : (3,) array_like
        Where the sensor stood: normals point towards it.
    """
    p = np.asarray(points, dtype=np.float64)
    if p.ndim != 2 or p.shape[1] != 3 or not np.all(np.isfinite(p)):
        raise InvalidArgumentError("points", "finite, shape (n, 3)", p.shape, "drop rows without data first")
    if not 3 <= neighbours <= len(p):
        raise InvalidArgumentError("neighbours", f"3 to n = {len(p)}", neighbours)
    deviations, normal = window_axes(p, KDTree(p), p, neighbours)
    sight = np.asarray(viewpoint, dtype=np.float64) - p
    normal = np.where(np.sum(normal * sight, axis=1, keepdims=True) < 0.0, -normal, normal)
    return Normals(normal, deviations[:, 0])


def window_axes(points: FloatArray, tree: KDTree, at: FloatArray, neighbours: int) -> tuple[FloatArray, FloatArray]:
    """Return the deviations (m, 3), ascending, along the principal axes of the points nearest to each of ``at`` (m, 3).

    And the unit axis (m, 3) of the smallest, of either sign.
    """
    around = points[tree.query(at, neighbours)[1]]
    around -= around.mean(axis=1, keepdims=True)
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around) / neighbours)
    return np.sqrt(np.maximum(values, 0.0)), vectors[..., 0]
