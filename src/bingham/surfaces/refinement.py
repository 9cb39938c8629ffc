"""Points of planes by their neighbourhoods: what one point's noise would decide wrongly, and bend the fit by."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from bingham.surfaces.plane_fit import WITHIN, fit_plane

__all__ = ["divided_planes", "refined_planes"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

# Repetitions, at most.
ROUNDS = 8
# The mean and the slopes of a neighbourhood's residuals may be so many of their standard deviations: more is a surface
# of its own. Residuals count as so many at most: one far off is a stray point.
UNEVEN, STRAY = 3.0, 6.0
# A plane whose squares of residuals are so large in the mean may be two, which have this share of them, at most; where
# it is divided at first, along its longer side.
SUSPECT, DIVIDED = 1.8, 0.7
SHARES = (0.2, 0.35, 0.5, 0.65, 0.8)
# They are two surfaces if they are farther apart than this share of the depth (sensors bend a plane by up to 0.0065 of
# it in the recorded images tried), and where they meet at least this share of what they are elsewhere.
APART, STEP = 0.007, 0.5
# Points so many links from another plane's are not used.
MARGIN = 2
# A plane that would rest on fewer points rests on all that carry its label.
FEWEST = 20


class _Region(NamedTuple):
    """Where points of a plane may be: indices (n,), and the function that sums values (n,) over neighbourhoods."""

    points: IntArray
    total: Callable[[FloatArray], FloatArray]


def refined_planes(
    flat: FloatArray,
    sigma: FloatArray,
    label: IntArray,
    planes: list[FloatArray],
    links: IntArray,
    shape: tuple[int, int],
    regions: list[_Region] | None = None,
) -> tuple[list[tuple[FloatArray, BoolArray]], IntArray]:
    """Return (n, δ) (4,) of each plane of an image and which points (N,) it rests on; and each point's plane.

    A point that goes to the nearer of two planes by its own distance is chosen by its noise, and what is left of either
    plane along their edge bends it. Here the squares of the residuals of its neighbourhood decide, to which it adds
    little itself; points beside an edge are left out, and neighbourhoods whose residuals have a mean or a slope, since
    a surface too small to be a plane of its own is there.

    Parameters
    ----------
    flat, sigma : (N, 3), (N,) ndarray
        Points, and the standard deviation of each one's depth; infinite where there is none.
    label : (N,) ndarray
        Index of each point's plane, −1 for none.
    planes : list of (4,) ndarray
        n and δ.
    links : (n, 2) ndarray
        Pairs of neighbours.
    shape : (H, W)
        Of the image.
    regions : list, optional
        Where the points of each plane may be: about those with its label unless given.
    """
    usable = np.isfinite(sigma)
    regions = _regions(label.reshape(shape), len(planes)) if regions is None else regions
    found = [(plane, label == k) for k, plane in enumerate(planes)]
    nearest = label
    for _ in range(ROUNDS):
        nearest, least = np.full(len(flat), -1), np.full(len(flat), np.inf)
        residuals: list[FloatArray] = []
        for k, (region, (plane, _)) in enumerate(zip(regions, found, strict=True)):
            at, valid = region.points, usable[region.points]
            r = np.zeros(len(at))
            r[valid] = _residuals(flat[at[valid]], sigma[at[valid]], plane)
            cost = region.total(np.minimum(r**2, WITHIN**2))
            nearer = valid & (cost < least[at])
            nearest[at[nearer]], least[at[nearer]] = k, cost[nearer]
            residuals.append(r)
        inner = ~_edges(nearest, links)
        before = found
        found = []
        for k, (region, r) in enumerate(zip(regions, residuals, strict=True)):
            at = region.points
            mine = nearest[at] == k
            clear = mine & inner[at]
            mine = clear if 2 * clear.sum() > mine.sum() else mine
            rows = np.zeros(len(flat), dtype=bool)
            rows[at] = _even(flat[at], r, mine, region)
            if rows.sum() < FEWEST:
                rows = label == k
            found.append((fit_plane(flat[rows], sigma[rows], organised=True), rows))
        if all(np.array_equal(rows, old) for (_, rows), (_, old) in zip(found, before, strict=True)):
            break
    return found, nearest


def divided_planes(
    flat: FloatArray,
    sigma: FloatArray,
    label: IntArray,
    planes: list[FloatArray],
    links: IntArray,
    shape: tuple[int, int],
    minimum: int,
) -> tuple[IntArray, list[FloatArray]]:
    """Return labels and planes with those apart that passed for one, as tops of two boxes of nearly one height do.

    Two planes are fitted to the points of each, divided at first where neighbourhoods lie above and below the plane, or
    across its longer side; they stay if they explain much more, the smaller one with ``minimum`` points only. Arguments
    are those of `refined_planes`.
    """
    label, planes = label.copy(), list(planes)
    for k, region in enumerate(_regions(label.reshape(shape), len(planes))):
        at = region.points[label[region.points] == k]
        r = np.zeros(len(flat))
        r[at] = _residuals(flat[at], sigma[at], planes[k])
        whole = float(np.sum(r[at] ** 2))
        if whole < SUSPECT * len(at):
            continue
        place = _places(flat[at]).T
        along = (place - place.mean(axis=0)) @ np.linalg.eigh(np.cov(place.T))[1][:, -1]
        only = np.where(label == k, sigma, np.inf)
        best = DIVIDED * whole
        kept: tuple[IntArray, list[FloatArray]] | None = None
        above = np.zeros(len(flat))
        above[region.points] = region.total(r[region.points])
        for first in (above[at] > 0.0, *(along > np.quantile(along, q) for q in SHARES)):
            if min(first.sum(), len(at) - first.sum()) < FEWEST:
                continue
            parts = np.full(len(flat), -1)
            parts[at] = first
            fits = [fit_plane(flat[parts == j], sigma[parts == j], organised=True) for j in (0, 1)]
            found, nearest = refined_planes(flat, only, parts, fits, links, shape, [region, region])
            squares = [_residuals(flat[at], sigma[at], plane) ** 2 for plane, _ in found]
            cost = float(np.sum(np.where(nearest[at] == 0, *squares)))
            if cost < best:
                best, kept = cost, (nearest[at], [plane for plane, _ in found])
        if kept is None or not _stepped(flat, at, *kept, region):
            continue
        of, two = kept
        larger = int(np.sum(of == 1) > np.sum(of == 0))
        planes[k] = two[larger]
        other = at[of != larger]
        label[other] = -1
        if len(other) >= minimum:
            label[other] = len(planes)
            planes.append(two[1 - larger])
    return label, planes


def _stepped(flat: FloatArray, at: IntArray, of: IntArray, two: list[FloatArray], region: _Region) -> bool:
    """Whether the points (n,) of two planes lie on two surfaces: where the planes meet is where a bent one bends."""
    offset = np.zeros(len(flat))
    offset[at] = np.abs(np.subtract(*(flat[at] @ plane[:3] - plane[3] for plane in two)))
    member = np.zeros((2, len(flat)))
    member[of, at] = 1.0
    beside = region.total(member[0][region.points]) * region.total(member[1][region.points]) > 0.5
    border = np.intersect1d(region.points[beside], at)
    depth = flat[at, 2]
    apart = float(np.median(offset[at] / depth))
    return apart > APART and (not len(border) or float(np.median(offset[border])) > STEP * float(np.median(offset[at])))


def _even(flat: FloatArray, residual: FloatArray, rows: BoolArray, region: _Region) -> BoolArray:
    """Return those of the rows near the plane about which residuals have no mean and no slopes.

    Where all of a surface is uneven, its own unevenness is the deviation; where few rows are left, all count.
    """
    total = region.total
    near = rows & (np.abs(residual) < WITHIN)
    if not near.any():
        return near
    r = np.where(rows, np.clip(residual, -STRAY, STRAY), 0.0)
    count, level = total(rows.astype(np.float64)), total(r)
    sums = [(level, count)]
    for place in _places(flat):
        x = np.where(rows, place - np.mean(place[rows]), 0.0)
        sums.append((total(r * x) - x * level, total(x**2) - 2.0 * x * total(x) + x**2 * count))
    even = near.copy()
    for value, variance in sums:
        z = np.abs(value[near]) / np.sqrt(np.maximum(variance[near], 1e-12))
        even[near] &= z < UNEVEN * max(1.0, 1.4826 * float(np.median(z)))
    return even if 2 * even.sum() > near.sum() else near


def _residuals(p: FloatArray, sigma: FloatArray, plane: FloatArray) -> FloatArray:
    """Return residuals of the inverse depth over their deviation."""
    return p[:, 2] * (1.0 - p @ plane[:3] / plane[3]) / sigma


def _places(flat: FloatArray) -> FloatArray:
    """Return coordinates (2, n) in the image."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return (flat[:, :2] / flat[:, 2:]).T


def _edges(label: IntArray, links: IntArray) -> BoolArray:
    """Return the points at most MARGIN links from one with another label."""
    a, b = links.T
    edge = np.zeros(len(label), dtype=bool)
    beside = label[a] != label[b]
    for _ in range(MARGIN):
        edge[a[beside]] = edge[b[beside]] = True
        beside = edge[a] | edge[b]
    return edge


def _regions(label: IntArray, count: int) -> list[_Region]:
    """Return the region of each plane: its rectangle of the image and a window more."""
    radius = max(3, min(label.shape) // 80)
    index = np.arange(label.size).reshape(label.shape)
    regions: list[_Region] = []
    for k in range(count):
        v, u = np.nonzero(label == k)
        down, across = (slice(max(x.min() - radius, 0), x.max() + radius + 1) for x in (v, u))
        part = index[down, across]
        regions.append(_Region(part.ravel(), _window_sums(part.shape, 2 * radius + 1)))
    return regions


def _window_sums(shape: tuple[int, int], size: int) -> Callable[[FloatArray], FloatArray]:
    return lambda values: uniform_filter(values.reshape(shape), size, mode="constant").ravel() * size**2
