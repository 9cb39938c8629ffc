"""Distributions of mechanics that the simulated motions must obey."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham.errors import InvalidArgumentError
from bingham.simulate import simulate_precession, simulate_tumbling

TENSOR = np.array([[2.0, 0.1, 0.3], [0.1, 3.0, -0.2], [0.3, -0.2, 4.0]])


def angle_between(p, q):
    """Angle in rad; by the chord, because arccos is blind below 1e-8."""
    sign = np.where(np.sum(p * q, axis=-1) < 0, -1, 1)[..., None]
    return 4 * np.arcsin(np.linalg.norm(p - sign * q, axis=-1) / 2)


@pytest.mark.parametrize("inertia", [(1.0, 2.0, 3.0), TENSOR])
def test_free_tumbling_conserves_energy_and_momentum(inertia):
    motion = simulate_tumbling(200.0, 20.0, inertia=inertia, angular_velocity=(0.4, -1.1, 0.7))
    tensor = np.diag(inertia) if np.ndim(inertia) == 1 else inertia
    body = motion.angular_velocity @ tensor
    energy = np.sum(body * motion.angular_velocity, axis=1) / 2
    np.testing.assert_allclose(energy, energy[0], rtol=1e-10)
    world = Rotation.from_quat(motion.orientation, scalar_first=True).apply(body)
    np.testing.assert_allclose(world, np.broadcast_to(world[0], world.shape), atol=1e-9)
    assert np.ptp(motion.angular_velocity, axis=0).min() > 0.1  # it does tumble


def test_the_intermediate_axis_turns_over():
    motion = simulate_tumbling(60.0, 50.0)
    spin = motion.angular_velocity[:, 1]
    assert spin.max() > 1.4
    assert spin.min() < -1.4
    stable = simulate_tumbling(60.0, 50.0, angular_velocity=(0.02, 0.02, 1.5)).angular_velocity[:, 2]
    assert stable.min() > 1.49


def test_a_symmetric_body_precesses_as_the_closed_form_says():
    # Torque-free top with moments (A, A, C): angular momentum L along the vertical gives precession L / A and
    # C (spin + precession cos tilt) = L cos tilt.
    a, c, tilt, precession = 2.0, 3.2, 0.7, 1.3
    spin = precession * np.cos(tilt) * (a - c) / c
    expected = simulate_precession(100.0, 25.0, spin=spin, precession=precession, tilt_rad=tilt)
    motion = simulate_tumbling(
        100.0,
        25.0,
        inertia=(a, a, c),
        angular_velocity=expected.angular_velocity[0],
        initial=expected.orientation[0],
    )
    np.testing.assert_allclose(motion.angular_velocity, expected.angular_velocity, atol=1e-9)
    assert angle_between(motion.orientation, expected.orientation).max() < 1e-9


@pytest.mark.parametrize("simulate", [simulate_tumbling, simulate_precession])
def test_orientation_is_the_integral_of_the_angular_velocity(simulate):
    """Midpoint rule on a fine grid: error of order step²."""
    errors = []
    for rate in (500.0, 1000.0):
        motion = simulate(4.0, rate)
        attitude = Rotation.from_quat(motion.orientation, scalar_first=True)
        turn = (attitude[:-2].inv() * attitude[2:]).as_rotvec() * rate / 2
        errors.append(np.abs(turn - motion.angular_velocity[1:-1]).max())
    assert errors[1] < 3e-6
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)


@pytest.mark.parametrize("simulate", [simulate_tumbling, simulate_precession])
def test_rest_phases(simulate):
    motion = simulate(10.0, 100.0, rest_s=2.0)
    np.testing.assert_array_equal(motion.moving, (motion.time >= 2) & (motion.time <= 8))
    np.testing.assert_array_equal(motion.orientation[:200], np.tile(motion.orientation[0], (200, 1)))
    assert not motion.angular_velocity[~motion.moving].any()
    assert angle_between(motion.orientation[0], motion.orientation[400]) > 0.1
    within = simulate(6.0, 100.0)
    np.testing.assert_allclose(motion.orientation[200:801], within.orientation, atol=1e-12)


@pytest.mark.parametrize("rest", [0.1, 0.7, 1.1, 2.3, 3.3])
def test_phases_survive_rounding(rest):
    motion = simulate_tumbling(9.9, 33.0, rest_s=rest)
    assert len(motion.time) == 327
    np.testing.assert_array_equal(motion.orientation[-1], motion.orientation[motion.time >= 9.9 - rest][-1])


def test_irregular_times_sample_the_same_motion():
    motion = simulate_precession(10.0, 100.0, jitter=0.3, drop_probability=0.2, rng=5)
    assert 750 < len(motion.time) < 850
    steps = np.diff(motion.time)
    assert steps.min() > 0.3 / 100
    assert np.std(steps) > 1e-3
    nearest = np.abs(motion.time * 100 - np.round(motion.time * 100))
    assert 0.29 < nearest.max() <= 0.3 + 1e-9
    regular = simulate_precession(10.0, 100.0)
    k = np.round(motion.time * 100).astype(int)
    assert angle_between(motion.orientation, regular.orientation[k]).max() < 0.003 * 2.4
    again = simulate_precession(10.0, 100.0, jitter=0.3, drop_probability=0.2, rng=5)
    np.testing.assert_array_equal(again.time, motion.time)


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("duration_s", 0.0),
        ("duration_s", 0.05),
        ("rate_hz", -1.0),
        ("rate_hz", np.nan),
        ("inertia", (1, 1, -1)),
        ("inertia", np.ones((2, 2))),
        ("angular_velocity", (1, 2)),
        ("initial", (1, 1, 0, 0)),
        ("rest_s", 5.0),
        ("jitter", 0.5),
        ("drop_probability", 1.0),
    ],
)
def test_arguments_out_of_range(argument, value):
    arguments = {"duration_s": 10.0, "rate_hz": 10.0} | {argument: value}
    with pytest.raises(InvalidArgumentError, match=argument):
        simulate_tumbling(**arguments)
