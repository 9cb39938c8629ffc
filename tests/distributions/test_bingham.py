"""The distribution against closed forms, samples and published numbers."""

import pickle

import numpy as np
import pytest
from scipy.special import ive
from scipy.stats import chi, ks_1samp, kstest

from bingham import Bingham, BinghamMixture, InvalidArgumentError, concentrations, moments
from bingham.rotations import compose

IDENTITY_LAST = np.eye(4)[:, ::-1]


def random_frame(d, seed):
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(d, d)))[0]


def test_isotropic_800_composed_with_itself():
    """(ω₀ − ω_s) S + ω_s I for ω_s = 6.2617e-4 each: −400.753 in all three entries."""
    p = Bingham([-800.0, -800.0, -800.0, 0.0], IDENTITY_LAST)
    np.testing.assert_allclose(p.compose(p).z, [-400.753, -400.753, -400.753, 0.0], atol=1e-3)


@pytest.mark.parametrize("z1", [-0.1, -1.0, -30.0, -1e4])
def test_plane_moments_are_bessel_ratios(z1):
    """Kurz et al. 2014, eqs. 77–79."""
    ratio = ive(1, -z1 / 2) / ive(0, -z1 / 2)
    np.testing.assert_allclose(moments([z1, 0.0]), [(1 - ratio) / 2, (1 + ratio) / 2], rtol=1e-12 * max(1, -z1))


@pytest.mark.parametrize("z", [[-900.0, -500.0, -3.0, 0.0], [0.0] * 4, [-1e5] * 3 + [0.0], [-1e5, -1e5, 0.0, 0.0],
                               [-20.0, -1.0, 0.0], [-5.0, 0.0], [-1e5, 0.0]])  # fmt: skip
def test_samples_have_the_moments_of_the_distribution(z):
    n = 400_000
    d = len(z)
    p = Bingham(z, random_frame(d, 1))
    x = p.rvs(n, rng=7)
    np.testing.assert_allclose(np.linalg.norm(x, axis=1), 1.0, atol=1e-12)
    square = (x @ p.M) ** 2
    from bingham.distributions.normalizer import log_normalizer_derivatives

    error = np.sqrt(np.einsum("ii->i", log_normalizer_derivatives(p.z)[2]) / n)
    assert np.all(np.abs(square.mean(0) - p.axis_moments) <= 4 * error + 1e-15)
    if z[0] == -900.0:  # the control: moments of a distribution 2 % wider are told apart
        assert np.any(np.abs(square.mean(0) - moments(0.98 * p.z)) > 4 * error)


def test_same_seed_same_samples():
    p = Bingham([-9.0, -4.0, -1.0, 0.0], random_frame(4, 2))
    np.testing.assert_array_equal(p.rvs(1000, rng=3), p.rvs(1000, rng=3))
    assert not np.array_equal(p.rvs(10, rng=3), p.rvs(10, rng=4))
    assert p.rvs(rng=0).shape == (4,)
    assert Bingham(np.tile(p.z, (2, 1)), np.tile(p.M, (2, 1, 1))).rvs((5, 3), rng=0).shape == (2, 5, 3, 4)


def test_composition_moment_equals_that_of_composed_samples():
    p, q = Bingham([-30.0, -10.0, -4.0, 0.0], random_frame(4, 3)), Bingham([-20.0, -9.0, -1.0, 0.0], random_frame(4, 4))
    n = 300_000
    y = compose(p.rvs(n, rng=1), q.rvs(n, rng=2))
    sample = np.einsum("ni,nj->ij", y, y) / n
    np.testing.assert_allclose(sample, p.compose(q).moment(), atol=4 * 0.5 / np.sqrt(n))
    assert np.abs(sample - q.compose(p).moment()).max() > 0.01  # the order matters


def test_true_composed_density_integrates_to_one_and_has_the_matched_moment():
    p, q = Bingham([-12.0, -6.0, -2.0, 0.0], random_frame(4, 5)), Bingham([-9.0, -5.0, -1.0, 0.0], random_frame(4, 6))
    matched = p.compose(q)
    n = 200_000
    x = matched.rvs(n, rng=8)
    weight = np.exp(p.composed_logpdf(q, x) - matched.logpdf(x))
    assert weight.mean() == pytest.approx(1.0, abs=4 * weight.std() / np.sqrt(n))
    moment = np.einsum("n,ni,nj->ij", weight, x, x) / n
    np.testing.assert_allclose(moment, matched.moment(), atol=0.01)


