import numpy as np
import pytest
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov
from scipy.stats import chi2

from bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.filters.first_order import BinghamFilter
from bingham.filters.second_order import SecondOrderBinghamFilter
from bingham.metrics import geodesic_error
from bingham.rotations import compose, from_rotation_vector
from bingham.studies import load_study
from bingham.studies.execute import run_study
from bingham.studies.madaan2017 import SPIN_NOISES, run_precession, run_spin
from bingham.studies.madaan2017_bodies import NOISE, SPIN_CHANGE, disturbed_orientation, disturbed_spin, isotropic
from bingham.studies.madaan2017_filters import THIN, scores
from bingham.studies.study import generator

STUDY = load_study("madaan2017")
# Four times as sure as the truth allows; gains, and so estimates, stay the same.
TOO_SURE = isotropic(4.0 * NOISE.z[0])


def _variance(z):
    """Variance of a rotation's angle about each axis, rad², for concentration z: that of half the angle is 1/(2|z|)."""
    return 4.0 / (2.0 * abs(z))


def _covered(reported, actual):
    """Share of errors, three of the actual variance, within 95 % regions from the reported one."""
    return chi2.cdf(chi2.ppf(0.95, 3) * reported / actual, 3)


def _marginals(w, r, orientation_disturbed):
    """Return actual and reported variances, of orientation and spin, of a linear filter that keeps marginals only.

    x' = x + v, v' = v + w, z = x' + noise; or, if the orientation is disturbed, x' = x + c + d with constant c and d of
    half of w's variance, and the spin meant is the next c + d.
    """
    px, pv = r, w
    for _ in range(20_000):
        s = px + pv + r
        kx, kv = (px + pv) / s, pv / s
        px, pv = (1.0 - kx) * (px + pv), (1.0 - kv) * pv + w
    f = np.array([[1.0 - kx, 1.0 - kx], [-kv, 1.0 - kv]])
    noise = r * np.outer([kx, kv], [kx, kv])
    if orientation_disturbed:
        g = np.array([kx - 1.0, kv])
        p = solve_discrete_lyapunov(f, 0.5 * w * np.outer(g, g) + noise)
        actual = p[0, 0], p[1, 1] + 0.5 * w
    else:
        actual = tuple(np.diag(solve_discrete_lyapunov(f, noise + np.diag([0.0, w]))))
    return actual, (px, pv)


@pytest.fixture(scope="module")
def result():
    return run_study(STUDY, runs=2, seed=3)


def test_filtering_a_precessing_body(result):
    # Three rotation axes with variance 4/(2·5e4): the measured error is √(3 · 4e-5) = 0.01095 rad.
    measured = result.value("precession", "measured", "rmse_rad")
    assert measured == pytest.approx(0.01095, rel=0.03)
    # Equal process and measurement noise: the Riccati equation's fixed point leaves (√5 − 1)/2 of the variance.
    expected = measured * np.sqrt((np.sqrt(5.0) - 1.0) / 2.0)
    assert result.value("precession", "bingham", "rmse_rad") == pytest.approx(expected, rel=0.03)
    assert expected < result.value("precession", "bingham_second_order", "rmse_rad") < measured
    assert 0.9 <= result.value("precession", "bingham", "coverage_95") <= 0.99
    # Noise alike in all directions and narrow: a Kalman filter does as well, unless told that one component is exact.
    padded = result.value("precession", "axial_kalman_padded", "rmse_rad")
    assert padded == pytest.approx(result.value("precession", "bingham", "rmse_rad"), rel=1e-3)
    assert result.value("precession", "axial_kalman", "rmse_rad") > 0.1
    assert result.value("precession", "axial_kalman", "coverage_95") < 0.1


LEVELS = [None, *range(len(SPIN_NOISES))]


def _case(level):
    """Return the case's name and the variances of spin change and measurement, rad²."""
    z = SPIN_CHANGE.z[0] if level is None else SPIN_NOISES[level]
    case = "precession" if level is None else f"precession, spin noise {z:.0f}"
    return case, _variance(z), _variance(NOISE.z[0])


