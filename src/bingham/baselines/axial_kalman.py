"""Kalman filter on the unit vector itself, for axes (d = 2) and quaternions (d = 4) (Kurz et al. 2014, §7)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.baselines.gaussian import GaussianState, KalmanFilter, KalmanInfo, align_to, kalman_update, symmetric
from bingham.errors import InvalidArgumentError
from bingham.rotations import compose, right_matrix
from bingham.validation import check_state, covariance_matrix, noise_covariance, unchecked, unit_rows

__all__ = ["AxialKalmanFilter"]


@dataclass(frozen=True, eq=False)
class AxialKalmanFilter(KalmanFilter[GaussianState]):
    """Linear Kalman filter in ℝ^d that mirrors each measurement to the estimate's side and renormalises the estimate.

    Noise is additive, x' = x ⊕ u + w and z = x + v, and its covariance is the same wherever the state points: what
    holds for the noise about the identity is used about every state. That is the published baseline, and its flaw.

    Parameters
    ----------
    process_covariance, measurement_covariance : (d, d) array_like
        Covariances of w and v, such as `to_gaussian` finds for Bingham noise with the identity as mode (eq. 57).
    per_second : bool
        Whether the process noise is that of a second, and grows with ``dt``, rather than that of a step.

    Examples
    --------
    >>> f = AxialKalmanFilter(np.zeros((2, 2)), np.eye(2))
    >>> state, _ = f.update(GaussianState(np.array([1.0, 0.0]), np.eye(2)), [-1.0, 0.0])
    >>> state.mean, state.covariance
    (array([1., 0.]), array([[0.5, 0. ],
           [0. , 0.5]]))
    """

    process_covariance: ArrayLike
    measurement_covariance: ArrayLike
    per_second: bool = False
    _w: NDArray[np.float64] = field(init=False, repr=False)
    _v: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        w = covariance_matrix(self.process_covariance, None, "process_covariance")
        if w.shape not in ((2, 2), (4, 4)):
            raise InvalidArgumentError("process_covariance", "shape (2, 2) or (4, 4)", w.shape)
        v = noise_covariance(self.measurement_covariance, len(w), "measurement_covariance")
        object.__setattr__(self, "_w", w)
        object.__setattr__(self, "_v", v)

    def predict(
        self, state: GaussianState, control: ArrayLike | Rotation | None = None, dt: float | None = None
    ) -> GaussianState:
        """Return the state of x ⊕ u + w for a known rotation u (..., d)."""
        d = len(self._w)
        check_state(state, GaussianState, d)
        mean, covariance = state.mean, state.covariance
        if control is not None:
            u = unit_rows(control, d, "control")
            turn = right_matrix(u)
            mean = compose(mean, u)
            covariance = turn @ covariance @ np.swapaxes(turn, -1, -2)
        return unchecked(GaussianState, mean=mean, covariance=symmetric(covariance) + self.noise_time(dt) * self._w)

    def update(self, state: GaussianState, z: ArrayLike | Rotation) -> tuple[GaussianState, KalmanInfo]:
        """Return the state given the measurement ±z (..., d); NaN is a missing measurement."""
        d = len(self._w)
        check_state(state, GaussianState, d)
        innovation = align_to(z, state.mean) - state.mean
        mean, covariance, info = kalman_update(state.mean, state.covariance, innovation, np.eye(d), self._v)
        return unchecked(GaussianState, mean=mean, covariance=covariance), info
