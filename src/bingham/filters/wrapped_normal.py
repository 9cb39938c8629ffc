"""Wrapped-normal / von Mises filter for axes, on the doubled circle (Kurz et al. 2013, Fig. 7).

An axis at angle θ is the direction φ = 2θ on the whole circle. There prediction adds wrapped normals, whose first
moments multiply, and the update multiplies von Mises densities, whose κ e^{iμ} add (Kurz, Gilitschenski & Hanebeck,
ACC 2013). Both laws are matched by their first moment A(κ) = I₁(κ)/I₀(κ) = e^{−σ²/2}.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import i0e, i1e

from bingham.errors import InvalidArgumentError
from bingham.filters.gaussian import KalmanInfo, KalmanTrack, run_steps
from bingham.rotations import unit_or_missing, unit_rows

__all__ = ["DoubledAngleState", "WrappedNormalFilter", "resultant_length", "von_mises_concentration"]

FloatArray = NDArray[np.float64]

# Quadratic convergence from an error of 1 % ends at rounding after four.
NEWTON_STEPS = 4


def resultant_length(kappa: ArrayLike) -> FloatArray:
    """Return A(κ) = I₁(κ)/I₀(κ) (...), the length of the first moment of a von Mises law."""
    k = np.asarray(kappa, dtype=np.float64)
    return i1e(k) / i0e(k)


def von_mises_concentration(resultant: ArrayLike) -> FloatArray:
    """Return κ (...) with A(κ) = resultant (...) in [0, 1), by Newton's method with A' = 1 − A/κ − A²."""
    r = np.asarray(resultant, dtype=np.float64)
    # Good to 1 % everywhere: exact to first order at 0 and at 1.
    kappa = r * (2.0 - r * r) / (1.0 - r * r)
    for _ in range(NEWTON_STEPS):
        a = resultant_length(kappa)
        slope = 1.0 - np.divide(a, kappa, out=np.full_like(kappa, 0.5), where=kappa > 0.0) - a * a
        kappa = np.maximum(kappa - (a - r) / slope, 0.0)
    return kappa


@dataclass(frozen=True, slots=True, eq=False)
class DoubledAngleState:
    """Law of φ = 2θ: mean direction ``direction`` (...), rad, and von Mises concentration ``kappa`` (...)."""

    direction: FloatArray
    kappa: FloatArray

    @property
    def mode(self) -> FloatArray:
        """The axis (cos θ, sin θ) (..., 2)."""
        return np.stack([np.cos(0.5 * self.direction), np.sin(0.5 * self.direction)], axis=-1)


@dataclass(frozen=True)
class WrappedNormalFilter:
    """Axis in the plane by the circular filter after doubling the angle.

    Parameters
    ----------
    process_variance, measurement_variance : float
        σ², rad², of the wrapped-normal noises of the *axis* angle θ; they count four times for 2θ.

    Examples
    --------
    >>> f = WrappedNormalFilter(0.0025, 0.27)
    >>> state = f.predict(DoubledAngleState(np.array(np.pi), np.array(0.5)))
    >>> state, _ = f.update(state, [1.0, 0.0])
    >>> np.abs(state.mode).round(6)
    array([1., 0.])
    """

    process_variance: float
    measurement_variance: float

    def __post_init__(self) -> None:
        for name, least in (("process_variance", 0.0), ("measurement_variance", np.finfo(float).tiny)):
            if not least <= getattr(self, name) < np.inf:
                raise InvalidArgumentError(name, "a finite variance in rad², not negative", getattr(self, name))

    @cached_property
    def _sensor_kappa(self) -> float:
        return float(von_mises_concentration(np.exp(-2.0 * self.measurement_variance)))

    def predict(
        self, state: DoubledAngleState, control: ArrayLike | None = None, dt: float | None = None
    ) -> DoubledAngleState:
        """Return the state of x ⊕ u ⊕ w: resultants multiply; control u (..., 2)."""
        u = None if control is None else unit_rows(control, 2, "control")
        turn = 0.0 if u is None else 2.0 * np.arctan2(u[..., 1], u[..., 0])
        resultant = resultant_length(state.kappa) * np.exp(-2.0 * self.process_variance)
        return DoubledAngleState(state.direction + turn, von_mises_concentration(resultant))

    def update(self, state: DoubledAngleState, z: ArrayLike) -> tuple[DoubledAngleState, KalmanInfo]:
        """Return the state given the measured axis z (..., 2): κ e^{iμ} add; NaN is a missing measurement."""
        a = unit_or_missing(z, 2, "z")
        missing = np.isnan(a[..., 0])
        a = np.where(missing[..., None], [1.0, 0.0], a)
        kappa_z = np.where(missing, 0.0, self._sensor_kappa)
        phi = 2.0 * np.arctan2(a[..., 1], a[..., 0])
        vector = state.kappa * np.exp(1j * state.direction) + kappa_z * np.exp(1j * phi)
        kappa = np.abs(vector)
        # log ∫ f(z|x) f(x), as a density of the axis on the whole circle of (cos θ, sin θ).
        log_evidence = (
            np.log(i0e(kappa) / (2.0 * np.pi * i0e(kappa_z) * i0e(state.kappa))) + kappa - state.kappa - kappa_z
        )
        statistic = 2.0 * (state.kappa + kappa_z - kappa)
        info = KalmanInfo(np.where(missing, 0.0, log_evidence), np.where(missing, np.nan, statistic))
        return DoubledAngleState(np.angle(vector), kappa), info

    def run(self, prior: DoubledAngleState, measurements: ArrayLike, controls: ArrayLike | None = None) -> KalmanTrack:
        """Predict, then update, for every row of measurements (..., T, 2)."""
        return run_steps(self, prior, measurements, controls)
