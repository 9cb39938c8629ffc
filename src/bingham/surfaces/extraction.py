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
from bingham.surfaces.normals import organised_normals
from bingham.surfaces.plane_fit import FINEST, WITHIN, Plane, fit_covariance, fit_plane, plane_of
from bingham.surfaces.refinement import divided_planes, refined_planes
from bingham.surfaces.segmentation import fit_directions
from bingham.surfaces.steps import stepped_planes
from bingham.surfaces.thinning import labels_of_all, searched_rows
from bingham.surfaces.windows import fitted_windows
from bingham.validation import as_numbers, check_number

__all__ = ["Plane", "PlaneSegments", "find_planes"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Neighbours on a surface lie within so many standard deviations of each other.
LINKED = 4.0
# A point whose normal is farther from the plane's, rad, does not belong to it; and parallel planes that are one.
TURNED, ALIKE = np.deg2rad(30.0), np.deg2rad(4.0)
ROUNDS = 3
# A place on a plane that is within so many standard deviations of another plane may hold points of either.
EDGE = 4.0
# Noise of the points over that of the windows they are estimated from, at most.
WIDEST = 1.6
# Pieces of a plane may be off it by so many standard deviations, and by such a share of the depth.
PIECE, BENT = 4.0, 0.003
NEIGHBOURS = 12
# A window with so much more noise than there is about it lies over an edge, and its axis is no normal.
UNEVEN = 2.0
# A plane of a loose cloud has such a share of its points for itself.
OWN = 0.5
# Its points may have so much more noise than nine in ten of them have at most.
NOISIER = 1.5
# Images are so many pixels wide and high at least.
NARROWEST = 8
# A normal that is so nearly across the line of sight (its cosine) may point either way by noise alone.
EDGE_ON = 0.2
# Windows about a point of a loose cloud, and the share of them with less noise than is taken.
SURROUNDINGS, QUIET = 64, 0.3
# Directions of the scene that are looked for, and how often in what no plane has explained.
DIRECTIONS, PASSES = range(2, 9), 3


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
    plane are joined, planes gather the points near them; what is left is searched again. A plane of a loose cloud that
    others explain is none, and one whose neighbourhoods lie at two levels is two. Of a loose cloud of more than 60 000
    points, or whose points lie in lines as a rotating scanner's do, some are searched and all are labelled.

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
    if noise is not None:
        check_number(noise, "noise", "a standard deviation > 0", above=0.0)
    flat, given = p.reshape(-1, 3), None
    if normals is not None:
        given = as_numbers(normals, "normals")
        if given.shape != p.shape:
            raise InvalidArgumentError("normals", f"a normal for each point, shape {p.shape}", given.shape)
        given = given.reshape(-1, 3)
    if p.ndim == 3 and min(p.shape[:2]) >= NARROWEST:
        return _found(p, given, min_share, noise, rng)
    rows = searched_rows(flat)
    some = _found(flat[rows], None if given is None else given[rows], min_share, noise, rng)
    planes, label = some.planes, some.label
    if len(rows) != len(flat):
        planes, label = labels_of_all(flat, rows, planes, label)
    return PlaneSegments(planes, label.reshape(p.shape[:-1]))


def _found(
    p: FloatArray, normals: FloatArray | None, min_share: float, noise: float | None, rng: Any
) -> PlaneSegments:  # fmt: skip
    """Search all of an organised or a loose cloud."""
    organised = p.ndim == 3
    flat = p.reshape(-1, 3)
    usable: Any = np.isfinite(flat).all(axis=1)
    if organised:
        usable = usable & (flat[:, 2] > 0.0)
    if usable.sum() < 50:
        raise InvalidArgumentError("points", "at least 50 different points", int(usable.sum()))
    n, closely, spread = _normals(p, usable, organised)
    if normals is not None:
        n, closely = normals, normals
    sigma = np.full(len(flat), np.inf)
    level: Any = float(np.nanmedian(spread)) if noise is None else float(noise)
    if organised:
        level = level * flat[usable, 2] ** 2  # noise of the inverse depth is that of the depth over its square
    elif noise is None:
        level = _local_noise(flat[usable], spread[usable])
    sigma[usable] = np.maximum(FINEST, level)
    if not organised and normals is None and noise is None:
        n = np.where((spread < UNEVEN * sigma)[:, None], n, np.nan)
    links = _grid_links(p.shape[:2], usable) if organised else _cloud_links(flat, usable)
    minimum = max(20, int(min_share * usable.sum()))
    return _search(flat, n, closely, sigma, noise is None, usable, links, p.shape[:-1], minimum, organised, rng)


def _normals(p: FloatArray, usable: NDArray[np.bool_], organised: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return normals (n, 3), those of the smallest windows (n, 3), and the residuals (n,) of the former."""
    if organised:
        found = organised_normals(p, radius=max(3, min(p.shape[:2]) // 80))
        return found.normals.reshape(-1, 3), found.normals.reshape(-1, 3), found.residual.ravel()
    flat = p.reshape(-1, 3)
    normals, closely, spread = np.full(flat.shape, np.nan), np.full(flat.shape, np.nan), np.full(len(flat), np.nan)
    (normals[usable], spread[usable]), closely[usable] = fitted_windows(flat[usable])
    return normals, closely, spread


def _local_noise(points: FloatArray, spread: FloatArray) -> FloatArray:
    """Return the noise (n,) about each point: of its surroundings' windows one that neither edge nor corner widens.

    A scanner's noise grows with the distance, and what a cloud's points are the distances of is not known.
    """
    noise = np.empty(len(points))
    tree = KDTree(points)
    for rows in np.array_split(np.arange(len(points)), len(points) // 20_000 + 1):
        near: Any = np.atleast_2d(tree.query(points[rows], min(SURROUNDINGS, len(points)))[1])
        noise[rows] = np.nanquantile(spread[near], QUIET, axis=1)
    return np.nan_to_num(noise, nan=float(np.nanmedian(spread)))


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
    flat: FloatArray, normals: FloatArray, closely: FloatArray, sigma: FloatArray, estimated: bool,
    usable: NDArray[np.bool_], links: IntArray, shape: tuple[int, ...], minimum: int, organised: bool, rng: Any,
) -> PlaneSegments:  # fmt: skip
    generator = np.random.default_rng(rng)
    thetas: list[FloatArray] = []
    label, first = np.full(len(flat), -1), sigma
    safe = np.where(usable[:, None], flat, 0.0)
    across = np.abs(np.sum(np.nan_to_num(normals) * safe, axis=1)) < EDGE_ON * np.linalg.norm(safe, axis=1)
    either = across & (not organised)
    for turn in range(PASSES):
        if turn:
            normals = np.where((label < 0)[:, None], closely, normals)
        left = usable & (label < 0) & np.isfinite(normals).all(axis=1)
        if left.sum() < minimum:
            break
        directions = fit_directions(normals[left], DIRECTIONS, restarts=2, rng=generator)
        of = np.full(len(flat), -1)
        of[left] = directions.predict(normals[left])
        fresh = _surfaces(flat, of, directions.directions, sigma, links, minimum)
        if not fresh:
            break
        fitted = [fit_plane(flat[rows], sigma[rows], organised) for rows in fresh]
        thetas = _joined([*thetas, *fitted], flat, sigma, label, fresh)
        for _ in range(ROUNDS):
            label = _gathered(flat, normals, sigma, usable, thetas, either)
            kept = [k for k in range(len(thetas)) if np.sum(label == k) >= minimum]
            if not organised:
                kept = _unexplained(flat, sigma, label, thetas, kept)
            clear = [_clear(flat, sigma, label == k, k, thetas, organised, minimum) for k in kept]
            thetas = [fit_plane(flat[rows], sigma[rows], organised) for rows in clear]
            if estimated and thetas:
                sigma = first * np.clip(_scale(flat, first, clear, thetas), 1.0, WIDEST)
        pieces = _connected(_gathered(flat, normals, sigma, usable, thetas, either), links, minimum)
        label = np.full(len(flat), -1)
        for k, parts in pieces.items():
            for rows in _of_one_plane(flat, sigma, parts, thetas[k], organised):
                label[rows] = k
    image = (shape[0], shape[1]) if organised else (1, 1)
    if organised:
        present = [k for k in range(len(thetas)) if np.any(label == k)]
        label = np.append(np.searchsorted(present, np.arange(len(thetas))), -1)[label]
        label, thetas = divided_planes(flat, sigma, label, [thetas[k] for k in present], links, image, minimum)
    else:
        label = _without_strays(flat, sigma, label, thetas)
        label, thetas = stepped_planes(flat, sigma, label, thetas, minimum)
    counts = np.array([np.sum(label == k) for k in range(len(thetas))], dtype=np.int64)
    order = [k for k in np.argsort(-counts, kind="stable") if counts[k] >= minimum]
    final = np.full(len(flat), -1)
    for place, k in enumerate(order):
        final[label == k] = place
    thetas = [thetas[k] for k in order]
    if organised:
        found, _ = refined_planes(flat, sigma, final, thetas, links, image)
    else:
        clear = [_clear(flat, sigma, final == k, k, thetas, organised, minimum) for k in range(len(thetas))]
        found = [(fit_plane(flat[rows], sigma[rows], organised), rows) for rows in clear]
    planes = [
        plane_of(flat[rows], plane, organised, int(counts[k])) for k, (plane, rows) in zip(order, found, strict=True)
    ]
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
    plane = fit_plane(flat[largest], sigma[largest], organised)
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
    covariance = fit_covariance(design, residual, design[:, :2])
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
            same |= bool(abs(thetas[k][:3] @ thetas[other][:3]) > np.cos(2.0 * ALIKE) and near.mean() > 0.7)
        if not same:
            kept.append(k)
    return [thetas[k] for k in kept]


def _without_strays(flat: FloatArray, sigma: FloatArray, label: IntArray, thetas: list[FloatArray]) -> IntArray:
    """Return the labels without those of points that are near a plane only by a noise that is not the plane's.

    Scattered points have windows as wide as they are scattered.
    """
    label = label.copy()
    for k, plane in enumerate(thetas):
        mine = np.flatnonzero(label == k)
        if len(mine):
            usual = NOISIER * np.quantile(sigma[mine], 0.9)
            label[mine[np.abs(flat[mine] @ plane[:3] - plane[3]) > WITHIN * usual]] = -1
    return label


def _unexplained(
    flat: FloatArray, sigma: FloatArray, label: IntArray, thetas: list[FloatArray], kept: list[int]
) -> list[int]:
    """Return those of the planes most of whose points no other plane explains.

    The noise of a plane beyond what passes for its deviation, and the points along an edge of two, are no surfaces.
    """
    far: dict[int, dict[int, NDArray[np.bool_]]] = {}
    for k in kept:
        mine = label == k
        far[k] = {j: np.abs(flat[mine] @ thetas[j][:3] - thetas[j][3]) > WITHIN * sigma[mine] for j in kept}
    left = list(kept)
    while len(left) > 1:
        own = [np.logical_and.reduce([far[k][j] for j in left if j != k]).mean() for k in left]
        least = int(np.argmin(own))
        if own[least] >= OWN:
            break
        left.pop(least)
    return left


def _gathered(
    flat: FloatArray, normals: FloatArray, sigma: FloatArray, usable: NDArray[np.bool_], thetas: list[FloatArray],
    either: NDArray[np.bool_],
) -> IntArray:  # fmt: skip
    """Return the nearest plane of every point that has one near and a normal like it (or `either` way), else −1."""
    label, best = np.full(len(flat), -1), np.full(len(flat), WITHIN)
    safe = np.where(usable[:, None], flat, 0.0)
    scale = np.where(usable, sigma, 1.0)
    known: Any = np.isfinite(normals).all(axis=1)
    for k, plane in enumerate(thetas):
        distance = np.abs(safe @ plane[:3] - plane[3]) / scale
        cosine = np.where(known[:, None], normals, 0.0) @ plane[:3]
        alike = ~known | (np.where(either, np.abs(cosine), cosine) > np.cos(TURNED))
        # Without a normal (at edges) a point has to be closer.
        nearer = usable & alike & (distance < np.where(known, best, 0.5 * best))
        label[nearer], best[nearer] = k, distance[nearer]
    return label
