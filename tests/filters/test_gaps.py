"""Inertial recordings with missing samples: estimates before and after, and what is reported about them."""

from pathlib import Path

import numpy as np
import pytest

from bingham import ImuFilter, ImuRecording
from bingham.filters import ImuState, InertialFilter
from bingham.io import read_recording
from bingham.kernels.gap import PACE_STATE, bridge_gaps
from bingham.metrics import geodesic_error
from bingham.simulate import simulate_imu, simulate_tumbling

BROAD = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "broad"
FAST = BROAD / "06_undisturbed_fast_rotation_A.npz"
STARTS = (40.0, 60.0, 80.0, 100.0)
recorded = pytest.mark.skipif(not BROAD.is_dir(), reason="the BROAD recordings are not beside the project")


def without(r, start, seconds):
    """Return the recording without the samples of some seconds, and the reference of what is left."""
    there = ~((r.time >= start) & (r.time < start + seconds))
    rows = (r.time, r.gyroscope, r.accelerometer, r.magnetometer, r.reference)
    *left, reference = (a[there] for a in rows)
    return ImuRecording("gap", *left), reference


def error_and_deviation(track, reference, begin, end):
    """Return median error and reported deviation, degrees, over some seconds."""
    window = (track.time >= begin) & (track.time < end) & np.isfinite(reference[:, 0])
    error = 2.0 * geodesic_error(track.modes[window], reference[window])
    deviation = np.sqrt(np.trace(track.covariance(frame="world")[window], axis1=1, axis2=2))
    return np.degrees(np.median(error)), np.degrees(np.median(deviation))


@pytest.fixture(scope="module")
def fast():
    return read_recording(FAST)


@recorded
@pytest.mark.parametrize("seconds", [0.05, 0.2, 0.9])
@pytest.mark.parametrize("make", [ImuFilter, InertialFilter])
def test_a_gap_in_fast_motion_is_not_taken_for_knowledge(fast, make, seconds):
    # Errors of up to 40° were reported as 2° before short gaps counted, and the plain filter's gate never opened again.
    for start in STARTS:
        cut, reference = without(fast, start, seconds)
        track = make().run(cut)
        for begin, end in ((seconds, seconds + 0.1), (2.0 + seconds, 3.0 + seconds), (10.0, 12.0)):
            error, deviation = error_and_deviation(track, reference, start + begin, start + end)
            assert error < 4.0 * deviation
        if seconds < 0.5:  # blind for longer, such a body may have rotated any way
            assert error < 6.0
        if make is InertialFilter:
            assert track.accepted[track.time > start].mean() > 0.9


@recorded
@pytest.mark.parametrize("seconds", [0.2, 0.9])
def test_smoothing_leaves_the_past_of_a_gap_alone(fast, seconds):
    for start in STARTS:
        cut, reference = without(fast, start, seconds)
        track = ImuFilter().smooth(cut)
        error, _ = error_and_deviation(track, reference, start - 1.0, start)
        assert error < 4.0
        error, deviation = error_and_deviation(track, reference, start + seconds, start + seconds + 0.1)
        assert error < 4.0 * deviation


@pytest.mark.parametrize("rate", [10.0, 100.0, 800.0])
def test_samples_in_a_row_are_no_gap_at_any_rate(rate):
    steps = np.random.default_rng(0).uniform(0.5, 1.5, 500) / rate
    variances, rates = np.empty(500), np.random.default_rng(1).standard_normal((500, 3))
    bridge_gaps(steps, rates.copy(), np.zeros(PACE_STATE), variances)
    assert not variances.any()
    steps[400] = 6.0 / rate
    bridge_gaps(steps, rates.copy(), np.zeros(PACE_STATE), variances)
    change2 = np.sum((rates[400] - rates[399]) ** 2)
    expected = (min(1.0, 24.0 / rate) ** 2 + change2 / 3.0) * (6.0 / rate) ** 2
    np.testing.assert_allclose(variances[400], expected, rtol=1e-12)
    assert np.count_nonzero(variances) == 1


@pytest.mark.parametrize("cut", [500, 501])
def test_runs_parted_at_a_gap_are_bit_identical(cut):
    r = simulate_imu(simulate_tumbling(12.0, 100.0, rng=0, rest_s=2.0), rng=1)
    r, _ = without(r, 5.0, 0.1)

    def part(a, b):
        return ImuRecording("part", r.time[a:b], r.gyroscope[a:b], r.accelerometer[a:b], r.magnetometer[a:b])

    whole, first = ImuFilter().run(r), ImuFilter().run(part(0, cut))
    second = ImuFilter().run(part(cut, r.size), state=ImuState.from_json(first.final.to_json()))
    np.testing.assert_array_equal(second.modes, whole.modes[cut:])
    np.testing.assert_array_equal(second.covariance(frame="body"), whole.covariance(frame="body")[cut:])
    whole, first = InertialFilter().run(r), InertialFilter().run(part(0, cut))
    second = InertialFilter().run(part(cut, r.size), first.state)
    np.testing.assert_array_equal(second.frames, whole.frames[cut:])
    np.testing.assert_array_equal(second.concentrations, whole.concentrations[cut:])
