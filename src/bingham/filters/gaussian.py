"""What the Kalman filters share: Gaussian states, the measurement update, the loop over a sequence.

Every function takes leading batch axes, so that many recordings are filtered side by side.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Generic, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.errors import InvalidArgumentError
from bingham.filters.protocol import Filter, State, each_step
from bingham.validation import covariance_matrix, finite, unchecked, unit_or_missing

__all__ = ["GaussianState", "KalmanInfo", "KalmanTrack", "align_to", "kalman_update", "put_moments", "run_steps"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class GaussianState:
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


@dataclass(frozen=True, slots=True, eq=False)
class KalmanTrack(Generic[State]):
    """States after each update, as one state with leading axes (..., T), and the log-evidence (..., T)."""

    states: State
    log_evidence: FloatArray

    @property
    def modes(self) -> FloatArray:
        """Unit vectors (..., T, d)."""
        return self.states.mode


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
    missing = np.any(np.isnan(innovation), axis=-1)
    e = np.where(missing[..., None], 0.0, innovation)
    PHt = covariance @ np.swapaxes(H, -1, -2)
    S = H @ PHt + R
    try:
        gain = np.swapaxes(np.linalg.solve(S, np.swapaxes(PHt, -1, -2)), -1, -2)
    except np.linalg.LinAlgError:
        raise InvalidArgumentError(
            "covariance", "H P Hᵀ + R regular", "a singular sum", "give the state or the measurement more noise"
        ) from None
    gain = np.where(missing[..., None, None], 0.0, gain)
    moved = mean + np.einsum("...ij,...j->...i", gain, e)
    parts = moved.reshape(*moved.shape[:-1], -1, m)
    scaled = (parts / np.linalg.norm(parts, axis=-1, keepdims=True)).reshape(moved.shape)
    I_KH = np.eye(mean.shape[-1]) - gain @ H
    # Joseph's form stays symmetric and positive semidefinite.
    P = I_KH @ covariance @ np.swapaxes(I_KH, -1, -2) + gain @ R @ np.swapaxes(gain, -1, -2)
    nis = np.einsum("...i,...i->...", e, np.linalg.solve(S, e[..., None])[..., 0])
    log_evidence = -0.5 * (nis + np.linalg.slogdet(S)[1] + m * np.log(2.0 * np.pi))
    info = KalmanInfo(np.where(missing, 0.0, log_evidence), np.where(missing, np.nan, nis))
    return np.where(missing[..., None], moved, scaled), P, info


def run_steps(
    kalman: Filter[State, KalmanInfo],
    prior: State,
    measurements: ArrayLike | Rotation,
    controls: ArrayLike | Rotation | None = None,
) -> KalmanTrack[State]:
    """Return the track of `each_step`, measurements and controls (..., T, d); a row of NaN is a missing measurement."""
    results = list(each_step(kalman, prior, measurements, controls))
    if not results:
        raise InvalidArgumentError("measurements", "shape (..., T, d) with T >= 1", "no rows")
    evidence = [info.log_evidence for _, info in results]
    cls, axis = type(prior), evidence[0].ndim
    columns = {
        f.name: np.stack([getattr(state, f.name) for state, _ in results], axis=axis)
        for f in fields(cls)  # type: ignore[arg-type]
    }
    return KalmanTrack(unchecked(cls, **columns), np.stack(evidence, axis=-1))
