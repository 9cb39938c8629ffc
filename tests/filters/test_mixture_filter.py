"""The mixture filter: one component is the first-order filter; symmetric objects, outliers, exact evidence."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from bingham import Bingham, BinghamFilter, BinghamMixture
from bingham.filters.mixture_filter import MixtureFilter, ambiguous_noise
from bingham.rotations import compose

IDENTITY_LAST = np.eye(4)[:, ::-1]
PROCESS = Bingham([-400.0, -300.0, -200.0, 0.0], IDENTITY_LAST)
SENSOR = Bingham([-250.0, -150.0, -90.0, 0.0], IDENTITY_LAST)


@pytest.mark.parametrize("side", ["right", "left"])
def test_one_component_is_the_first_order_filter(side):
    single, mixed = BinghamFilter(PROCESS, SENSOR, noise_side=side), MixtureFilter(PROCESS, SENSOR, side)
    rng = np.random.default_rng(0)
    a, b = Bingham.uniform(4), BinghamMixture.single(Bingham.uniform(4))
    for z in compose([0.5, 0.5, 0.5, 0.5], SENSOR.rvs(10, rng=rng)):
        a, b = single.predict(a), mixed.predict(b)
        a, info_a = single.update(a, z)
        b, info_b = mixed.update(b, z)
        np.testing.assert_array_equal(a.z, b.components.z[0])
        np.testing.assert_array_equal(a.mode, b.components.mode[0])
        assert info_a.log_evidence == pytest.approx(info_b.log_evidence, rel=1e-12)


def test_update_is_bayes_rule_with_exact_evidence():
    rng = np.random.default_rng(1)
    frames = np.stack([np.linalg.qr(rng.standard_normal((2, 2)))[0] for _ in range(3)])
    prior = BinghamMixture([0.5, 0.2], Bingham([[-3.0, 0.0], [-9.0, 0.0]], frames[:2]), 0.3)
    noise = BinghamMixture([0.6, 0.3], Bingham([[-5.0, 0.0], [-7.0, 0.0]], [np.eye(2)[:, ::-1], frames[2]]), 0.1)
    f = MixtureFilter(Bingham([-50.0, 0.0], np.eye(2)[:, ::-1]), noise, min_weight=0.0, merge_cost=0.0)
    z = np.array([np.cos(0.4), np.sin(0.4)])

    def joint(t):
        x = np.array([np.cos(t), np.sin(t)])
        error = compose(x * [1.0, -1.0], z)
        return prior.pdf(x) * noise.pdf(error)

    evidence = quad(joint, 0.0, 2.0 * np.pi, epsabs=1e-13, limit=200)[0]
    posterior, info = f.update(prior, z)
    assert np.exp(info.log_evidence) == pytest.approx(evidence, rel=1e-9)
    for t in (0.0, 0.7, 2.0):
        assert posterior.pdf(np.array([np.cos(t), np.sin(t)])) == pytest.approx(joint(t) / evidence, rel=1e-8)


def test_a_cube_seen_twice_keeps_its_twenty_four_orientations():
    group = Rotation.create_group("O").as_quat(scalar_first=True)
    noise = ambiguous_noise(Bingham([-300.0] * 3 + [0.0], IDENTITY_LAST), group)
    f = MixtureFilter(PROCESS, noise)
    rng = np.random.default_rng(2)
    truth = np.array([0.8, 0.2, -0.4, 0.4])
    truth /= np.linalg.norm(truth)
    state = BinghamMixture.single(Bingham.uniform(4))
    for _ in range(3):
        v = Bingham([-300.0] * 3 + [0.0], IDENTITY_LAST).rvs(rng=rng)
        state, _ = f.update(f.predict(state), compose(truth, compose(group[rng.integers(24)], v)))
    assert state.size == 24
    np.testing.assert_allclose(state.weights, 1.0 / 24.0, atol=0.01)
    # Every symmetric equivalent of the truth is near one of the peaks.
    nearest = np.abs(compose(truth, group) @ state.components.mode.T).max(axis=1)
    assert np.all(nearest > np.cos(0.06))


def test_outliers_do_not_move_a_state_that_expects_them():
    honest = MixtureFilter(PROCESS, SENSOR)
    noise = BinghamMixture([0.9], Bingham(SENSOR.z[None], SENSOR.M[None]), 0.1)
    wary = MixtureFilter(PROCESS, noise)
    state = BinghamMixture.single(Bingham([-300.0] * 3 + [0.0], IDENTITY_LAST))
    far = np.array([np.cos(0.5), np.sin(0.5), 0.0, 0.0])
    assert abs(wary.update(state, far)[0].mode[0]) > 0.9999
    assert abs(honest.update(state, far)[0].mode[0]) < 0.998
