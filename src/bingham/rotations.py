"""Array functions of Hamilton quaternions, scalar first (w, x, y, z), and of unit complex numbers (d = 2).

A quaternion q rotates body vectors into the world: v_world = q ⊗ v_body ⊗ q*. Nothing here flips a sign unasked.
"""

from __future__ import annotations

import math
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.errors import InvalidArgumentError

__all__ = [
    "align_signs",
    "as_quaternion",
    "canonical",
    "compose",
    "conjugate",
    "from_rotation_vector",
    "left_matrix",
    "right_matrix",
    "rotate",
    "to_rotation",
    "to_rotation_vector",
]

FloatArray = NDArray[np.float64]

# Unit length is asked for to this relative tolerance; within it the rounding is removed, beyond it the call fails.
UNIT_TOLERANCE = 1e-6


def as_quaternion(x: ArrayLike | Rotation, *, scalar_first: bool | None = None, name: str = "x") -> FloatArray:
    """Return unit quaternions (..., 4), scalar first, from an array in a named order or from a SciPy ``Rotation``.

    Parameters
    ----------
    x : (..., 4) array_like or Rotation
        Unit quaternions within 1e-6; signs are kept.
    scalar_first : bool, optional
        Order of an array; must be given for arrays and is not used for ``Rotation``.
    name : str
        Name of the argument for error messages.

    Raises
    ------
    InvalidArgumentError
        If the order is not reported, the shape is not (..., 4), or a quaternion is not of unit length.

    Examples
    --------
    >>> from scipy.spatial.transform import Rotation
    >>> as_quaternion(Rotation.from_rotvec([0, 0, 0]))
    array([1., 0., 0., 0.])
    >>> as_quaternion([0, 0, 0, 1], scalar_first=False)
    array([1., 0., 0., 0.])
    """
    if isinstance(x, Rotation):
        return np.asarray(x.as_quat(scalar_first=True), dtype=np.float64)
    if scalar_first is None:
        raise InvalidArgumentError(
            "scalar_first",
            "True for (w, x, y, z) or False for (x, y, z, w)",
            None,
            "state the order of the array; it is never guessed",
        )
    q = unit_rows(x, 4, name)
    return q if scalar_first else np.roll(q, 1, axis=-1)


def as_array(x: ArrayLike | Rotation) -> ArrayLike:
    """Return (w, x, y, z) of a `Rotation`, anything else as it is."""
    return x.as_quat(scalar_first=True) if isinstance(x, Rotation) else x


def as_numbers(x: Any, name: str) -> FloatArray:
    """Return x as a new float64 array; text, ragged rows and other things without numbers are rejected."""
    try:
        return np.array(as_array(x), dtype=np.float64)
    except (TypeError, ValueError):
        got = repr(x) if isinstance(x, str) else f"a {type(x).__name__} that makes none"
        raise InvalidArgumentError(name, "an array of numbers", got) from None


def unit_rows(x: ArrayLike | Rotation, d: int | None, name: str) -> FloatArray:
    """Return x (..., d) as float64 with rows of exactly unit length; `Rotation` becomes (w, x, y, z)."""
    a = as_numbers(x, name)
    if a.ndim == 0 or (d is not None and a.shape[-1] != d):
        raise InvalidArgumentError(name, f"shape (..., {d if d is not None else 'd'})", a.shape)
    norm = np.linalg.norm(a, axis=-1, keepdims=True)
    off = np.abs(norm - 1.0)
    if not np.all(off <= UNIT_TOLERANCE):
        worst = int(np.argmax(np.where(np.isnan(off), np.inf, off)))
        length = float(norm.flat[worst])
        unknown = math.isnan(length)
        raise InvalidArgumentError(
            name,
            f"unit vectors within {UNIT_TOLERANCE:g}",
            ("NaN" if unknown else f"length {length:.9g}") + _at_row(worst, norm.shape[:-1]),
            "drop rows of NaN first" if unknown else "normalise them first if that is meant",
        )
    return a / norm


