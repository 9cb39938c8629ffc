import numpy as np
import pytest

from bingham import Bingham
from bingham.studies.calibration import calibration_arrays, calibration_rows, moment_error
from bingham.studies.study import Row


@pytest.mark.parametrize("z", [[-3.0, 0.0], [-50.0, -4.0, -0.5, 0.0]])
def test_the_error_of_a_right_distribution_is_one_in_the_mean(z):
    rng = np.random.default_rng(0)
    frame = np.linalg.qr(rng.standard_normal((len(z), len(z))))[0]
    distribution = Bingham(z, frame)
    x = distribution.rvs(40_000, rng=rng)
    error = moment_error(distribution, x)
    assert error.mean() == pytest.approx(1.0, abs=4.0 * error.std() / 200.0)
    np.testing.assert_array_equal(moment_error(distribution, -x), error)
    # Negative control: a distribution that says twice the concentration.
    assert moment_error(Bingham(2.0 * np.array(z), frame), x).mean() > 1.2


def test_a_batch_of_laws_meets_its_own_truths():
    distributions = Bingham.from_spectrum(np.array([[-3.0, 0.0], [-9.0, 0.0]]), np.tile(np.eye(2), (2, 1, 1)))
    truth = np.array([[0.6, 0.8], [1.0, 0.0]])
    np.testing.assert_allclose(
        moment_error(distributions, truth), [moment_error(distributions[i], truth[i]) for i in (0, 1)]
    )


def test_rows_join_the_chunks():
    first, last = np.array([[0.0, 0.25], [0.5, 0.96]]), np.array([[0.75, 1.0]])
    chunks = {f"runs-{i}": calibration_arrays("a", p, 2.0 * p) for i, p in enumerate((first, last))}
    coverage, uniformity, nees = calibration_rows("case", "label", chunks, "runs", "a")
    assert (coverage.metric, coverage.value) == ("coverage_95", pytest.approx(2.0 / 3.0))
    # Just below 0.96, 4 of the 6 values 0, ¼, ½, ¾, 0.96, 1 are passed.
    assert uniformity == Row("case", "label", "calibration_ks", pytest.approx(0.96 - 4.0 / 6.0))
    assert (nees.metric, nees.value) == ("nees", pytest.approx(2.0 * (0.25 + 1.46 + 1.75) / 6.0))
