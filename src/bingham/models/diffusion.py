"""Motion in continuous time: Brownian motion of rotations and axes, alone or behind a gyroscope."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.algebra import NoiseParts, compose_spectra
from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.kernels.single import diffused_2, diffused_4
from bingham.models.motion import check_single
from bingham.rotations import from_rotation_vector
from bingham.validation import as_numbers, unit_rows

__all__ = ["Diffusion", "Gyroscope", "brownian_moments", "brownian_parts", "diffusion_weight"]

FloatArray = NDArray[np.float64]

PER_AXIS = "a finite number >= 0, or three for the axes"


def diffusion_weight(variance: ArrayLike, d: int) -> FloatArray:
    """Return 1 − e^{−σ²t} (d = 4) or 1 − e^{−2σ²t} (d = 2): the share of S that Brownian motion makes uniform.

    S' = I/d + (1 − weight)(S − I/d), exact for every σ²t (rad² per axis): x xᵀ − I/d lies in one eigenspace of the
    Laplacian, of rotations about 3 axes with rates σ² or of the angle in the plane.
    """
    return -np.expm1(-(1.0 if d == 4 else 2.0) * np.asarray(variance, dtype=np.float64))


def brownian_moments(variances: ArrayLike) -> FloatArray:
    """Return E[w²] (..., 3) of the vector part of the quaternion after Brownian motion from the identity.

    Rotating at random about three fixed orthogonal axes with variances λ₁, λ₂, λ₃ (..., 3), rad², leaves the second
    moment of (w₀, w) diagonal and mixes it by characters of the Klein four-group: with χ₁ = e^{−(λ₂+λ₃)/2} and so on,
    E[w₀²] = (1 + χ₁ + χ₂ + χ₃)/4, E[w₁²] = (1 + χ₁ − χ₂ − χ₃)/4, …. Narrow: λ/4; three infinite ones: uniform.
    """
    x, y, z = np.moveaxis(np.asarray(variances, dtype=np.float64), -1, 0)
    return np.stack([_axis_moment(x, y, z), _axis_moment(y, x, z), _axis_moment(z, x, y)], axis=-1)


def _axis_moment(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    # (e^{−(b+c)/2} − e^{−(a+c)/2} + 1 − e^{−(a+b)/2})/4, each pair without cancellation.
    lower, step = np.minimum(a, b), 0.5 * np.abs(b - a)
    first = np.copysign(np.exp(-0.5 * (lower + c)) * -np.expm1(-step), a - b)
    return 0.25 * (first - np.expm1(-0.5 * (a + b)))


def brownian_parts(variances: FloatArray) -> NoiseParts:
    """Return the noise of Brownian motion with variances (3,), rad², as the compiled steps take it."""
    w = brownian_moments(variances)
    return NoiseParts(np.array([1.0, 0.0, 0.0, 0.0]), np.diag(w), float(1.0 - w.sum()))


@dataclass(frozen=True)
class Diffusion:
    """Brownian motion: the angle about each axis has variance σ² t after t seconds, after a known rotation if any.

    Exact for any time steps: S' is the second moment of x ⊕ u ⊕ w(t), and three steps of 1 s are one of 3 s.

    Parameters
    ----------
    random_walk : float or (3,) array_like
        σ in rad/√s, for all axes or for each; raising it makes old knowledge fade faster.
    dim : int
        4 for rotations, 2 for axes in the plane (then the angle of the axis itself walks).
    left : bool, optional
        True: controls act on the left, u ⊕ x, and σ (3,) belongs to the world's axes; False: on the right, to the
        body's. Unless given, as ``noise_side`` of the filter says; right without one.
    """

    continuous_time: ClassVar[bool] = True

    random_walk: float | tuple[float, ...]
    dim: int = 4
    left: bool | None = None

    def __post_init__(self) -> None:
        if self.dim not in (2, 4):
            raise InvalidArgumentError("dim", "2 or 4", self.dim)
        object.__setattr__(self, "random_walk", _per_axis(self.random_walk, "random_walk", "rad/√s", self.dim))

    def variances(self, dt: ArrayLike) -> FloatArray:
        """Return σ² dt, rad²: (...) if it is the same about all axes, else (..., 3)."""
        return _variances(self.random_walk, dt)

    def propagate(self, state: Bingham, control: ArrayLike | None = None, dt: float | None = None) -> Bingham:
        """Return the distribution after dt seconds; ``control`` (d,) is a known rotation, which comes first."""
        check_single(state, self.dim)
        if control is not None:
            u = unit_rows(control, self.dim, "control")
            state = state.rotate(left=u) if self.left else state.rotate(right=u)
        return _diffused(state, self.variances(_time_step(dt)), bool(self.left))


@dataclass(frozen=True)
class Gyroscope:
    """x' = x ⊗ exp(ω dt / 2), then diffusion: a body-fixed gyroscope with white noise.

    The rate is that of the body about its own axes and acts on the right, on whichever side a filter has its noises.

    Parameters
    ----------
    noise_density : float or (3,) array_like
        rad/s/√Hz (equally rad/√s), for all axes or for each of the body's: the attitude's variance grows by
        noise_density² dt.
    """

    continuous_time: ClassVar[bool] = True

    noise_density: float | tuple[float, ...]
    dim: int = 4

    def __post_init__(self) -> None:
        if self.dim != 4:
            raise InvalidArgumentError("dim", "4", self.dim)
        object.__setattr__(self, "noise_density", _per_axis(self.noise_density, "noise_density", "rad/s/√Hz", 4))

    @property
    def random_walk(self) -> float | tuple[float, ...]:
        """The same number as the σ of `Diffusion`, rad/√s."""
        return self.noise_density

    def variances(self, dt: ArrayLike) -> FloatArray:
        """Return σ² dt, rad²: (...) if it is the same about all axes, else (..., 3)."""
        return _variances(self.noise_density, dt)

    def propagate(self, state: Bingham, control: ArrayLike | None = None, dt: float | None = None) -> Bingham:
        """Return the distribution after dt seconds at the angular rate ``control`` (3,), rad/s, body frame."""
        check_single(state, 4)
        step = _time_step(dt)
        rate = np.asarray(control, dtype=np.float64) if control is not None else np.full(3, np.nan)
        if rate.shape != (3,) or not np.all(np.isfinite(rate)):
            raise InvalidArgumentError("control", "a finite angular rate (3,), rad/s", control)
        rotated = state.rotate(right=from_rotation_vector(rate * step))
        return _diffused(rotated, self.variances(step), left=False)


def _per_axis(x: Any, name: str, unit: str, d: int) -> float | tuple[float, ...]:
    try:
        a = as_numbers(x, name)
    except InvalidArgumentError:
        a = np.array(np.nan)
    if a.shape not in ((), (3,)) or not np.all(np.isfinite(a) & (a >= 0.0)) or (a.ndim and d != 4):
        expected = "a finite number >= 0" if d == 2 else PER_AXIS
        raise InvalidArgumentError(name, f"{expected}, {unit}", repr(x))
    return float(a) if not a.ndim else tuple(a.tolist())


def _variances(sigma: float | tuple[float, ...], dt: ArrayLike) -> FloatArray:
    s, t = np.asarray(sigma), np.asarray(dt, dtype=np.float64)
    return s * s * (t[..., None] if s.ndim else t)


def _diffused(state: Bingham, variances: FloatArray, left: bool) -> Bingham:
    if variances.ndim:
        return Bingham.from_spectrum(*compose_spectra(state.z, state.M, brownian_parts(variances), left=left))
    weight = float(diffusion_weight(variances, state.dim))
    z, log_f = (diffused_4 if state.dim == 4 else diffused_2)(state.z, weight)
    return Bingham.from_spectrum(z, state.M, log_f)


def _time_step(dt: float | None) -> float:
    try:
        good = dt is not None and dt >= 0.0
    except TypeError:
        good = False
    if dt is None or not good:
        raise InvalidArgumentError("dt", "a time step in s, not negative", dt, "pass dt= (or times= to run)")
    return float(dt)
