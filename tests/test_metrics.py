import numpy as np
import pytest

from bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.metrics import (
    angle_probability,
    chi_square_probability,
    coverage,
    geodesic_error,
    nees,
    normal_probability,
    root_mean_square,
    uniformity_statistic,
)

SPECTRA = (
    [-3.0, 0],
    [-2000.0, 0],
    [-9.0, -1, 0],
    [0.0, 0, 0, 0],
    [-500.0, -500, -500, 0],
    [-5e4, -30, -2, 0],
    [-1e5, -1e5, 0, 0],
)


def distribution_of(z, seed=0):
    q = np.linalg.qr(np.random.default_rng(seed).normal(size=(len(z), len(z))))[0]
    return Bingham(z, q)


def test_geodesic_error_keeps_its_accuracy_at_the_ends():
    a = np.array([1.0, 0.0, 0.0, 0.0])
    for angle in (1e-12, 1e-5, 0.3, np.pi / 2):
        b = np.array([np.cos(angle), np.sin(angle), 0.0, 0.0])
        assert geodesic_error(a, b) == pytest.approx(angle, rel=1e-12)
        assert geodesic_error(a, -b) == pytest.approx(angle, rel=1e-12)
        assert geodesic_error(a, -b, axial=False) == pytest.approx(np.pi - angle, rel=1e-12)


@pytest.mark.parametrize("z", SPECTRA)
def test_angle_probability_is_uniform_for_the_distribution_itself_only(z):
    distribution = distribution_of(z)
    x = distribution.rvs(2000, rng=1)
    # Kolmogorov: 1.95/√n is passed once in a thousand.
    assert uniformity_statistic(angle_probability(distribution, x)) * np.sqrt(2000) < 1.95
    if z[-2] < 0:  # the angle to the mode of a girdle hardly depends on its thickness
        wrong = Bingham(np.asarray(z) * 2.0, distribution.M)
        assert uniformity_statistic(angle_probability(wrong, x)) * np.sqrt(2000) > 1.95


@pytest.mark.parametrize("z", SPECTRA)
def test_angle_probability_inverts_the_credible_angle(z):
    distribution = distribution_of(z)
    other = distribution.M[:, 0]
    for p in (0.1, 0.5, 0.95):
        angle = distribution.credible_angle(p)
        x = np.cos(angle) * distribution.mode + np.sin(angle) * other
        assert angle_probability(distribution, x) == pytest.approx(p, abs=1e-9)


def test_angle_probability_of_a_batch():
    distributions = Bingham(np.tile([-5.0, -2, -1, 0], (3, 1)), np.tile(np.eye(4), (3, 1, 1)))
    x = distribution_of([-1.0, -1, -1, 0]).rvs(3, rng=2)
    whole = angle_probability(distributions, x)
    assert whole.shape == (3,)
    np.testing.assert_allclose(whole, [angle_probability(distributions[i], x[i]) for i in range(3)], rtol=1e-12)


@pytest.mark.parametrize("d", [2, 4])
def test_nees_of_a_tangent_gaussian_is_chi_square(d):
    rng = np.random.default_rng(3)
    mode = np.eye(d)[0]
    spread = np.diag(rng.uniform(1e-4, 4e-4, d))
    tangent = rng.standard_normal((4000, d)) * np.sqrt(np.diag(spread))
    tangent[:, 0] = 0.0
    angle = np.linalg.norm(tangent, axis=1, keepdims=True)
    truth = np.cos(angle) * mode + np.sin(angle) * tangent / angle
    signs = rng.choice([-1.0, 1.0], (4000, 1))
    p = chi_square_probability(nees(mode, spread, signs * truth), d - 1)
    assert uniformity_statistic(p) * np.sqrt(4000) < 1.95
    p = chi_square_probability(nees(mode, 1.3 * spread, truth), d - 1)
    assert uniformity_statistic(p) * np.sqrt(4000) > 1.95


