"""Covariances stay positive semidefinite whatever the sizes of the noises."""

import numpy as np
import pytest

from bingham.baselines import (
    AxialKalmanFilter,
    GaussianState,
    QuaternionEkf,
    SecondOrderQuaternionEkf,
    SpinningGaussian,
)


def covariance(rng, d):
    """Eigenvalues from 1e-14 to 100, some of them 0, in any directions."""
    values = 10.0 ** rng.uniform(-14, 2, d) * (rng.random(d) < 0.9)
    axes = np.linalg.qr(rng.normal(size=(d, d)))[0]
    c = (axes * values) @ axes.T
    return 0.5 * (c + c.T) + 1e-16 * np.eye(d)


def unit(rng, n, d):
    x = rng.normal(size=(n, d))
    return x / np.linalg.norm(x, axis=1, keepdims=True)


def filters(rng):
    for d in (2, 4):
        yield AxialKalmanFilter(covariance(rng, d), covariance(rng, d)), GaussianState(np.eye(d)[0], covariance(rng, d))
    start = GaussianState(np.eye(4)[0], covariance(rng, 4))
    for fair in (False, True):
        noises = covariance(rng, 4), covariance(rng, 4)
        yield QuaternionEkf(*noises, rotate_noise=fair), start
        spinning = SpinningGaussian(np.tile(np.eye(4)[0], 2), covariance(rng, 8))
        yield SecondOrderQuaternionEkf(*noises, rotate_noise=fair), spinning


@pytest.mark.parametrize("seed", range(20))
def test_covariances_are_symmetric_and_positive_semidefinite(seed):
    rng = np.random.default_rng(seed)
    for kalman, prior in filters(rng):
        d = kalman.predict(prior).mode.shape[-1]
        track = kalman.run(prior, unit(rng, 40, d), controls=unit(rng, 40, d))
        found = track.states.covariance
        values = np.linalg.eigvalsh(found)
        assert np.all(values[:, 0] >= -1e-14 * values[:, -1])
        np.testing.assert_allclose(found, np.swapaxes(found, -1, -2), rtol=0.0, atol=1e-15 * values[:, -1].max())


def test_the_textbook_form_does_not():
    # P − K H P, and Joseph's form too, lose a small P beside a large one to rounding: what the test above would see.
    worst = 0.0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        P, R = covariance(rng, 4), covariance(rng, 4)
        K = np.linalg.solve(P + R, P).T
        P = P - K @ P
        values = np.linalg.eigvalsh(0.5 * (P + P.T))
        worst = min(worst, values[0] / np.abs(values).max())
    assert worst < -1e-12
