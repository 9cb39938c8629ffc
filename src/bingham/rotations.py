"""Array functions of Hamilton quaternions, scalar first (w, x, y, z), and of unit complex numbers (d = 2).

A quaternion q rotates body vectors into the world: v_world = q ⊗ v_body ⊗ q*. Nothing here flips a sign unasked.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError
from bingham.validation import UNIT_TOLERANCE, as_array, as_numbers, is_rotation, unit_rows

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

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
    "yaw_pitch_roll",
]

FloatArray = NDArray[np.float64]


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
    if is_rotation(x):
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


def yaw_pitch_roll(q: ArrayLike) -> FloatArray:
    """Return the angles (..., 3) in rad of R = R_z(yaw) R_y(pitch) R_x(roll), unit q (..., 4); NaN gives NaN.

    Upright, where only yaw ∓ roll is defined, one of the many pairs.

    Examples
    --------
    >>> np.degrees(yaw_pitch_roll([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])).round(6).tolist()
    [90.0, 0.0, 0.0]
    """
    w, x, y, z = np.moveaxis(np.asarray(q, dtype=np.float64), -1, 0)
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    return np.stack([yaw, pitch, roll], axis=-1)


def to_rotation(q: ArrayLike) -> Rotation:
    """Return the SciPy ``Rotation`` of q (..., 4), scalar first."""
    from scipy.spatial.transform import Rotation

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
