"""The recording types check their contract once and cannot be changed afterwards."""

import dataclasses

import numpy as np
import pytest

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
