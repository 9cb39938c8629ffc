import numpy as np
import pytest
from scipy.integrate import quad

from bingham import Bingham
from bingham.distributions.relations import angular_variance
from bingham.studies import load_study
from bingham.studies.execute import run_study
from bingham.studies.kurz2013 import bingham_gaussian_divergence


@pytest.fixture(scope="module")
def result():
    return run_study(load_study("kurz2013"), runs=100, seed=5)


def test_published_angular_variances():
    # Kurz et al. 2013 sampled them; by quadrature they are 0.5872, 0.00251 and 0.2727.
    for z1, expected in ((-1.0, 0.5872), (-200.0, 0.00251), (-3.0, 0.2727)):
        assert angular_variance(Bingham([z1, 0.0], np.eye(2))) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("z1", [0.0, -0.3, -3.0, -200.0, -1e6])
def test_angular_variance_limits(z1):
    # π²/12 for the uniform law, 1/(2|z₁|) for narrow ones.
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
    law, variance = Bingham([z1, 0.0], np.eye(2)), angular_variance(Bingham([z1, 0.0], np.eye(2)))

    def integrand(t):
        f = 2.0 * np.exp(z1 * np.sin(t) ** 2 - law.log_normalizer)
        return f * np.log(f / (np.exp(-0.5 * t * t / variance) / np.sqrt(2.0 * np.pi * variance)))

    assert bingham_gaussian_divergence(z1) == pytest.approx(
        quad(integrand, -np.pi / 2, np.pi / 2, epsabs=1e-13)[0], rel=1e-9
    )


def test_bingham_beats_the_scalar_kalman_filter(result):
    ours = result.value("2-D bingham", "bingham", "rmse_rad")
    kalman = result.value("2-D bingham", "scalar_kalman", "rmse_rad")
    # Standard errors over 100 runs are 0.005 and 0.008.
    assert ours == pytest.approx(0.186, abs=0.02)
    assert kalman == pytest.approx(0.221, abs=0.03)
    assert result.value("2-D bingham", "bingham", "wins") >= 80
    assert result.value("2-D bingham", "wrapped_normal", "rmse_rad") == pytest.approx(ours, rel=0.02)


def test_only_the_bingham_filters_uncertainty_is_right(result):
    assert 0.92 <= result.value("2-D bingham", "bingham", "coverage_95") <= 0.98
    assert result.value("2-D bingham", "scalar_kalman", "coverage_95") < 0.92
