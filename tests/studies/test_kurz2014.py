import numpy as np
import pytest

from bingham.studies import load_study
from bingham.studies.execute import run_study
from bingham.studies.kurz2014 import SCENARIOS


@pytest.fixture(scope="module")
def result():
    return run_study(load_study("kurz2014"), runs=30, seed=5)


def test_gaussians_to_the_papers_two_digits():
    # Eqs. (58)–(60).
    published = (np.diag([3.8e-1, 1.5e-1]), np.diag([4.7e-6, 2.5e-3]), np.diag([8.8e-2, 2.8e-1]))
    for (_, covariance), digits in zip(SCENARIOS[0].gaussians, published, strict=True):
        for i in (0, 1):
            assert f"{covariance[i, i]:.1e}" == f"{digits[i, i]:.1e}"
        assert abs(covariance[0, 1]) < 1e-15


def test_gaussian_noise_keeps_its_moments_in_the_refitted_law():
    rng = np.random.default_rng(0)
    for scenario in SCENARIOS:
        for which in (0, 1):
            x = np.concatenate([scenario.sample("gaussian", which, rng) for _ in range(400)])
            error = np.abs(np.einsum("ni,nj->ij", x, x) / len(x) - scenario.refitted[which].moment())
            assert error.max() < 5.0 * 0.5 / np.sqrt(len(x))


def test_bingham_noise(result):
    # Means over many runs: 0.248 against 0.326 and 0.0505 against 0.079;
    # standard errors over 30 runs 0.012, 0.02, 4e-4, 3e-3.
    assert result.value("2-D bingham", "bingham", "rmse_rad") == pytest.approx(0.248, abs=0.04)
    assert result.value("2-D bingham", "axial_kalman", "rmse_rad") == pytest.approx(0.326, abs=0.08)
    assert result.value("4-D bingham", "bingham", "rmse_rad") == pytest.approx(0.0505, abs=0.0015)
    assert result.value("4-D bingham", "axial_kalman", "rmse_rad") == pytest.approx(0.079, abs=0.01)
    assert result.value("2-D bingham", "bingham", "wins") >= 21
    assert result.value("4-D bingham", "bingham", "wins") == 30


@pytest.mark.parametrize("case", ["2-D gaussian", "4-D gaussian"])
def test_gaussian_noise_does_not_turn_the_tables(result, case):
    assert result.value(case, "bingham", "rmse_rad") < result.value(case, "axial_kalman", "rmse_rad")


@pytest.mark.parametrize("case", ["2-D bingham", "4-D bingham"])
def test_only_the_bingham_filters_uncertainty_is_right(result, case):
    assert 0.92 <= result.value(case, "bingham", "coverage_95") <= 0.98
    assert result.value(case, "axial_kalman", "coverage_95") < 0.85
