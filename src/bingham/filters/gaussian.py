"""What the Kalman filters share: Gaussian states, the measurement update, the loop over a sequence.

Every function takes leading batch axes, so that many recordings are filtered side by side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError
from bingham.rotations import unit_or_missing

__all__ = ["GaussianState", "KalmanInfo", "KalmanTrack", "covariance_matrix", "kalman_update", "mirrored", "run_steps"]

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

    @property
    def mode(self) -> FloatArray:
        """The mean, scaled to unit length (..., d)."""
        return self.mean / np.linalg.norm(self.mean, axis=-1, keepdims=True)


class KalmanInfo(NamedTuple):
    """``log_evidence`` (...): log N(innovation; 0, S). ``statistic`` (...): innovationᵀ S⁻¹ innovation."""

    log_evidence: FloatArray
    statistic: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class KalmanTrack:
    """States after each update, as one state with leading axes (..., T), and the log-evidence (..., T)."""

    states: Any
    log_evidence: FloatArray

    @property
    def modes(self) -> FloatArray:
        """Unit vectors (..., T, d)."""
        return self.states.mode


def covariance_matrix(x: ArrayLike, d: int | None, name: str) -> FloatArray:
    """Return x (d, d) as float64, checked to be symmetric and positive semidefinite."""
    c = np.asarray(x, dtype=np.float64)
    if c.ndim != 2 or c.shape[0] != c.shape[1] or (d is not None and c.shape[0] != d):
        raise InvalidArgumentError(name, f"shape ({d}, {d})" if d else "shape (d, d)", c.shape)
    if not np.all(np.isfinite(c)) or not np.allclose(c, c.T, rtol=1e-8, atol=0.0):
        raise InvalidArgumentError(name, "a finite symmetric matrix", c)
    if np.linalg.eigvalsh(c)[0] < -1e-12 * np.abs(c).max(initial=0.0):
        raise InvalidArgumentError(
            name, "a positive semidefinite matrix", f"smallest eigenvalue {np.linalg.eigvalsh(c)[0]:.3g}"
        )
    return c


def mirrored(z: ArrayLike, towards: FloatArray) -> FloatArray:
    """Return ±z (..., d), whichever is closer to ``towards`` (..., d) (Kurz et al. 2014, §7, modification 1)."""
    a = unit_or_missing(z, towards.shape[-1], "z")
    return np.where(np.sum(a * towards, axis=-1, keepdims=True) < 0.0, -a, a)


def kalman_update(
    state: GaussianState, innovation: FloatArray, H: FloatArray, R: FloatArray
) -> tuple[FloatArray, FloatArray, KalmanInfo]:
    """Return mean, covariance and info for innovation = z − h(mean), h's Jacobian H (..., m, d), noise R (..., m, m).

    Where the innovation is NaN the measurement is missing: the state stays, its evidence is 0.
    """
    P = state.covariance
    missing = np.any(np.isnan(innovation), axis=-1)
    e = np.where(missing[..., None], 0.0, innovation)
    PHt = P @ np.swapaxes(H, -1, -2)
    S = H @ PHt + R
    gain = np.swapaxes(np.linalg.solve(S, np.swapaxes(PHt, -1, -2)), -1, -2)
    gain = np.where(missing[..., None, None], 0.0, gain)
    mean = state.mean + np.einsum("...ij,...j->...i", gain, e)
    I_KH = np.eye(P.shape[-1]) - gain @ H
    # Joseph's form stays symmetric and positive semidefinite.
    covariance = I_KH @ P @ np.swapaxes(I_KH, -1, -2) + gain @ R @ np.swapaxes(gain, -1, -2)
    statistic = np.einsum("...i,...i->...", e, np.linalg.solve(S, e[..., None])[..., 0])
    log_evidence = -0.5 * (statistic + np.linalg.slogdet(S)[1] + e.shape[-1] * np.log(2.0 * np.pi))
    return mean, covariance, KalmanInfo(np.where(missing, 0.0, log_evidence), np.where(missing, np.nan, statistic))


def run_steps(kalman: Any, prior: Any, measurements: ArrayLike, controls: ArrayLike | None = None) -> KalmanTrack:
    """Predict, then update, for every row of measurements (..., T, d); controls (..., T, d) are known rotations.

    A row of NaN is a missing measurement.
    """
    y = np.asarray(measurements, dtype=np.float64)
    u = None if controls is None else np.asarray(controls, dtype=np.float64)
    if y.ndim < 2 or y.shape[-2] == 0:
        raise InvalidArgumentError("measurements", "shape (..., T, d) with T >= 1", y.shape)
    state = prior
    kept: list[Any] = []
    evidence: list[FloatArray] = []
    for t in range(y.shape[-2]):
        state = kalman.predict(state, None if u is None else u[..., t, :])
        state, info = kalman.update(state, y[..., t, :])
        kept.append(state)
        evidence.append(info.log_evidence)
    batch = y.ndim - 2
    fields = [np.stack([getattr(s, name) for s in kept], axis=batch) for name in type(state).__dataclass_fields__]
    return KalmanTrack(type(state)(*fields), np.stack(evidence, axis=-1))
