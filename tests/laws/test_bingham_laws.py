"""Distributions that hold for every dimension, concentration and batch shape, near-singular draws included."""

import numpy as np
import pytest

from bingham import Bingham, log_normalizer, moments

SPECTRA = {
    "uniform": lambda d: np.zeros(d),
    "isotropic": lambda d: np.r_[np.full(d - 1, -40.0), 0.0],
    "girdle": lambda d: np.r_[-300.0, np.zeros(d - 1)],
    "spread": lambda d: -np.r_[np.logspace(5, -1, d - 1), 0.0],
    "needle": lambda d: np.r_[np.full(d - 1, -1e9), 0.0],
    "nearly equal": lambda d: np.r_[-7.0 - 1e-9 * np.arange(d - 1), 0.0],
}
CASES = [pytest.param(d, name, id=f"{d}-{name}") for d in (2, 3, 4, 6) for name in SPECTRA]


def frame(d, seed=0):
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(d, d)))[0]


def distribution(d, name, seed=0):
    return Bingham(SPECTRA[name](d), frame(d, seed))


def directions(d, n=64, seed=1):
    x = np.random.default_rng(seed).normal(size=(n, d))
    return x / np.linalg.norm(x, axis=1, keepdims=True)


@pytest.mark.parametrize(("d", "name"), CASES)
def test_density_is_antipodally_symmetric(d, name):
    x = directions(d)
    np.testing.assert_array_equal(distribution(d, name).logpdf(x), distribution(d, name).logpdf(-x))


@pytest.mark.parametrize(("d", "name"), CASES)
def test_adding_a_multiple_of_the_identity_changes_nothing_but_f(d, name):
    p = distribution(d, name)
    q = Bingham.from_matrix(p.matrix + 3.25 * np.eye(d))
    scale = max(1.0, -p.z[0])
    np.testing.assert_allclose(q.z, p.z, atol=1e-13 * scale * d)
    assert log_normalizer(p.z + 3.25) == pytest.approx(p.log_normalizer + 3.25, rel=1e-14, abs=1e-12)


@pytest.mark.parametrize(("d", "name"), CASES)
def test_moment_round_trip(d, name):
    p = distribution(d, name)
    q = Bingham.from_moment(p.moment())
    # A dense S has entries of order one: its small eigenvalues are known to rounding of that, no better.
    np.testing.assert_allclose(q.axis_moments, p.axis_moments, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(("d", "name"), CASES)
def test_mode_has_the_largest_density(d, name):
    p = distribution(d, name)
    assert np.all(p.logpdf(directions(d)) <= p.logpdf(p.mode) + 1e-12 * max(1.0, -p.z[0]))


@pytest.mark.parametrize(("d", "name"), CASES)
def test_kl_is_zero_for_itself_and_positive_for_others(d, name):
    p = distribution(d, name)
    assert p.kl_divergence(p) == pytest.approx(0.0, abs=1e-9)
    q = Bingham(np.r_[-3.0, np.zeros(d - 1)], frame(d, 5))
    if name != "uniform":
        assert p.kl_divergence(q) > 1e-3
    assert q.kl_divergence(Bingham.uniform(d)) > 1e-3


@pytest.mark.parametrize(("d", "name"), CASES)
def test_updates_commute_and_associate(d, name):
    p, q, r = distribution(d, name), distribution(d, "isotropic", 7), distribution(d, "girdle", 9)
    a, b = p.multiply(q).multiply(r), r.multiply(p.multiply(q))
    c = q.multiply(r).multiply(p)
    scale = max(1.0, -p.z[0])
    np.testing.assert_allclose(a.matrix, b.matrix, atol=1e-12 * scale)
    np.testing.assert_allclose(a.matrix, c.matrix, atol=1e-12 * scale)


@pytest.mark.parametrize(("d", "name"), [c for c in CASES if c.values[0] in (2, 4)])
def test_composing_with_a_needle_at_the_identity_changes_nothing(d, name):
    p = distribution(d, name)
    needle = Bingham(np.r_[np.full(d - 1, -1e14), 0.0], np.eye(d)[:, ::-1])
    q = p.compose(needle)
    np.testing.assert_allclose(q.moment(), p.moment(), atol=1e-12)


@pytest.mark.parametrize(("d", "name"), [c for c in CASES if c.values[0] in (2, 4)])
def test_composing_with_the_uniform_distribution_gives_the_uniform_distribution(d, name):
    np.testing.assert_allclose(distribution(d, name).compose(Bingham.uniform(d)).z, 0.0, atol=1e-11)


@pytest.mark.parametrize(("d", "name"), [c for c in CASES if c.values[0] in (2, 4)])
def test_inverse_and_rotation(d, name):
    p = distribution(d, name)
    x, u = directions(d), directions(d, 1, 3)[0]
    back = np.array(x)
    back[:, 1:] *= -1
    scale = 1e-12 * max(1.0, -p.z[0])
    np.testing.assert_allclose(p.inverse().logpdf(back), p.logpdf(x), atol=scale)
    from bingham.rotations import compose

    np.testing.assert_allclose(p.rotate(left=u).logpdf(compose(u, x)), p.logpdf(x), atol=10 * scale)
    np.testing.assert_allclose(p.rotate(right=u).logpdf(compose(x, u)), p.logpdf(x), atol=10 * scale)


@pytest.mark.parametrize("shape", [(), (1,), (5,), (2, 3)])
@pytest.mark.parametrize("d", [2, 3, 4, 5])
def test_batches_agree_with_single_laws(d, shape):
    rng = np.random.default_rng(4)
    z = -(10.0 ** rng.uniform(-3, 5, (*shape, d)))
    frames = np.linalg.qr(rng.normal(size=(*shape, d, d)))[0]
    p = Bingham(z, frames)
    assert p.shape == shape
    x = directions(d, 1)[0]
    for index in np.ndindex(shape):
        single = Bingham(z[index], frames[index])
        np.testing.assert_allclose(p.logpdf(x)[index] if shape else p.logpdf(x), single.logpdf(x), rtol=1e-12)
        np.testing.assert_allclose(p.moment()[index], single.moment(), rtol=1e-11, atol=1e-16)
        np.testing.assert_allclose(np.asarray(p.entropy())[index], single.entropy(), rtol=1e-10, atol=1e-12)
        if shape:
            np.testing.assert_array_equal(p[index].z, single.z)


@pytest.mark.parametrize("d", [2, 3, 4, 6])
def test_normalisation_by_an_independent_quadrature(d):
    """Mean of the density over uniform draws times the area is 1 within 4 standard errors; a wrong F is noticed."""
    from scipy.special import gamma

    area = 2 * np.pi ** (d / 2) / gamma(d / 2)
    p = Bingham(np.r_[-6.0, -3.0, np.zeros(d - 2)] if d > 2 else [-6.0, 0.0], frame(d))
    f = area * p.pdf(directions(d, 200_000, 11))
    error = f.std() / np.sqrt(f.size)
    assert abs(f.mean() - 1.0) < 4 * error
    assert abs(1.02 * f.mean() - 1.0) > 4 * error  # the control: two per cent would fail


@pytest.mark.parametrize("d", [2, 3, 4, 7])
def test_moments_sum_to_one_and_keep_the_order(d):
    z = -(10.0 ** np.random.default_rng(0).uniform(-6, 9, (200, d)))
    w = moments(z)
    np.testing.assert_allclose(w.sum(-1), 1.0, atol=1e-12)
    np.testing.assert_array_equal(np.argsort(w, -1), np.argsort(z, -1))
