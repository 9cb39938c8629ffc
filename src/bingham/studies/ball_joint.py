"""A mixture of second-order Kalman filters in the spinning-ball study: what keeping the joint covariance is worth.

Hypotheses of the spin and published noises are those of the mixture of Bingham filters. Two things differ: orientation
and spin keep their covariance, and a logo out of sight is what it says, that its height h = (R(x) e_z)_z is below 0,
and no measurement of the back.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp
from scipy.stats import norm

from bingham.baselines.gaussian import GaussianState
from bingham.baselines.quaternion_ekf import noise_about
from bingham.baselines.second_order_ekf import SecondOrderQuaternionEkf, SpinningGaussian
from bingham.sampling.riemannian import RiemannianSampling
from bingham.studies.ball_gaussian import covariance_of
from bingham.studies.ball_noises import IDENTITY, INFORMED, LOGO, PROCESS, SPIN_PRIOR
from bingham.studies.ball_scores import Found

__all__ = ["ekf_mixture", "out_of_sight"]

FloatArray = NDArray[np.float64]
HYPOTHESES = 16
# h = xᵀ K x for unit x.
HEIGHT = np.array([1.0, -1.0, -1.0, 1.0])


def ekf_mixture(seen: FloatArray, types: FloatArray) -> Found:
    """Track orientation and spin by 16 hypotheses of the spin, weighed by evidence, from the first detection on."""
    kalman = SecondOrderQuaternionEkf(
        covariance_of(PROCESS), covariance_of(LOGO), noise_side="right", rotate_noise=True
    )
    log_weights = np.full(HYPOTHESES, -np.log(HYPOTHESES))
    state: SpinningGaussian | None = None
    orientations: list[GaussianState] = []
    spins: list[GaussianState] = []
    chosen: list[int] = []
    for z in seen:
        dark = bool(np.isnan(z).any())
        if state is not None:
            state = kalman.predict(state)
            state, evidence = out_of_sight(state) if dark else _detected(kalman, state, z)
            log_weights = log_weights + evidence
            log_weights -= np.asarray(logsumexp(log_weights))
        elif not dark:
            state = _start(z[0])
        if state is None:
            orientations.append(GaussianState(IDENTITY, 0.25 * np.eye(4)))
            spins.append(GaussianState(IDENTITY, covariance_of(SPIN_PRIOR)))
            chosen.append(0)
            continue
        best = int(np.argmax(log_weights))
        orientation, spin = state.orientation, state.spin
        orientations.append(GaussianState(orientation.mean[best], orientation.covariance[best]))
        spins.append(GaussianState(spin.mean[best], spin.covariance[best]))
        chosen.append(int(np.argmax(np.asarray(logsumexp(log_weights[:, None] + _log_density(spin, types), axis=0)))))
    return Found(orientations, spins, chosen)


def out_of_sight(state: SpinningGaussian) -> tuple[SpinningGaussian, FloatArray]:
    """Return the k states given h < 0, h linear about their means, by its truncated moments, and log P(h < 0) (k,)."""
    x, P = state.orientation.mode, state.covariance
    slope = np.zeros_like(state.mean)
    slope[:, :4] = 2.0 * HEIGHT * x
    across = np.einsum("kij,kj->ki", P, slope)
    variance = np.einsum("ki,ki->k", slope, across)
    deviation = np.sqrt(variance)
    b = -(x * x @ HEIGHT) / deviation
    log_evidence = norm.logcdf(b)
    # Mean and variance of a normal variable below its b-th deviation (the inverse Mills ratio).
    mills = np.exp(norm.logpdf(b) - log_evidence)
    gain = across / variance[:, None]
    mean = state.mean - gain * (deviation * mills)[:, None]
    lost = np.clip(mills * (mills + b), 0.0, 1.0) * variance
    mean = (mean.reshape(-1, 2, 4) / np.linalg.norm(mean.reshape(-1, 2, 4), axis=-1, keepdims=True)).reshape(-1, 8)
    return SpinningGaussian(mean, P - lost[:, None, None] * gain[:, :, None] * gain[:, None, :]), log_evidence


def _start(y: FloatArray) -> SpinningGaussian:
    """Return the hypotheses, the logo where it is seen: the prior of the spin in 16 parts, as for Bingham filters."""
    spins = RiemannianSampling(HYPOTHESES).sample(SPIN_PRIOR).points
    seen = noise_about(y, covariance_of(LOGO), left=False)
    orientation = GaussianState(np.tile(y, (HYPOTHESES, 1)), np.tile(seen, (HYPOTHESES, 1, 1)))
    return SpinningGaussian.independent(
        orientation, GaussianState(spins, noise_about(spins, covariance_of(INFORMED), left=True))
    )


def _detected(
    kalman: SecondOrderQuaternionEkf, state: SpinningGaussian, z: FloatArray
) -> tuple[SpinningGaussian, FloatArray]:
    """Return the states and log-evidences (k,), each of the interpretation that is the more probable one for it."""
    (one, first), (other, second) = (kalman.update(state, row) for row in z)
    swap = second.log_evidence > first.log_evidence
    mean = np.where(swap[:, None], other.mean, one.mean)
    covariance = np.where(swap[:, None, None], other.covariance, one.covariance)
    return SpinningGaussian(mean, covariance), np.where(swap, second.log_evidence, first.log_evidence)


def _log_density(spin: GaussianState, types: FloatArray) -> FloatArray:
    """Return log N(type; spin) (k, types), signs of quaternions chosen to suit."""
    signs = np.where(spin.mean @ types.T < 0.0, -1.0, 1.0)
    e = signs[..., None] * types - spin.mean[:, None]
    nis = np.einsum("kti,kij,ktj->kt", e, np.linalg.inv(spin.covariance), e)
    return -0.5 * (nis + np.linalg.slogdet(spin.covariance)[1][:, None])
