"""Tests of hypotheses against published values, exact moments and simulated sizes."""

import numpy as np
import pytest
from scipy.stats import binom

from bingham import Bingham, InvalidArgumentError
from bingham.inference import (
    cluster_girdle_test,
    common_axis_test,
    equality_test,
    goodness_of_fit_test,
    mean_axis_test,
    symmetry_test,
    uniformity_test,
)

REPLICATES = 2000
# Rejections out of 2000 that a test of size 0.04 to 0.06 has, but for one time in ten thousand.
FEWEST, MOST = binom.ppf(1e-4, REPLICATES, 0.04), binom.isf(1e-4, REPLICATES, 0.06)
SHAPES = {"cluster": [-20.0, -15.0, 0.0], "girdle": [-20.0, -3.0, 0.0], "rotations": [-30.0, -15.0, -6.0, 0.0]}


def rejections(result):
    return np.sum(result.pvalue < 0.05)


def test_published_symmetry(published):
    """Lineations of the Quetico province: 3.549, p = 0.170; quartz axes of Kamb (1959): 6.78, p = 0.034."""
    lineations = symmetry_test(published("quetico_lineations"))
    assert lineations.statistic == pytest.approx(3.549, abs=5e-4)
    assert lineations.pvalue == pytest.approx(0.170, abs=5e-4)
    quartz = symmetry_test(published("kamb1959_fig7"))
    assert quartz.statistic == pytest.approx(6.78, abs=5e-3)
    assert quartz.pvalue == pytest.approx(0.034, abs=5e-4)
    again = symmetry_test(published("kamb1959_fig7"), null="simulation", rng=1)
    assert again.pvalue == pytest.approx(0.034, abs=0.012)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_null_mean_of_uniformity(d):
    """E[S] = (d − 1)(d + 2)/2, 5 for d = 3, and E[G] = 1/2, at every n."""
    x = Bingham.uniform(d).rvs((REPLICATES, 7), rng=1)
    for method, mean in (("bingham", (d - 1) * (d + 2) / 2), ("gine", 0.5)):
        s = uniformity_test(x[: 300 if method == "gine" else None], method=method).statistic
        assert s.mean() == pytest.approx(mean, abs=4 * s.std() / np.sqrt(s.size))


@pytest.mark.parametrize("n", [20, 100])
@pytest.mark.parametrize(("d", "method"), [(2, "rayleigh"), (2, "bingham"), (3, "bingham"), (4, "bingham")])
def test_size_of_uniformity(d, method, n):
    x = Bingham.uniform(d).rvs((REPLICATES, n), rng=n)
    assert FEWEST <= rejections(uniformity_test(x, method=method)) <= MOST
    tilted = Bingham(np.append(np.zeros(d - 1), 2.0), np.eye(d)).rvs((200, n), rng=n)
    assert rejections(uniformity_test(tilted, method=method)) > ({2: 135, 3: 90, 4: 45}[d] if n == 20 else 190)


@pytest.mark.parametrize("n", [3, 5, 20, 84])
def test_stronger_fabrics_are_less_uniform(n):
    """Corrections of the distribution of S must not turn round in its tail."""
    x = np.array([Bingham([-k, -0.8 * k, 0.0], np.eye(3)).rvs(n, rng=1) for k in np.geomspace(0.01, 1e4, 60)])
    result = uniformity_test(x)
    order = np.argsort(result.statistic)
    assert np.all(np.diff(result.pvalue[order]) <= 0.0)
    assert result.pvalue[-1] < (0.06 if n == 3 else 1e-2)


def test_gine_sees_what_second_moments_do_not():
    """Axes about the four diagonals of a cube have the second moment of uniform ones."""
    diagonals = np.array([[1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1]]) / np.sqrt(3)
    z = [[-30.0, -30.0, 0.0]] * 4
    frames = np.array([np.linalg.svd(v[None])[2][::-1].T for v in diagonals])
    x = Bingham(z, frames).rvs(15, rng=1).reshape(-1, 3)
    assert uniformity_test(x).pvalue > 0.05
    assert uniformity_test(x, method="gine").pvalue < 0.01
    assert uniformity_test(x, method="gine", null="simulation", resamples=999, rng=0).pvalue < 0.01