@pytest.mark.parametrize(("z", "d"), [([-40.0, -15.0, -5.0, 0.0], 4), ([-8.0, -2.0, 0.0], 3), ([-3.0, 0.0], 2)])
def test_fit_recovers_the_distribution_within_its_standard_errors(z, d):
    p = Bingham(z, random_frame(d, 9))
    n = 200_000
    x = p.rvs(n, rng=10)
    fitted = Bingham.fit(x * np.where(np.random.default_rng(0).random(n) < 0.5, -1.0, 1.0)[:, None])
    error = fitted.standard_errors(n)
    assert np.all(np.abs(fitted.z - p.z)[:-1] < 4 * error.concentrations[:-1])
    angle = np.arccos(np.minimum(1.0, np.abs(fitted.mode @ p.mode)))
    assert angle < 4 * np.sqrt(np.sum(error.axes[-1, :-1] ** 2))
    np.testing.assert_allclose(fitted.moment(), np.einsum("ni,nj->ij", x, x) / n, atol=1e-12)


def test_weights_count_rows():
    x = Bingham([-9.0, -2.0, 0.0], np.eye(3)).rvs(50, rng=0)
    counts = np.random.default_rng(1).integers(0, 4, 50)
    np.testing.assert_allclose(
        Bingham.fit(x, counts).matrix, Bingham.fit(np.repeat(x, counts, axis=0)).matrix, rtol=1e-9
    )


def test_standard_errors_are_those_of_repeated_fits():
    p = Bingham([-30.0, -10.0, 0.0], np.eye(3))
    n, repeats = 1500, 300
    fits = Bingham.fit(p.rvs((repeats, n), rng=4))
    spread = fits.z[:, :2].std(0)
    np.testing.assert_allclose(spread, p.standard_errors(n).concentrations[:2], rtol=0.15)
    tilt = np.abs(fits.M[:, 0, 2])
    assert np.sqrt(np.mean(tilt**2)) == pytest.approx(p.standard_errors(n).axes[0, 2], rel=0.15)


def test_entropy_and_divergence_agree_with_samples():
    p, q = Bingham([-30.0, -10.0, -4.0, 0.0], random_frame(4, 3)), Bingham([-20.0, -9.0, -1.0, 0.0], random_frame(4, 4))
    x = p.rvs(200_000, rng=1)
    log_p, log_q = p.logpdf(x), q.logpdf(x)
    assert p.entropy() == pytest.approx(-log_p.mean(), abs=4 * log_p.std() / 447)
    assert p.cross_entropy(q) == pytest.approx(-log_q.mean(), abs=4 * log_q.std() / 447)
    assert p.kl_divergence(q) == pytest.approx((log_p - log_q).mean(), abs=4 * (log_p - log_q).std() / 447)
    assert Bingham.uniform(4).entropy() == pytest.approx(np.log(2 * np.pi**2), rel=1e-13)


@pytest.mark.parametrize(("z", "d"), [([-30.0, -10.0, -4.0, 0.0], 4), ([-50.0, -1.0, 0.0], 3), ([-8.0, 0.0], 2),
                                      ([0.0, 0.0, 0.0, 0.0], 4), ([-1e4, -1e4, -1e4, 0.0], 4)])  # fmt: skip
def test_credible_angle_covers_its_probability(z, d):
    p = Bingham(z, random_frame(d, 0))
    x = p.rvs(100_000, rng=5)
    angle = np.arccos(np.minimum(1.0, np.abs(x @ p.mode)))
    for level in (0.1, 0.5, 0.95, 0.999):
        share = np.mean(angle <= p.credible_angle(level))
        assert share == pytest.approx(level, abs=4 * np.sqrt(level * (1 - level) / 100_000))
    assert p.credible_angle(0.0) == 0.0
    assert p.credible_angle(1.0) == pytest.approx(np.pi / 2)


def test_credible_angle_of_a_needle_is_that_of_a_gaussian():
    p = Bingham([-1e10] * 3 + [0.0], np.eye(4))
    assert p.credible_angle(0.95) * np.sqrt(2e10) == pytest.approx(chi(3).ppf(0.95), rel=1e-8)


