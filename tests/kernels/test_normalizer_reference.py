"""log F against 40-digit values, its asymptote, its distributions and four methods of the literature."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import bingham
from bingham.kernels import numpy_rule
from bingham.kernels.contour import log_normalizer_array
from reference import oracles
from reference.table import DIMENSIONS, error_of_exp, references


def tolerance(d: int) -> float:
    return 1e-12 if d <= 6 else 1e-10


@pytest.mark.parametrize("d", DIMENSIONS)
@pytest.mark.parametrize("log_normalizer", [bingham.log_normalizer, log_normalizer_array], ids=["public", "contour"])
def test_agrees_with_forty_digits(log_normalizer, d):
    table = references(d)
    values = log_normalizer(np.array([row.z for row in table]))
    errors = [error_of_exp(v, row.log_normalizer) for v, row in zip(values, table, strict=True)]
    assert len(errors) >= 20
    worst = int(np.argmax(errors))
    assert errors[worst] < tolerance(d), (table[worst].family, table[worst].z)


@pytest.mark.parametrize("d", DIMENSIONS)
def test_the_comparison_notices_a_perturbed_value(d):
    table = references(d)
    values = bingham.log_normalizer(np.array([row.z for row in table])) + 3 * tolerance(d)
    assert all(error_of_exp(v, row.log_normalizer) > tolerance(d) for v, row in zip(values, table, strict=True))


@pytest.mark.parametrize("d", DIMENSIONS)
def test_uniform_distribution_has_the_area_of_the_sphere(d):
    area = math.log(2) + d / 2 * math.log(math.pi) - math.lgamma(d / 2)
    assert bingham.log_normalizer(np.zeros(d)) == pytest.approx(area, rel=0, abs=tolerance(d))


@pytest.mark.parametrize("d", [2, 3, 4, 5, 6, 10, 20])
def test_tends_to_the_gaussian_integral(d):
    """F = 2 ∏ √(π/|zᵢ|) (1 + Σ 1/(4|zᵢ|) + …): two caps, each a Gaussian on its tangent plane."""
    for exponent in (7, 8, 9, 10, 11, 12):
        z = -(10.0**exponent) * np.linspace(1, 3, d - 1)
        asymptote = math.log(2) + 0.5 * np.sum(np.log(np.pi / -z)) + np.log1p(np.sum(-0.25 / z))
        difference = bingham.log_normalizer(np.append(z, 0.0)) - asymptote
        assert abs(difference) < tolerance(d) + 0.5 * np.sum(1 / z) ** 2


@pytest.mark.parametrize("d", [2, 3, 4, 5, 6, 10, 50])
@pytest.mark.parametrize("moving", ["one", "all but one"])
def test_finite_and_monotone_to_minus_1e12(d, moving):
    grid = np.append(-np.logspace(12, -6, 400), 0.0)
    z = np.zeros((grid.size, d))
    z[:, : 1 if moving == "one" else d - 1] = grid[:, None]
    values = bingham.log_normalizer(z)
    assert np.all(np.isfinite(values))
    assert np.all(np.diff(values) > 0)


@pytest.mark.parametrize("d", [2, 3, 4, 6, 12])
@pytest.mark.parametrize("shape", [(), (1,), (7,), (2, 3), (0,), (2, 0, 3)])
def test_every_batch_shape(d, shape):
    z = -np.random.default_rng(1).exponential(50.0, (*shape, d))
    values = bingham.log_normalizer(z)
    assert np.shape(values) == shape
    for index in np.ndindex(shape):
        assert np.asarray(values)[index] == bingham.log_normalizer(z[index])


@pytest.mark.parametrize("d", [2, 3, 4, 5, 6, 12, 30])
def test_order_does_not_matter_and_offsets_add(d):
    rng = np.random.default_rng(2)
    z = -(10.0 ** rng.uniform(-3, 6, (200, d)))
    values = bingham.log_normalizer(z)
    np.testing.assert_allclose(bingham.log_normalizer(rng.permuted(z, axis=1)), values, rtol=0, atol=2 * tolerance(d))
    for offset in (-3.5, 0.25, 700.0):
        # z + c itself is rounded: the largest entry loses eps·max|z| at most
        rounding = np.finfo(float).eps * (np.abs(z).max(axis=1) + abs(offset)) * 2
        assert np.all(np.abs(bingham.log_normalizer(z + offset) - values - offset) < 2 * tolerance(d) + rounding)


def spectra(d: int, low: float, high: float, count: int) -> np.ndarray:
    rng = np.random.default_rng(10 * d)
    z = -(10.0 ** rng.uniform(low, high, (count, d)))
    z[: count // 4, 0] = z[: count // 4, 1]
    z[:, -1] = 0.0
    return rng.permuted(z, axis=1)


@pytest.mark.parametrize(
    ("oracle", "d", "high", "relative"),
    [
        (oracles.bessel, 2, 2, 1e-12),
        (oracles.wood, 4, 6, 1e-11),
        (oracles.series, 2, 2.9, 2e-12),
        (oracles.series, 3, 2.9, 2e-12),
        (oracles.series, 6, 2.9, 2e-12),
        (oracles.series, 10, 2.5, 1e-10),
        (oracles.saddlepoint, 2, 6, 5e-2),
        (oracles.saddlepoint, 4, 6, 5e-2),
        (oracles.saddlepoint, 10, 6, 5e-2),
    ],
)
def test_agrees_with_methods_of_the_literature(oracle, d, high, relative):
    for z in spectra(d, -2, high, 16):
        log_f, moments = oracle(z)
        assert abs(np.expm1(bingham.log_normalizer(z) - log_f)) < relative, z
        np.testing.assert_allclose(bingham.moments(z), moments, rtol=relative, err_msg=str(z))


def test_agrees_with_the_bessel_form_to_minus_1e9():
    for z in spectra(2, 2, 9, 40):
        assert abs(bingham.log_normalizer(z) - oracles.bessel(z)[0]) < 1e-12


def test_saddlepoint_is_an_approximation():
    """The oracle of 5e-2 is no copy of the library: their difference is visible, and shrinks near uniform."""
    gap = [
        abs(np.expm1(oracles.saddlepoint(z)[0] - bingham.log_normalizer(z))) for z in ((-900, -500, -3, 0), (0,) * 4)
    ]
    assert 1e-3 < gap[0] < 5e-2
    assert 1e-5 < gap[1] < 1e-3


def test_the_rule_is_the_derived_one():
    rule = json.loads((Path(oracles.__file__).parent / "rule.json").read_text())
    assert [numpy_rule.SR.tolist(), numpy_rule.SI.tolist()] == [rule["re_s"], rule["im_s"]]
    assert [numpy_rule.CR.tolist(), numpy_rule.CI.tolist()] == [rule["re_c"], rule["im_c"]]
