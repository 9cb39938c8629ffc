"""Confidence regions against simulation, published ellipses and exact limits."""

import numpy as np
import pytest
from scipy.stats import chi2, f

from bingham import Bingham, InvalidArgumentError
from bingham.distributions.marginal import marginal_fit
from bingham.inference import concentration_intervals, confidence_ellipse, mean_axis_test
from bingham.inference.neighbours import gaps, limits, pivot, profile_root

REPLICATES = 2000
# Four standard errors of a share of 0.95.
CHANCE = 4 * np.sqrt(0.95 * 0.05 / REPLICATES)
SHAPES = {
    "bipolar": [-20.0, -15.0, 0.0],
    "girdle": [-20.0, -3.0, 0.0],
    "triaxial": [-30.0, -8.0, 0.0],
    "rotations": [-60.0, -25.0, -9.0, 0.0],
}


def replicates(z, n, seed):
    d = len(z)
    frame = np.linalg.qr(np.random.default_rng(seed).normal(size=(d, d)))[0]
    p = Bingham(z, frame)
    return p, p.rvs((REPLICATES, n), rng=seed)


@pytest.mark.parametrize("n", [10, 20, 50])
@pytest.mark.parametrize("name", SHAPES)
def test_ellipses_cover(name, n):
    p, x = replicates(SHAPES[name], n, n)
    for k in range(p.dim):
        accepted = mean_axis_test(x, p.M[:, k], index=k).pvalue >= 0.05
        assert 0.93 - CHANCE < accepted.mean() < 0.965 + CHANCE
        part = confidence_ellipse(x[:50], axis=k).contains(p.M[:, k])
        np.testing.assert_array_equal(part, accepted[:50])
    for method in ("f", "sandwich"):
        inside = confidence_ellipse(x, method=method).contains(p.mode)
        assert 0.93 - CHANCE < inside.mean() < 0.965 + CHANCE
    if n == 10:  # the control: the usual ellipse does not
        assert confidence_ellipse(x, method="chi2").contains(p.mode).mean() < 0.89


@pytest.mark.parametrize("z", [[-20.0, -20.0, 0.0], [-20.0, 0.0, 0.0], [-30.0, -30.0, -30.0, 0.0], [0.0, 0.0, 0.0]])
def test_regions_cover_where_concentrations_are_equal(z):
    """Every axis of an equal group is as good as another there; the ellipse by Fisher information knows too much."""
    p, x = replicates(z, 20, 7)
    for k in range(p.dim):
        covered = np.mean(mean_axis_test(x, p.M[:, k], index=k).pvalue >= 0.05)
        assert 0.93 - CHANCE < covered < 0.965 + CHANCE
    assert confidence_ellipse(x, method="f", axis=0).contains(p.M[:, 0]).mean() < 0.93 or z[1] == 0.0 > z[0]
    # Mostly it says that the sample leaves them open.
    tied = int(np.flatnonzero(np.diff(z) == 0.0)[0])
    semi = confidence_ellipse(x[:200], axis=tied).semi_axes[:, tied]
    assert np.mean(semi == np.pi / 2) > 0.8


def pivots(x, z):
    """Return t (R, d − 1) of the true z for samples x (R, n, d): within ±1.96 where the interval holds them."""
    n = x.shape[-2]
    fitted = Bingham.fit(x)
    w, plain = fitted.axis_moments, np.array(fitted.z)
    best_z, best = marginal_fit(w, n, plain)
    near = gaps(plain, w, n)
    every = [np.full(len(x), c) for c in z]
    root = [profile_root(k, every[k], best_z, w, n, best)[0] for k in range(len(z) - 1)]
    t = [pivot(k, every[k], best_z, w, n, best, limits(k, near)) for k in range(len(z) - 1)]
    return np.stack(t, axis=1), np.stack(root, axis=1)