def test_probability_integral_transform_is_uniform():
    p = Bingham([-6.0, -2.0, 0.0], np.eye(3))
    angles = np.arccos(np.abs(p.rvs(400, rng=2) @ p.mode))
    grid = np.linspace(0.001, 0.999, 200)
    transform = np.interp(angles, p.credible_angle(grid), grid)
    assert kstest(transform, "uniform").pvalue > 0.01
    assert ks_1samp(transform**1.3, lambda t: t).pvalue < 0.01  # the control


@pytest.mark.parametrize("frame", ["body", "world"])
def test_covariance_round_trip_and_gaussian_limit(frame):
    p = Bingham([-3e6, -2e6, -1e6, 0.0], random_frame(4, 3))
    c = p.covariance(frame=frame)
    np.testing.assert_allclose(np.linalg.eigvalsh(c), [2 / 3e6, 1e-6, 2e-6], rtol=1e-5)
    np.testing.assert_allclose(Bingham.from_covariance(p.mode, c, frame=frame).matrix, p.matrix, rtol=1e-6, atol=1.0)


def test_covariance_frames_differ_by_the_rotation_of_the_mode():
    from bingham.rotations import to_rotation

    p = Bingham([-900.0, -300.0, -100.0, 0.0], random_frame(4, 8))
    r = to_rotation(p.mode).as_matrix()
    np.testing.assert_allclose(p.covariance(frame="world"), r @ p.covariance(frame="body") @ r.T, atol=1e-14)


def test_covariance_is_rejected_without_a_clear_mode():
    with pytest.raises(InvalidArgumentError, match="clear mode"):
        Bingham.uniform(4).covariance(frame="body")
    assert np.isnan(Bingham([-100, -100, 0, 0], np.eye(4)).covariance(frame="world", undefined="nan")).all()
    with pytest.raises(InvalidArgumentError, match="'body' or 'world'"):
        Bingham([-9, -9, -9, 0], np.eye(4)).covariance(frame="sensor")


def test_values_are_immutable_and_survive_pickling():
    p = Bingham([-9.0, -4.0, -1.0, 0.0], random_frame(4, 2))
    with pytest.raises(AttributeError, match="immutable"):
        p.z = 1
    with pytest.raises(ValueError, match="read-only"):
        p.z[0] = 1
    q = pickle.loads(pickle.dumps(p))
    np.testing.assert_array_equal(q.M, p.M)


def test_parts_of_a_batch():
    p = Bingham.from_matrix(np.array([np.diag([-k, -2.0 * k, 0.0]) for k in (1.0, 2.0, 3.0)]))
    np.testing.assert_array_equal(p[1].z, [-4.0, -2.0, 0.0])
    np.testing.assert_array_equal(p[np.array([2, 0])].z, p.z[[2, 0]])
    np.testing.assert_array_equal(p[..., None].z, p.z[:, None])
    assert p[1:].shape == (2,)


def test_order_of_entries_is_free():
    m = random_frame(4, 1)
    p = Bingham([0.0, -5.0, -1.0, -9.0], m)
    np.testing.assert_allclose(p.z, [-9.0, -5.0, -1.0, 0.0])
    np.testing.assert_allclose(np.abs(p.mode @ m[:, 0]), 1.0)