@pytest.mark.parametrize("level", LEVELS)
def test_the_second_order_filter_errs_and_covers_as_marginals_of_a_linear_filter(result, level):
    case, w, r = _case(level)
    actual, reported = _marginals(w, r, level is None)
    for k, prefix in enumerate(("", "spin_")):
        rmse = result.value(case, "bingham_second_order", f"{prefix}rmse_rad")
        assert rmse == pytest.approx(np.sqrt(3.0 * actual[k]), rel=0.06)
        ratio = result.value(case, "bingham_second_order", f"{prefix}actual_over_reported_variance")
        assert ratio == pytest.approx(actual[k] / reported[k], rel=0.12)
        covered = result.value(case, "bingham_second_order", f"{prefix}coverage_95")
        # 200 steps are counted, neighbours a little alike: at 0.88 a standard error is about 0.03.
        assert covered == pytest.approx(_covered(reported[k], actual[k]), abs=0.07 if level == 2 else 0.045)


@pytest.mark.parametrize("level", [0, 1, 2])
def test_the_filter_with_the_joint_covariance_says_how_well_it_knows_both(result, level):
    case, w, r = _case(level)
    predicted = solve_discrete_are(np.array([[1.0, 0.0], [1.0, 1.0]]), np.array([[1.0], [0.0]]), np.diag([0, w]), [[r]])
    best = np.diag(predicted - predicted[:, :1] @ predicted[:1] / (predicted[0, 0] + r))
    for k, prefix in enumerate(("", "spin_")):
        assert result.value(case, "joint", f"{prefix}rmse_rad") == pytest.approx(np.sqrt(3.0 * best[k]), rel=0.06)
        assert 0.91 < result.value(case, "joint", f"{prefix}coverage_95") < 0.985
        assert result.value(case, "joint", f"{prefix}actual_over_reported_variance") == pytest.approx(1.0, abs=0.12)
        # The approximation shows: too sure of the orientation, not sure enough of the spin.
        marginal = result.value(case, "bingham_second_order", f"{prefix}actual_over_reported_variance")
        if level > 0:
            assert marginal > 1.1 if k == 0 else marginal < 0.8


def test_the_change_of_spin_is_that_of_the_truth():
    body = disturbed_orientation(generator(0))
    change = compose(body["spin"][1:], body["spin"][:-1] * [1.0, -1.0, -1.0, -1.0])
    # The steady turn of the spin itself, 2e-4 rad a step, does not show.
    np.testing.assert_allclose(3.0 / np.mean(np.sum(change[:, 1:] ** 2, axis=1)), -2.0 * SPIN_CHANGE.z[0], rtol=0.06)


def test_bodies_obey_their_models():
    distribution = isotropic(-1e3)
    body = disturbed_spin(distribution, generator(1))
    np.testing.assert_allclose(compose(body["spin"][:-1], body["truth"][:-1]), body["truth"][1:], atol=1e-12)
    nominal = compose(body["controls"][1:], body["spin"][:-1])
    w = compose(body["spin"][1:], nominal * [1.0, -1.0, -1.0, -1.0])
    np.testing.assert_allclose(np.mean(np.sum(w[:, 1:] ** 2, axis=1)), 1.0 - distribution.axis_moments[3], rtol=0.08)
    half = 0.5 * np.mean((2.0 * geodesic_error(body["measured"], body["truth"])) ** 2)
    assert half == pytest.approx(1.5 * _variance(NOISE.z[0]), rel=0.06)


@pytest.mark.parametrize("z", [-5e4, -30.0])
def test_coverage_counts_what_lies_within_credible_angles(z):
    rng = np.random.default_rng(5)
    truth = Bingham.uniform(4).rvs(400, rng=rng)
    modes = compose(truth, isotropic(z).rvs(400, rng=rng))
    frames = np.stack([isotropic(z).rotate(left=q).M for q in modes])
    for factor in (0.25, 1.0, 4.0):
        distributions = Bingham.from_spectrum(np.tile(factor * isotropic(z).z, (400, 1)), frames)
        found = scores("a", truth, modes, distributions)
        inside = geodesic_error(modes, truth)[::THIN] <= distributions.credible_angle(0.95)[::THIN]
        assert found["coverage/a"] == inside.mean()
    # Of the last ones, four times too sure.
    assert inside.mean() == pytest.approx(_covered(0.25, 1.0), abs=0.2)


def _sure(process, measurement):
    """Return a first-order filter that takes noises for narrower than they are."""
    return BinghamFilter(process if process is not NOISE else TOO_SURE, TOO_SURE)


