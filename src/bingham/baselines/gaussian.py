"""What the Kalman filters share: Gaussian states, noise over time, the measurement update.

Every function takes leading batch axes, so that many recordings are filtered side by side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.baselines.state import ArrayState
from bingham.errors import InvalidArgumentError
from bingham.filters.protocol import State
from bingham.filters.run import RecursiveFilter
from bingham.filters.track import Track
from bingham.validation import covariance_matrix, finite, unit_or_missing

__all__ = ["GaussianState", "KalmanFilter", "KalmanInfo", "align_to", "kalman_update", "put_moments", "symmetric"]

FloatArray = NDArray[np.float64]


class KalmanFilter(RecursiveFilter[State, Track[State]]):
    """Base of the Kalman filters: they take batches; ``per_second`` says what their process noise is."""

    per_second: bool = False

    @property
    def batched(self) -> bool:
        """Whether there may be leading batch axes: there may."""
        return True

    @property
    def needs_times(self) -> bool:
        """Whether the process noise is given per second."""
        return self.per_second

    @property
    def noise_per_step(self) -> bool:
        """Whether the process noise is that of one step."""
        return not self.per_second

    def noise_time(self, dt: float | None) -> float:
        """Return what the process noise counts in a step: ``dt`` seconds, or one step."""
        if not self.per_second:
            return 1.0
        if dt is None or not dt >= 0.0:
            hint = "pass dt= (or times= to run)"
            raise InvalidArgumentError("dt", "a time step in s, not negative, for noise per second", dt, hint)
        return dt


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class GaussianState(ArrayState):
    """Gaussian N(mean, covariance) of a vector in ℝ^d that stands for an axis or a rotation.

    Parameters
    ----------
    mean : ndarray, shape (..., d)
        Of unit length after every update.
    covariance : ndarray, shape (..., d, d)
        Of the vector's components.
    """

    mean: FloatArray
    covariance: FloatArray

    def __post_init__(self) -> None:
        put_moments(self, self.mean, self.covariance)

    @property
    def mode(self) -> FloatArray:
        """The mean, scaled to unit length (..., d)."""
        return self.mean / np.linalg.norm(self.mean, axis=-1, keepdims=True)


def put_moments(state: Any, mean: ArrayLike, covariance: ArrayLike) -> None:
    """Check a state's mean (..., d) and covariance (..., d, d) and set them, with leading axes alike."""
    m = finite(mean, "mean")
    if m.ndim == 0 or not np.all(np.any(m != 0.0, axis=-1)):
        raise InvalidArgumentError("mean", "vectors (..., d) other than 0", m)
    d = m.shape[-1]
    c = covariance_matrix(covariance, d, "covariance")
    try:
        batch = np.broadcast_shapes(m.shape[:-1], c.shape[:-2])
    except ValueError:
        raise InvalidArgumentError("covariance", f"shape {(*m.shape, d)}, as the mean", c.shape) from None
    object.__setattr__(state, "mean", np.broadcast_to(m, (*batch, d)))
    object.__setattr__(state, "covariance", np.broadcast_to(c, (*batch, d, d)))


class KalmanInfo(NamedTuple):
    """What an update says about itself.

    ``log_evidence`` (...): log N(innovation; 0, S), 0 where z is missing. ``nis`` (...): innovationᵀ S⁻¹
    innovation, NaN where z is missing.
    """

    log_evidence: FloatArray
    nis: FloatArray

    @property
    def accepted(self) -> NDArray[np.bool_]:
        """Which states (...) were updated: all but those of missing measurements."""
        return ~np.isnan(self.nis)

    @property
    def reason(self) -> str:
        """Why not all of them: "missing"; empty otherwise."""
        return "" if self.accepted.all() else "missing"


def align_to(z: ArrayLike | Rotation, towards: FloatArray) -> FloatArray:
    """Return ±z (..., d), whichever is closer to ``towards`` (..., d) (Kurz et al. 2014, §7, modification 1)."""
    a = unit_or_missing(z, towards.shape[-1], "z")
    return np.where(np.sum(a * towards, axis=-1, keepdims=True) < 0.0, -a, a)


def kalman_update(
    mean: FloatArray, covariance: FloatArray, innovation: FloatArray, H: FloatArray, R: FloatArray
) -> tuple[FloatArray, FloatArray, KalmanInfo]:
    """Return mean, covariance and info for innovation = z − h(mean), h's Jacobian H (..., m, d), noise R (..., m, m).

    The mean's vectors of length m, one after the other, are scaled to unit length. Where the innovation is NaN the
    measurement is missing: the state stays, its evidence is 0.
    """
    m = innovation.shape[-1]
    missing = np.asarray(np.isnan(innovation).any(axis=-1))
    e = np.where(missing[..., None], 0.0, innovation) if missing.any() else innovation
    HP = H @ covariance
    total = HP @ np.swapaxes(H, -1, -2) + R
    sides = (HP, e[..., None])
    if total.ndim != e.ndim + 1 or total.shape[:-2] != e.shape[:-1]:
        batch = np.broadcast_shapes(total.shape[:-2], e.shape[:-1])
        total = np.broadcast_to(total, (*batch, m, m))
        sides = tuple(np.broadcast_to(x, (*batch, *x.shape[-2:])) for x in sides)
    try:
        solved = np.linalg.solve(total, np.concatenate(sides, axis=-1))
    except np.linalg.LinAlgError:
        raise InvalidArgumentError(
            "covariance", "H P Hᵀ + R regular", "a singular sum", "give the state or the measurement more noise"
        ) from None
    gain = np.swapaxes(solved[..., :-1], -1, -2)
    moved = mean + (gain @ e[..., None])[..., 0]
    parts = moved.reshape(*moved.shape[:-1], -1, m)
    scaled = (parts / np.sqrt(np.sum(parts * parts, axis=-1, keepdims=True))).reshape(moved.shape)
    I_KH = np.eye(mean.shape[-1]) - gain @ H
    # Joseph's form stays positive semidefinite but for rounding errors of a large P, which may outweigh what is left.
    posterior = semidefinite(I_KH @ covariance @ np.swapaxes(I_KH, -1, -2) + gain @ R @ np.swapaxes(gain, -1, -2))
    nis = np.sum(e * solved[..., -1], axis=-1)
    log_evidence = -0.5 * (nis + np.linalg.slogdet(total)[1] + m * np.log(2.0 * np.pi))
    if missing.any():
        posterior = np.where(missing[..., None, None], covariance, posterior)
        scaled = np.where(missing[..., None], mean, scaled)
        log_evidence, nis = np.where(missing, 0.0, log_evidence), np.where(missing, np.nan, nis)
    return scaled, posterior, KalmanInfo(np.asarray(log_evidence), np.asarray(nis))


def semidefinite(P: FloatArray) -> FloatArray:
    """Return the positive semidefinite matrix nearest to P (..., d, d): negative eigenvalues become 0."""
    values, axes = np.linalg.eigh(symmetric(P))
    root = axes * np.sqrt(np.maximum(values, 0.0))[..., None, :]
    return root @ np.swapaxes(root, -1, -2)


def symmetric(P: FloatArray) -> FloatArray:
    """Return (P + Pᵀ)/2: rounding of F P Fᵀ leaves covariances neither symmetric nor quite semidefinite."""
    return 0.5 * (P + np.swapaxes(P, -1, -2))
