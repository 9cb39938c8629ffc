"""Noise densities found without ground truth."""

import numpy as np
import pytest

from bingham import ImuRecording, InvalidArgumentError
from bingham.filters.tune import SensorNoise, tune
from bingham.simulate import simulate_imu, simulate_tumbling

TRUE = {"gyroscope": 1.5e-3, "accelerometer": 8e-3, "magnetometer": 0.6}


@pytest.fixture(scope="module")
def recording():
    return simulate_imu(
        simulate_tumbling(90.0, 100.0, rng=4, rest_s=3.0),
        gyroscope_noise_density=TRUE["gyroscope"],
        accelerometer_noise_density=TRUE["accelerometer"],
        magnetometer_noise=TRUE["magnetometer"],
        gyroscope_bias=[0.01, -0.02, 0.005],
        rng=5,
    )


@pytest.mark.parametrize("off", [(10.0, 0.1, 10.0), (0.1, 10.0, 0.1)])
def test_true_densities_from_a_decade_off(recording, off):
    start = SensorNoise(*(f * v for f, v in zip(off, TRUE.values(), strict=True)))
    counts = []
    tuning = tune(recording, start=start, progress=lambda n, _: counts.append(n))
    for name, value in TRUE.items():
        assert abs(getattr(tuning.noise, name) / value - 1) < 0.15, name
        assert abs(np.log(getattr(tuning.noise, name) / value)) < 4 * tuning.relative_error[name], name
    assert tuning.log_evidence > tuning.start_log_evidence
    assert counts == list(range(1, len(counts) + 1))
    assert len(counts) == tuning.evaluations


def test_densities_of_white_noise_are_not_doubted_and_scatter_as_much(recording):
    tuning = tune(recording)
    assert tuning.doubts == {}
    for name, value in TRUE.items():
        assert 0.7 < tuning.scatter[name] / value < 1.1, name


def test_recording_at_rest_leaves_the_gyroscope_open():
    still = simulate_imu(simulate_tumbling(20.0, 100.0, rng=4, rest_s=9.9), gyroscope_noise_density=1e-5, rng=6)
    begin = still.time < 9.0
    tuning = tune(ImuRecording("rest", *(x[begin] for x in (still.time, still.gyroscope, still.accelerometer))))
    assert set(tuning.doubts) == {"gyroscope"}
    assert "not determined" in tuning.doubts["gyroscope"]


def test_motion_in_the_densities_is_told(recording):
    # Swings of 2 m/s² at 0.5 Hz, and a gyroscope that reads 5 % too much.
    swing = 2.0 * np.sin(np.pi * recording.time)[:, None] * [1.0, 0.0, 0.0]
    shaken = ImuRecording(
        "shaken", recording.time, 1.05 * recording.gyroscope, recording.accelerometer + swing, recording.magnetometer
    )
    doubts = tune(shaken).doubts
    assert "accelerometer" in doubts
    assert "not noise" in doubts["accelerometer"]


def test_profile_falls_by_two_at_two_standard_errors(recording):
    tuning = tune(recording)
    for name in TRUE:
        values, levels = tuning.profile(name, np.exp(tuning.relative_error[name] * np.array([-2.0, 0.0, 2.0])))
        assert levels[[0, 2]] - levels[1] == pytest.approx([-2.0, -2.0], abs=0.7), name
        assert values[1] == pytest.approx(getattr(tuning.noise, name))


def test_profile_peaks_at_the_estimate(recording):
    tuning = tune(recording)
    values, levels = tuning.profile("gyroscope", (0.5, 1.0, 2.0))
    assert values[1] == pytest.approx(tuning.noise.gyroscope)
    assert levels[1] > max(levels[0], levels[2])
    with pytest.raises(InvalidArgumentError, match="'gyroscope' or"):
        tuning.profile("barometer")


def test_six_axes_tune_two_densities(recording):
    cut = ImuRecording("six", recording.time, recording.gyroscope, recording.accelerometer)
    tuning = tune(cut)
    assert set(tuning.relative_error) == {"gyroscope", "accelerometer"}
    assert abs(tuning.noise.gyroscope / TRUE["gyroscope"] - 1) < 0.15


def test_what_cannot_be_tuned_is_rejected(recording):
    with pytest.raises(InvalidArgumentError, match="an accelerometer"):
        tune(ImuRecording("gyro", recording.time, recording.gyroscope))
    with pytest.raises(InvalidArgumentError, match="at least 2 s"):
        tune(ImuRecording("short", [0.0, 0.5], np.zeros((2, 3)), np.ones((2, 3))))