@pytest.mark.parametrize("n", [20, 100])
@pytest.mark.parametrize("name", SHAPES)
def test_sizes_of_tests_of_axes(name, n):
    z = np.array(SHAPES[name])
    p = Bingham(z, np.linalg.qr(np.random.default_rng(1).normal(size=(z.size, z.size)))[0])
    x, y = p.rvs((REPLICATES, n), rng=1), Bingham(2 * z, p.M).rvs((REPLICATES, n + 5), rng=2)
    assert FEWEST <= rejections(mean_axis_test(x, p.mode)) <= MOST
    assert FEWEST <= rejections(common_axis_test(x, y)) <= MOST
    # Controls: another axis, another distribution.
    assert rejections(mean_axis_test(x, p.M[:, 0])) == REPLICATES
    assert FEWEST <= rejections(mean_axis_test(x, p.M[:, 0], index=0)) <= MOST
    turned = Bingham(z, p.M[:, [*range(1, z.size), 0]]).rvs((200, n), rng=3)
    assert rejections(common_axis_test(x[:200], turned)) > 190
    assert rejections(equality_test(x[:200], y[:200], null="asymptotic")) > (40 if n == 20 else 180)
    again = Bingham(z, p.M).rvs((REPLICATES, n), rng=4)
    assert FEWEST <= rejections(equality_test(x, again, null="asymptotic")) <= MOST


@pytest.mark.parametrize("n", [20, 100])
def test_size_of_symmetry(n):
    for kind, z in (("bipolar", [-10.0, -10.0, 0.0]), ("girdle", [-30.0, 0.0, 0.0])):
        x = Bingham(z, np.eye(3)).rvs((REPLICATES, n), rng=n)
        assert FEWEST <= rejections(symmetry_test(x, kind=kind)) <= MOST
        lopsided = Bingham(z + np.array([-60.0, 0.0, 0.0]) if kind == "bipolar" else [-30.0, -12.0, 0.0], np.eye(3))
        assert rejections(symmetry_test(lopsided.rvs((200, n), rng=n), kind=kind)) > (175 if n == 20 else 195)


@pytest.mark.parametrize("n", [20, 100])
def test_size_of_cluster_against_girdle(n):
    x = Bingham([-16.0, -8.0, 0.0], np.eye(3)).rvs((REPLICATES, n), rng=n)
    result = cluster_girdle_test(x)
    assert FEWEST <= rejections(result) <= MOST
    assert np.all(np.isclose(result.pvalue_cluster + result.pvalue_girdle, 1.0))
    for z, sign in (([-30.0, -1.0, 0.0], -1), ([-30.0, -30.0, 0.0], 1)):
        other = cluster_girdle_test(Bingham(z, np.eye(3)).rvs((200, n), rng=n))
        assert np.mean(np.sign(other.statistic) == sign) > (0.6 if n == 20 else 0.9)


def test_resampled_sizes():
    """Exact tests at n = 8, where no expansion holds."""
    rng = np.random.default_rng(5)
    p = Bingham([-9.0, -3.0, 0.0], np.eye(3))
    runs = 200
    counts = np.zeros(3)
    for _ in range(runs):
        x, y = p.rvs(8, rng=rng), p.rvs(8, rng=rng)
        counts[0] += mean_axis_test(x, [0, 0, 1], null="permutation", resamples=19, rng=rng).pvalue <= 0.1
        counts[1] += equality_test(x, y, resamples=19, rng=rng).pvalue <= 0.1
        counts[2] += goodness_of_fit_test(x, resamples=19, rng=rng).pvalue <= 0.1
    assert np.all(binom.ppf(1e-4, runs, 0.1) <= counts)
    assert np.all(counts <= binom.isf(1e-4, runs, 0.1))


