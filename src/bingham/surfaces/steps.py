"""Planes of a loose cloud that passed for one though there is a step between them of no more than their noise."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from bingham.surfaces.plane_fit import WITHIN, fit_plane

__all__ = ["stepped_planes"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

# Points of a neighbourhood on a plane.
WINDOW = 32
# Two surfaces are so many of their standard deviations apart; halves of one plane chosen by the means of neighbourhoods
# are 2 √(2/π)/√WINDOW = 0.28 apart. Where they meet, they are such a share apart of what they are elsewhere: where a
# bent surface bends, its halves meet.
APART, STEP = 2.0, 0.5
# Points of a surface deviate by so much of the usual noise at most: scattered ones are none.
WIDEST = 1.5
ROUNDS = 6


def stepped_planes(
    flat: FloatArray, sigma: FloatArray, label: IntArray, planes: list[FloatArray], minimum: int
) -> tuple[IntArray, list[FloatArray]]:
    """Return labels and planes with those apart whose points lie on two surfaces side by side.

    One point in its noise may be of either; the mean residual of its WINDOW nearest on the plane has a noise that is
    √WINDOW times less, and shows of which.

    Parameters
    ----------
    flat, sigma : (N, 3), (N,) ndarray
        Points, m, and the standard deviation of each across its surface; infinite where there is none.
    label : (N,) ndarray
        Index of each point's plane, −1 for none: these may belong to the smaller surface of two.
    planes : list of (4,) ndarray
        n and δ.
    minimum : int
        Points of a plane, at least.
    """
    label, planes = label.copy(), list(planes)
    known = np.isfinite(sigma)
    p, s = np.where(known[:, None], flat, 0.0), np.where(known, sigma, 0.0)
    waiting, whole = list(range(len(planes))), len(planes)
    while waiting:
        k = waiting.pop()
        mine = label == k
        if k < whole:
            mine |= (label < 0) & (np.abs(p @ planes[k][:3] - planes[k][3]) < 2.0 * WITHIN * s)
        rows = np.flatnonzero(mine)
        found = _halves(p[rows], s[rows], planes[k], minimum) if len(rows) >= max(2 * minimum, 2 * WINDOW) else None
        if found is None:
            continue
        # What is divided once more is a part of this: there is an end to it.
        label[rows] = -1
        for theirs, plane in found:
            label[rows[theirs]] = len(planes)
            waiting.append(len(planes))
            planes.append(plane)
    return label, planes


def _halves(
    p: FloatArray, sigma: FloatArray, plane: FloatArray, minimum: int
) -> list[tuple[BoolArray, FloatArray]] | None:
    """Return which points are of each of two planes, and the planes, or None where there is one."""
    place = p @ np.linalg.svd(plane[None, :3])[2][1:].T
    near: Any = KDTree(place).query(place, WINDOW)[1]
    residual = p @ plane[:3] - plane[3]
    # One plane fitted to two is tilted; neighbourhoods tell by how much, but for those over the step.
    x, r = (a[near] - a[near].mean(axis=1, keepdims=True) for a in (place, residual))
    slopes = np.linalg.solve(
        np.einsum("nki,nkj->nij", x, x) + 1e-12 * np.eye(2), np.einsum("nki,nk->ni", x, r)[..., None]
    )
    residual = residual - place @ np.median(slopes[..., 0], axis=0)
    level = residual[near].mean(axis=1)
    noise = float(np.median(residual[near].std(axis=1)))
    low, high = np.quantile(level, [0.01, 0.99])
    if high - low < APART * noise:
        return None
    of = (level > 0.5 * (low + high)).astype(np.int64)
    two: list[FloatArray] = []
    for _ in range(ROUNDS):
        if min(np.sum(of == 0), np.sum(of == 1)) < minimum:
            return None
        two = [fit_plane(p[of == j], sigma[of == j], organised=False) for j in (0, 1)]
        off = np.stack([np.minimum(np.abs(p @ t[:3] - t[3]) / noise, 2.0 * WITHIN) ** 2 for t in two])
        before, of = of, (off[1][near].mean(axis=1) < off[0][near].mean(axis=1)).astype(np.int64)
        if np.array_equal(of, before):
            break
    off = np.stack([p @ t[:3] - t[3] for t in two])
    parts = [(of == j) & (np.abs(off[j]) < WITHIN * np.maximum(sigma, noise)) for j in (0, 1)]
    if min(map(np.sum, parts)) < minimum or max(off[j][of == j].std() for j in (0, 1)) > WIDEST * noise:
        return None
    apart = np.abs(off[0] - off[1] * np.sign(two[0][:3] @ two[1][:3]))
    smaller = parts[int(parts[1].sum() < parts[0].sum())]
    beside = of[near].min(axis=1) != of[near].max(axis=1)
    usual = float(np.median(apart[smaller]))
    if usual < APART * noise or (beside.any() and float(np.median(apart[beside])) < STEP * usual):
        return None
    return list(zip(parts, two, strict=True))
