"""Planes of a depth image or a point cloud: normals → directions (Bingham mixtures) → planes with covariance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from bingham.errors import InvalidArgumentError
from bingham.rotations import compose, conjugate
from bingham.surfaces.normals import cloud_normals, organised_normals
from bingham.surfaces.planes import as_group, make_plane
from bingham.surfaces.segmentation import fit_directions
from bingham.validation import as_numbers

__all__ = ["Plane", "PlaneSegments", "find_planes"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Points of a plane lie within so many standard deviations of it, neighbours within so many of each other.
WITHIN, LINKED = 3.0, 4.0
# A point whose normal is farther from the plane's, rad, does not belong to it; and parallel planes that are one.
TURNED, ALIKE = np.deg2rad(30.0), np.deg2rad(4.0)
ROUNDS = 3
# A place on a plane that is within so many standard deviations of another plane may hold points of either.
EDGE = 4.0
# Noise of the points over that of the windows they are estimated from, at most.
WIDEST = 1.6
# Blocks along each side of a plane whose residuals are looked at together.
BLOCKS = 8
# Pieces of a plane may be off it by so many standard deviations, and by such a share of the depth.
PIECE, BENT = 4.0, 0.003
NEIGHBOURS = 12
# Standard deviation of a point across its surface is not taken for less, m.
FINEST = 1e-3
# Directions of the scene that are looked for, and how often in what no plane has explained.
DIRECTIONS, PASSES = range(2, 9), 3


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


@dataclass(frozen=True, slots=True, eq=False)
class PlaneSegments:
    """Planes, largest first, and the index of each point's plane, −1 for none: (H, W) or (n,)."""

    planes: list[Plane]
    label: IntArray


def find_planes(
    points: ArrayLike, *, normals: ArrayLike | None = None, min_share: float = 0.01, noise: float | None = None,
    rng: Any = None,
) -> PlaneSegments:  # fmt: skip
    """Find the planes of an organised or a loose point cloud.

    Normals get directions by a Bingham mixture with signs (`fit_directions`). Neighbours of one direction that are not
    offset along it are one surface: parallel planes are apart. Surfaces get planes by least squares, surfaces of one
    plane are joined, planes gather the points near them; what is left is searched again.

    Parameters
    ----------
    points : (H, W, 3) or (n, 3) array_like
        Metres, camera frame with z forward; rows of NaN or z ≤ 0 of an organised cloud are no data.
    normals : (H, W, 3) or (n, 3) array_like, optional
        Unit normals towards the camera; estimated unless given.
    min_share : float
        Planes with less of the points are none.
    noise : float, optional
        Standard deviation of the inverse depth, 1/m (organised), or of a point, m (loose); estimated unless given.
    rng : None, int or numpy.random.Generator
        Passed to ``numpy.random.default_rng``.
    """
    p = as_numbers(points, "points")
    if p.ndim not in (2, 3) or p.shape[-1] != 3:
        raise InvalidArgumentError("points", "an organised cloud (H, W, 3) or a loose one (n, 3)", p.shape)
    if not 0.0 < min_share < 1.0:
        raise InvalidArgumentError("min_share", "a share in (0, 1)", min_share)
    organised = p.ndim == 3
    flat = p.reshape(-1, 3)
    usable: Any = np.isfinite(flat).all(axis=1)
    if organised:
        usable = usable & (flat[:, 2] > 0.0)
    if usable.sum() < 50:
        raise InvalidArgumentError("points", "at least 50 points", int(usable.sum()))
    n, spread = _normals(p, usable, organised)
    if normals is not None:
        n = as_numbers(normals, "normals").reshape(-1, 3)
    sigma = np.full(len(flat), np.inf)
    level = float(np.nanmedian(spread)) if noise is None else float(noise)
    depth = flat[usable, 2] if organised else np.ones(int(usable.sum()))
    # Noise of the inverse depth is that of the depth over its square.
    sigma[usable] = np.maximum(FINEST, level * (depth**2 if organised else 1.0))
    links = _grid_links(p.shape[:2], usable) if organised else _cloud_links(flat, usable)
    minimum = max(20, int(min_share * usable.sum()))
    return _search(flat, n, sigma, noise is None, usable, links, p.shape[:-1], minimum, organised, rng)


