"""Smoothing of orientation sequences against Rauch, Tung & Striebel's smoother and against itself."""

import numpy as np
import pytest

from bingham import Bingham, BinghamFilter, Diffusion, Gate, Gyroscope, InvalidArgumentError, OrientationSensor
from bingham.filters.smoother import smooth_fixed_interval, smooth_fixed_lag
from bingham.rotations import compose, conjugate, from_rotation_vector, to_rotation_vector


def circle(angle):
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def rts(z, q, r):
    """Scalar Rauch–Tung–Striebel smoother of a random walk with a flat prior: means and variances."""
    n = len(z)
    m, p = np.empty(n), np.empty(n)
    m[0], p[0] = z[0], r
    for t in range(1, n):
        ahead = p[t - 1] + q
        k = ahead / (ahead + r)
        m[t], p[t] = m[t - 1] + k * (z[t] - m[t - 1]), (1 - k) * ahead
    for t in range(n - 2, -1, -1):
        g = p[t] / (p[t] + q)
        m[t] += g * (m[t + 1] - m[t])
        p[t] += g * g * (p[t + 1] - p[t] - q)
    return m, p


def walk(d, steps=60, q=0.02, r=0.05, seed=0):
    """Random walk on the group, its measurements and the filter that fits."""
    rng = np.random.default_rng(seed)
    width = d - 1 if d == 4 else 1
    step, noise = q * rng.standard_normal((steps, width)), r * rng.standard_normal((steps, width))
    turn = from_rotation_vector if d == 4 else lambda a: circle(a[..., 0])
    x = np.empty((steps, d))
    x[0] = np.eye(d)[0]
    for t in range(1, steps):
        x[t] = compose(x[t - 1], turn(step[t]))
    z = compose(x, turn(noise))
    # exp(z sin²(θ/2)) or, on the circle, exp(z sin²θ), with the variance r².
    sensor = Bingham(np.r_[np.full(d - 1, (-2 if d == 4 else -0.5) / r**2), 0.0], np.eye(d)[:, ::-1])
    return x, z, sensor


def test_narrow_laws_on_the_circle_agree_with_rauch_tung_striebel():
    rng = np.random.default_rng(1)
    q, r, n = 0.004, 0.01, 80
    angle = np.cumsum(q * rng.standard_normal(n)) + r * rng.standard_normal(n)
    f = BinghamFilter(Diffusion(q, dim=2), OrientationSensor(Bingham([-1 / (2 * r * r), 0.0], np.eye(2)[:, ::-1])))
    track = smooth_fixed_interval(f, Bingham.uniform(2), circle(angle), times=np.arange(n, dtype=float))
    means, variances = rts(angle, q * q, r * r)
    modes = track.modes * np.sign(track.modes[:, :1])
    np.testing.assert_allclose(np.arctan2(modes[:, 1], modes[:, 0]), means, atol=2e-5)
    np.testing.assert_allclose(-1 / (2 * track.concentrations[:, 0]), variances, rtol=2e-3)


@pytest.mark.parametrize("d", [2, 4])
def test_the_last_distribution_is_the_filtered_one_and_a_long_lag_is_the_interval(d):
    _, z, sensor = walk(d, 25)
    noise = Bingham(np.r_[np.full(d - 1, -500.0), 0], np.eye(d)[:, ::-1])
    f = BinghamFilter(noise, sensor)
    prior = Bingham.uniform(d)
    filtered, interval = f.run(prior, z), smooth_fixed_interval(f, prior, z)
    np.testing.assert_allclose(interval.concentrations[-1], filtered.concentrations[-1], rtol=1e-9, atol=1e-9)
    lagged = smooth_fixed_lag(f, prior, z, 25)
    np.testing.assert_allclose(lagged.concentrations, interval.concentrations, rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(smooth_fixed_lag(f, prior, z, 0).log_evidence, filtered.log_evidence)
    np.testing.assert_allclose(
        smooth_fixed_lag(f, prior, z, 0).concentrations, filtered.concentrations, rtol=1e-6, atol=1e-6
    )


def test_smoothing_rotations_halves_the_error_and_narrows_the_distribution():
    x, z, sensor = walk(4, 400, seed=3)
    f = BinghamFilter(Bingham.from_covariance([1.0, 0, 0, 0], 4e-4 * np.eye(3), frame="body"), sensor)
    prior = Bingham.uniform(4)
    filtered, lagged, smoothed = f.run(prior, z), smooth_fixed_lag(f, prior, z, 2), smooth_fixed_interval(f, prior, z)
    rms = [
        np.sqrt(np.mean(to_rotation_vector(compose(conjugate(x), track.modes)) ** 2))
        for track in (filtered, lagged, smoothed)
    ]
    assert rms[2] < rms[1] < rms[0]
    assert rms[2] < 0.85 * rms[0]
    middle = slice(50, 350)
    assert (smoothed.concentrations[middle, 0] < filtered.concentrations[middle, 0]).all()


def test_gyroscope_irregular_times_missing_and_rejected_measurements():
    rng = np.random.default_rng(7)
    n = 120
    times = np.cumsum(rng.uniform(0.02, 0.2, n))
    rate = np.tile([0.3, -0.5, 0.8], (n, 1))
    x = np.empty((n, 4))
    x[0] = [1.0, 0, 0, 0]
    for t in range(1, n):
        x[t] = compose(x[t - 1], from_rotation_vector(rate[t] * (times[t] - times[t - 1])))
    z = compose(x, from_rotation_vector(0.05 * rng.standard_normal((n, 3))))
    z[40:60] = np.nan
    z[80] = [0.0, 1.0, 0.0, 0.0]
    noise = Bingham.from_covariance([1.0, 0, 0, 0], 0.05**2 * np.eye(3), frame="body")
    f = BinghamFilter(Gyroscope(0.02), OrientationSensor(noise), gate=Gate(0.9999))
    filtered = f.run(Bingham.uniform(4), z, controls=rate, times=times)
    smoothed = smooth_fixed_interval(f, Bingham.uniform(4), z, controls=rate, times=times)
    assert filtered.decision[80] == 0
    error = np.linalg.norm(to_rotation_vector(compose(conjugate(x), smoothed.modes)), axis=1)
    assert error.max() < 0.06
    spread = np.trace(smoothed.covariance(frame="body"), axis1=1, axis2=2)
    assert (spread <= np.trace(filtered.covariance(frame="body"), axis1=1, axis2=2) * (1 + 1e-9)).all()
    # The expectation is 3; errors along a smoothed track are correlated, hence the wide bounds.
    left = to_rotation_vector(compose(conjugate(smoothed.modes), x))
    squared = np.einsum("ni,nij,nj->n", left, np.linalg.inv(smoothed.covariance(frame="body")), left)
    assert 1.0 < squared.mean() < 6.0


def test_what_cannot_be_smoothed_is_rejected():
    f = BinghamFilter(
        Bingham([-900.0, -500.0, -100.0, 0.0], np.eye(4)[:, ::-1]), Bingham([-50.0] * 3 + [0.0], np.eye(4)[:, ::-1])
    )
    z = np.tile([1.0, 0, 0, 0], (3, 1))
    with pytest.raises(InvalidArgumentError, match="isotropic process noise"):
        smooth_fixed_interval(f, Bingham.uniform(4), z, controls=z)
    with pytest.raises(InvalidArgumentError, match="lag: expected an integer"):
        smooth_fixed_lag(f, Bingham.uniform(4), z, -1)
    with pytest.raises(InvalidArgumentError, match="one sequence"):
        smooth_fixed_interval(f, Bingham.uniform(4), z[None])
