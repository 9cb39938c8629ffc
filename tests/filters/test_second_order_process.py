"""Both second-order filters on signals of the paper's process: x' = v ⊗ x, v' = w ⊗ u ⊗ v, y = z ⊗ x."""

import numpy as np
import pytest

from bingham import Bingham
from bingham.baselines.gaussian import GaussianState
from bingham.baselines.second_order_ekf import SecondOrderQuaternionEkf, SpinningGaussian
from bingham.errors import InvalidArgumentError
from bingham.filters.second_order import SecondOrderBinghamFilter, SpinState
from bingham.metrics import geodesic_error
from bingham.models.sensors import OrientationSensor
from bingham.rotations import compose, conjugate, from_rotation_vector
from bingham.sampling.power import power, quaternion_power
from bingham.studies.glover2013_signals import noise_covariance

NEAR = np.eye(4)[:, [1, 2, 3, 0]]
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
PROCESS, NOISE, SPIN = (-400.0,) * 3, (-50.0,) * 3, (-10.0,) * 3
STEPS = 100


def near_identity(z):
    return Bingham([*z, 0.0], NEAR)


def signal(run, push=0.05):
    """Truth, measurements, controls (T, 4) and the first spin."""
    rng = np.random.default_rng(run)
    w, z = near_identity(PROCESS).rvs(STEPS, rng=rng), near_identity(NOISE).rvs(STEPS, rng=rng)
    first = from_rotation_vector(0.3 * rng.standard_normal(3))
    phase = 2.0 * np.pi * (np.arange(STEPS)[:, None] / [40.0, 50.0, 60.0] + rng.random(3))
    u = from_rotation_vector(push * np.sin(phase))
    x, v, truth = IDENTITY, first, np.empty((STEPS, 4))
    for n in range(STEPS):
        x, v = compose(v, x), compose(w[n], compose(u[n], v))
        truth[n] = x
    return truth, compose(z, truth), u, first


def bingham_filter(first):
    state = SpinState(near_identity(NOISE), near_identity(SPIN).rotate(right=first))
    return SecondOrderBinghamFilter(near_identity(PROCESS), near_identity(NOISE)), state


def kalman_filter(first):
    x = GaussianState(IDENTITY, noise_covariance(NOISE))
    state = SpinningGaussian.independent(x, GaussianState(first, noise_covariance(SPIN)))
    return SecondOrderQuaternionEkf(noise_covariance(PROCESS), noise_covariance(NOISE)), state


def fair_kalman_filter(first):
    published, state = kalman_filter(first)
    return SecondOrderQuaternionEkf(
        published.process_covariance, published.measurement_covariance, rotate_noise=True
    ), state


def mean_error(build, data, controlled=True):
    truth, measured, controls, first = data
    f, state = build(first)
    modes = np.empty_like(truth)
    for n, y in enumerate(measured):
        state, _ = f.update(f.predict(state, controls[n] if controlled else None), y)
        modes[n] = state.mode
    return 2.0 * np.degrees(geodesic_error(modes, truth).mean())


@pytest.mark.parametrize("build", [bingham_filter, fair_kalman_filter])
def test_a_filter_uses_the_papers_controls(build):
    data = [signal(run, push=0.4) for run in range(20)]
    error = np.mean([mean_error(build, d) for d in data])
    measured = np.mean([2.0 * np.degrees(geodesic_error(d[1], d[0]).mean()) for d in data])
    assert error < 0.8 * measured
    # Negative control: the same filter, not told about the controls.
    assert np.mean([mean_error(build, d, controlled=False) for d in data]) > 1.3 * error


def test_the_bingham_filter_is_ahead_of_the_published_kalman_filter_and_both_of_the_measurements():
    data = [signal(run) for run in range(200)]
    ours, kalman = (np.array([mean_error(build, d) for d in data]) for build in (bingham_filter, kalman_filter))
    measured = np.mean([2.0 * np.degrees(geodesic_error(d[1], d[0]).mean()) for d in data])
    gain = kalman - ours
    assert gain.mean() > 3.0 * gain.std() / np.sqrt(len(gain))
    assert ours.mean() < kalman.mean() < measured


