"""Kalman filter for axes in the plane with the angle as its scalar state (Kurz et al. 2013, §VI)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.baselines.gaussian import KalmanFilter, KalmanInfo
from bingham.baselines.state import ArrayState
from bingham.validation import check_kind, finite, noise_variance, unchecked, unit_or_missing, unit_rows, variance

__all__ = ["AngleState", "ScalarKalmanFilter"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class AngleState(ArrayState):
    """Gaussian of an axis' angle: ``angle`` (...) in [0, π), rad, taken modulo π, and ``variance`` (...), rad²."""

    angle: FloatArray
    variance: FloatArray

    def __post_init__(self) -> None:
        angle, spread = np.broadcast_arrays(finite(self.angle, "angle"), variance(self.variance, "variance"))
        object.__setattr__(self, "angle", _half_turn(angle))
        object.__setattr__(self, "variance", spread)

    @property
    def mode(self) -> FloatArray:
        """The axis (cos, sin) of the angle (..., 2)."""
        return np.stack([np.cos(self.angle), np.sin(self.angle)], axis=-1)


@dataclass(frozen=True)
class ScalarKalmanFilter(KalmanFilter[AngleState]):
    """Angle of an axis by the linear Kalman filter; measurements are moved by multiples of π to the estimate.

    Parameters
    ----------
    process_variance : float
        rad² added in each step; raising it makes old measurements fade faster.
    measurement_variance : float
        rad² of a measured angle; raising it trusts measurements less.
    per_second : bool
        Whether the process noise is that of a second, and grows with ``dt``, rather than that of a step.

    Examples
    --------
    >>> f = ScalarKalmanFilter(0.0, 1.0)
    >>> state, info = f.update(AngleState(np.array(0.1), np.array(1.0)), [np.cos(3.1), np.sin(3.1)])
    >>> round(float(state.angle), 4), round(float(state.variance), 4)
    (0.0292, 0.5)
    """

    process_variance: float
    measurement_variance: float
    per_second: bool = False

    def __post_init__(self) -> None:
        noise_variance(self.process_variance, "process_variance")
        noise_variance(self.measurement_variance, "measurement_variance", positive=True)

    def predict(self, state: AngleState, control: ArrayLike | None = None, dt: float | None = None) -> AngleState:
        """Return the state of x ⊕ u ⊕ w: the angle of the control u (..., 2) is added, and the process variance."""
        check_kind(state, AngleState, "state")
        turn = 0.0 if control is None else _angle(unit_rows(control, 2, "control"))
        angle = _half_turn(state.angle + turn)
        return unchecked(AngleState, angle=angle, variance=state.variance + self.noise_time(dt) * self.process_variance)

    def update(self, state: AngleState, z: ArrayLike) -> tuple[AngleState, KalmanInfo]:
        """Return the state given the measured axis z (..., 2); NaN is a missing measurement."""
        check_kind(state, AngleState, "state")
        measured = _angle(unit_or_missing(z, 2, "z"))
        missing = np.isnan(measured)
        # Shift by a multiple of π so that |innovation| ≤ π/2.
        innovation = np.mod(measured - state.angle + 0.5 * np.pi, np.pi) - 0.5 * np.pi
        innovation = np.where(missing, 0.0, innovation)
        total = state.variance + self.measurement_variance
        gain = np.where(missing, 0.0, state.variance / total)
        angle = _half_turn(state.angle + gain * innovation)
        nis = innovation**2 / total
        log_evidence = -0.5 * (nis + np.log(2.0 * np.pi * total))
        info = KalmanInfo(np.where(missing, 0.0, log_evidence), np.where(missing, np.nan, nis))
        return unchecked(AngleState, angle=angle, variance=(1.0 - gain) * state.variance), info


def _angle(axis: FloatArray) -> FloatArray:
    return np.arctan2(axis[..., 1], axis[..., 0])


def _half_turn(angle: FloatArray) -> FloatArray:
    """Return the angle modulo π, in [0, π)."""
    a = np.mod(angle, np.pi)
    # Angles just below 0 round up to π.
    return np.where(a < np.pi, a, 0.0)
