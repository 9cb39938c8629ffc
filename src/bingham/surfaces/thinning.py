"""Some of a loose cloud's points to look for planes in, and the labels of all from those of some."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from bingham.surfaces.normals import window_axes
from bingham.surfaces.plane_fit import FINEST, WITHIN, Plane

__all__ = ["labels_of_all", "searched_rows"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# Points of a neighbourhood; they lie on a line if their second principal variance is less than this share of the first,
# which a share of LINED may do. More points than MOST are thinned out, to no fewer than FEWEST.
WINDOW, ON_LINE, LINED, MOST, FEWEST = 20, 0.15, 0.05, 60_000, 2000


def searched_rows(flat: FloatArray) -> IntArray:
    """Return the rows that planes are looked for in: all, or one in each cell of a grid.

    A point given often counts once; of very many some suffice; and a rotating scanner's points lie so much closer along
    its rings than across that the nearest ones are on a line and show no normal.
    """
    known = np.flatnonzero(np.isfinite(flat).all(axis=1))
    rows: Any = known[np.sort(np.unique(flat[known], axis=0, return_index=True)[1])]
    p = flat[rows]
    if len(rows) <= MOST and not _on_lines(p):
        return np.arange(len(flat)) if len(rows) == len(known) else rows
    nearest: Any = KDTree(p).query(p[:: max(1, len(p) // 2000)], 2)[0]
    size = 2.0 * float(np.median(nearest[:, 1]))
    kept = rows
    while len(kept) > MOST or _on_lines(flat[kept]):
        cells = np.unique(np.floor((p - p.min(axis=0)) / size).astype(np.int64), axis=0, return_index=True)[1]
        if len(cells) < FEWEST:
            break
        kept, size = rows[np.sort(cells)], 1.4 * size
    return kept


def _on_lines(p: FloatArray) -> bool:
    """Whether the neighbours of many points lie on lines."""
    if len(p) < 50:
        return False
    variances = window_axes(p, KDTree(p), p[:: max(1, len(p) // 1000)], WINDOW)[0] ** 2
    return bool(np.mean(variances[:, 1] < ON_LINE * variances[:, 2]) > LINED)


def labels_of_all(
    flat: FloatArray, rows: IntArray, planes: list[Plane], label: IntArray
) -> tuple[list[Plane], IntArray]:  # fmt: skip
    """Return the planes found in some rows with their counts, and the labels (n,) of all points, near them or not.

    ``label`` (m,) is the index of the plane of each of the rows, −1 for none.
    """
    known = np.flatnonzero(np.isfinite(flat).all(axis=1))
    nearest: Any = KDTree(flat[rows]).query(flat[known])[1]
    theirs = label[nearest]
    of = np.full(len(flat), -1)
    counted: list[Plane] = []
    for k, plane in enumerate(planes):
        off = np.abs(flat[known] @ plane.normal - plane.distance)
        mine = known[(theirs == k) | ((theirs < 0) & (off < WITHIN * plane.residual) & (of[known] < 0))]
        mine = mine[np.abs(flat[mine] @ plane.normal - plane.distance) < 2.0 * WITHIN * max(plane.residual, FINEST)]
        of[mine] = k
        counted.append(replace(plane, count=len(mine)))
    return counted, of