def test_the_exact_likelihood_of_the_spin_is_that_of_importance_sampling():
    # F(C(v)) ∝ ∫ f(y | x') f(x') dx', x' = v ⊗ x: mean of the likelihood over draws of the joint distribution.
    rng = np.random.default_rng(1)
    before = Bingham(-60.0 * rng.random(4), np.linalg.qr(rng.normal(size=(4, 4)))[0])
    noise, y = near_identity((-40.0, -20.0, -8.0)), from_rotation_vector([1.0, 0.4, -2.0])
    likelihood = Bingham.from_matrix(OrientationSensor(noise, left=True).likelihood(y).matrix)
    draws = before.rvs(400_000, rng=rng)
    spins = likelihood.compose(before.inverse()).rvs(6, rng=rng)
    for v in spins:
        weights = noise.pdf(compose(y, conjugate(compose(v, draws))))
        exact = np.exp(likelihood.composed_logpdf(before.inverse(), v))
        error = weights.std() / np.sqrt(len(weights))
        assert abs(weights.mean() - exact) < 3.0 * error
        # Negative control: the other order of composition.
        other = np.exp(before.inverse().composed_logpdf(likelihood, v))
        assert abs(weights.mean() - other) > 3.0 * error


def test_the_filters_spin_is_the_importance_samplers_in_the_narrow_limit():
    rng = np.random.default_rng(2)
    f = SecondOrderBinghamFilter(near_identity((-9e3,) * 3), near_identity((-900.0, -600.0, -300.0)))
    x, v = near_identity((-800.0, -500.0, -300.0)), near_identity((-300.0,) * 3)
    u, y = from_rotation_vector([0.3, -0.1, 0.2]), from_rotation_vector([0.1, 0.05, -0.1])
    n = 400_000
    xs, vs, ws = (p.rvs(n, rng=rng) for p in (x, v, f.process_noise))
    weights = f.measurement_noise.pdf(compose(y, conjugate(compose(vs, xs))))
    weights /= weights.sum()
    state, _ = f.update(f.predict(SpinState(x, v), u), y)
    for found, draws in ((state.orientation, compose(vs, xs)), (state.spin, compose(ws, compose(u, vs)))):
        moment = np.einsum("n,ni,nj->ij", weights, draws, draws)
        spread = np.sqrt(np.einsum("n,ni,nj->ij", weights**2, draws**2, draws**2))
        assert np.abs(moment - found.moment()).max() < 5.0 * spread.max() + 2e-3


@pytest.mark.parametrize("parts", [2, 3])
def test_equal_parts_of_a_step_move_as_the_step(parts):
    x, v = (
        near_identity((-90.0, -50.0, -20.0)),
        near_identity((-3e4,) * 3).rotate(right=from_rotation_vector([0.5, 0.2, 0.1])),
    )
    f = SecondOrderBinghamFilter(near_identity((-1e9,) * 3), near_identity((-50.0,) * 3))
    whole = f.predict(SpinState(x, v), dt=1.0)
    state = SpinState(x, v)
    for _ in range(parts):
        state = f.predict(state, dt=1.0 / parts)
    assert 2.0 * geodesic_error(state.mode, whole.mode) < 1e-4
    # Negative control: without the power the body turns `parts` times as far.
    assert 2.0 * geodesic_error(f.predict(f.predict(SpinState(x, v))).mode, whole.mode) > 0.4


def test_the_power_of_a_distribution_is_that_of_its_samples():
    p = near_identity((-80.0, -40.0, -15.0)).rotate(left=from_rotation_vector([0.5, 0.2, -0.4]))
    x = quaternion_power(p.rvs(300_000, rng=3), 0.4)
    moment = x.T @ x / len(x)
    assert np.abs(moment - power(p, 0.4).moment()).max() < 1e-3
    assert np.abs(moment - p.moment()).max() > 5e-2


def test_the_power_of_a_distribution_is_its_integral():
    # The angle of v about a fixed axis, the mode's too, is a circular Bingham's: narrow about the other two axes, v^s
    # is in that plane, and its moment is an integral over one angle.
    plane = [-1e9, -1e9, -20.0]
    p = near_identity(plane).rotate(left=from_rotation_vector([0.0, 0.0, 0.6]))
    half = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 20_001)[:-1]
    weight = np.exp(plane[2] * np.sin(half - 0.3) ** 2)
    for s in (0.3, 2.0):
        exact = np.average(np.cos(2.0 * s * half), weights=weight)
        found = power(p, s).moment()
        assert abs(found[0, 0] - found[3, 3] - exact) < 3e-6
        assert abs(p.moment()[0, 0] - p.moment()[3, 3] - exact) > 1e-2


