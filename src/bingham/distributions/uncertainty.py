"""What a Bingham distribution says about its own spread: credible angles, covariances, standard errors of a fit."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.normalizer import log_normalizer, log_normalizer_derivatives
from bingham.errors import InvalidArgumentError
from bingham.rotations import compose, conjugate
from bingham.validation import as_numbers, check_number

__all__ = [
    "colatitude_density",
    "covariance",
    "credible_angle",
    "frame_required",
    "heading_and_inclination",
    "moment_from_covariance",
    "standard_errors",
]

FloatArray = NDArray[np.float64]
P = ParamSpec("P")
R = TypeVar("R")

NODES, WEIGHTS = np.polynomial.legendre.leggauss(48)
# The part of the tail beyond the point where the density along the weakest axis is e^{-TAIL} is below rounding.
TAIL = 40.0


def colatitude_density(z: FloatArray, angle: float) -> tuple[FloatArray, FloatArray]:
    """Return nodes φ in [0, angle] and weights with Σ weights·g(φ) = E[g(φ); φ ≤ angle], φ = arccos |xᵀ mode|, z (d,).

    The density of φ is 2 sin^{d−2}φ F_{d−1}(z_rest sin²φ) / F(z).

    From the density of t = mᵀx, f(t) ∝ (1 − t²)^{(d−3)/2} F_{d−1}((1 − t²) z_rest), t = cos φ. The range is cut into
    panels of the width of the narrowest axis, dyadically growing, so that one rule resolves every spread.
    """
    d = z.size
    width = min(angle, 2.0 / math.sqrt(1.0 - 2.0 * z[0]))
    edges = [0.0]
    while edges[-1] < angle:
        edges.append(min(angle, edges[-1] + max(width, 0.7 * edges[-1])))
    left, right = np.array(edges[:-1])[:, None], np.array(edges[1:])[:, None]
    half = 0.5 * (right - left)
    phi = (left + half * (NODES + 1.0)).ravel()
    weight = (half * WEIGHTS).ravel()
    sine = np.sin(phi)
    rest = sine[:, None] ** 2 * z[:-1]
    log_rest = log_normalizer(rest) if d > 2 else math.log(2.0) + rest[:, 0]
    return phi, 2.0 * weight * np.exp((d - 2) * np.log(sine) + log_rest - log_normalizer(z))


def credible_angle(z: FloatArray, p: ArrayLike) -> Any:
    """Return α (...) with P(arccos |xᵀ mode| ≤ α) = p for z (..., d), p (...), broadcast."""
    from scipy.optimize import root_scalar

    share = as_numbers(p, "p")
    if not np.all((share >= 0.0) & (share <= 1.0)):
        raise InvalidArgumentError("p", "probabilities in [0, 1]", p)
    shape = np.broadcast_shapes(z.shape[:-1], share.shape)
    rows = np.broadcast_to(z, (*shape, z.shape[-1])).reshape(-1, z.shape[-1])
    levels = np.broadcast_to(share, shape).ravel()
    out = np.empty(levels.size)
    for i, (row, level) in enumerate(zip(rows, levels, strict=True)):
        # Beyond `far` lies less than rounding, unless the weakest axis reaches all around.
        far = min(0.5 * math.pi, math.asin(min(1.0, math.sqrt(TAIL / max(-row[-2], 1e-300)))))
        if level <= 0.0:
            out[i] = 0.0
        elif level >= 1.0:
            out[i] = 0.5 * math.pi
        elif colatitude_density(row, far)[1].sum() <= level:
            out[i] = far
        else:
            solution = root_scalar(
                lambda a, r=row, q=level: (colatitude_density(r, a)[1].sum() if a > 0.0 else 0.0) - q,
                bracket=(0.0, far),
                xtol=1e-14,
                rtol=1e-12,
            )
            out[i] = solution.root
    return out.reshape(shape)[()]


def frame_required(function: Callable[P, R]) -> Callable[P, R]:
    """Reject calls without ``frame=`` in the words of every other mistake, not with Python's bare TypeError."""

    @wraps(function)
    def asking(*args: P.args, **kwargs: P.kwargs) -> R:
        if "frame" not in kwargs:
            got = f"{args[-1]!r} without the name" if isinstance(args[-1], str) else "none"
            hint = "name the axes of the small rotation; there is no default"
            raise InvalidArgumentError("frame", "frame='body' or frame='world'", got, hint)
        return function(*args, **kwargs)

    return asking


def _frame_is_named(frame: str) -> bool:
    if frame not in ("body", "world"):
        raise InvalidArgumentError("frame", "'body' or 'world'", repr(frame), "name the axes of the small rotation")
    return frame == "body"


