"""Point sets of the standard normal: the distance against integrals it was derived from, constraint, cache."""

import math

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import exp1

from bingham import InvalidArgumentError
from bingham.kernels.lcd import exponential_integral
from bingham.sampling import gaussian_lcd, standard_normal_points
from bingham.sampling.gaussian_lcd import REACH, distance


@pytest.fixture(autouse=True)
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("BINGHAM_CACHE", str(tmp_path))
    standard_normal_points.cache_clear()
    yield tmp_path
    standard_normal_points.cache_clear()


@pytest.mark.parametrize("u", [1e-300, 1e-12, 0.3, 0.999, 1.0, 1.001, 4.0, 30.0, 600.0])
def test_exponential_integral(u):
    assert exponential_integral(u) == pytest.approx(exp1(u), rel=1e-13)


def by_definition(points):
    """D by nested quadrature of (F̂ − F)² over r on a line and over b, n = 1; no closed inner integral."""
    x, w = np.polynomial.legendre.leggauss(40)
    points = np.asarray(points)

    def inner(b):
        reach = 12.0 * math.sqrt(1.0 + b * b)
        knots = np.unique(np.concatenate([[-reach, -1.0, 1.0, reach], points, points - 7.0 * b, points + 7.0 * b]))
        half = 0.5 * np.diff(knots)[:, None]
        r = 0.5 * (knots[1:] + knots[:-1])[:, None] + half * x
        normal = b / math.sqrt(1.0 + b * b) * np.exp(-r * r / (2.0 * (1.0 + b * b)))
        mixture = np.exp(-((r[..., None] - points) ** 2) / (2.0 * b * b)).mean(axis=-1)
        return float(np.sum(half * w * (normal - mixture) ** 2))

    return quad(inner, 0.0, REACH, points=[0.05, 0.3, 1.0, 3.0], epsabs=1e-11, limit=400)[0]


def test_distance_equals_its_definition_on_the_line():
    points = [-1.4, 0.1, 0.9]
    assert distance(np.array(points)[:, None])[0] == pytest.approx(by_definition(points), abs=1e-8)


@pytest.mark.parametrize("n", [2, 3, 4, 7])
def test_distance_equals_numerical_integral_over_widths(n):
    # The inner integral over r is a product of n Gaussian integrals; the outer one over b goes to mpmath here.
    x = np.random.default_rng(n).normal(size=(6, n))
    squares = np.sum(x * x, axis=1)
    pairs = np.sum((x[:, None] - x) ** 2, axis=-1).ravel()

    def integrand(b):
        normal = mpmath.pi ** (n / 2) * b ** (2 * n) * (1 + b * b) ** (-mpmath.mpf(n) / 2)
        width = 1 + 2 * b * b
        mixed = (
            sum((2 * mpmath.pi * b**4 / width) ** (mpmath.mpf(n) / 2) * mpmath.exp(-r / (2 * width)) for r in squares)
            / 6
        )
        among = sum((mpmath.pi * b * b) ** (mpmath.mpf(n) / 2) * mpmath.exp(-s / (4 * b * b)) for s in pairs) / 36
        return b ** (1 - n) * (normal - 2 * mixed + among)

    with mpmath.workdps(25):
        reference = float(mpmath.quad(integrand, [0, 0.1, 0.5, 1, 2, 5, REACH]))
    assert distance(x)[0] == pytest.approx(reference, abs=1e-8)


def test_gradient_is_the_derivative():
    rng = np.random.default_rng(3)
    x, direction = rng.normal(size=(5, 3)), rng.normal(size=(5, 3))
    for options in ({}, {"symmetric": True}, {"symmetric": True, "middle": 1}):
        h = 1e-5
        numeric = (distance(x + h * direction, **options)[0] - distance(x - h * direction, **options)[0]) / (2 * h)
        assert np.sum(distance(x, **options)[1] * direction) == pytest.approx(numeric, rel=1e-7)


def test_folded_distance_equals_that_of_all_points():
    x = np.random.default_rng(4).normal(size=(5, 2))
    whole = np.concatenate([x, np.zeros((1, 2)), -x])
    value, slope = distance(x, symmetric=True, middle=1)
    everywhere = distance(whole)
    assert value == pytest.approx(everywhere[0], abs=1e-12)
    assert np.allclose(slope, everywhere[1][:5] - everywhere[1][6:], atol=1e-12)


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("n", [1, 2, 3])
def test_distance_falls_with_the_number_of_points_and_beats_random_ones(n, symmetric):
    sizes = [8, 9, 10, 12, 16, 17, 24, 40]
    sets = [standard_normal_points(n, m, symmetric=symmetric) for m in sizes]
    values = [distance(points)[0] for points in sets]
    assert np.all(np.diff(values) < 0.0)
    random = distance(np.random.default_rng(0).normal(size=(40, n)))[0]
    assert values[-1] < 0.5 * random
    for m, points in zip(sizes, sets, strict=True):
        assert np.abs(points.T @ points / m - np.eye(n)).max() < 1e-13
        assert np.abs(points.sum(axis=0)).max() < 1e-12


def test_optimum_cannot_be_improved_by_small_moves_that_keep_the_moment():
    points = standard_normal_points(2, 20)
    best = distance(points)[0]
    rng = np.random.default_rng(5)
    for _ in range(20):
        moved = points + 0.02 * rng.normal(size=points.shape)
        moved -= moved.mean(axis=0)
        moved = moved @ np.linalg.inv(np.linalg.cholesky(moved.T @ moved / 20)).T
        assert distance(moved)[0] > best


def test_points_come_from_the_cache_and_damage_is_fixed(empty_cache, monkeypatch):
    first = standard_normal_points(3, 30)
    (path,) = empty_cache.glob("*.npy")
    standard_normal_points.cache_clear()
    with monkeypatch.context() as patch:
        patch.setattr(gaussian_lcd, "_optimize", lambda *_: pytest.fail("computed again"))
        assert np.array_equal(standard_normal_points(3, 30), first)
    for damage in (b"", b"not an array", path.read_bytes()[:-9]):
        path.write_bytes(damage)
        standard_normal_points.cache_clear()
        assert np.array_equal(standard_normal_points(3, 30), first)
    np.save(path, np.zeros((30, 3)))
    standard_normal_points.cache_clear()
    assert np.array_equal(standard_normal_points(3, 30), first)
    assert [p.name for p in empty_cache.iterdir()] == [path.name]


def test_a_folder_that_cannot_be_written_warns_and_still_answers(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("BINGHAM_CACHE", str(blocked))
    with pytest.warns(UserWarning, match="BINGHAM_CACHE"):
        points = standard_normal_points(1, 5)
    assert math.isclose(float(points[:, 0] @ points[:, 0]), 5.0)


def test_too_few_points_are_rejected():
    with pytest.raises(InvalidArgumentError, match="at least 6"):
        standard_normal_points(3, 5)
    with pytest.raises(InvalidArgumentError, match="at least 4"):
        standard_normal_points(3, 3, symmetric=False)
    assert standard_normal_points(3, 6).shape == (6, 3)
