"""Simulated sensors against the truth they were made of."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import ive
from scipy.stats import chi2

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.simulate import Motion, simulate_imu, simulate_orientations, simulate_precession, simulate_tumbling


def rest(size, step=0.01):
    time = np.cumsum(np.full(size, step))
    attitude = np.tile([0.5, 0.5, -0.5, 0.5], (size, 1))
    return Motion("rest", time, attitude, np.zeros((size, 3)), np.ones(size, dtype=bool))


def integrated(recording):
    """Strapdown integration of the gyroscope from the first reference."""
    steps = np.diff(recording.time)[:, None]
    attitude = Rotation.from_quat(recording.reference[0], scalar_first=True)
    out = [attitude]
    for turn in Rotation.from_rotvec(recording.gyroscope[1:] * steps):
        attitude = attitude * turn
        out.append(attitude)
    return Rotation.concatenate(out)


@pytest.mark.parametrize("simulate", [simulate_tumbling, simulate_precession])
def test_the_ideal_gyroscope_integrates_to_the_truth(simulate):
    motion = simulate(20.0, 100.0, rest_s=1.0, jitter=0.3, drop_probability=0.1, rng=1)
    recording = simulate_imu(motion, gyroscope_noise_density=0.0)
    truth = Rotation.from_quat(recording.reference, scalar_first=True)
    assert (truth.inv() * integrated(recording)).magnitude().max() < 1e-11
    # and is close to the instantaneous rate, half an interval late
    moving = motion.moving & np.roll(motion.moving, 1)
    middle = (motion.angular_velocity + np.roll(motion.angular_velocity, 1, axis=0)) / 2
    np.testing.assert_allclose(recording.gyroscope[moving], middle[moving], atol=2e-3)
    np.testing.assert_array_equal(recording.score, motion.moving)


def test_vectors_point_where_the_orientation_says():
    motion = simulate_tumbling(10.0, 50.0)
    ideal = simulate_imu(motion, accelerometer_noise_density=0.0, magnetometer_noise=0.0, field_dip_rad=1.0)
    attitude = Rotation.from_quat(motion.orientation, scalar_first=True)
    up = np.tile([0, 0, 9.81], (len(motion.time), 1))
    np.testing.assert_allclose(attitude.apply(ideal.accelerometer.copy()), up, atol=1e-12)
    field = np.tile([0, 49 * np.cos(1), -49 * np.sin(1)], (len(motion.time), 1))
    np.testing.assert_allclose(attitude.apply(ideal.magnetometer.copy()), field, atol=1e-12)
    assert simulate_imu(motion, magnetometer=False).magnetometer is None


def within_chi2(values, variance):
    """Sum of squares within the central 1 − 1e-6 of its distribution."""
    low, high = chi2.ppf([5e-7, 1 - 5e-7], values.size) * variance
    return low < np.sum(values**2) < high


@pytest.mark.parametrize("step", [0.01, 0.04])
def test_noise_densities_hold_at_every_rate(step):
    size = 20_000
    motion = rest(size, step)
    recording = simulate_imu(
        motion, gyroscope_noise_density=0.01, accelerometer_noise_density=0.02, magnetometer_noise=0.3, rng=2
    )
    still = Rotation.from_quat(motion.orientation[0], scalar_first=True).inv()
    assert within_chi2(recording.gyroscope, 0.01**2 / step)
    assert not within_chi2(recording.gyroscope, 1.1 * 0.01**2 / step)
    assert within_chi2(recording.accelerometer - still.apply([0, 0, 9.81]), 0.02**2 / step)
    field = still.apply(49 * np.array([0, np.cos(1.17), -np.sin(1.17)]))
    assert within_chi2(recording.magnetometer - field, 0.3**2)
    # the angle drifts as a random walk: variance density² per second, whatever the rate
    turns = np.add.reduceat(recording.gyroscope * step, np.arange(0, size, 100), axis=0)
    assert within_chi2(turns, 0.01**2 * 100 * step)


def test_bias_starts_as_asked_and_walks():
    bias = np.array([0.01, -0.02, 0.03])
    constant = simulate_imu(rest(100), gyroscope_noise_density=0.0, gyroscope_bias=bias)
    np.testing.assert_allclose(constant.gyroscope, np.tile(bias, (100, 1)), atol=1e-15)
    walking = simulate_imu(
        rest(20_000), gyroscope_noise_density=0.0, gyroscope_bias=bias, gyroscope_bias_walk=1e-3, rng=3
    )
    np.testing.assert_allclose(walking.gyroscope[0], bias, atol=1e-15)
    assert within_chi2(np.diff(walking.gyroscope, axis=0), 1e-6 * 0.01)


def test_the_seed_decides():
    motion = simulate_tumbling(1.0, 100.0)
    one, two, other = (simulate_imu(motion, rng=seed) for seed in (7, 7, 8))
    np.testing.assert_array_equal(one.gyroscope, two.gyroscope)
    assert not np.array_equal(one.gyroscope, other.gyroscope)


def test_arguments_out_of_range():
    motion = rest(5)
    for change in ({"gyroscope_noise_density": -1.0}, {"magnetometer_noise": np.nan}, {"gyroscope_bias": 0.1}):
        with pytest.raises(InvalidArgumentError, match=next(iter(change))):
            simulate_imu(motion, **change)
    with pytest.raises(InvalidArgumentError, match="at least 2"):
        simulate_imu(rest(1))


@pytest.mark.parametrize("kappa", [5.0, 400.0])
def test_orientation_noise_has_the_spread_of_its_distribution(kappa):
    """exp(κ w²) on the quaternions: E cos(angle) = d/da log(I₀(a) − I₁(a)) at a = κ/2."""
    size, a = 20_000, kappa / 2
    noise = Bingham([-kappa, -kappa, -kappa, 0.0], np.eye(4)[:, ::-1])
    recording = simulate_orientations(rest(size), noise, rng=11)
    cosine = 2 * np.sum(recording.orientation * recording.truth, axis=1) ** 2 - 1
    expected = (ive(1, a) - (ive(0, a) + ive(2, a)) / 2) / (ive(0, a) - ive(1, a))
    error = 4 * cosine.std() / np.sqrt(size)
    assert abs(cosine.mean() - expected) < error
    assert abs(cosine.mean() - (1 - 1.1 * (1 - expected))) > error  # a spread 10 % larger is told apart


class Noise:
    """A distribution like `Bingham` that always gives one rotation of 0.1 rad about the body's x axis."""

    dim = 4

    def rvs(self, size, *, rng):
        return np.tile([np.cos(0.05), np.sin(0.05), 0, 0], (size, 1))


def test_orientation_noise_acts_in_the_body_frame():
    motion = simulate_precession(5.0, 20.0)
    recording = simulate_orientations(motion, Noise())
    truth = Rotation.from_quat(recording.truth, scalar_first=True)
    measured = Rotation.from_quat(recording.orientation, scalar_first=True)
    error = (truth.inv() * measured).as_rotvec()
    np.testing.assert_allclose(error, np.tile([0.1, 0, 0], (len(error), 1)), atol=1e-12)
    planar = Noise()
    planar.dim = 2
    with pytest.raises(InvalidArgumentError, match="dim 4"):
        simulate_orientations(motion, planar)
