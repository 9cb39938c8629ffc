"""Spectral forms and the composition of moments, for `Bingham`."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError
from bingham.kernels.numpy_rule import LARGEST, diagonalize_one
from bingham.rotations import compose, conjugate
from bingham.validation import UNIT_TOLERANCE, as_numbers, unit_rows

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["NoiseParts", "compose_spectra", "noise_parts", "sample_rows", "sorted_spectrum", "spectral"]

FloatArray = NDArray[np.float64]

ORTHOGONAL_TOLERANCE = 1e-6
# A frame as orthogonal as this stays as it is: what was computed or saved comes back with the same bits.
ROUNDING = 1e-14
SYMMETRY_TOLERANCE = 1e-8


class NoiseParts(NamedTuple):
    """A noise distribution v for the compiled steps: v = mode ⊕ e (right) or e ⊕ mode (left), e near the identity.

    ``mode`` (d,); ``tangent`` (d−1, d−1) = E[vec e vec eᵀ]; ``weight`` = E[(modeᵀ v)²].
    """

    mode: FloatArray
    tangent: FloatArray
    weight: float


def sorted_spectrum(z: ArrayLike, frame: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return z (..., d) ascending with last entry 0 and the columns of frame (..., d, d) in the same order."""
    a, m = as_numbers(z, "z"), as_numbers(frame, "M")
    if a.ndim == 0 or a.shape[-1] < 2:
        raise InvalidArgumentError("z", "shape (..., d) with d >= 2", a.shape)
    d = a.shape[-1]
    if m.ndim < 2 or m.shape[-2:] != (d, d):
        swapped = a.ndim >= 2 and a.shape[-2] == d and m.shape == a.shape[:-1]
        hint = "z comes first: Bingham(z, M)" if swapped else ""
        raise InvalidArgumentError("M", f"shape (..., {d}, {d}) to go with z of shape {a.shape}", m.shape, hint)
    if not np.all(np.isfinite(a)) or np.any(np.ptp(a, axis=-1) > LARGEST):
        raise InvalidArgumentError("z", f"finite concentrations that differ by at most {LARGEST:g}", a)
    gram = np.swapaxes(m, -1, -2) @ m
    off = np.abs(gram - np.eye(d)).max(initial=0.0)
    if not off <= ORTHOGONAL_TOLERANCE:
        raise InvalidArgumentError(
            "M",
            f"an orthogonal matrix within {ORTHOGONAL_TOLERANCE:g}",
            f"max |MᵀM − I| = {off:.3g}",
            "orthonormalise its columns, or use from_matrix",
        )
    try:
        shape = np.broadcast_shapes(a.shape[:-1], m.shape[:-2])
    except ValueError:
        raise InvalidArgumentError("M", f"a batch to go with z of shape {a.shape}", m.shape) from None
    a, m = np.broadcast_to(a, (*shape, d)), np.broadcast_to(m, (*shape, d, d))
    order = np.argsort(a, axis=-1, kind="stable")
    a = np.take_along_axis(a, order, axis=-1)
    m = np.take_along_axis(m, order[..., None, :], axis=-1)
    if off > ROUNDING:
        # One Newton step towards the nearest orthogonal matrix removes the rounding of typed or stored digits.
        m = m @ (1.5 * np.eye(d) - 0.5 * (np.swapaxes(m, -1, -2) @ m))
    return np.ascontiguousarray(a - a[..., -1:]), np.ascontiguousarray(m)


def sample_rows(x: ArrayLike | Rotation) -> FloatArray:
    """Return unit vectors as rows (..., n, d); columns of unit length get an error of their own."""
    try:
        a = unit_rows(x, None, "x")
    except InvalidArgumentError:
        columns = as_numbers(x, "x")
        if columns.ndim >= 2 and np.all(np.abs(np.linalg.norm(columns, axis=-2) - 1.0) <= UNIT_TOLERANCE):
            got = f"shape {columns.shape} with unit vectors as columns"
            raise InvalidArgumentError("x", "samples as rows, shape (..., n, d)", got, "transpose it: x.T") from None
        raise
    if a.ndim < 2:
        raise InvalidArgumentError("x", "samples as rows, shape (..., n, d)", a.shape)
    return a


