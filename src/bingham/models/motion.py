"""Motion models: how a distribution moves and widens between two measurements.

Each is a small frozen value with ``propagate(state, control, dt) -> Bingham``; ``left`` says on which side
its noise acts: x ⊕ w (False; body frame, Kurz et al.) or w ⊕ x (True; world frame, Glover & Kaelbling).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.algebra import NoiseParts, compose_spectra, noise_parts
from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution
from bingham.errors import InvalidArgumentError
from bingham.kernels.moments import concentrations_2
from bingham.kernels.single import diffused_4
from bingham.rotations import from_rotation_vector
from bingham.validation import check_number, unit_rows

__all__ = ["ControlledRotation", "Diffusion", "Gyroscope", "MotionModel", "RandomWalk", "diffusion_weight"]

FloatArray = NDArray[np.float64]


class MotionModel(Protocol):
    """What a filter asks of a motion model."""

    @property
    def dim(self) -> int:
        """Ambient dimension of the states it moves."""
        ...

    def propagate(self, state: Bingham, control: ArrayLike | None, dt: float | None) -> Bingham:
        """Return the predicted distribution."""
        ...


def diffusion_weight(variance: ArrayLike, d: int) -> FloatArray:
    """Return 1 − e^{−σ²t} (d = 4) or 1 − e^{−2σ²t} (d = 2): the share of S that Brownian motion makes uniform.

    S' = I/d + (1 − uniform_weight)(S − I/d), exact for every σ²t (rad² per axis): x xᵀ − I/d lies in one eigenspace of
    the Laplacian, of rotations about 3 axes with rates σ² or of the angle in the plane.
    """
    return -np.expm1(-(1.0 if d == 4 else 2.0) * np.asarray(variance, dtype=np.float64))


def _diffused(state: Bingham, uniform_weight: float) -> Bingham:
    if state.dim == 4:
        z, log_f = diffused_4(state.z, uniform_weight)
    else:
        w = float(state.axis_moments[0])
        z1, log_f, _ = concentrations_2(w + uniform_weight * (0.5 - w))
        z = np.array([z1, 0.0])
    return Bingham.from_spectrum(z, state.M, log_f)


def _single(state: Bingham, d: int) -> None:
    if state.dim != d or state.shape:
        raise InvalidArgumentError(
            "state", f"a single distribution of dimension {d}", f"dimension {state.dim}, batch {state.shape}"
        )


def _time_step(dt: float | None) -> float:
    try:
        good = dt is not None and dt >= 0.0
    except TypeError:
        good = False
    if dt is None or not good:
        raise InvalidArgumentError("dt", "a time step in s, not negative", dt, "pass dt= (or times= to run)")
    return float(dt)


@dataclass(frozen=True)
class RandomWalk:
    """x' = x ⊕ w (or w ⊕ x), w ~ `noise`, once per step whatever its duration (Kurz et al. 2014, eq. 40).

    Parameters
    ----------
    noise : Bingham
        d = 2 or 4; its mode may be a constant motion.
    left : bool
        True for w ⊕ x.
    """

    noise: Bingham
    left: bool = False

    def __post_init__(self) -> None:
        check_distribution(self.noise, "noise")
        if self.noise.dim not in (2, 4) or self.noise.shape:
            raise InvalidArgumentError("noise", "a single distribution of dimension 2 or 4", repr(self.noise))

    @property
    def dim(self) -> int:
        """Ambient dimension."""
        return self.noise.dim

    @cached_property
    def parts(self) -> NoiseParts:
        """The noise as the compiled steps take it."""
        return noise_parts(self.noise.z, self.noise.M, self.noise.axis_moments, left=self.left)

    def propagate(self, state: Bingham, control: ArrayLike | None = None, dt: float | None = None) -> Bingham:
        """Return the moment match of x ⊕ w; ``control`` rotates the state first, as in `ControlledRotation`."""
        _single(state, self.dim)
        if control is not None:
            u = unit_rows(control, self.dim, "control")
            state = state.rotate(left=u) if self.left else state.rotate(right=u)
        return Bingham.from_spectrum(*compose_spectra(state.z, state.M, self.parts, left=self.left))


@dataclass(frozen=True)
class ControlledRotation(RandomWalk):
    """x' = x ⊕ u ⊕ w (or w ⊕ u ⊕ x): a known rotation u, the control, then noise."""

    def propagate(self, state: Bingham, control: ArrayLike | None = None, dt: float | None = None) -> Bingham:
        """Return the predicted distribution; ``control`` (d,) is the unit quaternion or unit complex number u."""
        if control is None:
            raise InvalidArgumentError("control", f"the known rotation, shape ({self.dim},)", None)
        return super().propagate(state, control, dt)


@dataclass(frozen=True)
class Diffusion:
    """Isotropic Brownian motion: the angle about each axis has variance σ² t after t seconds.

    Parameters
    ----------
    random_walk : float
        σ in rad/√s; raising it makes old knowledge fade faster.
    dim : int
        4 for rotations, 2 for axes in the plane (then the angle of the axis itself walks).
    """

    random_walk: float
    dim: int = 4

    def __post_init__(self) -> None:
        check_number(self.random_walk, "random_walk", "a finite number >= 0, rad/√s", minimum=0.0)
        if self.dim not in (2, 4):
            raise InvalidArgumentError("dim", "2 or 4", self.dim)

    def propagate(self, state: Bingham, control: ArrayLike | None = None, dt: float | None = None) -> Bingham:
        """Return the distribution after dt seconds; ``control`` (d,) is a known rotation on the right."""
        _single(state, self.dim)
        if control is not None:
            state = state.rotate(right=control)
        return _diffused(state, float(diffusion_weight(self.random_walk**2 * _time_step(dt), self.dim)))


@dataclass(frozen=True)
class Gyroscope:
    """x' = x ⊗ exp(ω dt / 2), then diffusion: a body-fixed gyroscope with white noise.

    Parameters
    ----------
    noise_density : float
        rad/s/√Hz (equally rad/√s): the attitude's variance per axis grows by noise_density² dt.
    """

    noise_density: float
    dim: int = 4

    def __post_init__(self) -> None:
        check_number(self.noise_density, "noise_density", "a finite number >= 0, rad/s/√Hz", minimum=0.0)
        if self.dim != 4:
            raise InvalidArgumentError("dim", "4", self.dim)

    @property
    def random_walk(self) -> float:
        """The same number as the σ of `Diffusion`, rad/√s."""
        return self.noise_density

    def propagate(self, state: Bingham, control: ArrayLike | None = None, dt: float | None = None) -> Bingham:
        """Return the distribution after dt seconds at the angular rate ``control`` (3,), rad/s, body frame."""
        _single(state, 4)
        step = _time_step(dt)
        rate = np.asarray(control, dtype=np.float64) if control is not None else np.full(3, np.nan)
        if rate.shape != (3,) or not np.all(np.isfinite(rate)):
            raise InvalidArgumentError("control", "a finite angular rate (3,), rad/s", control)
        rotated = state.rotate(right=from_rotation_vector(rate * step))
        return _diffused(rotated, float(diffusion_weight(self.noise_density**2 * step, 4)))
