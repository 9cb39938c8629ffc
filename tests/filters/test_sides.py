"""Sides of noises and controls, and diffusion that differs between axes, against simulated motion."""

import numpy as np
import pytest

from bingham import Bingham, BinghamFilter, BinghamMixture, Diffusion, Gyroscope, MixtureFilter, SampledFilter
from bingham.filters import smooth_fixed_interval
from bingham.metrics import geodesic_error
from bingham.models import ControlledRotation, OrientationSensor, RandomWalk
from bingham.rotations import compose, from_rotation_vector

AXES = np.eye(4)[:, ::-1]
LOPSIDED = Bingham([-4000.0, -800.0, -150.0, 0.0], AXES)
NARROW = Bingham([-2e4] * 3 + [0.0], AXES)
START = Bingham.from_covariance([0.5, 0.5, -0.5, 0.5], 1e-4 * np.eye(3), frame="body")
DT, LENGTH = 0.1, 60
SIDES = pytest.mark.parametrize("side", ["right", "left"])


def joined(x, y, side):
    """Return x ⊕ y on the right, y ⊕ x on the left."""
    return compose(y, x) if side == "left" else compose(x, y)


def simulate(side, seed=4):
    """Return controls that rotate about changing axes by tenths of a radian, truth, and measurements on the side."""
    rng = np.random.default_rng(seed)
    u = from_rotation_vector(0.3 * rng.normal(size=(LENGTH, 3)))
    v = LOPSIDED.rvs(LENGTH, rng=rng)
    truth, x = np.empty((LENGTH, 4)), START.mode
    for t in range(LENGTH):
        x = joined(x, u[t], side)
        truth[t] = x
    return u, truth, joined(truth, v, side)


def degrees(modes, truth):
    return np.degrees(2.0 * np.sqrt(np.mean(geodesic_error(modes, truth) ** 2)))


def filters(side):
    noise = Bingham([-5e5] * 3 + [0.0], AXES)
    sampled = SampledFilter(
        process_noise=Diffusion(1e-3), noise_side=side,
        log_likelihood=lambda z, q: LOPSIDED.logpdf(
            compose(z, q * [1, -1, -1, -1]) if side == "left" else compose(q * [1, -1, -1, -1], z)),
    )  # fmt: skip
    return {
        "diffusion": BinghamFilter(Diffusion(1e-3), LOPSIDED, noise_side=side),
        "walk": BinghamFilter(RandomWalk(noise), LOPSIDED, noise_side=side),
        "controlled": BinghamFilter(ControlledRotation(noise), OrientationSensor(LOPSIDED), noise_side=side),
        "list": BinghamFilter(Diffusion(1e-3), [LOPSIDED], noise_side=side),
        "mixture": MixtureFilter(Diffusion(1e-3), LOPSIDED, noise_side=side),
        "sampled": sampled,
    }


@SIDES
@pytest.mark.parametrize("name", list(filters("right")))
def test_controls_and_noises_act_on_the_side_of_the_filter(side, name):
    u, truth, z = simulate(side)
    given = {"controls": u, "times": DT * np.arange(LENGTH), "start_time": -DT}
    f = filters(side)[name]
    prior = BinghamMixture.single(START) if name == "mixture" else START
    track = f.run(prior, z, **given)
    assert degrees(track.modes, truth) < 0.5 * degrees(z, truth)
    state = prior
    for t in range(LENGTH):
        state, _ = f.update(f.predict(state, u[t], DT), z[t])
    assert geodesic_error(state.mode, track.modes[-1]) < 1e-8
    other = filters({"left": "right", "right": "left"}[side])[name]
    assert degrees(other.run(prior, z, **given).modes, truth) > 5.0  # the control