def unit_or_missing(x: ArrayLike | Rotation, d: int, name: str) -> FloatArray:
    """Return x (..., d), as `unit_rows`, where rows may be NaN throughout: missing measurements."""
    a = as_numbers(x, name)
    if a.shape[-1:] != (d,):
        raise InvalidArgumentError(name, f"shape (..., {d})", a.shape)
    missing_rows(a, name)
    norm = np.sqrt(np.einsum("...i,...i->...", a, a))
    wrong = np.flatnonzero(np.abs(norm - 1.0).ravel() > UNIT_TOLERANCE)
    if wrong.size:
        raise InvalidArgumentError(
            name,
            f"unit vectors within {UNIT_TOLERANCE:g}, or NaN for a missing row",
            f"length {norm.flat[wrong[0]]:.9g}" + _at_row(wrong[0], norm.shape),
            "normalise them first if that is meant",
        )
    a /= norm[..., None]
    return a


def missing_rows(a: FloatArray, name: str) -> NDArray[np.bool_]:
    """Return which rows of a (..., n) are NaN throughout; reject rows that are so in part."""
    # One pass over complete data: a sum is NaN where any entry is.
    missing = np.isnan(a.sum(axis=-1))
    rows = a.reshape(-1, a.shape[-1])[missing.ravel()]
    partly = np.flatnonzero(~np.isnan(rows).all(axis=-1))
    if partly.size:
        row = np.flatnonzero(missing.ravel())[partly[0]]
        got = f"{rows[partly[0]].tolist()}" + _at_row(row, missing.shape)
        raise InvalidArgumentError(
            name, "complete rows, or all NaN where missing", got, "drop the row, or blank all of it"
        )
    return missing


def is_missing(z: Any) -> bool:
    """Whether the measurement z is an array, of any shape, that is NaN throughout."""
    # At once for what most measurements are.
    if isinstance(z, np.ndarray) and z.ndim == 1 and z.size and z[0] == z[0]:
        return False
    try:
        a = np.asarray(z if z is not None else (), dtype=np.float64)
    except (TypeError, ValueError):
        return False
    return a.size > 0 and bool(np.isnan(a).all())


def _at_row(index: Any, shape: tuple[int, ...]) -> str:
    """Return " at row i, j" for a flat index into rows of the given shape, nothing for a single vector."""
    return " at row " + ", ".join(str(int(i)) for i in np.unravel_index(index, shape)) if shape else ""


def unit_row(x: ArrayLike | Rotation, d: int, name: str) -> FloatArray:
    """Return one unit vector (d,), as `unit_rows`; fast for float64 arrays that are unit vectors already."""
    if isinstance(x, np.ndarray) and x.dtype == np.float64 and x.shape == (d,):
        square = sum([c * c for c in x.tolist()])
        if abs(square - 1.0) <= 4e-16:
            return x
        if abs(square - 1.0) <= UNIT_TOLERANCE:
            return x / math.sqrt(square)
    a = np.atleast_1d(as_numbers(x, name))
    missing_rows(a, name)
    a = unit_rows(a, d, name)
    if a.shape != (d,):
        raise InvalidArgumentError(name, f"a single unit vector ({d},)", a.shape)
    return a


def compose(p: ArrayLike, q: ArrayLike) -> FloatArray:
    """Return p ⊕ q: the Hamilton product for (..., 4), complex multiplication for (..., 2); p and q broadcast.

    Unit length is not checked: inner loops call this, and the product of any two quaternions is defined.

    Examples
    --------
    >>> compose([0.0, 1, 0, 0], [0.0, 0, 1, 0])
    array([0., 0., 0., 1.])
    """
    a, b = np.asarray(p, dtype=np.float64), np.asarray(q, dtype=np.float64)
    if a.shape[-1:] == b.shape[-1:] == (2,):
        return np.stack(
            [a[..., 0] * b[..., 0] - a[..., 1] * b[..., 1], a[..., 0] * b[..., 1] + a[..., 1] * b[..., 0]], axis=-1
        )
    if not a.shape[-1:] == b.shape[-1:] == (4,):
        raise InvalidArgumentError("p, q", "last axes of length 2 or 4, alike", f"{a.shape} and {b.shape}")
    aw, ax, ay, az = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bw, bx, by, bz = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )


def conjugate(q: ArrayLike) -> FloatArray:
    """Return q*, the inverse rotation, of q (..., 4) or (..., 2)."""
    a = np.array(q, dtype=np.float64)
    a[..., 1:] *= -1.0
    return a


def left_matrix(q: ArrayLike) -> FloatArray:
    """Return L (..., d, d) with q ⊕ x = L x, d = 2 or 4."""
    a = np.asarray(q, dtype=np.float64)
    return np.swapaxes(compose(a[..., None, :], np.eye(a.shape[-1])), -1, -2)


