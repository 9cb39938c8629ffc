import numpy as np
import pytest

from bingham.studies import load_study
from bingham.studies.execute import run_study
from bingham.studies.kurz2014 import SCENARIOS

# Twice the paper's.
RUNS = 200


@pytest.fixture(scope="module")
def result():
    return run_study(load_study("kurz2014"), runs=RUNS, seed=1)


def test_gaussians_to_the_papers_two_digits():
    # Eqs. (58)–(60).
    published = (np.diag([3.8e-1, 1.5e-1]), np.diag([4.7e-6, 2.5e-3]), np.diag([8.8e-2, 2.8e-1]))
    for (_, covariance), digits in zip(SCENARIOS[0].gaussians, published, strict=True):
        for i in (0, 1):
            assert f"{covariance[i, i]:.1e}" == f"{digits[i, i]:.1e}"
        assert abs(covariance[0, 1]) < 1e-15


def test_gaussian_noise_keeps_its_moments_in_the_refitted_distribution():
    rng = np.random.default_rng(0)
    for scenario in SCENARIOS:
        for which in (0, 1):
            x = np.concatenate([scenario.sample("gaussian", which, rng) for _ in range(400)])
            error = np.abs(np.einsum("ni,nj->ij", x, x) / len(x) - scenario.refitted[which].moment())
            assert error.max() < 5.0 * 0.5 / np.sqrt(len(x))


def test_bingham_noise(result):
    # An independent prototype's means; standard errors over 200 runs are 0.005, 0.01, 1.5e-4 and 1e-3.
    assert result.value("2-D bingham", "bingham", "rmse_rad") == pytest.approx(0.248, abs=0.012)
    assert result.value("2-D bingham", "axial_kalman", "rmse_rad") == pytest.approx(0.32, abs=0.03)
    assert result.value("4-D bingham", "bingham", "rmse_rad") == pytest.approx(0.0506, abs=0.0006)
    assert result.value("4-D bingham", "axial_kalman", "rmse_rad") == pytest.approx(0.0776, abs=0.003)
    assert result.value("2-D bingham", "bingham", "wins") >= 0.85 * RUNS
    assert result.value("4-D bingham", "bingham", "wins") >= 0.99 * RUNS


@pytest.mark.parametrize(("case", "least"), [("2-D gaussian", 0.85), ("4-D gaussian", 0.99)])
def test_gaussian_noise_does_not_turn_the_tables(result, case, least):
    assert result.value(case, "bingham", "rmse_rad") < result.value(case, "axial_kalman", "rmse_rad")
    assert result.value(case, "bingham", "wins") >= least * RUNS


@pytest.mark.parametrize("case", ["2-D bingham", "2-D gaussian", "4-D bingham", "4-D gaussian"])
def test_only_the_bingham_filters_uncertainty_is_right(result, case):
    assert 0.92 <= result.value(case, "bingham", "coverage_95") <= 0.98
    assert result.value(case, "bingham", "calibration_ks") < 0.05
    assert result.value(case, "bingham", "nees") == pytest.approx(1.0, abs=0.15)
    # Negative control.
    assert result.value(case, "axial_kalman", "coverage_95") < 0.9
    assert result.value(case, "axial_kalman", "calibration_ks") > 0.08
    assert result.value(case, "axial_kalman", "nees") > 1.5


def test_times_stand_beside_the_published_ones(monkeypatch):
    for i, way in enumerate(("step", "call")):
        monkeypatch.setattr(f"bingham.studies.kurz2014.microseconds_per_{way}", lambda *_, i=i: 2.0 + i)
    result = run_study(load_study("kurz2014"), runs=1, seed=1)
    rows = [row for row in result.table if row.metric == "us_per_step"]
    assert [(row.case, row.value, row.paper) for row in rows] == [
        ("2-D bingham", 2.0, 8e3),
        ("2-D bingham, call by call", 3.0, 8e3),
        ("4-D bingham", 2.0, 13e3),
        ("4-D bingham, call by call", 3.0, 13e3),
    ]