@SIDES
def test_a_gyroscope_is_fixed_to_the_body_whatever_the_side_of_the_measurements_noise(side):
    rng = np.random.default_rng(7)
    rate = rng.normal(size=(LENGTH, 3))
    truth, x = np.empty((LENGTH, 4)), START.mode
    for t in range(LENGTH):
        x = compose(x, from_rotation_vector(rate[t] * DT))
        truth[t] = x
    z = joined(truth, LOPSIDED.rvs(LENGTH, rng=rng), side)
    given = {"controls": rate, "times": DT * np.arange(LENGTH), "start_time": -DT}
    f = BinghamFilter(Gyroscope(1e-3), LOPSIDED, noise_side=side)
    track = f.run(START, z, **given)
    assert degrees(track.modes, truth) < 0.5 * degrees(z, truth)
    state = START
    for t in range(LENGTH):
        state, _ = f.update(f.predict(state, rate[t], DT), z[t])
    np.testing.assert_allclose(track.final.matrix, state.matrix, rtol=1e-7, atol=1e-5)
    vague = f.run(Bingham.uniform(4), z, **given)
    smoothed = smooth_fixed_interval(f, Bingham.uniform(4), z, **given)
    assert degrees(smoothed.modes[:20], truth[:20]) < 0.7 * degrees(vague.modes[:20], truth[:20])


@SIDES
def test_models_that_name_a_side_keep_it(side):
    u, truth, z = simulate("left")
    f = BinghamFilter(Diffusion(1e-3, left=True), OrientationSensor(LOPSIDED, left=True), noise_side=side)
    track = f.run(START, z, controls=u, times=DT * np.arange(LENGTH), start_time=-DT)
    assert degrees(track.modes, truth) < 0.5 * degrees(z, truth)


SIGMA = np.array([0.9, 0.1, 0.4])


@SIDES
def test_anisotropic_diffusion_has_the_moments_of_simulated_motion(side):
    rng = np.random.default_rng(0)
    n, t, steps = 40_000, 1.0, 60
    x = np.tile([0.5, 0.5, -0.5, 0.5], (n, 1))
    for _ in range(steps):
        x = joined(x, from_rotation_vector(SIGMA * np.sqrt(t / steps) * rng.normal(size=(n, 3))), side)
    needle = Bingham.from_covariance([0.5, 0.5, -0.5, 0.5], 1e-12 * np.eye(3), frame="body")
    motion = Diffusion(SIGMA, left=side == "left")
    predicted = motion.propagate(needle, None, t).moment()
    sample = np.einsum("ni,nj->ij", x, x) / n
    np.testing.assert_allclose(sample, predicted, atol=4 * 0.4 / np.sqrt(n) + 3e-3)
    wrong = Diffusion(SIGMA, left=side == "right").propagate(needle, None, t).moment()
    assert np.abs(sample - wrong).max() > 0.05  # the control


def test_anisotropic_diffusion_is_exact_over_any_time_steps():
    f = BinghamFilter(Diffusion(SIGMA), NARROW)
    z = np.full((7, 4), np.nan)
    z[0] = [0.5, 0.5, -0.5, 0.5]
    one = f.run(Bingham.uniform(4), z[[0, 1]], times=[0.0, 3.0]).final
    many = f.run(Bingham.uniform(4), z, times=[0.0, 0.1, 0.5, 1.4, 1.5, 2.0, 3.0]).final
    np.testing.assert_allclose(one.moment(), many.moment(), atol=1e-11)
    np.testing.assert_allclose(
        f.predict(f.predict(f.run(Bingham.uniform(4), z[:1], times=[0.0]).final, None, 1.0), None, 2.0).moment(),
        one.moment(), atol=1e-11,
    )  # fmt: skip
    later = f.run(Bingham.uniform(4), z[[0, 1]], times=[0.0, 1e4]).final
    np.testing.assert_allclose(later.z, 0.0, atol=1e-9)
    same = BinghamFilter(Diffusion([0.3, 0.3, 0.3]), NARROW), BinghamFilter(Diffusion(0.3), NARROW)
    a, b = (g.run(Bingham.uniform(4), z, times=np.arange(7.0)).final for g in same)
    np.testing.assert_allclose(a.moment(), b.moment(), atol=1e-12)


def test_a_gyroscope_with_one_bad_axis_spreads_about_it():
    f = BinghamFilter(Gyroscope([1e-3, 1e-3, 0.1]), NARROW)
    z = np.full((50, 4), np.nan)
    z[0] = np.eye(4)[0]
    track = f.run(Bingham.uniform(4), z, controls=np.zeros((50, 3)), times=np.arange(50.0) / 10)
    variance = np.diagonal(track.final.covariance(frame="body") - track.covariance(frame="body")[0])
    np.testing.assert_allclose(variance, np.array([1e-6, 1e-6, 1e-2]) * 4.9, rtol=0.05, atol=1e-6)