@pytest.mark.parametrize("n", [10, 24])
@pytest.mark.parametrize(
    "z",
    [
        *SHAPES.values(),
        [-12.0, -12.0, 0.0],
        [-15.0, 0.0, 0.0],
        [-400.0, -300.0, 0.0],
        [-30.0, -30.0, -30.0, 0.0],
        [-30.0, -25.0, -20.0, 0.0],
        [-50.0, -50.0, -15.0, 0.0],
        [-300.0, -60.0, -10.0, 0.0],
    ],
)
def test_concentration_intervals_cover(z, n):
    """Equal, near and far concentrations alike; two standard errors of 2000 samples are given to chance."""
    x = Bingham(z, np.eye(len(z))).rvs((REPLICATES, n), rng=n)
    t, plain = pivots(x, z)
    covered = np.mean(np.abs(t) <= 1.96, axis=0)
    assert np.all((covered > 0.93 - 0.01) & (covered < 0.965 + 0.009))
    result = concentration_intervals(x[:50])
    inside = (result.low <= z) & (np.array(z) <= result.high)
    # Close to a limit t may cross it thrice, as concentrations fitted under the hypothesis join.
    clear = np.abs(np.abs(t[:50]) - 1.96) > 0.1
    np.testing.assert_array_equal(inside[:, :-1][clear], (np.abs(t[:50]) <= 1.96)[clear])
    if z[:2] == [-30.0, -25.0]:  # the control: by χ² the middle one of near ones is held too often
        assert np.mean(np.abs(plain[:, 1]) <= 1.96) > 0.98


def test_errors_of_intervals_are_even_where_concentrations_are_far_apart():
    """Skewness is taken back: each end misses in a fortieth of the samples, which plain χ² does not."""
    z = [-200.0, -20.0, 0.0]
    t, plain = pivots(Bingham(z, np.eye(3)).rvs((20_000, 10), rng=1), z)
    for side in (-1.0, 1.0):
        np.testing.assert_allclose(np.mean(side * t > 1.96, axis=0), 0.025, atol=0.008)
    assert np.mean(plain[:, 0] < -1.96) > 0.034
    assert np.mean(plain[:, 0] > 1.96) < 0.021


def test_maximum_likelihood_and_its_errors_are_off():
    """The control: two standard errors about the maximum of the likelihood are far from 0.025 beyond each end."""
    for name in SHAPES:
        p, x = replicates(SHAPES[name], 10, 10)
        fitted = Bingham.fit(x)
        errors = fitted.standard_errors(10).concentrations
        beyond = [(fitted.z + side * 1.96 * errors - p.z)[:, :-1] * side < 0.0 for side in (-1.0, 1.0)]
        assert np.any(np.abs(np.mean(beyond, axis=1) - 0.025) > 0.012)


def test_bias_of_few_axes_is_taken_back():
    p, x = replicates([-20.0, -8.0, 0.0], 10, 1)
    plain, corrected = Bingham.fit(x).z, Bingham.fit(x, bias_corrected=True).z
    assert 1.6 < plain[:, 0].mean() / -20.0 < 2.0
    assert abs(np.median(corrected[:, 0]) / -20.0 - 1) < 0.06 < np.median(plain[:, 0]) / -20.0 - 1
    assert np.abs(corrected[:, 0] + 20).mean() < 0.75 * np.abs(plain[:, 0] + 20).mean()
    many = p.rvs(20_000, rng=2)
    np.testing.assert_allclose(Bingham.fit(many, bias_corrected=True).z, Bingham.fit(many).z, rtol=2e-3)


def test_plane_is_the_gamma_interval_of_a_narrow_sample():
    """z₁ = −1/(2σ²), and n s²/σ² of n nearly parallel axes in the plane is χ² with n − 1 degrees."""
    x = Bingham([-1e6, 0.0], np.eye(2)).rvs(12, rng=3)
    square = 12 * np.linalg.eigvalsh(x.T @ x / 12)[0]
    for level in (0.5, 0.95, 0.99):
        result = concentration_intervals(x, level)
        assert result.estimate[0] == pytest.approx(-11 / (2 * square), rel=1e-4)
        ends = -chi2.ppf([0.5 + level / 2, 0.5 - level / 2], 11) / (2 * square)
        np.testing.assert_allclose([result.low[0], result.high[0]], ends, rtol=0.015)


def test_likelihood_region_crosses_its_directions_at_its_semi_axes():
    x = Bingham([-40.0, -6.0, 0.0], np.eye(3)).rvs(25, rng=1)
    region = confidence_ellipse(x, method="likelihood", axis=0)
    for i, angle in enumerate(region.semi_axes):
        for factor in (0.999, 1.001):
            tilted = np.cos(factor * angle) * region.center + np.sin(factor * angle) * region.directions[:, i]
            assert region.contains(tilted) == (factor < 1)
    many = Bingham([-20.0, -8.0, 0.0], np.eye(3)).rvs(2000, rng=2)
    plain, exact = confidence_ellipse(many, method="f"), confidence_ellipse(many)
    np.testing.assert_allclose(exact.semi_axes, plain.semi_axes, rtol=0.01)


