"""Checks of arguments, and arrays made of them: cheap enough for every call."""

from __future__ import annotations

import math
import sys
from operator import index
from typing import TYPE_CHECKING, Any, TypeGuard, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]
T = TypeVar("T")

# Unit length is asked for to this relative tolerance; within it the rounding is removed, beyond it the call fails.
UNIT_TOLERANCE = 1e-6


def described(x: Any) -> str:
    """Return what x is, in a few words: text as written, arrays by shape, other things by type."""
    if isinstance(x, np.ndarray):
        return f"an array of shape {x.shape}"
    if x is None or isinstance(x, (bool, int, float)):
        return str(x)
    if isinstance(x, str):
        return repr(x)
    return f"the class {x.__name__}" if isinstance(x, type) else f"a {type(x).__name__}"


def check_kind(x: Any, kind: type[Any], name: str, hint: str = "") -> None:
    """Reject what is no instance of kind."""
    if not isinstance(x, kind):
        raise InvalidArgumentError(name, f"a {kind.__name__}", described(x), hint)


def check_number(x: Any, name: str, expected: str, *, above: float = -np.inf, minimum: float = -np.inf) -> None:
    """Reject what is no single finite number x > above, x ≥ minimum."""
    try:
        good = bool(np.isfinite(x) and x > above and x >= minimum)
    except (TypeError, ValueError):
        good = False
    if not good:
        raise InvalidArgumentError(name, expected, described(x))


def integer(x: Any, name: str, minimum: int) -> int:
    """Return x as an int, at least `minimum`; a float is rejected even where it is whole."""
    try:
        number = index(x)
    except TypeError:
        raise InvalidArgumentError(name, f"an integer ≥ {minimum}", described(x)) from None
    if number < minimum:
        raise InvalidArgumentError(name, f"an integer ≥ {minimum}", number)
    return number


def as_generator(rng: Any) -> np.random.Generator:
    """Return ``numpy.random.default_rng(rng)``; what it does not take is rejected by name."""
    try:
        return np.random.default_rng(rng)
    except (TypeError, ValueError):
        raise InvalidArgumentError("rng", "None, an integer ≥ 0 or a numpy.random.Generator", described(rng)) from None


def as_array(x: ArrayLike | Rotation) -> ArrayLike:
    """Return (w, x, y, z) of a `Rotation`, anything else as it is."""
    return x.as_quat(scalar_first=True) if is_rotation(x) else cast("ArrayLike", x)


def is_rotation(x: object) -> TypeGuard[Rotation]:
    """Whether x is SciPy's `Rotation`; whoever has one has imported it, which takes long."""
    module = sys.modules.get("scipy.spatial.transform")
    return module is not None and isinstance(x, module.Rotation)


def as_numbers(x: Any, name: str) -> FloatArray:
    """Return x as a new float64 array; text, ragged rows and masked entries are rejected."""
    if np.ma.is_masked(x):
        hint = "fill them: x.filled(np.nan) marks missing rows where those are allowed"
        raise InvalidArgumentError(name, "an array without masked entries", f"{np.ma.count_masked(x)} masked", hint)
    try:
        return np.array(as_array(x), dtype=np.float64)
    except (TypeError, ValueError, RuntimeError):
        got = repr(x) if isinstance(x, str) else f"a {type(x).__name__} that makes none"
        library = {"torch": "torch", "jax": "jax", "jaxlib": "jax"}.get(type(x).__module__.partition(".")[0])
        hint = f"use bingham.{library} where it is traced, differentiated or on a device" if library else ""
        raise InvalidArgumentError(name, "an array of numbers", got, hint) from None


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


