import numpy as np
import pytest
from scipy.integrate import quad

from bingham import Bingham
from bingham.distributions.relations import angular_variance
from bingham.filters.first_order import BinghamFilter
from bingham.studies import load_study
from bingham.studies.execute import run_study
from bingham.studies.kurz2013 import bingham_gaussian_divergence
from bingham.studies.timing import microseconds_per_call, microseconds_per_step

CASE = "2-D bingham"


@pytest.fixture(scope="module")
def result():
    # The published size: standard errors of the mean RMSE are 0.0015 and 0.0023.
    return run_study(load_study("kurz2013"), runs=1000, seed=1)


def test_published_angular_variances():
    # Kurz et al. 2013 sampled them; by quadrature they are 0.5872, 0.00251 and 0.2727.
    for z1, expected in ((-1.0, 0.5872), (-200.0, 0.00251), (-3.0, 0.2727)):
        assert angular_variance(Bingham([z1, 0.0], np.eye(2))) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("z1", [0.0, -0.3, -3.0, -200.0, -1e6])
def test_angular_variance_limits(z1):
    # π²/12 for the uniform distribution, 1/(2|z₁|) for narrow ones.
    value = angular_variance(Bingham([z1, 0.0], np.eye(2)))
    if z1 == 0.0:
        assert value == pytest.approx(np.pi**2 / 12, rel=1e-12)
    elif z1 < -100.0:
        assert value == pytest.approx(-0.5 / z1, rel=1.1 / abs(z1))
    else:
        f = [
            quad(lambda t, k=k: t**k * np.exp(z1 * np.sin(t) ** 2), -np.pi / 2, np.pi / 2, epsabs=1e-13)[0]
            for k in (0, 2)
        ]
        assert value == pytest.approx(f[1] / f[0], rel=1e-10)


def test_divergence_is_that_of_the_definition():
    z1 = -3.0
    distribution, variance = Bingham([z1, 0.0], np.eye(2)), angular_variance(Bingham([z1, 0.0], np.eye(2)))

    def integrand(t):
        f = 2.0 * np.exp(z1 * np.sin(t) ** 2 - distribution.log_normalizer)
        return f * np.log(f / (np.exp(-0.5 * t * t / variance) / np.sqrt(2.0 * np.pi * variance)))

    assert bingham_gaussian_divergence(z1) == pytest.approx(
        quad(integrand, -np.pi / 2, np.pi / 2, epsabs=1e-13)[0], rel=1e-9
    )


def test_bingham_beats_the_scalar_kalman_filter(result):
    ours = result.value(CASE, "bingham", "rmse_rad")
    # An independent prototype's means.
    assert ours == pytest.approx(0.186, abs=0.012)
    assert result.value(CASE, "scalar_kalman", "rmse_rad") == pytest.approx(0.219, abs=0.012)
    assert result.value(CASE, "bingham", "wins") >= 850
    assert result.value(CASE, "wrapped_normal", "rmse_rad") == pytest.approx(ours, rel=0.02)


def test_only_the_circular_filters_uncertainty_is_right(result):
    for name in ("bingham", "wrapped_normal"):
        assert result.value(CASE, name, "coverage_95") == pytest.approx(0.95, abs=0.01)
        assert result.value(CASE, name, "calibration_ks") < 0.02
        assert result.value(CASE, name, "nees") == pytest.approx(1.0, abs=0.05)
    # Negative control.
    assert result.value(CASE, "scalar_kalman", "coverage_95") < 0.92
    assert result.value(CASE, "scalar_kalman", "calibration_ks") > 0.05
    assert result.value(CASE, "scalar_kalman", "nees") > 1.3


def test_the_kalman_filter_is_run_with_the_published_variances_too(result):
    # They exceed the true ones by 1 to 7 %: nothing but a little less certainty follows.
    case = f"{CASE}, published variances"
    for metric, least, most in (("rmse_rad", 0.98, 1.02), ("coverage_95", 1.002, 1.02), ("nees", 0.92, 0.98)):
        ratio = result.value(case, "scalar_kalman", metric) / result.value(CASE, "scalar_kalman", metric)
        assert least < ratio < most, metric
    assert result.value(case, "bingham", "wins") >= 850
    published = [row.paper for row in result.table if row.metric == "angular_variance_rad2"]
    assert published == [0.5956, 0.0027, 0.2836]


def test_times_are_in_microseconds_per_step(monkeypatch):
    # A clock that advances by 3 s between any two looks at it.
    monkeypatch.setattr("bingham.studies.timing.perf_counter", iter(np.arange(0.0, 1e4, 3.0)).__next__)
    noise, rows = Bingham([-3.0, 0.0], np.eye(2)[::-1]), np.tile([1.0, 0.0], (50, 1))
    timed = BinghamFilter(noise, noise), Bingham([-1.0, 0.0], np.eye(2)), rows
    assert microseconds_per_step(*timed) == pytest.approx(3e6 / 2000)
    assert microseconds_per_call(*timed) == pytest.approx(3e6 / 50)


def test_times_stand_beside_the_published_ones(monkeypatch):
    for i, way in enumerate(("step", "call")):
        monkeypatch.setattr(f"bingham.studies.kurz2013.microseconds_per_{way}", lambda *_, i=i: 2.0 + i)
    result = run_study(load_study("kurz2013"), runs=1, seed=1)
    rows = [row for row in result.table if row.metric == "us_per_step"]
    assert [(row.case, row.value, row.paper) for row in rows] == [
        (CASE, 2.0, 60e3),
        (f"{CASE}, call by call", 3.0, 60e3),
    ]