def covariance(M: FloatArray, w: FloatArray, frame: str, undefined: str) -> FloatArray:
    """Return C = 4 Σᵢ ωᵢ eᵢ eᵢᵀ (..., 3, 3), eᵢ the vector part of mode* ⊗ mᵢ (body) or mᵢ ⊗ mode* (world)."""
    body = _frame_is_named(frame)
    if M.shape[-1] != 4:
        raise InvalidArgumentError("distribution", "one of rotations, d = 4", f"d = {M.shape[-1]}")
    if undefined not in ("raise", "nan"):
        raise InvalidArgumentError("undefined", "'raise' or 'nan'", repr(undefined))
    vague = 2.0 * w[..., 2] > w[..., 3]
    if undefined == "raise" and np.any(vague):
        raise InvalidArgumentError(
            "distribution",
            "one clear mode (twice as heavy as any other axis)",
            f"moments {w[vague][0] if w.ndim > 1 else w}",
            "use moment() or credible_angle(), or pass undefined='nan'",
        )
    axes = np.swapaxes(M, -1, -2)
    back = conjugate(M[..., None, :, 3])
    e = (compose(back, axes) if body else compose(axes, back))[..., :3, 1:]
    c = 4.0 * np.einsum("...ki,...k,...kj->...ij", e, w[..., :3], e)
    return np.where(vague[..., None, None], np.nan, c) if np.any(vague) else c


def heading_and_inclination(covariance: FloatArray, level: float = 0.95) -> tuple[FloatArray, FloatArray]:
    """Return how far heading and inclination may be off, rad (...), of covariances (..., 3, 3) in world axes, rad².

    The half-width of a normal variable's interval about the vertical third axis, and the radius of a disc that holds at
    least as much of the other two: their largest standard deviation times √χ²₂.
    """
    a, b, c = covariance[..., 0, 0], covariance[..., 0, 1], covariance[..., 1, 1]
    widest = (a + c) / 2.0 + np.hypot((a - c) / 2.0, b)
    from scipy.special import chdtri  # loads slowly

    across = math.sqrt(chdtri(1, 1.0 - level)) * np.sqrt(covariance[..., 2, 2])
    return across, math.sqrt(chdtri(2, 1.0 - level)) * np.sqrt(widest)


def moment_from_covariance(mode: FloatArray, c: ArrayLike, frame: str) -> tuple[FloatArray, FloatArray]:
    """Return (ω, M) of the second moment about mode (..., 4) whose `covariance` is c (..., 3, 3)."""
    body = _frame_is_named(frame)
    a = as_numbers(c, "covariance")
    if a.shape[-2:] != (3, 3):
        raise InvalidArgumentError("covariance", "shape (..., 3, 3), rad²", a.shape)
    if not np.all(np.isfinite(a)) or np.abs(a - np.swapaxes(a, -1, -2)).max(initial=0.0) > 1e-8 * np.abs(a).max(
        initial=0.0
    ):
        raise InvalidArgumentError("covariance", "finite and symmetric", a)
    values, vectors = np.linalg.eigh(a)
    tangent = 0.25 * values
    weight = 1.0 - tangent.sum(axis=-1)
    if not (np.all(tangent > 0.0) and np.all(weight > tangent[..., 2])):
        raise InvalidArgumentError(
            "covariance",
            "positive definite with a trace small enough for a mode (below about 2 rad²)",
            f"variances from {values.min():.4g} to {values.max():.4g} rad²",
            "multiply degrees² by (π/180)²; for angles that may be anything start from a girdle or Bingham.uniform",
        )
    # Descending variance is ascending moment order reversed: rows from the narrowest to the widest, then the mode.
    e = np.concatenate([np.zeros((*values.shape, 1)), np.swapaxes(vectors, -1, -2)], axis=-1)
    axes = compose(mode[..., None, :], e) if body else compose(e, mode[..., None, :])
    shape = np.broadcast_shapes(axes.shape[:-2], mode.shape[:-1])
    rows = np.concatenate(
        [np.broadcast_to(axes, (*shape, 3, 4)), np.broadcast_to(mode[..., None, :], (*shape, 1, 4))], axis=-2
    )
    w = np.concatenate([tangent, weight[..., None]], axis=-1)
    return np.ascontiguousarray(np.broadcast_to(w, (*shape, 4))), np.ascontiguousarray(np.swapaxes(rows, -1, -2))


def standard_errors(z: FloatArray, n: float) -> tuple[FloatArray, FloatArray]:
    """Return standard errors of z (..., d) and of the axes (..., d, d) for n samples."""
    check_number(n, "n", "the number of samples, above 0", above=0.0)
    _, w, hessian = log_normalizer_derivatives(z)
    d = z.shape[-1]
    information = n * hessian[..., : d - 1, : d - 1]
    # Scaled to unit diagonal before the inversion: its entries span the square of the spectrum.
    scale = np.sqrt(np.einsum("...ii->...i", information))
    inverse = np.linalg.inv(information / (scale[..., :, None] * scale[..., None, :]))
    error_z = np.concatenate(
        [np.sqrt(np.einsum("...ii->...i", inverse)) / scale, np.zeros((*z.shape[:-1], 1))], axis=-1
    )
    gap = (z[..., :, None] - z[..., None, :]) * (w[..., :, None] - w[..., None, :])
    with np.errstate(divide="ignore"):
        axes = 1.0 / np.sqrt(2.0 * n * np.maximum(gap, 0.0))
    axes[..., np.arange(d), np.arange(d)] = 0.0
    return error_z, axes
