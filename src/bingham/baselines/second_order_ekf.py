"""Extended Kalman filter on orientation and spin (LaViola 2003, as adapted by Glover & Kaelbling 2013, §6)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.baselines.gaussian import GaussianState, KalmanFilter, KalmanInfo, put_moments
from bingham.baselines.quaternion_ekf import noise_about, update_orientation
from bingham.baselines.state import ArrayState
from bingham.rotations import compose, left_matrix, right_matrix
from bingham.sampling.power import power_jacobian
from bingham.validation import check_noise_side, check_number, check_state, noise_covariance, unchecked, unit_rows

__all__ = ["SecondOrderQuaternionEkf", "SpinningGaussian"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SpinningGaussian(ArrayState):
    """Gaussian of (x, v): orientation x and rotation per step v, ``mean`` (..., 8), ``covariance`` (..., 8, 8)."""

    mean: FloatArray
    covariance: FloatArray

    def __post_init__(self) -> None:
        put_moments(self, self.mean, self.covariance)
        check_state(self, SpinningGaussian, 8)

    @classmethod
    def independent(cls, orientation: GaussianState, spin: GaussianState) -> SpinningGaussian:
        """Return the joint distribution of an independent orientation and spin."""
        covariance = np.zeros((*orientation.mean.shape[:-1], 8, 8))
        covariance[..., :4, :4] = orientation.covariance
        covariance[..., 4:, 4:] = spin.covariance
        return cls(np.concatenate([orientation.mean, spin.mean], axis=-1), covariance)

    @property
    def orientation(self) -> GaussianState:
        """Marginal distribution of the orientation."""
        return unchecked(GaussianState, mean=self.mean[..., :4], covariance=self.covariance[..., :4, :4])

    @property
    def spin(self) -> GaussianState:
        """Marginal distribution of the rotation per step."""
        return unchecked(GaussianState, mean=self.mean[..., 4:], covariance=self.covariance[..., 4:, 4:])

    @property
    def mode(self) -> FloatArray:
        """Orientation quaternion (..., 4)."""
        return self.orientation.mode


@dataclass(frozen=True, eq=False)
class SecondOrderQuaternionEkf(KalmanFilter[SpinningGaussian]):
    """Quaternion EKF with x' = v ⊗ x, v' = w ⊗ u ⊗ v, z = x ⊗ noise (or noise ⊗ x, ``noise_side="left"``).

    Parameters
    ----------
    process_covariance : (4, 4) array_like
        Of the spin's perturbation w about the identity.
    measurement_covariance : (4, 4) array_like
        Of the measurement noise about the identity.
    noise_side : {"left", "right"}
        Side of the measurement noise.
    rotate_noise : bool
        As in `QuaternionEkf`: False as published, True for the fair filter.
    interval : float
        Time, s, in which v rotates the body once, and of which the spin's perturbation is w; as in
        `SecondOrderBinghamFilter`.
    """

    process_covariance: ArrayLike
    measurement_covariance: ArrayLike
    noise_side: Literal["left", "right"] = "left"
    rotate_noise: bool = False
    interval: float = 1.0
    _w: FloatArray = field(init=False, repr=False)
    _v: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_noise_side(self.noise_side)
        check_number(self.interval, "interval", "a time > 0, s", above=0.0)
        object.__setattr__(self, "_w", noise_covariance(self.process_covariance, 4, "process_covariance"))
        object.__setattr__(self, "_v", noise_covariance(self.measurement_covariance, 4, "measurement_covariance"))

    @property
    def noise_per_step(self) -> bool:
        """Whether the noise is that of one step, whatever its duration: spin and noise are those of ``interval``."""
        return False

    def predict(
        self, state: SpinningGaussian, control: ArrayLike | Rotation | None = None, dt: float | None = None
    ) -> SpinningGaussian:
        """Return the state one step, or ``dt`` seconds, later; the control u (..., 4) changes the spin.

        Over a time dt the orientation moves by v^s, s = dt/interval, and the spin's noise has s times its covariance.
        """
        check_state(state, SpinningGaussian, 8)
        x, v = state.mean[..., :4], state.mean[..., 4:]
        u = np.array([1.0, 0.0, 0.0, 0.0]) if control is None else unit_rows(control, 4, "control")
        steps = 1.0
        raised, by_spin = v, np.eye(4)
        if dt is not None:
            check_number(dt, "dt", "a time ≥ 0, s", minimum=0.0)
            steps = float(dt) / self.interval
            if steps != 1.0:
                raised, by_spin = power_jacobian(v / np.linalg.norm(v, axis=-1, keepdims=True), steps)
        F = np.zeros((*np.broadcast_shapes(state.mean.shape[:-1], u.shape[:-1]), 8, 8))
        F[..., :4, :4], F[..., :4, 4:] = left_matrix(raised), right_matrix(x) @ by_spin
        F[..., 4:, 4:] = left_matrix(u)
        spin = compose(u, v)
        covariance = F @ state.covariance @ np.swapaxes(F, -1, -2)
        covariance[..., 4:, 4:] += steps * (noise_about(spin, self._w, True) if self.rotate_noise else self._w)
        mean = np.concatenate(np.broadcast_arrays(compose(raised, x), spin), axis=-1)
        return unchecked(SpinningGaussian, mean=mean, covariance=covariance)

    def update(
        self, state: SpinningGaussian, z: ArrayLike | Rotation, covariance: ArrayLike | None = None
    ) -> tuple[SpinningGaussian, KalmanInfo]:
        """Return the state given the orientation ±z (..., 4); NaN is a missing measurement.

        ``covariance`` (4, 4) replaces the measurement noise for this update.
        """
        check_state(state, SpinningGaussian, 8)
        noise = self._v if covariance is None else noise_covariance(covariance, 4, "covariance")
        left = self.noise_side == "left"
        mean, P, info = update_orientation(state.mean, state.covariance, z, noise, left=left, rotate=self.rotate_noise)
        return unchecked(SpinningGaussian, mean=mean, covariance=P), info