def right_matrix(q: ArrayLike) -> FloatArray:
    """Return R (..., d, d) with x ⊕ q = R x, d = 2 or 4."""
    a = np.asarray(q, dtype=np.float64)
    return np.swapaxes(compose(np.eye(a.shape[-1]), a[..., None, :]), -1, -2)


def from_rotation_vector(r: ArrayLike) -> FloatArray:
    """Return exp(r/2) (..., 4), the quaternion of the rotation vector r (..., 3) in rad."""
    a = np.asarray(r, dtype=np.float64)
    if a.shape[-1:] != (3,):
        raise InvalidArgumentError("r", "shape (..., 3)", a.shape)
    half = 0.5 * np.linalg.norm(a, axis=-1, keepdims=True)
    # np.sinc(x/π) = sin(x)/x, finite at 0.
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * a], axis=-1)


def to_rotation_vector(q: ArrayLike) -> FloatArray:
    """Return the rotation vector (..., 3) in rad, length at most π, of the rotation ±q (..., 4)."""
    a = np.asarray(q, dtype=np.float64)
    if a.shape[-1:] != (4,):
        raise InvalidArgumentError("q", "shape (..., 4)", a.shape)
    a = np.where(a[..., :1] < 0.0, -a, a)
    s = np.linalg.norm(a[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(s, a[..., :1])
    factor = np.divide(angle, s, out=np.full_like(s, 2.0), where=s > 0.0)
    return factor * a[..., 1:]


def rotate(q: ArrayLike | Rotation, v: ArrayLike) -> FloatArray:
    """Return q ⊗ v ⊗ q* for vectors v (..., 3): body coordinates into world coordinates.

    q (..., 4) and v broadcast. A q whose length is not 1 within 1e-6 is rejected; NaN gives NaN.
    """
    a, b = np.asarray(as_array(q), dtype=np.float64), np.asarray(v, dtype=np.float64)
    if a.shape[-1:] != (4,):
        raise InvalidArgumentError("q", "shape (..., 4)", a.shape)
    if b.shape[-1:] != (3,):
        raise InvalidArgumentError("v", "shape (..., 3)", b.shape)
    square = np.einsum("...i,...i->...", a, a)
    # 2e-6 of the square are 1e-6 of the length; comparisons with NaN are false.
    if np.any(np.abs(square - 1.0) > 2.0 * UNIT_TOLERANCE):
        worst = float(np.sqrt(square.flat[np.nanargmax(np.abs(square - 1.0))]))
        hint = "normalise them first if that is meant"
        raise InvalidArgumentError("q", f"unit quaternions within {UNIT_TOLERANCE:g}", f"length {worst:.9g}", hint)
    t = 2.0 * np.cross(a[..., 1:], b)
    return b + a[..., :1] * t + np.cross(a[..., 1:], t)


def to_rotation(q: ArrayLike) -> Rotation:
    """Return the SciPy ``Rotation`` of q (..., 4), scalar first."""
    return cast(Any, Rotation).from_quat(np.asarray(q, dtype=np.float64), scalar_first=True)


def canonical(q: ArrayLike) -> FloatArray:
    """Return ±q (..., d) with the first non-zero entry positive."""
    a = np.array(q, dtype=np.float64)
    first = np.take_along_axis(a, np.argmax(a != 0.0, axis=-1)[..., None], axis=-1)
    return np.where(first < 0.0, -a, a)


def align_signs(q: ArrayLike) -> FloatArray:
    """Return ±q (T, d) with qₜ·qₜ₊₁ ≥ 0: no sign jumps along the first axis; the first row keeps its sign.

    Missing rows, NaN, are stepped over: the row after a gap agrees with the last one before it.

    Examples
    --------
    >>> align_signs([[1.0, 0.0], [np.nan, np.nan], [-1.0, 0.0]])[2] + 0.0
    array([1., 0.])
    """
    a = as_numbers(q, "q")
    if a.ndim != 2:
        raise InvalidArgumentError("q", "one sequence, shape (T, d)", a.shape)
    there = ~np.isnan(a).any(axis=1)
    known = a[there]
    flips = np.where(np.sum(known[1:] * known[:-1], axis=-1) < 0.0, -1.0, 1.0)
    known[1:] *= np.cumprod(flips)[:, None]
    a[there] = known
    return a