def _normals(p: FloatArray, usable: NDArray[np.bool_], organised: bool) -> tuple[FloatArray, FloatArray]:
    if organised:
        found = organised_normals(p, radius=max(3, min(p.shape[:2]) // 80))
        return found.normals.reshape(-1, 3), found.residual.ravel()
    flat = p.reshape(-1, 3)
    normals, spread = np.full(flat.shape, np.nan), np.full(len(flat), np.nan)
    found = cloud_normals(flat[usable], neighbours=min(20, int(usable.sum())))
    normals[usable], spread[usable] = found.normals, found.residual
    return normals, spread


def _grid_links(shape: tuple[int, ...], usable: NDArray[np.bool_]) -> IntArray:
    index = np.arange(shape[0] * shape[1]).reshape(shape)
    pairs = [(index[:, :-1], index[:, 1:]), (index[:-1], index[1:])]
    links = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in pairs])
    return links[usable[links].all(axis=1)]


def _cloud_links(flat: FloatArray, usable: NDArray[np.bool_]) -> IntArray:
    rows = np.flatnonzero(usable)
    nearest: Any = KDTree(flat[rows]).query(flat[rows], min(NEIGHBOURS, len(rows)))[1]
    near = nearest[:, 1:]
    return np.stack([np.repeat(rows, near.shape[1]), rows[near.ravel()]], axis=1)


def _search(
    flat: FloatArray, normals: FloatArray, sigma: FloatArray, estimated: bool, usable: NDArray[np.bool_],
    links: IntArray, shape: tuple[int, ...], minimum: int, organised: bool, rng: Any,
) -> PlaneSegments:  # fmt: skip
    generator = np.random.default_rng(rng)
    thetas: list[FloatArray] = []
    label, first = np.full(len(flat), -1), sigma
    for _ in range(PASSES):
        left = usable & (label < 0) & np.isfinite(normals).all(axis=1)
        if left.sum() < minimum:
            break
        directions = fit_directions(normals[left], DIRECTIONS, restarts=2, rng=generator)
        of = np.full(len(flat), -1)
        of[left] = directions.predict(normals[left])
        fresh = _surfaces(flat, of, directions.directions, sigma, links, minimum)
        if not fresh:
            break
        fitted = [_fit(flat[rows], sigma[rows], organised) for rows in fresh]
        thetas = _joined([*thetas, *fitted], flat, sigma, label, fresh)
        for _ in range(ROUNDS):
            label = _gathered(flat, normals, sigma, usable, thetas)
            kept = [k for k in range(len(thetas)) if np.sum(label == k) >= minimum]
            clear = [_clear(flat, sigma, label == k, k, thetas, organised, minimum) for k in kept]
            thetas = [_fit(flat[rows], sigma[rows], organised) for rows in clear]
            if estimated and thetas:
                sigma = first * np.clip(_scale(flat, first, clear, thetas), 1.0, WIDEST)
        pieces = _connected(_gathered(flat, normals, sigma, usable, thetas), links, minimum)
        label = np.full(len(flat), -1)
        for k, parts in pieces.items():
            for rows in _of_one_plane(flat, sigma, parts, thetas[k], organised):
                label[rows] = k
    order = np.argsort([-np.sum(label == k) for k in range(len(thetas))], kind="stable")
    planes: list[Plane] = []
    final = np.full(len(flat), -1)
    for k in order:
        rows = label == k
        if rows.sum() >= minimum:
            final[rows] = len(planes)
            clear = _clear(flat, sigma, rows, int(k), thetas, organised, minimum)
            planes.append(_plane(flat[clear], _fit(flat[clear], sigma[clear], organised), organised, int(rows.sum())))
    return PlaneSegments(planes, final.reshape(shape))


