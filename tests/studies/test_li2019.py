"""The 2019 study: a small run of it, its references against each other, its figures."""

from functools import partial

import numpy as np
import pytest

from bingham import Bingham
from bingham.filters.exact_vector import exact_vector_posterior
from bingham.filters.first_order import BinghamFilter
from bingham.models.motion import ControlledRotation
from bingham.rotations import rotate
from bingham.studies import load_study
from bingham.studies.execute import run_study
from bingham.studies.li2019 import (
    FILTERS,
    NOISE_LEVELS,
    PROCESS,
    VECTOR,
    IsotropicVector,
    milliseconds_per_step,
    rotated,
    simulate,
)
from bingham.studies.li2019_sampling import EXAMPLES, _case, distribution_of, trust_region


@pytest.fixture(scope="module")
def result():
    with pytest.MonkeyPatch.context() as patch:
        # Times are not judged here: one repetition.
        patch.setattr("bingham.studies.li2019.milliseconds_per_step", partial(milliseconds_per_step, repetitions=1))
        return run_study(load_study("li2019"), runs=1, seed=3)


def test_rotated_vector_is_the_sandwich_product():
    q = Bingham.uniform(4).rvs(20, rng=1)
    assert np.allclose(rotated(q), rotate(q, VECTOR), atol=1e-15)


def test_isotropic_vector_is_conjugate():
    variance, z = 0.02, np.array([0.3, -0.9, 0.5])
    f = BinghamFilter(ControlledRotation(PROCESS), IsotropicVector(variance))
    state, info = f.update(PROCESS, z)
    constant = -1.5 * np.log(2.0 * np.pi * variance)
    exact = exact_vector_posterior(
        PROCESS, VECTOR, lambda r: constant - 0.5 * np.sum((z - r) ** 2, axis=1) / variance, z
    )
    assert np.abs(state.moment() - exact.moment).max() < 1e-8
    assert info.log_evidence == pytest.approx(exact.log_evidence, abs=1e-7)


def test_runs_repeat_and_differ():
    a, b = simulate(3, 1, 0), simulate(3, 1, 0)
    assert np.array_equal(a[0], b[0]) and np.array_equal(a[1], b[1])
    assert not np.allclose(a[0], simulate(3, 1, 1)[0]) and not np.allclose(a[0], simulate(4, 1, 0)[0])


@pytest.mark.parametrize(("diagonal", "m"), EXAMPLES)
def test_residuals_and_fourth_moments_of_the_example(result, diagonal, m):
    case = _case(diagonal, m)
    for name in ("rss", "rss_gnomonic"):
        assert result.value(case, name, "residual") < 1e-10
    unscented = result.value(case, "unscented", "fourth_moment_error")
    assert result.value(case, "rss", "fourth_moment_error") < unscented
    assert result.value(case, "rss", "fourth_moment_error") < result.value(case, "rss_gnomonic", "fourth_moment_error")


def test_corrections_of_figure_5(result):
    case = "S2 C=(1,8,70) m=150 correction"
    values = {
        name: [result.value(case, name, metric) for metric in ("residual", "displacement_rad", "fourth_moment_error")]
        for name in ("trust_region", "trust_region_penalised", "steepest_descent", "newton")
    }
    # The paper's E: 2.8e-10, 1.5e-9, 1.6e-10.
    assert all(residual < 1e-9 for residual, _, _ in values.values())
    # What the figure shows: without a penalty the trust region distorts, steepest descent does not.
    for metric in (1, 2):
        assert values["steepest_descent"][metric] < values["trust_region"][metric]
        assert values["trust_region_penalised"][metric] < values["trust_region"][metric]
        assert values["newton"][metric] < values["trust_region"][metric]


def test_trust_region_against_pymanopt():
    pymanopt = pytest.importorskip("pymanopt")
    from bingham.sampling import RiemannianSampling
    from bingham.sampling.descent import moment_residual

    distribution = distribution_of((1.0, 8.0, 70.0))
    moment, penalty = distribution.moment(), 1e-3
    start = RiemannianSampling(16, map="gnomonic", correction="none").sample(distribution).points
    m = len(start)
    manifold = pymanopt.manifolds.Oblique(3, m)

    @pymanopt.function.numpy(manifold)
    def cost(x):
        return moment_residual(x.T, moment) + penalty * (1.0 - np.sum(x.T * start) / m)

    @pymanopt.function.numpy(manifold)
    def euclidean_gradient(x):
        return 4.0 / m * (x @ x.T / m - moment) @ x - penalty / m * start.T

    @pymanopt.function.numpy(manifold)
    def euclidean_hessian(x, v):
        return 4.0 / m * ((x @ x.T / m - moment) @ v + (v @ x.T + x @ v.T) / m @ x)

    problem = pymanopt.Problem(
        manifold, cost, euclidean_gradient=euclidean_gradient, euclidean_hessian=euclidean_hessian
    )
    optimizer = pymanopt.optimizers.TrustRegions(verbosity=0, min_gradient_norm=1e-9)
    theirs = optimizer.run(problem, initial_point=start.T.copy()).point.T
    # With a penalty the minimum is isolated: both must find the same points.
    assert np.abs(trust_region(start, moment, penalty) - theirs).max() < 1e-4


def test_ranking_at_the_lowest_noise(result):
    case = "tracking a=0.0001"
    rmse = {
        name: result.value(case, name, "rmse_rad")
        for name in ("unscented_7", "rss_100", "rss_progressive_100", "particle_20000", "quadrature")
    }
    assert rmse["rss_progressive_100"] < 2.0 * rmse["particle_20000"]
    assert rmse["rss_progressive_100"] < 1.2 * rmse["quadrature"] < rmse["rss_100"] < rmse["unscented_7"]
    assert result.value(case, "quadrature", "moment_error") == 0.0
    assert result.value(case, "rss_progressive_100", "moment_error") < result.value(case, "rss_100", "moment_error")


def test_every_filter_reports_error_and_time(result):
    for row in result.table:
        assert np.isfinite(row.value), row
    timed = {row.filter for row in result.table if row.metric == "ms_per_step"}
    assert {"unscented_7", "rss_100", "particle_2000", "conjugate", "quadrature"} <= timed


def test_every_filter_runs_at_every_noise(result):
    for level in range(len(NOISE_LEVELS)):
        for name in FILTERS:
            assert np.all(np.isfinite(result.curves[f"rmse/{level}/{name}"]))
    # The run that is drawn follows the truth where single updates do.
    error = {
        name: np.linalg.norm(result.curves[f"track/{name}"] - result.curves["track/truth"], axis=1) for name in FILTERS
    }
    assert np.median(error["rss_progressive_100"]) < 0.1 < np.median(error["unscented_7"])
