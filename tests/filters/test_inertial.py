"""The plain inertial filter on simulated and recorded motion."""

from pathlib import Path

import numpy as np
import pytest

from bingham import Bingham, ImuRecording, InvalidArgumentError
from bingham.filters import InertialFilter
from bingham.io import read_recording
from bingham.metrics import broad_rmse

BROAD = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "broad"


def part(r, a, b):
    """Rows a to b of a recording."""
    cut = slice(a, b)
    optional = {n: None if getattr(r, n) is None else getattr(r, n)[cut] for n in ("accelerometer", "magnetometer")}
    return ImuRecording(r.name, r.time[cut], r.gyroscope[cut], **optional)


def simulated(seconds=60.0, **options):
    from bingham.simulate import simulate_imu, simulate_tumbling

    motion = simulate_tumbling(seconds, 100.0, rng=0, rest_s=2.0)
    return simulate_imu(motion, rng=1, **options)


@pytest.mark.skipif(not BROAD.is_dir(), reason="the BROAD recordings are not beside the project")
def test_broad_without_bias_estimation():
    """One parameter set, 15 trials: mean total RMSE at most 3.6°, inclination 1.1° (VQF without bias: 3.49°)."""
    errors = []
    for path in sorted(BROAD.glob("*.npz")):
        recording = read_recording(path)
        track = InertialFilter().run(recording)
        errors.append(broad_rmse(track.modes, recording.reference, recording.score))
    total, _, inclination = np.mean(errors, axis=0)
    assert len(errors) == 15
    assert total <= 3.6
    assert inclination <= 1.1


def test_follows_a_simulated_motion():
    r = simulated(gyroscope_noise_density=1e-3)
    track = InertialFilter().run(r)
    total, _, inclination = broad_rmse(track.modes[500:], r.reference[500:], np.ones(r.size - 500, bool))
    assert total < 2.0
    assert inclination < 1.0
    assert track.accepted.mean() > 0.99


def test_split_run_is_bit_identical():
    r = simulated(20.0)
    whole = InertialFilter().run(r)
    first = InertialFilter().run(part(r, 0, 777))
    second = InertialFilter().run(part(r, 777, r.size), first.state)
    np.testing.assert_array_equal(second.frames, whole.frames[777:])
    np.testing.assert_array_equal(second.concentrations, whole.concentrations[777:])
    np.testing.assert_array_equal(second.log_evidence, whole.log_evidence[777:])


def test_a_gap_widens_the_distribution():
    r = simulated(20.0)
    keep = np.r_[0:1000, 1500 : r.size]
    gap = ImuRecording("gap", r.time[keep], r.gyroscope[keep], r.accelerometer[keep], r.magnetometer[keep])
    track = InertialFilter().run(gap)
    spread = np.trace(track.covariance(frame="world"), axis1=1, axis2=2)
    assert spread[1000] > 1.5 * spread[999]


def test_without_a_magnetometer_heading_stays_unknown():
    r = simulated(10.0)
    track = InertialFilter().run(ImuRecording("6-axis", r.time, r.gyroscope, r.accelerometer))
    assert np.isnan(track.covariance(frame="world")[-1]).all()
    assert track.concentrations[-1, 1] < -1000.0
    assert track.concentrations[-1, 2] > -1e-6


def test_a_prior_and_declination_are_used():
    r = simulated(30.0, gyroscope_noise_density=1e-4)
    a = InertialFilter(declination=0.2).run(r)
    b = InertialFilter().run(r)
    from bingham.rotations import compose, conjugate, to_rotation_vector

    turn = to_rotation_vector(compose(a.modes[-1], conjugate(b.modes[-1])))
    np.testing.assert_allclose(turn, [0.0, 0.0, -0.2], atol=5e-3)
    prior = Bingham.from_covariance(r.reference[0], 1e-6 * np.eye(3), frame="world")
    start = InertialFilter().run(r, prior).modes[0]
    assert abs(start @ r.reference[0]) > 1 - 1e-6


def test_bad_input_is_named():
    with pytest.raises(InvalidArgumentError, match="averaging_time: expected a finite number > 0"):
        InertialFilter(averaging_time=0.0)
    r = simulated(6.0)
    with pytest.raises(InvalidArgumentError, match="times after"):
        InertialFilter().run(r, InertialFilter().run(r).state)
    with pytest.raises(InvalidArgumentError, match="prior"):
        InertialFilter().run(r, Bingham.uniform(3))
    with pytest.raises(InvalidArgumentError, match="prior: expected a Bingham distribution, got a list"):
        InertialFilter().run(r, [1.0, 0.0, 0.0, 0.0])