def _surfaces(
    flat: FloatArray, of: IntArray, directions: FloatArray, sigma: FloatArray, links: IntArray, minimum: int
) -> list[IntArray]:
    """Return the points of each connected piece of one direction, neighbours not offset along it."""
    a, b = links.T
    same = (of[a] >= 0) & (of[a] == of[b])
    a, b = a[same], b[same]
    offset = np.abs(np.sum((flat[a] - flat[b]) * directions[of[a]], axis=1))
    near = offset < LINKED * np.minimum(sigma[a], sigma[b]) + 2.0 * FINEST
    return _pieces(len(flat), a[near], b[near], minimum)


def _pieces(size: int, a: IntArray, b: IntArray, minimum: int) -> list[IntArray]:
    graph = coo_array((np.ones(len(a), dtype=bool), (a, b)), shape=(size, size))
    piece = connected_components(graph, directed=False)[1]
    counts = np.bincount(piece)
    return [np.flatnonzero(piece == k) for k in np.flatnonzero(counts >= minimum)]


def _connected(label: IntArray, links: IntArray, minimum: int) -> dict[int, list[IntArray]]:
    """Return the connected pieces of each plane, largest first, without those that are too small to be surfaces."""
    a, b = links[(label[links[:, 0]] == label[links[:, 1]]) & (label[links[:, 0]] >= 0)].T
    found: dict[int, list[IntArray]] = {}
    for rows in sorted(_pieces(len(label), a, b, max(20, minimum // 10)), key=len, reverse=True):
        if label[rows[0]] >= 0:
            found.setdefault(int(label[rows[0]]), []).append(rows)
    return found


def _of_one_plane(
    flat: FloatArray, sigma: FloatArray, pieces: list[IntArray], plane: FloatArray, organised: bool
) -> list[IntArray]:
    """Return the pieces that lie in the plane of the largest: parallel surfaces a little apart are not one.

    The mean offset of a piece may be so many of its standard deviations, the largest one's plane's included, and what a
    sensor's own bending leaves.
    """
    largest = pieces[0]
    if len(pieces) == 1:
        return pieces
    plane = _fit(flat[largest], sigma[largest], organised)
    normal, delta = plane[:3], plane[3]

    def seen(rows: IntArray) -> tuple[FloatArray, FloatArray]:
        """Design of the fit, and residuals: of the inverse depth (organised), or of the distance."""
        p = flat[rows]
        if organised:
            rays = p / p[:, 2:]
            return rays, 1.0 / p[:, 2] - rays @ normal / delta
        u = np.linalg.svd(normal[None])[2][1:]
        return np.column_stack([p @ u.T, np.ones(len(p))]), p @ normal - delta

    design, residual = seen(largest)
    covariance = _fit_covariance(design, residual, design[:, :2])
    kept = [largest]
    for rows in pieces[1:]:
        design, residual = seen(rows)
        at = design.mean(axis=0)
        std = np.sqrt(at @ covariance @ at + np.var(residual) / len(rows))
        depth = float(np.median(flat[rows, 2])) if organised else float(np.linalg.norm(flat[rows].mean(axis=0)))
        bent = BENT / depth if organised else BENT * depth
        if abs(residual.mean()) < PIECE * std + bent:
            kept.append(rows)
    return kept


def _fit(points: FloatArray, sigma: FloatArray, organised: bool) -> FloatArray:
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


def _scale(
    flat: FloatArray, sigma: FloatArray, rows: list[NDArray[np.bool_]], thetas: list[FloatArray]
) -> float:  # fmt: skip
    """Return the standard deviation of the points from their planes over ``sigma``: the best window's is too small."""
    off = [np.abs(flat[mine] @ plane[:3] - plane[3]) / sigma[mine] for mine, plane in zip(rows, thetas, strict=True)]
    return float(np.median(np.concatenate(off)) / 0.6745)


def _clear(
    flat: FloatArray, sigma: FloatArray, rows: NDArray[np.bool_], k: int, thetas: list[FloatArray], organised: bool,
    minimum: int,
) -> NDArray[np.bool_]:  # fmt: skip
    """Return the rows of plane k without those where another plane is as near: along an edge, points change sides.

    Asked of the place on the plane where a point would be without noise, so that the choice does not bend the fit. A
    plane that is left with few points keeps all.
    """
    normal, distance = thetas[k][:3], thetas[k][3]
    p = flat[rows]
    place = p * (distance / (p @ normal))[:, None] if organised else p - (p @ normal - distance)[:, None] * normal
    clear = np.ones(len(p), dtype=bool)
    for other, plane in enumerate(thetas):
        if other != k:
            clear &= np.abs(place @ plane[:3] - plane[3]) > EDGE * sigma[rows]
    if clear.sum() < max(minimum // 2, 20):
        return rows
    out = rows.copy()
    out[rows] = clear
    return out


def _joined(
    thetas: list[FloatArray], flat: FloatArray, sigma: FloatArray, label: IntArray, fresh: list[IntArray]
) -> list[FloatArray]:
    """Return the planes without those that hold the centres of larger ones' points and are parallel to them."""
    rows = [np.flatnonzero(label == k) for k in range(len(thetas) - len(fresh))] + fresh
    kept: list[int] = []
    for k in sorted(range(len(thetas)), key=lambda k: -len(rows[k])):
        if not len(rows[k]):
            continue
        some = rows[k][:: max(1, len(rows[k]) // 400)]
        same = False
        for other in kept:
            near = np.abs(flat[some] @ thetas[other][:3] - thetas[other][3]) < WITHIN * sigma[some] + 5.0 * FINEST
            same |= bool(thetas[k][:3] @ thetas[other][:3] > np.cos(2.0 * ALIKE) and near.mean() > 0.7)
        if not same:
            kept.append(k)
    return [thetas[k] for k in kept]


def _gathered(
    flat: FloatArray, normals: FloatArray, sigma: FloatArray, usable: NDArray[np.bool_], thetas: list[FloatArray]
) -> IntArray:
    """Return the nearest plane of every point that has one near and a normal like it, else −1."""
    label, best = np.full(len(flat), -1), np.full(len(flat), WITHIN)
    safe = np.where(usable[:, None], flat, 0.0)
    scale = np.where(usable, sigma, 1.0)
    known: Any = np.isfinite(normals).all(axis=1)
    for k, plane in enumerate(thetas):
        distance = np.abs(safe @ plane[:3] - plane[3]) / scale
        alike = ~known | (np.where(known[:, None], normals, 0.0) @ plane[:3] > np.cos(TURNED))
        # Without a normal (at edges) a point has to be closer.
        nearer = usable & alike & (distance < np.where(known, best, 0.5 * best))
        label[nearer], best[nearer] = k, distance[nearer]
    return label


def _plane(points: FloatArray, plane: FloatArray, organised: bool, count: int) -> Plane:
    """Return the plane of ``count`` points with the covariance of its least-squares fit to some of them."""
    residual = points @ plane[:3] - plane[3]
    if organised:
        rays = points / points[:, 2:]
        theta = -plane[:3] / -plane[3]
        left = 1.0 / points[:, 2] - rays @ theta
        covariance = _fit_covariance(rays, left, rays[:, :2])

        def group(t: FloatArray) -> FloatArray:
            size = np.linalg.norm(t)
            return as_group(make_plane(-t / size, -1.0 / size))

    else:
        # (e₁, e₂, δ): two small rotations of the normal and the distance.
        u = np.linalg.svd(plane[None, :3])[2][1:]
        design = np.column_stack([points @ u.T, -np.ones(len(points))])
        covariance = _fit_covariance(design, residual, design[:, :2])
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


def _fit_covariance(design: FloatArray, residual: FloatArray, place: FloatArray) -> FloatArray:
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
