"""The error of the BROAD data set: angles of orientations, split at the vertical."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError
from bingham.rotations import compose, conjugate
from bingham.validation import as_numbers, unit_rows

__all__ = ["BroadErrors", "broad_errors", "broad_rmse", "heading_offset"]

FloatArray = NDArray[np.float64]


class BroadErrors(NamedTuple):
    """Angles of the error rotation, rad: the whole, its rotation about the vertical, the rest; see `broad_errors`."""

    total: FloatArray
    heading: FloatArray
    inclination: FloatArray


def broad_errors(estimate: ArrayLike, reference: ArrayLike) -> BroadErrors:
    """Return how far quaternions are from a reference, split at the vertical (Laidig et al., Data 6(7):72, 2021).

    With e = estimate ⊗ reference*, the error in earth coordinates (z vertical): total 2 arccos |e_w|, heading
    2 arctan |e_z/e_w|, inclination 2 arccos √(e_w² + e_z²), so that cos ½total = cos ½heading · cos ½inclination.

    Parameters
    ----------
    estimate, reference : (..., 4) array_like
        Unit quaternions (w, x, y, z), body to earth; a row of NaN gives NaN. They broadcast.

    Returns
    -------
    BroadErrors
        Angles in [0, π], shape (...).

    Examples
    --------
    >>> import numpy as np
    >>> np.degrees(broad_errors([np.cos(0.1), 0.0, 0.0, np.sin(0.1)], [1.0, 0.0, 0.0, 0.0])).round(3).tolist()
    [11.459, 11.459, 0.0]
    """
    e = _error(estimate, reference)
    w, x, y, z = np.moveaxis(np.abs(e), -1, 0)
    # atan2 keeps the digits that arccos loses near 0.
    upright, tilted = np.hypot(w, z), np.hypot(x, y)
    return BroadErrors(2 * np.arctan2(np.hypot(tilted, z), w), 2 * np.arctan2(z, w), 2 * np.arctan2(tilted, upright))


def broad_rmse(estimate: ArrayLike, reference: ArrayLike, score: ArrayLike | None = None) -> BroadErrors:
    """Return root mean squares of `broad_errors` over time, rad.

    Parameters
    ----------
    estimate, reference : (T, 4) array_like
        Unit quaternions; nothing is aligned or interpolated.
    score : (T,) array_like of bool, optional
        Samples that count (BROAD: the movement phases); rows without a reference (NaN) never do.

    Raises
    ------
    InvalidArgumentError
        If no sample counts.
    """
    errors = np.array(broad_errors(estimate, reference))
    counted = np.isfinite(errors).all(axis=0)
    if score is not None:
        mask = np.asarray(score, dtype=np.bool_)
        if mask.shape != counted.shape:
            raise InvalidArgumentError("score", f"one for each sample, shape {counted.shape}", mask.shape)
        counted &= mask
    if not counted.any():
        raise InvalidArgumentError("score", "at least one sample with a reference", "none")
    return BroadErrors(*np.sqrt(np.mean(errors[:, counted] ** 2, axis=1)))


def heading_offset(estimate: ArrayLike, reference: ArrayLike) -> float:
    """Return the constant rotation about the vertical, rad, that carries a reference closest to estimates (T, 4).

    α maximising Σ cos²½(angle between R_z(α) ⊗ reference and estimate), from the leading eigenvector of Σ e eᵀ over
    (e_w, e_z). Needed where the reference's own heading is arbitrary.
    """
    e = _error(estimate, reference)[..., [0, 3]]
    e = e[np.isfinite(e).all(axis=-1)]
    if not len(e):
        raise InvalidArgumentError("reference", "at least one known orientation", "none")
    w, z = np.linalg.eigh(e.T @ e)[1][:, -1]
    return float(2 * np.arctan(z / w)) if w else float(np.pi)


def _error(estimate: ArrayLike, reference: ArrayLike) -> FloatArray:
    known = as_numbers(reference, "reference")
    if known.shape[-1:] != (4,):
        raise InvalidArgumentError("reference", "shape (..., 4)", known.shape)
    filled = np.where(np.isnan(known), [1.0, 0.0, 0.0, 0.0], known)
    q, r = unit_rows(estimate, 4, "estimate"), unit_rows(filled, 4, "reference")
    try:
        np.broadcast_shapes(q.shape, r.shape)
    except ValueError:
        raise InvalidArgumentError(
            "reference", f"a shape that broadcasts with the estimates' {q.shape}", r.shape, "one row for each estimate"
        ) from None
    e = compose(q, conjugate(r))
    return np.where(np.isnan(known).any(axis=-1, keepdims=True), np.nan, e)