def test_small_closed_forms():
    assert normal_probability(1.959963984540054, 1.0) == pytest.approx(0.95, abs=1e-12)
    assert chi_square_probability(7.814727903251179, 3) == pytest.approx(0.95, abs=1e-12)
    assert coverage([0.1, 0.94, 0.96, 0.5]) == 0.75
    assert root_mean_square([3.0, 4.0]) == pytest.approx(np.sqrt(12.5))
    assert uniformity_statistic([0.5]) == 0.5


def test_an_unknown_truth_is_neither_inside_nor_outside():
    distribution = Bingham([-9.0, -4, -1, 0], np.eye(4))
    truth = distribution.rvs(10, rng=4)
    whole = angle_probability(distribution, truth)
    truth[::2] = np.nan
    p = angle_probability(distribution, truth)
    np.testing.assert_array_equal(np.isnan(p), [True, False] * 5)
    np.testing.assert_array_equal(p[1::2], whole[1::2])
    np.testing.assert_array_equal(np.isnan(geodesic_error(distribution.mode, truth)), [True, False] * 5)
    e = nees(np.eye(4)[3], 0.1 * np.eye(4), truth)
    np.testing.assert_array_equal(np.isnan(e), [True, False] * 5)
    np.testing.assert_array_equal(np.isnan(chi_square_probability(e, 3)), [True, False] * 5)
    assert np.isnan(normal_probability(np.nan, 1.0))
    for summary in (coverage, uniformity_statistic):
        with pytest.raises(InvalidArgumentError, match=r"probability: .*NaN in 5 of 10; .*~np.isnan"):
            summary(p)
    with pytest.raises(InvalidArgumentError, match=r"x: .*NaN in 5 of 10"):
        root_mean_square(e)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: geodesic_error([1, 0], [1, 0, 0]), r"truth: expected shape \(..., 2\), got \(3,\)"),
        (lambda: geodesic_error(1.0, [1, 0]), "estimate: expected shape"),
        (lambda: geodesic_error(np.eye(2), np.eye(2)[[0, 1, 0]]), r"truth: .*broadcasts with the estimates' \(2, 2\)"),
        (lambda: geodesic_error([2, 0], [1, 0]), "estimate: .*length 2"),
        (lambda: nees([1, 0], np.eye(3), [1, 0]), r"covariance: expected shape \(..., 2, 2\)"),
        (lambda: nees([1, 0], np.full((2, 2), np.nan), [1, 0]), "covariance: expected finite"),
        (lambda: nees([1, 0], np.diag([1.0, 0.0]), [1, 0]), "covariance: expected positive definite"),
        (lambda: nees([np.nan, np.nan], np.eye(2), [1, 0]), "estimate: .*NaN"),
        (lambda: normal_probability(0.0, [1.0, 0.0]), "variance: expected positive values, got minimum 0"),
        (lambda: chi_square_probability(1.0, 0), "degrees: expected"),
        (lambda: chi_square_probability([np.nan, -1.0], 3), "statistic: .*got -1"),
        (lambda: coverage([0.1], level=95), "level"),
        (lambda: coverage([0.5, 95.0]), r"probability: expected values in \[0, 1\], got 0.5 to 95"),
        (lambda: coverage([]), "probability: expected at least one value"),
        (lambda: uniformity_statistic([]), "probability: expected at least one value"),
    ],
)
def test_what_makes_no_sense_is_rejected(call, words):
    with pytest.raises(InvalidArgumentError, match=words):
        call()


def test_nees_of_a_plane_is_the_angle_over_its_deviation():
    # e = 0.2 rad, C = 0.01 rad² across, whatever the covariance says along the estimate.
    truth = [np.cos(0.2), np.sin(0.2)]
    assert nees([1.0, 0.0], [[7.0, 0.0], [0.0, 0.01]], truth) == pytest.approx(4.0, rel=1e-12)
    assert nees([1.0, 0.0], [[7.0, 0.0], [0.0, 0.01]], np.negative(truth)) == pytest.approx(4.0, rel=1e-12)
