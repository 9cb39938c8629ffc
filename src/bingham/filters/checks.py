"""Checks that several filters share: sides of noises, variances, covariances, dimensions of states."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.arguments import check_kind, described
from bingham.distributions.bingham import Bingham
from bingham.distributions.mixture import BinghamMixture
from bingham.errors import InvalidArgumentError

__all__ = [
    "check_measurement_noise",
    "check_noise_side",
    "check_process_noise",
    "check_state",
    "covariance_matrix",
    "finite",
    "noise_covariance",
    "noise_variance",
    "unchecked",
    "variance",
]

FloatArray = NDArray[np.float64]
T = TypeVar("T")

DISTRIBUTION_OF_NOISE = "for a covariance C about the identity: Bingham.from_covariance([1, 0, 0, 0], C, frame='body')"


def check_noise_side(noise_side: str) -> None:
    """Reject what is neither "right" (body frame) nor "left" (world frame)."""
    if noise_side not in ("right", "left"):
        raise InvalidArgumentError("noise_side", "'right' or 'left'", repr(noise_side))


def check_process_noise(w: Any) -> None:
    """Reject what is neither a distribution nor has the methods of a `MotionModel`."""
    if isinstance(w, Bingham) or (callable(getattr(w, "propagate", None)) and not isinstance(w, type)):
        return
    expected = "a Bingham distribution or a motion model with propagate(state, control, dt)"
    if callable(getattr(w, "likelihood", None)):
        hint = "swap them: the process noise comes first, the sensor second"
    else:
        hint = DISTRIBUTION_OF_NOISE + ", or take Diffusion(σ) or Gyroscope(noise density)"
    raise InvalidArgumentError("process_noise", expected, described(w), hint)


def check_measurement_noise(v: Any, *, mixtures: bool = False) -> None:
    """Reject what is no distribution (or mixture, where filters take them) and has not the method of a `Sensor`."""
    if isinstance(v, Bingham) or (mixtures and isinstance(v, BinghamMixture)):
        return
    if callable(getattr(v, "likelihood", None)) and not isinstance(v, type):
        return
    distributions = "a Bingham distribution, a BinghamMixture" if mixtures else "a Bingham distribution"
    if callable(getattr(v, "propagate", None)):
        hint = "swap them: the process noise, or motion model, comes first, the sensor second"
    elif isinstance(v, BinghamMixture):
        hint = "MixtureFilter takes mixtures"
    else:
        hint = DISTRIBUTION_OF_NOISE
    expected = f"{distributions} or a sensor with likelihood(z, predicted)"
    raise InvalidArgumentError("measurement_noise", expected, described(v), hint)


def check_state(state: Any, kind: type[Any], length: int) -> None:
    """Reject a state of another kind, or whose vector has another length, than the filter's."""
    check_kind(state, kind, "state")
    mean = state.mean
    if mean.shape[-1] != length:
        raise InvalidArgumentError("state", f"a mean of shape (..., {length})", mean.shape)


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


def unchecked(cls: type[T], **fields: FloatArray) -> T:
    """Return the frozen state with these fields as they are: a filter's own results need no checks."""
    state = object.__new__(cls)
    for name, value in fields.items():
        object.__setattr__(state, name, value)
    return state
