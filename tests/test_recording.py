"""The recording types check their contract once and cannot be changed afterwards."""

import dataclasses

import numpy as np
import pytest

from bingham import Bingham, BinghamFilter, Diffusion
from bingham.errors import InvalidArgumentError
from bingham.recording import ImuRecording, OrientationRecording

NAN = np.nan
TIME = [0.0, 0.1, 0.35]
GYRO = np.zeros((3, 3))
UNIT = [[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0.6, 0.8]]


def imu(**changes):
    return ImuRecording(**({"name": "x", "time": TIME, "gyroscope": GYRO} | changes))


def orientations(**changes):
    return OrientationRecording(**({"name": "x", "time": TIME, "orientation": UNIT} | changes))


def test_arrays_are_own_read_only_float64_copies():
    time = np.array(TIME, dtype=np.float32)
    recording = imu(time=time, reference=UNIT, score=[True, False, True])
    time[:] = 7
    assert recording.time[1] == np.float32(0.1)
    for array in (recording.time, recording.gyroscope, recording.reference):
        assert array.dtype == np.float64
        assert array.flags.c_contiguous
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        recording.time = time


def test_missing_rows_are_kept_and_not_scored():
    reference = np.array(UNIT)
    reference[1] = NAN
    recording = imu(accelerometer=[[0, 0, 9.81], [NAN] * 3, [0, 0, 9.81]], reference=reference)
    assert recording.scored.tolist() == [True, False, True]
    assert np.isnan(recording.accelerometer[1]).all()
    assert imu(reference=reference, score=[True, True, False]).scored.tolist() == [True, False, False]
    assert not imu().scored.any()
    assert orientations(truth=reference).scored.tolist() == [True, False, True]


def test_planar_orientations():
    recording = orientations(orientation=[[1.0, 0], [0, 1], [0.6, 0.8]])
    assert recording.dim == 2
    assert recording.duration_s == 0.35


@pytest.mark.parametrize(
    ("build", "changes", "argument", "words"),
    [
        (imu, {"time": []}, "time", "N ≥ 1"),
        (imu, {"time": [0, 1, NAN]}, "time", "finite"),
        (imu, {"time": [0, 1, 1]}, "time", "increasing.*index 2"),
        (imu, {"time": [0, 2, 1]}, "time", "increasing.*1.0 after 2.0"),
        (imu, {"time": "noon"}, "time", "numbers"),
        (imu, {"gyroscope": np.zeros((2, 3))}, "gyroscope", r"\(3, 3\).*\(2, 3\)"),
        (imu, {"gyroscope": np.full((3, 3), NAN)}, "gyroscope", "finite numbers"),
        (imu, {"accelerometer": [[1, NAN, 1], [1, 1, 1], [1, 1, 1]]}, "accelerometer", "whole row.*index 0"),
        (imu, {"magnetometer": np.full((3, 3), np.inf)}, "magnetometer", "finite"),
        (imu, {"reference": np.ones((3, 4))}, "reference", "unit norm.*norm 2"),
        (imu, {"score": [1, 0, 1]}, "score", "booleans"),
        (imu, {"earth_frame": "up"}, "earth_frame", "ENU"),
        (orientations, {"orientation": np.eye(3)}, "orientation", r"\(N, 2\) or \(N, 4\)"),
        (orientations, {"orientation": 1.001 * np.array(UNIT)}, "orientation", "unit"),
        (orientations, {"orientation": np.full((3, 4), NAN)}, "orientation", "finite numbers"),
        (orientations, {"truth": np.eye(3)}, "truth", r"\(3, 4\)"),
        (orientations, {"position": np.zeros((3, 2))}, "position", r"\(3, 3\)"),
    ],
)
def test_violations_name_argument_expectation_and_value(build, changes, argument, words):
    with pytest.raises(InvalidArgumentError, match=words) as caught:
        build(**changes)
    assert str(caught.value).startswith(f"{argument}: expected ")


NANOSECONDS = 1_700_000_000_000_000_000 + 5_000_000 * np.arange(10)
MULTIPLY = "Multiply by 1e-"


@pytest.mark.parametrize(
    ("times", "message"),
    [
        (NANOSECONDS, r"expected seconds, got 1.7e\+18 .*nanoseconds\? Multiply by 1e-9"),
        (NANOSECONDS.astype(float), r"nanoseconds\? Multiply by 1e-9"),
        (NANOSECONDS // 1000, r"microseconds\? Multiply by 1e-6"),
        (NANOSECONDS // 1_000_000, r"milliseconds\? Multiply by 1e-3"),
        (NANOSECONDS - NANOSECONDS[0], r"whole numbers in steps of 5e\+06.*Multiply by 1e-9"),
        (NANOSECONDS.astype("datetime64[ns]"), "expected float seconds, got datetime64.*np.timedelta64"),
        ((NANOSECONDS - NANOSECONDS[0]).astype("timedelta64[ns]"), "expected float seconds, got timedelta64"),
    ],
)
def test_times_that_cannot_be_seconds(times, message):
    rows = np.tile([1.0, 0.0, 0.0, 0.0], (10, 1))
    narrow = Bingham.from_covariance([1.0, 0, 0, 0], 1e-2 * np.eye(3), frame="body")
    with pytest.raises(InvalidArgumentError, match="times: .*" + message):
        BinghamFilter(Diffusion(0.1), narrow).run(Bingham.uniform(4), rows, times=times)
    with pytest.raises(InvalidArgumentError, match="time: .*" + message):
        OrientationRecording("x", times, rows)
    with pytest.raises(InvalidArgumentError, match=r"time: expected (float )?seconds"):
        ImuRecording("x", times, np.zeros((10, 3)))


@pytest.mark.parametrize("unit", [1, 1000])
def test_a_gyroscope_is_not_read_every_hour(unit):
    times = (NANOSECONDS - NANOSECONDS[0]) / unit  # nano- and microseconds, as floats
    with pytest.raises(
        InvalidArgumentError, match="time: expected seconds of a gyroscope, got steps of 5.*" + MULTIPLY
    ):
        ImuRecording("x", times, np.zeros((10, 3)))


@pytest.mark.parametrize(
    "times",
    [
        np.arange(10),
        86_400 * np.arange(10),  # daily
        604_800.0 * np.arange(10),  # weekly: as floats
        1_700_000_000 + 3600 * np.arange(10),  # since 1970
        6.3e10 + np.arange(10),  # since the year 1
        -1e9 + np.arange(10.0),
        [0, 1e7, *range(10_000_001, 10_000_009)],  # a long gap
    ],
)
def test_seconds_are_seconds(times):
    rows = np.tile([1.0, 0.0, 0.0, 0.0], (10, 1))
    np.testing.assert_array_equal(OrientationRecording("x", times, rows).time, times)
    if np.median(np.diff(times)) < 100:
        assert ImuRecording("x", times, np.zeros((10, 3))).size == 10
