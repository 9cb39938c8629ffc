"""Extended Kalman filter on quaternions, first order (LaViola 2003, as adapted by Glover & Kaelbling 2013, §6).

The measurement function projects the state onto the sphere, h(x) = x/|x|, and the state is renormalised after every
update. LaViola's continuous prediction is replaced by the discrete step x' = u ⊗ x.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.baselines.gaussian import GaussianState, KalmanFilter, KalmanInfo, align_to, kalman_update, symmetric
from bingham.rotations import left_matrix, right_matrix
from bingham.validation import check_noise_side, check_state, noise_covariance, unchecked, unit_rows

__all__ = ["QuaternionEkf", "noise_about", "projection_jacobian", "update_orientation"]

FloatArray = NDArray[np.float64]


def projection_jacobian(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return x/|x| (..., d) and its Jacobian (I − x xᵀ/|x|²)/|x| (..., d, d)."""
    norm = np.linalg.norm(x, axis=-1)[..., None]
    unit = x / norm
    return unit, (np.eye(x.shape[-1]) - unit[..., :, None] * unit[..., None, :]) / norm[..., None]


def noise_about(x: FloatArray, covariance: FloatArray, left: bool) -> FloatArray:
    """Return the covariance (..., 4, 4) of v ⊗ x (left) or x ⊗ v for a covariance (4, 4) of v and unit x (..., 4)."""
    turn = right_matrix(x) if left else left_matrix(x)
    return turn @ covariance @ np.swapaxes(turn, -1, -2)


def update_orientation(
    mean: FloatArray, covariance: FloatArray, z: ArrayLike | Rotation, noise: FloatArray, *, left: bool, rotate: bool
) -> tuple[FloatArray, FloatArray, KalmanInfo]:
    """Return mean (..., m), covariance (..., m, m) and info given ±z = x/|x| + noise, x the state's first four entries.

    ``rotate`` turns the noise's covariance (4, 4) to that of v ⊗ x (left) or x ⊗ v.
    """
    unit, projection = projection_jacobian(mean[..., :4])
    rest = np.zeros((*projection.shape[:-1], mean.shape[-1] - 4))
    H = np.concatenate([projection, rest], axis=-1)
    if rotate:
        noise = noise_about(unit, noise, left)
    return kalman_update(mean, covariance, align_to(z, unit) - unit, H, noise)


@dataclass(frozen=True, eq=False)
class QuaternionEkf(KalmanFilter[GaussianState]):
    """First-order quaternion EKF: x' = w ⊗ u ⊗ x, z = v ⊗ x (noise_side="left") or x' = x ⊗ u ⊗ w, z = x ⊗ v.

    Parameters
    ----------
    process_covariance, measurement_covariance : (4, 4) array_like
        Covariances of w and v about the identity quaternion.
    noise_side : {"left", "right"}
        Side of the noises and of the control: world frame (Glover) or body frame (Kurz).
    rotate_noise : bool
        False adds the two covariances as they are wherever the state points, as published. True turns them into
        the state's frame, which is what the multiplicative noise means: the fair filter.
    per_second : bool
        Whether the process noise is that of a second, and grows with ``dt``, rather than that of a step.

    Examples
    --------
    >>> f = QuaternionEkf(np.eye(4) * 1e-3, np.eye(4) * 1e-2, rotate_noise=True)
    >>> start = GaussianState(np.array([1.0, 0, 0, 0]), np.eye(4) * 0.1)
    >>> state, info = f.update(f.predict(start), [-1.0, 0, 0, 0])
    >>> state.mean
    array([1., 0., 0., 0.])
    """

    process_covariance: ArrayLike
    measurement_covariance: ArrayLike
    noise_side: Literal["left", "right"] = "left"
    rotate_noise: bool = False
    per_second: bool = False
    _w: FloatArray = field(init=False, repr=False)
    _v: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_noise_side(self.noise_side)
        object.__setattr__(self, "_w", noise_covariance(self.process_covariance, 4, "process_covariance"))
        object.__setattr__(self, "_v", noise_covariance(self.measurement_covariance, 4, "measurement_covariance"))

    def predict(
        self, state: GaussianState, control: ArrayLike | Rotation | None = None, dt: float | None = None
    ) -> GaussianState:
        """Return the state one step later, rotated by the control u (..., 4)."""
        check_state(state, GaussianState, 4)
        left = self.noise_side == "left"
        mean, covariance = state.mean, state.covariance
        if control is not None:
            u = unit_rows(control, 4, "control")
            turn = left_matrix(u) if left else right_matrix(u)
            mean = np.einsum("...ij,...j->...i", turn, mean)
            covariance = turn @ covariance @ np.swapaxes(turn, -1, -2)
        noise = noise_about(mean, self._w, left) if self.rotate_noise else self._w
        return unchecked(GaussianState, mean=mean, covariance=symmetric(covariance) + self.noise_time(dt) * noise)

    def update(
        self, state: GaussianState, z: ArrayLike | Rotation, covariance: ArrayLike | None = None
    ) -> tuple[GaussianState, KalmanInfo]:
        """Return the state given ±z (..., 4); NaN is a missing measurement.

        ``covariance`` (4, 4) replaces the measurement noise for this update.
        """
        check_state(state, GaussianState, 4)
        noise = self._v if covariance is None else noise_covariance(covariance, 4, "covariance")
        left = self.noise_side == "left"
        mean, P, info = update_orientation(state.mean, state.covariance, z, noise, left=left, rotate=self.rotate_noise)
        return unchecked(GaussianState, mean=mean, covariance=P), info