@pytest.mark.parametrize(("call", "message"), [
    (lambda: Bingham([-1.0, 0.0], np.ones((2, 2))), "M: expected an orthogonal matrix"),
    (lambda: Bingham([-1.0, np.nan], np.eye(2)), "z: expected finite"),
    (lambda: Bingham([-1.0, 0.0], np.eye(3)), "M: expected shape"),
    (lambda: Bingham.from_matrix([[0.0, 1.0], [0.0, 0.0]]), "A: expected a symmetric"),
    (lambda: Bingham.from_moment(np.diag([0.0, 1.0])), "S: expected a positive definite"),
    (lambda: Bingham.from_moment(np.diag([0.3, 0.3])), "S: expected trace 1"),
    (lambda: Bingham.fit([[1.0, 0.0], [1.0, 0.0]]), "x: expected at least d = 2 different axes .*, got 2 samples"),
    (lambda: Bingham.fit(Bingham.uniform(4).rvs(2, rng=1)), "x: .* d = 4 .* got 2 samples .*; add samples"),
    (lambda: Bingham.fit([[2.0, 0.0]]), "x: expected unit vectors"),
    (lambda: Bingham.fit(np.eye(2), [-1.0, 1.0]), "weights: expected"),
    (lambda: Bingham.uniform(2).logpdf([np.nan, 0.0]), "x: expected unit vectors .* got NaN; drop rows of NaN"),
    (lambda: Bingham.fit([[1.0, 0.0], [np.nan, 0.0]]), "x: expected unit vectors .* got NaN at row 1; drop"),
    (lambda: Bingham.uniform(2).logpdf([[1.0, 0.0], [2.0, 0.0]]), "got length 2 at row 1; normalise"),
    (lambda: Bingham.uniform(4).covariance(frame="body"), "distribution: expected one clear mode"),
    (lambda: Bingham.uniform(3).compose(Bingham.uniform(3)), "dimension 2 or 4"),
    (lambda: Bingham.uniform(3).multiply(Bingham.uniform(4)), "other: expected a distribution of dimension 3"),
    (lambda: Bingham.uniform(4).credible_angle(1.5), "p: expected probabilities"),
    (lambda: Bingham.fit(np.eye(3), [1.0, 1.0]), r"weights: expected one for each sample, shape \(3,\), got \(2,\)"),
    (lambda: Bingham.fit(np.eye(2), ["a", "b"]), "weights: expected an array of numbers"),
    (lambda: Bingham("abc", np.eye(2)), "z: expected an array of numbers, got 'abc'"),
    (lambda: Bingham([-1.0, 0.0], "abc"), "M: expected an array of numbers, got 'abc'"),
    (lambda: Bingham(np.zeros((2, 3)), np.tile(np.eye(3), (4, 1, 1))), "M: expected a batch to go with z"),
    (lambda: Bingham.uniform(3).standard_errors(np.eye(3)), r"n: .*samples.* got an array of shape \(3, 3\)"),
    (lambda: Bingham.uniform(2.5), "d: expected an integer ≥ 2, got 2[.]5"),
    (lambda: Bingham.uniform(3).rvs(2, rng="a"), "rng: expected None, .*got 'a'"),
    (lambda: Bingham.uniform(3).kl_divergence(np.eye(3)), "other: expected a Bingham, got an array"),
    (lambda: BinghamMixture([0.5, 0.5], [Bingham.uniform(3)] * 2), "components: expected a Bingham, got a list; one"),
    (lambda: BinghamMixture([1.0], Bingham([[-1.0, 0.0]], [np.eye(2)]), "x"), "background: expected a number"),
    (lambda: concentrations([0.0, 1.0]), "w: expected positive"),
    (lambda: concentrations([0.6, 0.6]), "w: expected rows with sum 1"),
    (lambda: moments([[np.inf, 0.0]]), "z: expected finite"),
    (lambda: Bingham.fit(Bingham.uniform(4).rvs(30, rng=1).T), r"x: .*\(4, 30\) with unit vectors as columns; .*x.T"),
    (lambda: Bingham(np.eye(4), [-3.0, -2.0, -1.0, 0.0]), r"M: expected shape .*; z comes first: Bingham\(z, M\)"),
    (lambda: Bingham([-9.0, -9.0, -9.0, 0.0], IDENTITY_LAST).covariance(), "frame: expected frame=.body. or"),
    (lambda: Bingham([-9.0, -9.0, -9.0, 0.0], IDENTITY_LAST).covariance("body"), "frame: .*got .body. without"),
    (lambda: Bingham.from_covariance([1.0, 0, 0, 0], np.eye(3) / 9), "frame: .* got none; name the axes"),
    (lambda: Bingham.from_covariance([1.0, 0, 0, 0], np.diag([9.0, 9.0, 25.0]), frame="body"),
     r"covariance: .*variances from 9 to 25 rad²; multiply degrees² by \(π/180\)²"),
])  # fmt: skip
def test_bad_input_is_named(call, message):
    with pytest.raises(InvalidArgumentError, match=message):
        call()


@pytest.mark.parametrize("size", [2.5, -1, (2, -3), "3", (1.5, 2)])
def test_sizes_of_samples_are_whole_numbers(size):
    with pytest.raises(InvalidArgumentError, match="size: expected an integer ≥ 0 or a tuple of them, got"):
        Bingham.uniform(4).rvs(size)


def test_shapes_of_samples():
    distribution = Bingham.uniform(4)
    for size, shape in ((None, (4,)), (np.int64(3), (3, 4)), ((), (4,)), ((2, 0), (2, 0, 4)), (0, (0, 4))):
        assert distribution.rvs(size, rng=0).shape == shape