def test_a_prior_takes_one_or_two_axes():
    two = np.array([[1.0, 0.0, 0.0], [0.8, 0.6, 0.0]])
    with pytest.raises(InvalidArgumentError, match="x: expected at least d = 3 different axes"):
        Bingham.fit(two)
    fitted = Bingham.fit(two, prior=0.5)
    w = np.linalg.eigvalsh((two.T @ two + 0.5 / 3 * np.eye(3)) / 2.5)
    np.testing.assert_allclose(fitted.axis_moments, w, rtol=1e-12)
    assert abs(Bingham.fit(two[:1], prior=0.1).mode[0]) == pytest.approx(1.0)
    with pytest.raises(InvalidArgumentError, match="prior: expected a number of axes ≥ 0, got -1"):
        Bingham.fit(two, prior=-1)


def test_published_ellipse(published):
    """PmagPy's sample: 3.42° by 4.04° with χ², by F wider; its own 4.48° by 4.49° come from a table that ends early."""
    x = published("pmagpy_gobing")
    semi = np.degrees(confidence_ellipse(x, method="chi2").semi_axes)
    np.testing.assert_allclose(semi, [3.42, 4.04], atol=0.005)
    ratio = np.degrees(confidence_ellipse(x, method="f").semi_axes) / semi
    np.testing.assert_allclose(ratio**2, 2 * 19 / 18 * f.ppf(0.95, 2, 18) / chi2.ppf(0.95, 2), rtol=1e-6)


def test_bootstrap_agrees_in_large_samples():
    x = Bingham([-20.0, -8.0, 0.0], np.eye(3)).rvs(400, rng=1)
    plain, again = confidence_ellipse(x), confidence_ellipse(x, method="bootstrap", rng=0)
    np.testing.assert_allclose(again.semi_axes, plain.semi_axes, rtol=0.12)
    a, b = concentration_intervals(x), concentration_intervals(x, method="bootstrap", rng=0)
    np.testing.assert_allclose(b.high - b.low, a.high - a.low, rtol=0.25, atol=1e-9)
    np.testing.assert_allclose(a.estimate, b.estimate)


def test_batches_are_their_samples():
    x = Bingham([-20.0, -8.0, 0.0], np.eye(3)).rvs((2, 3, 15), rng=1)
    whole, intervals = confidence_ellipse(x), concentration_intervals(x)
    for k in np.ndindex(2, 3):
        np.testing.assert_allclose(whole.semi_axes[k], confidence_ellipse(x[k]).semi_axes)
        np.testing.assert_allclose(intervals.low[k], concentration_intervals(x[k]).low, rtol=1e-4)
    assert whole.contains([0.0, 0.0, 1.0]).shape == (2, 3)


@pytest.mark.parametrize("method", ["f", "likelihood"])
def test_edge_of_an_ellipse_is_its_edge(method):
    x = Bingham([-20.0, -8.0, 0.0], np.eye(3)).rvs(30, rng=1)
    ellipse = confidence_ellipse(x, method=method)
    edge = ellipse.outline()
    inside = edge + 1e-6 * ellipse.center
    assert np.all(ellipse.contains(inside / np.linalg.norm(inside, axis=1, keepdims=True)))
    outside = edge - 1e-6 * ellipse.center
    assert not np.any(ellipse.contains(outside / np.linalg.norm(outside, axis=1, keepdims=True)))
    assert ellipse.contains(-ellipse.center)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda x: confidence_ellipse(x[:3]), "x: expected more than d = 3 axes, got 3"),
        (lambda x: confidence_ellipse(x, 95), "level: expected a probability between 0 and 1, got 95; 0.95 for 95 %"),
        (
            lambda x: confidence_ellipse(x, method="F"),
            "method: expected 'likelihood' or 'f' or 'chi2' or 'sandwich' or 'bootstrap'",
        ),
        (lambda x: concentration_intervals(x, level=0.0), "level: expected a probability"),
        (lambda x: concentration_intervals(x[None], method="bootstrap"), "x: expected one sample"),
        (lambda x: confidence_ellipse(2 * x), "x: expected unit vectors"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(InvalidArgumentError, match=message):
        call(Bingham([-20.0, -8.0, 0.0], np.eye(3)).rvs(10, rng=1))