@pytest.mark.parametrize("factor", [4.0, 0.25])
def test_a_filter_that_is_too_sure_or_too_little_is_seen(monkeypatch, factor):
    level = 1
    right = run_spin(4, 0, level)
    noise = isotropic(factor * NOISE.z[0])
    monkeypatch.setattr(
        "bingham.studies.madaan2017_filters.SecondOrderBinghamFilter",
        lambda distribution, _, noise_side: SecondOrderBinghamFilter(
            isotropic(factor * distribution.z[0]), noise, noise_side
        ),
    )
    wrong = run_spin(4, 0, level)
    _, w, r = _case(level)
    actual, reported = _marginals(w, r, False)
    name = "bingham_second_order"
    for k, prefix in enumerate(("", "spin_")):
        # The estimates are the same, their reported variances are not.
        assert wrong[f"{prefix}rmse/{name}"] == pytest.approx(right[f"{prefix}rmse/{name}"], rel=1e-2)
        expected = actual[k] / reported[k]
        assert right[f"{prefix}variance/{name}"] == pytest.approx(expected, rel=0.2)
        assert wrong[f"{prefix}variance/{name}"] == pytest.approx(factor * expected, rel=0.2)
        assert right[f"{prefix}coverage/{name}"] == pytest.approx(_covered(reported[k], actual[k]), abs=0.06)
        covered = _covered(reported[k] / factor, actual[k])
        assert wrong[f"{prefix}coverage/{name}"] == pytest.approx(covered, abs=0.12)
        if factor > 1.0:
            assert wrong[f"{prefix}coverage/{name}"] < 0.8
    assert wrong["spin_variance/joint"] == pytest.approx(right["spin_variance/joint"], rel=1e-12)


def test_a_first_order_filter_that_is_too_sure_covers_less(monkeypatch):
    right = run_precession(4, 0)
    monkeypatch.setattr("bingham.studies.madaan2017.BinghamFilter", _sure)
    wrong = run_precession(4, 0)
    assert wrong["coverage/bingham"] == pytest.approx(_covered(0.25, 1.0), abs=0.15)
    assert wrong["coverage/axial_kalman_padded"] == right["coverage/axial_kalman_padded"] > 0.88


@pytest.fixture(scope="module")
def recording():
    time = np.cumsum(np.random.default_rng(0).uniform(0.005, 0.015, 1500))
    orientation = from_rotation_vector(np.stack([np.sin(0.2 * time), np.cos(0.3 * time), 0.1 * time], axis=1))
    return {"name": "x", "time": time, "orientation": orientation}


def test_a_recorded_motion_is_smoothed(recording, monkeypatch):
    result = run_study(STUDY, runs=1, seed=3, options=recording)
    measured = result.value("recorded motion", "measured", "rmse_rad")
    assert result.value("recorded motion", "bingham", "rmse_rad") < 0.85 * measured
    assert 0.88 < result.value("recorded motion", "bingham", "coverage_95") < 1.0
    monkeypatch.setattr("bingham.studies.madaan2017.BinghamFilter", _sure)
    wrong = run_study(STUDY, runs=1, seed=3, options=recording)
    assert wrong.value("recorded motion", "bingham", "coverage_95") < 0.8


def test_the_figures_show_body_and_recording(result, recording):
    pytest.importorskip("matplotlib")
    from bingham.plot.studies import draw

    assert set(draw(result)) == {"axis", "error"}
    both = run_study(STUDY, runs=1, seed=3, options=recording)
    figures = draw(both)
    assert set(figures) == {"axis", "error", "recorded_axis", "recorded_error"}
    # Each shows its own motion: the noise about the recorded one is as wide as the filter's errors are not.
    time, error = figures["recorded_error"].axes[0].lines[0].get_data()
    np.testing.assert_allclose(time, recording["time"] - recording["time"][0])
    rms = np.sqrt(np.mean(np.square(error)))
    assert rms == pytest.approx(np.degrees(both.value("recorded motion", "measured", "rmse_rad")))
    truth = np.array(figures["recorded_axis"].axes[0].lines[0].get_data()).T
    assert truth.shape == (1500, 2)
    # Lengths in the plane of widest motion are at most those in space.
    chord = np.linalg.norm(truth[1:] - truth[:-1], axis=1).sum()
    assert 0.1 < chord < 2.0 * geodesic_error(recording["orientation"][1:], recording["orientation"][:-1]).sum()


def test_axes_are_rejected():
    with pytest.raises(InvalidArgumentError, match="recording: expected quaternions"):
        run_study(
            STUDY, runs=1, options={"name": "x", "time": np.arange(3.0), "orientation": np.tile([1.0, 0.0], (3, 1))}
        )