def unit_row(x: ArrayLike | Rotation, d: int, name: str) -> FloatArray:
    """Return one unit vector (d,), as `unit_rows`; fast for float64 arrays that are unit vectors already."""
    if isinstance(x, np.ndarray) and x.dtype == np.float64 and x.shape == (d,):
        norm = math.hypot(*x.tolist())
        if abs(norm - 1.0) <= 2e-16:
            return x
        if abs(norm - 1.0) <= 0.5 * UNIT_TOLERANCE:
            return x / norm
    a = np.atleast_1d(as_numbers(x, name))
    missing_rows(a, name)
    a = unit_rows(a, d, name)
    if a.shape != (d,):
        raise InvalidArgumentError(name, f"a single unit vector ({d},)", a.shape)
    return a


def _at_row(index: Any, shape: tuple[int, ...]) -> str:
    """Return " at row i, j" for a flat index into rows of the given shape, nothing for a single vector."""
    return " at row " + ", ".join(str(int(i)) for i in np.unravel_index(index, shape)) if shape else ""


def check_noise_side(noise_side: str) -> None:
    """Reject what is neither "right" (body frame) nor "left" (world frame)."""
    if noise_side not in ("right", "left"):
        raise InvalidArgumentError("noise_side", "'right' or 'left'", repr(noise_side))


def finite(x: ArrayLike, name: str) -> FloatArray:
    """Return x as float64 without NaN or infinite entries."""
    a = np.asarray(x, dtype=np.float64)
    if not np.all(np.isfinite(a)):
        raise InvalidArgumentError(name, "finite numbers", a)
    return a


def variance(x: ArrayLike, name: str, *, positive: bool = False) -> FloatArray:
    """Return x (...) as float64, finite and not negative, or above 0."""
    a = finite(x, name)
    if not np.all(a > 0.0 if positive else a >= 0.0):
        raise InvalidArgumentError(name, "finite numbers above 0" if positive else "finite numbers >= 0", a)
    return a


def noise_variance(x: ArrayLike, name: str, *, positive: bool = False) -> None:
    """Reject what is no single `variance`."""
    if variance(x, name, positive=positive).ndim:
        raise InvalidArgumentError(name, "a single number", x)


def covariance_matrix(x: ArrayLike, d: int | None, name: str) -> FloatArray:
    """Return x (..., d, d) as float64; symmetric within 1e-8 of its size, positive semidefinite within 1e-12."""
    c = finite(x, name)
    if c.ndim < 2 or c.shape[-1] != c.shape[-2] or (d is not None and c.shape[-1] != d):
        raise InvalidArgumentError(name, f"shape (..., {d}, {d})" if d else "shape (..., d, d)", c.shape)
    size = np.abs(c).max(axis=(-2, -1), initial=0.0)
    if np.any(np.abs(c - np.swapaxes(c, -1, -2)).max(axis=(-2, -1), initial=0.0) > 1e-8 * size):
        raise InvalidArgumentError(name, "symmetric matrices", c)
    smallest = np.linalg.eigvalsh(c)[..., 0]
    if np.any(smallest < -1e-12 * size):
        raise InvalidArgumentError(name, "positive semidefinite matrices", f"smallest eigenvalue {smallest.min():.3g}")
    return c


def noise_covariance(x: ArrayLike, d: int, name: str) -> FloatArray:
    """Return a single `covariance_matrix` (d, d)."""
    c = covariance_matrix(x, d, name)
    if c.ndim != 2:
        raise InvalidArgumentError(name, f"shape ({d}, {d})", c.shape)
    return c


def check_state(state: Any, kind: type[Any], length: int) -> None:
    """Reject a state of another kind, or whose vector has another length, than the filter's."""
    check_kind(state, kind, "state")
    mean = state.mean
    if mean.shape[-1] != length:
        raise InvalidArgumentError("state", f"a mean of shape (..., {length})", mean.shape)


def unchecked(cls: type[T], **fields: FloatArray) -> T:
    """Return the frozen state with these fields as they are: a filter's own results need no checks."""
    state = object.__new__(cls)
    for name, value in fields.items():
        object.__setattr__(state, name, value)
    return state
