import numpy as np
import pytest
from scipy.stats import chi2

from bingham.errors import InvalidArgumentError
from bingham.filters.constant_spin import fit_constant_spin
from bingham.filters.spin import SpinFilter, spin_prior, tuned_spin_filter
from bingham.rotations import compose, conjugate, from_rotation_vector, to_rotation_vector

INSIDE = chi2.ppf(0.95, 3)


def unit(a):
    return a / np.linalg.norm(a)


def turning_body(seed, rows=200, noise=0.05, revolutions=3.0):
    """Times, truth, measurements of a body turning about a fixed axis, 5–50 ms apart, and its rate."""
    rng = np.random.default_rng(seed)
    rate = 2.0 * np.pi * revolutions * unit(rng.standard_normal(3))
    t = np.cumsum(rng.uniform(0.005, 0.05, rows))
    truth = compose(from_rotation_vector(t[:, None] * rate), unit(rng.standard_normal(4)))
    return t, truth, compose(truth, from_rotation_vector(noise * rng.standard_normal((rows, 3)))), rate


def inside(error, covariance):
    return np.einsum("ni,nij,nj->n", error, np.linalg.inv(covariance), error) < INSIDE


@pytest.mark.parametrize("revolutions", [0.2, 3.0, 9.0])
def test_constant_spin_is_found_with_its_uncertainty(revolutions):
    covered, control = [], []
    for seed in range(100):
        t, _, z, rate = turning_body(seed, 60, revolutions=revolutions)
        fit = fit_constant_spin(z, t)
        covered.append(inside((fit.rate - rate)[None], fit.covariance[None])[0])
        control.append(inside((fit.rate - rate)[None], fit.covariance[None] / 4.0)[0])
    assert 0.89 <= np.mean(covered) <= 0.99
    # Negative control: half the standard deviation covers too little.
    assert np.mean(control) < 0.8


def test_constant_spin_of_exact_orientations_is_exact():
    t, truth, _, rate = turning_body(0, 9)
    fit = fit_constant_spin(np.where(np.arange(9)[:, None] % 2, truth, -truth), t)
    np.testing.assert_allclose(fit.rate, rate, rtol=1e-9)
    assert fit.revolutions_per_second == pytest.approx(3.0, rel=1e-9)
    assert np.abs(np.sum(fit.orientation(t) * truth, axis=1)).min() > 1.0 - 1e-12
    truth[3] = np.nan
    np.testing.assert_allclose(fit_constant_spin(truth, t).rate, rate, rtol=1e-9)


def test_equal_steps_alias_and_unequal_ones_do_not():
    rate = np.array([0.0, 0.0, 2.0 * np.pi * 60.0])
    steps = np.random.default_rng(1).uniform(0.5, 1.5, 30)
    for t, found in ((0.01 * np.arange(30.0), -40.0), (0.01 * np.cumsum(steps), 60.0)):
        z = from_rotation_vector(t[:, None] * rate)
        assert fit_constant_spin(z, t).rate[2] == pytest.approx(2.0 * np.pi * found, rel=1e-6)


@pytest.mark.parametrize("noise", [0.01, 0.03])
def test_axis_rate_and_coverage_at_irregular_times(noise):
    spin, attitude, control = [], [], []
    for seed in range(50):
        t, truth, z, rate = turning_body(seed, noise=noise)
        track = tuned_spin_filter(z, t).run(spin_prior(z, t), z, t)
        found = track.rates[-1]
        assert np.degrees(np.arccos(unit(found) @ unit(rate))) < 1.0
        assert abs(np.linalg.norm(found) / np.linalg.norm(rate) - 1.0) < 0.005
        error = to_rotation_vector(compose(truth, conjugate(track.modes)))[50:]
        attitude.append(inside(error, track.covariances[50:, :3, :3]).mean())
        spin.append(inside(rate - track.rates[50:], track.covariances[50:, 3:, 3:]).mean())
        control.append(inside(rate - track.rates[50:], track.covariances[50:, 3:, 3:] / 4.0).mean())
    assert 0.92 <= np.mean(spin) <= 0.98
    assert 0.92 <= np.mean(attitude) <= 0.98
    # Negative control.
    assert np.mean(control) < 0.8


def test_a_changing_spin_is_followed_and_its_walk_is_learned():
    rng = np.random.default_rng(5)
    walk, t = 2.0, np.cumsum(rng.uniform(0.005, 0.05, 1500))
    rate, x, rates, truth = np.array([3.0, -8.0, 12.0]), np.array([1.0, 0.0, 0.0, 0.0]), [], []
    for dt in np.diff(t, prepend=t[0] - 0.01):
        for _ in range(10):
            rate = rate + walk * np.sqrt(dt / 10) * rng.standard_normal(3)
            x = compose(from_rotation_vector(rate * dt / 10), x)
        rates.append(rate)
        truth.append(x)
    z = compose(np.array(truth), from_rotation_vector(0.02 * rng.standard_normal((1500, 3))))
    spin_filter = tuned_spin_filter(z, t)
    assert spin_filter.spin_walk == pytest.approx(walk, rel=0.2)
    assert spin_filter.measurement_noise == pytest.approx(0.02, rel=0.05)
    track = spin_filter.run(spin_prior(z, t), z, t)
    assert 0.92 <= inside(np.array(rates) - track.rates, track.covariances[:, 3:, 3:]).mean() <= 0.98


def test_a_run_in_two_parts_is_the_whole_run():
    t, _, z, _ = turning_body(3)
    z[40:60] = np.nan
    f = SpinFilter(0.05, 0.3)
    whole = f.run(spin_prior(z, t), z, t)
    first = f.run(spin_prior(z, t), z[:90], t[:90])
    second = f.run(first.final, z[90:], t[90:], start_time=t[89])
    np.testing.assert_array_equal(np.concatenate([first.modes, second.modes]), whole.modes)
    np.testing.assert_array_equal(second.covariances[-1], whole.covariances[-1])
    assert not whole.accepted[40:60].any() and whole.log_evidence[45] == 0.0
    # Uncertainty grows while nothing is measured.
    assert np.trace(whole.covariances[59, :3, :3]) > 2.0 * np.trace(whole.covariances[39, :3, :3])


def test_frames_of_the_noise():
    t, truth, _, _ = turning_body(4)
    covariance = np.diag([0.1, 0.01, 0.01]) ** 2
    e = np.random.default_rng(0).multivariate_normal(np.zeros(3), covariance, len(t))
    evidence = {}
    for side, z in (
        ("right", compose(truth, from_rotation_vector(e))),
        ("left", compose(from_rotation_vector(e), truth)),
    ):
        for assumed in ("right", "left"):
            f = SpinFilter(covariance, 0.01, noise_side=assumed)
            evidence[side, assumed] = f.run(spin_prior(z, t), z, t).log_evidence[20:].sum()
    assert evidence["right", "right"] > evidence["right", "left"] + 100.0
    assert evidence["left", "left"] > evidence["left", "right"] + 100.0


def test_bad_input_is_named():
    t, _, z, _ = turning_body(0, 9)
    with pytest.raises(InvalidArgumentError, match="times"):
        fit_constant_spin(z, t[::-1])
    with pytest.raises(InvalidArgumentError, match="at least two"):
        fit_constant_spin(z[:1], t[:1])
    with pytest.raises(InvalidArgumentError, match="measurement_noise"):
        SpinFilter(0.0, 1.0)
    with pytest.raises(InvalidArgumentError, match="at least four"):
        spin_prior(z[:3], t[:3])