def spectral(matrix: ArrayLike, name: str, *, compiled: bool = True) -> tuple[FloatArray, FloatArray]:
    """Return ascending eigenvalues (..., d) and eigenvectors (..., d, d; columns) of a checked symmetric matrix.

    compiled=False serves a single matrix without the compiler.
    """
    a = as_numbers(matrix, name)
    if a.ndim < 2 or a.shape[-1] != a.shape[-2] or a.shape[-1] < 2:
        raise InvalidArgumentError(name, "shape (..., d, d) with d >= 2", a.shape)
    if not np.all(np.isfinite(a)):
        raise InvalidArgumentError(name, "finite entries", "NaN or infinity")
    skew = np.abs(a - np.swapaxes(a, -1, -2)).max(initial=0.0)
    if skew > SYMMETRY_TOLERANCE * max(1.0, float(np.abs(a).max(initial=0.0))):
        raise InvalidArgumentError(
            name,
            "a symmetric matrix",
            f"max |{name} − {name}ᵀ| = {skew:.3g}",
            f"symmetrise it: ({name} + {name}.T) / 2",
        )
    d = a.shape[-1]
    if a.ndim == 2 and not (compiled and d == 4):
        return diagonalize_one(a)
    if d != 4:
        return np.linalg.eigh(a)
    from bingham.kernels.rows import diagonalize_rows_4

    # LAPACK gives a good frame cheaply; Jacobi in that frame restores the relative accuracy of small eigenvalues.
    rows = a.reshape(-1, d, d)
    frames = np.ascontiguousarray(np.swapaxes(np.linalg.eigh(rows)[1], -1, -2))
    values = np.empty(rows.shape[:-1])
    diagonalize_rows_4(np.ascontiguousarray(rows), values, frames)
    return values.reshape(a.shape[:-1]), np.ascontiguousarray(np.swapaxes(frames, -1, -2)).reshape(a.shape)


def noise_parts(z: FloatArray, frame: FloatArray, w: FloatArray, *, left: bool = False) -> NoiseParts:
    """Split one noise distribution into its mode and the moment of its deviation; z (d,), frame (d, d), w = ω (d,)."""
    d = z.shape[-1]
    mode = np.ascontiguousarray(frame[:, -1])
    axes = frame.T[: d - 1]
    deviation = compose(axes, conjugate(mode)) if left else compose(conjugate(mode), axes)
    e = deviation[:, 1:]
    return NoiseParts(mode, np.ascontiguousarray((e.T * w[: d - 1]) @ e), float(w[-1]))


def compose_spectra(
    z: FloatArray, frame: FloatArray, noise: NoiseParts, *, left: bool = False
) -> tuple[FloatArray, FloatArray, float]:
    """Return (z', M', log F') of the moment match of x ⊕ v (left: v ⊕ x) for one distribution x, d = 2 or 4."""
    d = z.shape[-1]
    if z.ndim != 1 or d not in (2, 4):
        raise InvalidArgumentError(
            "distribution",
            "a single one of dimension 2 or 4",
            f"shape {z.shape}",
            "compose batches one by one, or use BinghamFilter.run",
        )
    single = _single_steps()
    if d == 2:
        new_z, new_frame = np.empty(2), np.empty((2, 2))
        log_f = single.composed_2(z, frame, noise.mode, noise.tangent[0, 0], new_z, new_frame)
        return new_z, new_frame, log_f
    return single.composed_4(z, frame, noise.mode, noise.tangent, noise.weight, left)


@cache
def _single_steps() -> Any:
    """Import the kernels of single steps when one is asked for, and only once: an import statement takes 0.6 µs."""
    from bingham.kernels import single

    return single
