"""Equal-area and equal-angle maps of the lower hemisphere, and back."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError

__all__ = ["Projection", "map_coordinates", "project", "unproject"]

FloatArray = NDArray[np.float64]
Projection = Literal["equal-area", "equal-angle"]


def project(x: ArrayLike, projection: Projection = "equal-area") -> FloatArray:
    """Return east and north (..., 2) on the unit disc of the lower end of axes x (..., 3) in north, east, down.

    With θ the angle from straight down the radius is √2 sin(θ/2) on the equal-area (Schmidt) net and tan(θ/2) on the
    equal-angle (Wulff) net.

    Examples
    --------
    >>> project([[0.0, 0.0, 1.0], [0.0, 0.8, -0.6]]).round(4) + 0.0
    array([[ 0.    ,  0.    ],
           [-0.6325,  0.    ]])
    """
    v = np.asarray(x, dtype=np.float64)
    down = np.where(v[..., 2:] < 0.0, -v, v)
    scale = np.sqrt(1.0 + down[..., 2:]) if _is_equal_area(projection) else 1.0 + down[..., 2:]
    return down[..., [1, 0]] / scale


def unproject(points: ArrayLike, projection: Projection = "equal-area") -> FloatArray:
    """Return the unit vectors (..., 3), north, east, down ≥ 0, of points (..., 2) on the disc."""
    p = np.asarray(points, dtype=np.float64)
    square = np.sum(p**2, axis=-1, keepdims=True)
    if _is_equal_area(projection):
        down, scale = 1.0 - square, np.sqrt(np.maximum(2.0 - square, 0.0))
    else:
        down, scale = (1.0 - square) / (1.0 + square), 2.0 / (1.0 + square)
    return np.concatenate([p[..., [1]] * scale, p[..., [0]] * scale, down], axis=-1)


def map_coordinates(ax: Any, x: FloatArray, projection: Projection) -> tuple[FloatArray, FloatArray]:
    """Return the coordinates (...), (...) at which `ax` shows the lower end of axes x (..., 3).

    Axes of mplstereonet do the projection themselves, from longitude and latitude about straight down.
    """
    if is_stereonet(ax):
        down = np.where(x[..., 2:] < 0.0, -x, x)
        return np.arctan2(down[..., 1], down[..., 2]), np.arcsin(np.clip(down[..., 0], -1.0, 1.0))
    points = project(x, projection)
    return points[..., 0], points[..., 1]


def is_stereonet(ax: Any) -> bool:
    """Whether `ax` belongs to mplstereonet."""
    return "stereonet" in str(getattr(ax, "name", ""))


def _is_equal_area(projection: str) -> bool:
    if projection not in ("equal-area", "equal-angle"):
        raise InvalidArgumentError("projection", "'equal-area' or 'equal-angle'", repr(projection))
    return projection == "equal-area"