def test_the_power_does_not_depend_on_which_axes_stand_for_equal_concentrations():
    for z in ((-3.0,) * 3, (-900.0,) * 3, (-900.0, -40.0, -40.0)):
        powers = []
        for angle in (0.0, 0.4, 1.1):
            # About the first axis: it turns the second and the third, of equal z, and leaves the first and the mode.
            axes = NEAR.copy()
            axes[2:, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
            p = Bingham.from_spectrum(np.array([*z, 0.0]), axes).rotate(left=from_rotation_vector([0.5, 0.2, -0.4]))
            powers.append(power(p, 0.4).moment())
        np.testing.assert_allclose(powers[1:], [powers[0]] * 2, rtol=0.0, atol=1e-13)


def test_rounding_of_what_comes_in_stays_rounding():
    # Equal concentrations and measurements without noise: the axes of the spin are rounding's choice.
    f = SecondOrderBinghamFilter(near_identity((-3000.0,) * 3), near_identity((-300.0,) * 3))
    start = SpinState(near_identity((-3.0,) * 3), near_identity((-1000.0,) * 3))
    times = 0.1 * np.cumsum([1.0, 0.5] * 6)
    measured = from_rotation_vector(times[:, None] * [2.0, -1.0, 3.0])
    modes = f.run(start, measured, times=times).modes
    for seed in range(4):
        rounded = measured + 1.1e-16 * np.random.default_rng(seed).choice([-1.0, 1.0], measured.shape)
        assert geodesic_error(f.run(start, rounded, times=times).modes, modes).max() < 1e-12


def test_spin_is_found_at_irregular_times():
    rng = np.random.default_rng(4)
    rate = 6.0 * np.pi * np.array([0.6, 0.64, 0.48])
    noise = near_identity((-400.0,) * 3)
    f = SecondOrderBinghamFilter(near_identity((-4e4,) * 3), noise, interval=0.01)
    errors = {}
    for irregular in (True, False):
        state, x = SpinState(Bingham.uniform(4), near_identity((-20.0,) * 3)), IDENTITY
        for _ in range(200):
            dt = rng.uniform(0.005, 0.05)
            x = compose(from_rotation_vector(rate * dt), x)
            y = compose(noise.rvs(rng=rng), x)
            # Negative control: steps of no stated length.
            state, _ = f.update(f.predict(state, dt=dt if irregular else None), y)
        errors[irregular] = 2.0 * np.degrees(geodesic_error(state.spin.mode, from_rotation_vector(0.01 * rate)))
    assert errors[True] < 2.5 < errors[False]


def test_times_are_seconds_for_both_filters():
    first, noise = from_rotation_vector([0.5, 0.2, 0.1]), noise_covariance(NOISE)
    spin = near_identity((-1e7,) * 3).rotate(right=first)
    exact = quaternion_power(first, 2.5)
    for interval in (1.0, 0.02):
        bingham = SecondOrderBinghamFilter(near_identity(PROCESS), near_identity(NOISE), interval=interval)
        moved = bingham.predict(SpinState(near_identity((-1e7,) * 3), spin), dt=2.5 * interval)
        assert 2.0 * geodesic_error(moved.mode, exact) < 1e-6
        kalman = SecondOrderQuaternionEkf(noise_covariance(PROCESS), noise, interval=interval)
        state = SpinningGaussian.independent(GaussianState(IDENTITY, noise), GaussianState(first, noise))
        assert 2.0 * geodesic_error(kalman.predict(state, dt=2.5 * interval).mode, exact) < 1e-12
    with pytest.raises(InvalidArgumentError, match="interval"):
        SecondOrderQuaternionEkf(noise, noise, interval=0.0)


def test_the_kalman_filter_moves_by_the_same_power():
    first = from_rotation_vector([0.5, 0.2, 0.1])
    f, state = fair_kalman_filter(first)
    assert 2.0 * geodesic_error(f.predict(state, dt=2.5).mode, quaternion_power(first, 2.5)) < 1e-12
    # Jacobian against differences of the mean.
    step, base = 1e-6, f.predict(state, dt=0.4)
    for k in range(3):
        moved = from_rotation_vector(step * np.eye(3)[k])
        other = SpinningGaussian(np.concatenate([state.mean[:4], compose(first, moved)]), state.covariance)
        x = compose(conjugate(base.mean[:4]), f.predict(other, dt=0.4).mean[:4])
        exact = compose(conjugate(quaternion_power(first, 0.4)), quaternion_power(compose(first, moved), 0.4))
        assert np.abs(x - exact).max() < 1e-11
