"""Wrapped-normal / von Mises filter for axes, on the doubled circle (Kurz et al. 2013, Fig. 7).

An axis at angle θ is the direction φ = 2θ on the whole circle. There prediction adds wrapped normals, whose first
moments multiply, and the update multiplies von Mises densities, whose κ e^{iμ} add (Kurz, Gilitschenski & Hanebeck,
ACC 2013). Both distributions are matched by their first moment A(κ) = I₁(κ)/I₀(κ) = e^{−σ²/2}.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import i0e

from bingham.baselines.gaussian import KalmanFilter, KalmanInfo
from bingham.baselines.state import ArrayState
from bingham.baselines.von_mises import log_resultant, von_mises_concentration
from bingham.validation import check_kind, finite, noise_variance, unchecked, unit_or_missing, unit_rows, variance

__all__ = ["DoubledAngleState", "WrappedNormalFilter"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class DoubledAngleState(ArrayState):
    """Distribution of φ = 2θ: mean direction ``direction`` (...), rad, and von Mises concentration ``kappa`` (...)."""

    direction: FloatArray
    kappa: FloatArray

    def __post_init__(self) -> None:
        fields = np.broadcast_arrays(finite(self.direction, "direction"), variance(self.kappa, "kappa"))
        object.__setattr__(self, "direction", fields[0])
        object.__setattr__(self, "kappa", fields[1])

    @property
    def mode(self) -> FloatArray:
        """The axis (cos θ, sin θ) (..., 2)."""
        return np.stack([np.cos(0.5 * self.direction), np.sin(0.5 * self.direction)], axis=-1)


@dataclass(frozen=True)
class WrappedNormalFilter(KalmanFilter[DoubledAngleState]):
    """Axis in the plane by the circular filter after doubling the angle.

    Parameters
    ----------
    process_variance, measurement_variance : float
        σ², rad², of the wrapped-normal noises of the *axis* angle θ; they count four times for 2θ.
    per_second : bool
        Whether the process noise is that of a second, and grows with ``dt``, rather than that of a step.

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
    per_second: bool = False

    def __post_init__(self) -> None:
        noise_variance(self.process_variance, "process_variance")
        noise_variance(self.measurement_variance, "measurement_variance", positive=True)

    @cached_property
    def _sensor_kappa(self) -> float:
        return float(von_mises_concentration(-2.0 * self.measurement_variance))

    def predict(
        self, state: DoubledAngleState, control: ArrayLike | None = None, dt: float | None = None
    ) -> DoubledAngleState:
        """Return the state of x ⊕ u ⊕ w: resultants multiply; control u (..., 2)."""
        check_kind(state, DoubledAngleState, "state")
        u = None if control is None else unit_rows(control, 2, "control")
        turn = 0.0 if u is None else 2.0 * np.arctan2(u[..., 1], u[..., 0])
        kappa = von_mises_concentration(log_resultant(state.kappa) - 2.0 * self.noise_time(dt) * self.process_variance)
        return unchecked(DoubledAngleState, direction=state.direction + turn, kappa=kappa)

    def update(self, state: DoubledAngleState, z: ArrayLike) -> tuple[DoubledAngleState, KalmanInfo]:
        """Return the state given the measured axis z (..., 2): κ e^{iμ} add; NaN is a missing measurement."""
        check_kind(state, DoubledAngleState, "state")
        a = unit_or_missing(z, 2, "z")
        missing = np.isnan(a[..., 0])
        a = np.where(missing[..., None], [1.0, 0.0], a)
        phi = 2.0 * np.arctan2(a[..., 1], a[..., 0])
        kappa_x, kappa_z = state.kappa, self._sensor_kappa
        vector = kappa_x * np.exp(1j * state.direction) + kappa_z * np.exp(1j * phi)
        kappa = np.abs(vector)
        # κ_x + κ_z − κ without cancellation, by the cosine rule; 0 if nothing is known.
        length = np.maximum(kappa_x + kappa_z + kappa, np.finfo(float).tiny)
        loss = 4.0 * kappa_x * kappa_z * np.sin(0.5 * (phi - state.direction)) ** 2 / length
        # log ∫ f(z|x) f(x), as a density of the axis on the whole circle of (cos θ, sin θ).
        log_evidence = np.log(i0e(kappa) / (2.0 * np.pi * i0e(kappa_z) * i0e(kappa_x))) - loss
        info = KalmanInfo(np.where(missing, 0.0, log_evidence), np.where(missing, np.nan, 2.0 * loss))
        direction, kappa = np.where(missing, state.direction, np.angle(vector)), np.where(missing, kappa_x, kappa)
        return unchecked(DoubledAngleState, direction=direction, kappa=kappa), info
