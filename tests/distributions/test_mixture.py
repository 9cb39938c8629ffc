"""The mixture as a distribution: normalisation, algebra and entropy against integrals and samples."""

import numpy as np
import pytest
from scipy.integrate import quad

from bingham import Bingham, BinghamMixture, InvalidArgumentError


def random_mixture(rng, d, size, background=0.0, low=50.0, high=500.0, separation=30.0):
    """Components with modes at least `separation` degrees apart and concentrations log-uniform in [low, high]."""
    while True:
        frames = np.stack([np.linalg.qr(rng.standard_normal((d, d)))[0] for _ in range(size)])
        z = np.zeros((size, d))
        z[:, :-1] = -np.exp(rng.uniform(np.log(low), np.log(high), (size, d - 1)))
        distributions = Bingham(z, frames)
        cosine = np.abs(distributions.mode @ distributions.mode.T) - 2.0 * np.eye(size)
        if size == 1 or cosine.max() < np.cos(np.deg2rad(separation)):
            return BinghamMixture(np.full(size, (1.0 - background) / size), distributions, background)


@pytest.fixture
def planar():
    rng = np.random.default_rng(3)
    return random_mixture(rng, 2, 3, 0.2, 2.0, 30.0, 20.0), random_mixture(rng, 2, 2, 0.1, 2.0, 30.0, 20.0)


def circle(f):
    return quad(lambda t: f(np.array([np.cos(t), np.sin(t)])), 0.0, 2.0 * np.pi, epsabs=1e-12, limit=400)[0]


def test_density_integrates_to_one(planar):
    assert circle(planar[0].pdf) == pytest.approx(1.0, abs=1e-10)


def test_product_is_the_normalised_product(planar):
    p, q = planar
    evidence = circle(lambda x: p.pdf(x) * q.pdf(x))
    product = p.multiply(q, min_weight=0.0)
    for t in (0.1, 1.0, 2.5):
        x = np.array([np.cos(t), np.sin(t)])
        assert product.pdf(x) == pytest.approx(p.pdf(x) * q.pdf(x) / evidence, rel=1e-9)


def test_entropy_lies_between_its_bounds(planar):
    lower, upper = planar[0].entropy_bounds()
    entropy = circle(lambda x: -planar[0].pdf(x) * planar[0].logpdf(x))
    assert lower <= entropy <= upper
    assert upper - lower < 2.0


def test_entropy_bounds_meet_for_one_uniform_distribution():
    lower, upper = BinghamMixture.single(Bingham.uniform(3)).entropy_bounds()
    assert lower == pytest.approx(np.log(4.0 * np.pi), rel=1e-12)
    assert upper == pytest.approx(np.log(4.0 * np.pi), rel=1e-12)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_samples_have_the_moment(d):
    mixture = random_mixture(np.random.default_rng(d), d, 3, 0.1, 5.0, 50.0)
    x = mixture.rvs(40_000, rng=1)
    spread = 4.0 * np.sqrt(0.25 / len(x))
    assert np.abs(x.T @ x / len(x) - mixture.moment()).max() < spread
    single = BinghamMixture.single(mixture.components[0])
    assert np.abs(x.T @ x / len(x) - single.moment()).max() > spread


def test_composition_has_the_moment_of_the_products():
    rng = np.random.default_rng(5)
    p, q = random_mixture(rng, 4, 2, 0.1), random_mixture(rng, 4, 3)
    from bingham.rotations import compose

    x = compose(p.rvs(40_000, rng=1), q.rvs(40_000, rng=2))
    assert np.abs(x.T @ x / len(x) - p.compose(q).moment()).max() < 4.0 * np.sqrt(0.25 / len(x))


def test_rotation_and_inverse_move_the_density():
    rng = np.random.default_rng(6)
    p = random_mixture(rng, 4, 3, 0.05)
    from bingham.rotations import compose, conjugate

    a, x = rng.standard_normal((2, 4))
    a, x = a / np.linalg.norm(a), x / np.linalg.norm(x)
    assert p.rotate(left=a).logpdf(compose(a, x)) == pytest.approx(p.logpdf(x), rel=1e-10)
    assert p.inverse().logpdf(conjugate(x)) == pytest.approx(p.logpdf(x), rel=1e-12)


def test_reduction_keeps_the_moment_and_merges_twins():
    rng = np.random.default_rng(7)
    p = random_mixture(rng, 4, 3, 0.1)
    doubled = Bingham(
        np.concatenate([p.components.z, p.components.z]), np.concatenate([p.components.M, p.components.M])
    )
    q = BinghamMixture(np.concatenate([p.weights, p.weights]) / 2.0, doubled, p.background)
    x = rng.standard_normal((20, 4))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    np.testing.assert_allclose(q.reduce(3).logpdf(x), p.logpdf(x), rtol=1e-8)
    np.testing.assert_allclose(q.merge(1e-9).logpdf(x), p.logpdf(x), rtol=1e-8)
    assert q.merge(1e-9).size == 3
    np.testing.assert_allclose(q.reduce(1).moment(), p.moment(), atol=1e-12)


def test_peaks_of_far_components_are_their_modes_and_close_ones_fuse():
    p = random_mixture(np.random.default_rng(8), 3, 4, 0.1, 200.0, 500.0)
    peaks = p.peaks()
    assert len(peaks.axes) == 4
    np.testing.assert_allclose(np.abs(p.components.mode @ peaks.axes.T).max(axis=1), 1.0, atol=1e-6)
    assert np.all(np.diff(peaks.log_density) <= 0.0)
    tilt = np.array([[1.0, 0, 0], [0, np.cos(0.02), np.sin(0.02)], [0, -np.sin(0.02), np.cos(0.02)]])
    twins = Bingham([[-50.0, -50.0, 0.0]] * 2, [np.eye(3), tilt])
    fused = BinghamMixture([0.5, 0.5], twins).peaks()
    assert len(fused.axes) == 1
    assert abs(fused.axes[0] @ [0.0, np.sin(0.01), np.cos(0.01)]) == pytest.approx(1.0, abs=1e-10)


def test_probabilities_sum_to_one_and_follow_bayes():
    p = random_mixture(np.random.default_rng(9), 3, 2, 0.3, 5.0, 20.0)
    x = p.rvs(100, rng=0)
    r = p.predict_proba(x)
    np.testing.assert_allclose(r.sum(axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(r[:, 0] * p.pdf(x), p.weights[0] * p.components[0].pdf(x), rtol=1e-10)
    assert p.score(x) == pytest.approx(np.mean(np.log(p.pdf(x))), rel=1e-12)
    assert p.bic(x) - p.aic(x) == pytest.approx(p.parameter_count * (np.log(100) - 2.0), rel=1e-10)
    assert p.parameter_count == 2 * 5 + 2


def test_rejects_what_is_no_mixture():
    distributions = Bingham([[-5.0, 0.0]] * 2, [np.eye(2)] * 2)
    with pytest.raises(InvalidArgumentError, match="weights"):
        BinghamMixture([0.5, 0.6], distributions)
    with pytest.raises(InvalidArgumentError, match="weights"):
        BinghamMixture([1.0], distributions)
    with pytest.raises(InvalidArgumentError, match="dimension"):
        BinghamMixture([0.5, 0.5], distributions).multiply(Bingham.uniform(3))
    with pytest.raises(AttributeError):
        BinghamMixture([0.5, 0.5], distributions).background = 0.1