def test_goodness_of_fit_finds_a_mixture():
    p = Bingham([-30.0, -20.0, 0.0], np.eye(3))
    mixed = np.concatenate([p.rvs(80, rng=1), Bingham.uniform(3).rvs(20, rng=2)])
    assert goodness_of_fit_test(mixed, rng=0).pvalue < 0.01
    assert goodness_of_fit_test(p.rvs(100, rng=3), rng=0).pvalue > 0.01


def test_three_ways_to_one_pvalue():
    p = Bingham([-20.0, -8.0, 0.0], np.eye(3))
    x, y = p.rvs(60, rng=3), p.rvs(50, rng=4)
    for test, kinds in (
        (lambda null: mean_axis_test(x, [0, 0.1, 0.99**0.5], null=null, resamples=2999, rng=1), ("permutation",)),
        (lambda null: common_axis_test(x, y, null=null, resamples=1999, rng=1), ("bootstrap",)),
        (lambda null: equality_test(x, y, null=null, resamples=2999, rng=1), ("permutation",)),
    ):
        asymptotic = test("asymptotic").pvalue
        for null in kinds:
            assert test(null).pvalue == pytest.approx(asymptotic, abs=0.04)


def test_frames_and_signs_do_not_matter():
    rng = np.random.default_rng(0)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    x, y = Bingham([-9.0, -3.0, 0.0], np.eye(3)).rvs((2, 30), rng=1)
    signs = np.where(rng.random((30, 1)) < 0.5, -1.0, 1.0)
    a, b = (signs * x) @ rotation.T, (signs * y) @ rotation.T
    for test in (
        lambda x, y, m: uniformity_test(x),
        lambda x, y, m: symmetry_test(x),
        lambda x, y, m: mean_axis_test(x, m),
        lambda x, y, m: common_axis_test(x, y),
        lambda x, y, m: equality_test(x, y, null="asymptotic"),
        lambda x, y, m: cluster_girdle_test(x),
    ):
        m = np.array([0.0, 0.6, 0.8])
        assert test(a, b, rotation @ m).pvalue == pytest.approx(test(x, y, m).pvalue, rel=1e-6)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda x: uniformity_test(x, method="rayleigh"), "x: expected axes in the plane"),
        (lambda x: uniformity_test(x, method="s"), "method: expected 'bingham' or 'gine' or 'rayleigh', got 's'"),
        (lambda x: symmetry_test(x[:, :2] / np.linalg.norm(x[:, :2], axis=1, keepdims=True)), "x: expected d ≥ 3"),
        (lambda x: common_axis_test(x), "others: expected one more sample"),
        (lambda x: common_axis_test(x, np.eye(4)), "others: expected axes with d = 3"),
        (lambda x: equality_test(x[:2], x[:2]), "x: expected at least 8 axes"),
        (lambda x: mean_axis_test(x, [1.0, 1.0, 0.0]), "axis: expected unit vectors"),
        (lambda x: mean_axis_test(x[:3], [0, 0, 1]), "x: expected more than d = 3 axes"),
        (lambda x: mean_axis_test(x * [1, 1, 0] / np.linalg.norm(x[:, :2], axis=1, keepdims=True), [1, 0, 0]),
         "x: expected axes that span the space"),
        (lambda x: cluster_girdle_test(np.eye(4)), "x: expected axes in space"),
        (lambda x: goodness_of_fit_test(x, rng="a"), "rng: expected"),
        (lambda x: uniformity_test([[np.nan, 0, 0], [1, 0, 0]]), "x: expected unit vectors .* got NaN"),
    ],
)  # fmt: skip
def test_bad_input_is_named(call, message):
    with pytest.raises(InvalidArgumentError, match=message):
        call(Bingham([-9.0, -3.0, 0.0], np.eye(3)).rvs(10, rng=1))
