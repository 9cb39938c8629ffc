"""Confidence regions against simulation, published ellipses and exact limits."""

import numpy as np
import pytest
from scipy.stats import chi2, f

from bingham import Bingham, InvalidArgumentError
from bingham.inference import concentration_intervals, confidence_ellipse, mean_axis_test

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


@pytest.mark.parametrize("n", [10, 20, 50])
@pytest.mark.parametrize("name", SHAPES)
def test_concentration_intervals_cover(name, n):
    p, x = replicates(SHAPES[name], n, n)
    part = x[:1000]
    result = concentration_intervals(part)
    covered = np.mean((result.low <= p.z) & (p.z <= result.high), axis=0)[:-1]
    assert np.all(covered > 0.93 - 1.5 * CHANCE)
    # Concentrations that nearly agree are covered too often.
    assert np.all(covered < (0.985 if name == "bipolar" else 0.965 + 1.5 * CHANCE))
    if n == 10:  # the control: maximum likelihood plus and minus two of its errors is far off its mark
        errors = Bingham.fit(part).standard_errors(n).concentrations
        low = Bingham.fit(part).z + 1.96 * errors < p.z
        high = Bingham.fit(part).z - 1.96 * errors > p.z
        assert np.any(np.abs([*low.mean(axis=0)[:-1], *high.mean(axis=0)[:-1]] - np.full(2 * p.dim - 2, 0.025)) > 0.012)


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
    result = concentration_intervals(x)
    square = 12 * np.linalg.eigvalsh(x.T @ x / 12)[0]

    def log_likelihood(z):
        return 0.5 * 11 * np.log(-z) + z * square

    best = log_likelihood(-11 / (2 * square))
    assert result.estimate[0] == pytest.approx(-11 / (2 * square), rel=1e-4)
    for end in (result.low[0], result.high[0]):
        assert 2 * (best - log_likelihood(end)) == pytest.approx(chi2.ppf(0.95, 1), rel=1e-3)


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
