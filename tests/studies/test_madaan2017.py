import numpy as np
import pytest
from scipy.linalg import solve_discrete_lyapunov
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

    x' = x + v', v' = v + w, z = x' + noise; or, if the orientation is disturbed, x' = x + c + d with constant c and
    d of half of w's variance, and the spin meant is c + d.
    """
    px, pv = r, w
    for _ in range(5000):
        s = px + pv + w + r
        kx, kv = (s - r) / s, (pv + w) / s
        px, pv = (1.0 - kx) * (s - r), (1.0 - kv) * (pv + w)
    f = np.array([[1.0 - kx, 1.0 - kx], [-kv, 1.0 - kv]])
    noise = r * np.outer([kx, kv], [kx, kv])
    if orientation_disturbed:
        g, spin = np.array([1.0 - kx, -kv]), np.array([-kv, 1.0 - kv])
        p = solve_discrete_lyapunov(f, 0.5 * w * np.outer(g, g) + noise)
        actual = p[0, 0], spin @ p @ spin + 0.5 * w * (1.0 - kv) ** 2 + r * kv**2
    else:
        g = np.array([1.0 - kx, 1.0 - kv])
        actual = tuple(np.diag(solve_discrete_lyapunov(f, w * np.outer(g, g) + noise)))
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


@pytest.mark.parametrize("level", [None, *range(len(SPIN_NOISES))])
def test_the_second_order_filter_errs_and_covers_as_marginals_of_a_linear_filter(result, level):
    case = "precession" if level is None else f"precession, spin noise {SPIN_NOISES[level]:.0f}"
    distribution = SPIN_CHANGE if level is None else isotropic(SPIN_NOISES[level])
    actual, reported = _marginals(_variance(distribution.z[0]), _variance(NOISE.z[0]), level is None)
    for k, prefix in enumerate(("", "spin_")):
        rmse = result.value(case, "bingham_second_order", f"{prefix}rmse_rad")
        assert rmse == pytest.approx(np.sqrt(3.0 * actual[k]), rel=0.06)
        covered = result.value(case, "bingham_second_order", f"{prefix}coverage_95")
        # 200 steps are counted, neighbours a little alike: at 0.88 a standard error is about 0.03.
        assert covered == pytest.approx(_covered(reported[k], actual[k]), abs=0.07 if level == 2 else 0.045)


def test_the_change_of_spin_is_that_of_the_truth():
    body = disturbed_orientation(generator(0))
    change = compose(body["spin"][1:], body["spin"][:-1] * [1.0, -1.0, -1.0, -1.0])
    # The steady turn of the spin itself, 2e-4 rad a step, does not show.
    np.testing.assert_allclose(3.0 / np.mean(np.sum(change[:, 1:] ** 2, axis=1)), -2.0 * SPIN_CHANGE.z[0], rtol=0.06)


def test_bodies_obey_their_models():
    distribution = isotropic(-1e3)
    body = disturbed_spin(distribution, generator(1))
    np.testing.assert_allclose(compose(body["spin"][1:], body["truth"][:-1]), body["truth"][1:], atol=1e-12)
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


def test_a_filter_that_is_too_sure_covers_less(monkeypatch):
    right = run_precession(4, 0), run_spin(4, 0, 0)
    monkeypatch.setattr("bingham.studies.madaan2017.BinghamFilter", _sure)
    monkeypatch.setattr(
        "bingham.studies.madaan2017_filters.SecondOrderBinghamFilter",
        lambda distribution, noise, noise_side: SecondOrderBinghamFilter(
            isotropic(4.0 * distribution.z[0]), TOO_SURE, noise_side
        ),
    )
    wrong = run_precession(4, 0), run_spin(4, 0, 0)
    # The estimates are the same, their reported variances a quarter.
    for one, other in zip(right, wrong, strict=True):
        assert other["rmse/bingham_second_order"] == pytest.approx(one["rmse/bingham_second_order"], rel=2e-3)
        assert one["coverage/bingham_second_order"] > 0.88 and one["spin_coverage/bingham_second_order"] > 0.94
        assert 0.25 < other["coverage/bingham_second_order"] < 0.6
        # The spin's own distribution is too wide to begin with (it covers all): the filter takes it for independent.
        assert other["spin_coverage/bingham_second_order"] < one["spin_coverage/bingham_second_order"]
    assert wrong[0]["coverage/bingham"] == pytest.approx(_covered(0.25, 1.0), abs=0.15)
    assert wrong[0]["coverage/axial_kalman_padded"] == right[0]["coverage/axial_kalman_padded"] > 0.88


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
