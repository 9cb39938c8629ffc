"""The Kalman filters of the spinning-ball study, on one flight."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from bingham.baselines.gaussian import GaussianState
from bingham.baselines.quaternion_ekf import QuaternionEkf
from bingham.baselines.second_order_ekf import SecondOrderQuaternionEkf, SpinningGaussian
from bingham.distributions.bingham import Bingham
from bingham.distributions.matching import matching_covariance
from bingham.rotations import conjugate, left_matrix, right_matrix
from bingham.studies.ball_noises import BACK, DARK, IDENTITY, LOGO, PROCESS, SPIN_PRIOR, turns
from bingham.studies.ball_scores import Found

__all__ = ["covariance_of", "ekf_first_order", "ekf_second_order"]

FloatArray = NDArray[np.float64]


def _classify_gaussian(state: GaussianState, types: FloatArray) -> int:
    """Return the most probable type under a Gaussian, signs of quaternions chosen to suit."""
    nearest = np.where((types @ state.mean < 0.0)[:, None], -types, types)
    e = nearest - state.mean
    return int(np.argmin(np.einsum("ki,ki->k", e, np.linalg.solve(state.covariance, e.T).T)))


@cache
def _covariance(z: tuple[float, ...]) -> FloatArray:
    return matching_covariance(Bingham(z, np.eye(4)[:, [1, 2, 3, 0]]))


def covariance_of(noise: Bingham) -> FloatArray:
    """Return the covariance of the paper's mapping: equal second moments once the Gaussian is projected."""
    return _covariance(tuple(float(x) for x in noise.z))


def ekf_first_order(seen: FloatArray, types: FloatArray, fair: bool) -> Found:
    """Track the spin alone, from the rotations between neighbouring observations."""
    process, logo = covariance_of(PROCESS), covariance_of(LOGO)
    kalman = QuaternionEkf(process, logo, noise_side="right" if fair else "left", rotate_noise=fair)
    state = GaussianState(IDENTITY, covariance_of(SPIN_PRIOR))
    spins: list[GaussianState] = []
    for observed in turns(seen):
        state = kalman.predict(state)
        if observed is not None:
            between, noise, y = observed
            covariance = covariance_of(noise)
            if fair:
                turn = left_matrix(y) @ right_matrix(conjugate(y))
                covariance = turn @ covariance @ turn.T
            updates = (kalman.update(state, z, covariance) for z in between)
            state, _ = max(updates, key=lambda r: float(r[1].log_evidence))
        spins.append(state)
    return Found(None, spins, [_classify_gaussian(spin, types) for spin in spins])


def ekf_second_order(seen: FloatArray, types: FloatArray, fair: bool) -> Found:
    """Track orientation and spin."""
    process, logo, dark = (covariance_of(noise) for noise in (PROCESS, LOGO, DARK))
    kalman = SecondOrderQuaternionEkf(process, logo, noise_side="right", rotate_noise=fair)
    unknown = GaussianState(IDENTITY, 0.25 * np.eye(4))
    state = SpinningGaussian.independent(unknown, GaussianState(IDENTITY, covariance_of(SPIN_PRIOR)))
    kept: list[SpinningGaussian] = []
    for z in seen:
        state = kalman.predict(state)
        if np.isnan(z).any():
            state, _ = kalman.update(state, BACK, dark)
        else:
            state, _ = max((kalman.update(state, row) for row in z), key=lambda r: float(r[1].log_evidence))
        kept.append(state)
    chosen = [_classify_gaussian(s.spin, types) for s in kept]
    return Found([s.orientation for s in kept], [s.spin for s in kept], chosen)
