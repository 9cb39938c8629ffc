"""Windows of a loose cloud that are wide enough for its noise, and the planes fitted to them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from bingham.surfaces.normals import Normals, window_axes

__all__ = ["fitted_windows"]

FloatArray = NDArray[np.float64]

# Points of the smallest window and of the widest.
FEWEST, MOST = 20, 1280
# A window whose deviation across is more than this share of the smaller one along shows the noise, not the surface.
THICK = 0.4
# Windows side by side that are large enough if such a share of them shows a surface: those over an edge never do.
AROUND, SHOWN = 8, 0.3


def fitted_windows(points: FloatArray) -> tuple[Normals, FloatArray]:
    """Return normals (n, 3) towards the origin and residuals (n,), m, of planes fitted to windows of a loose cloud.

    And the normals of the smallest windows, by which a surface no larger than a wide one is found.

    The k nearest points have the standard deviation σ across a surface, and along it one that grows with √k: where σ is
    not well below it, the axis of the smallest is any. Windows are twice as large there until it is, or the one that
    is least thick counts. Wide ones overlap so much that those about some points serve all.
    """
    tree = KDTree(points)
    deviations, normals = window_axes(points, tree, points, min(FEWEST, len(points)))
    smallest = normals.copy()
    residual, least = deviations[:, 0], _thickness(deviations)
    rows, size = np.flatnonzero(_too_small(points, points, least, FEWEST)), 2 * FEWEST
    while len(rows) and size <= min(MOST, len(points) // 2):
        some = points[rows[:: size // (2 * FEWEST)]]
        deviations, axes = window_axes(points, tree, some, size)
        nearest: Any = KDTree(some).query(points[rows])[1]
        thickness = _thickness(deviations)
        wider = _too_small(points[rows], some, thickness, size)
        better = ~wider | (thickness[nearest] < least[rows])
        taken, theirs = rows[better], nearest[better]
        normals[taken], residual[taken], least[taken] = axes[theirs], deviations[theirs, 0], thickness[theirs]
        rows, size = rows[wider], 2 * size
    towards, closely = (np.where(np.sum(n * points, axis=1, keepdims=True) > 0.0, -n, n) for n in (normals, smallest))
    return Normals(towards, residual), closely


def _thickness(deviations: FloatArray) -> FloatArray:
    return deviations[:, 0] / np.maximum(deviations[:, 1], 1e-12)


def _too_small(points: FloatArray, places: FloatArray, thickness: FloatArray, size: int) -> NDArray[np.bool_]:
    """Whether the windows at places around each point are too small, of windows half of which overlap."""
    step = max(1, min(size, 2 * FEWEST) // 2)
    shown = thickness[::step] < THICK
    near: Any = KDTree(places[::step]).query(points, min(2 * AROUND, len(shown)))[1]
    return np.mean(shown[near.reshape(len(points), -1)], axis=1) < SHOWN
