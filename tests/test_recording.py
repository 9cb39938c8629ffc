"""The recording types check their contract once and cannot be changed afterwards."""

import dataclasses
import re
import warnings
from pathlib import Path

import numpy as np
import pytest

from bingham import Bingham, BinghamFilter, Diffusion
from bingham.errors import InvalidArgumentError, RecordingWarning
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
        (NANOSECONDS - NANOSECONDS[0], r"integers in steps of 5e\+06.*Multiply by 1e-9"),
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


def doubted(time=0.01, rate=0.1, force=9.81, rows=100):
    along = np.array([0.0, 0.6, 0.8])
    force = np.broadcast_to(force, rows)[:, None] * along
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        ImuRecording("x", time * np.arange(rows), np.tile(rate * along, (rows, 1)), force)
    assert all(w.filename == __file__ for w in caught)
    return [str(w.message) for w in caught]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"time": 10.0}, r"x: time: usually 10 s between samples.* Multiply by 1e-3"),
        ({"time": 1.0}, r"x: time: usually 1 s between samples"),
        ({"force": 1.0}, r"x: accelerometer: usually 1 m/s².* is it in g\? Multiply by 9\.80665"),
        (
            {"force": 0.0},
            r"x: accelerometer: usually 0 m/s².*: another unit, or another sensor's\? Check the order: time",
        ),
        ({"force": 50.0}, r"x: accelerometer: usually 50 m/s².*: another unit, or another sensor's\? Check the order"),
        ({"rate": 9.8}, r"x: gyroscope: usually 9\.8 rad/s, the number of gravity .*accelerometer's\? Check the order"),
        ({"rate": 45.0}, r"x: gyroscope: up to 45 rad/s, 7 revolutions a second: degrees/s\? Multiply by π/180"),
        ({"rate": 250.0}, r"x: gyroscope: up to 250 rad/s, 40 revolutions a second: degrees/s\? Multiply by π/180"),
    ],
)
def test_numbers_in_other_units_are_doubted(values, message):
    (said,) = doubted(**values)
    assert re.match(message, said)


@pytest.mark.parametrize(
    "values",
    [
        {},
        {"rate": 0.0},
        {"force": np.where(np.arange(100) < 40, 0.0, 9.81)},
        {"force": 16.0, "rate": 35.0},
        {"time": 0.1},
        {"rows": 1, "time": 5.0},
    ],
)
def test_numbers_in_si_units_are_not_doubted(values):
    assert doubted(**values) == []


def test_more_than_half_a_turn_between_seldom_samples_is_rejected():
    with pytest.raises(InvalidArgumentError, match=r"time: .* less than half a rotation.*10 s with 10 rad.*1e-3"):
        doubted(time=10.0, rate=1.0)
    assert doubted(time=0.1, rate=39.0) == []  # fast, but no sign of milliseconds


def test_swapped_sensors_are_doubted():
    t, gyroscope, force = 0.01 * np.arange(100), np.full((100, 3), 0.3), np.tile([0.0, 0.0, 9.81], (100, 1))
    field = np.tile([0.0, 20.0, -45.0], (100, 1))
    for swapped, named in (((force, gyroscope, field), "gyroscope"), ((gyroscope, field, force), "accelerometer")):
        with pytest.warns(RecordingWarning, match=f"x: {named}: usually .* Check the order: time, gyroscope"):
            ImuRecording("x", t, *swapped)


@pytest.mark.parametrize("folder", ["broad", "smartphone", "tumvi"])
def test_no_recording_of_a_real_sensor_is_doubted(folder):
    files = sorted((Path(__file__).resolve().parents[1] / "../shared/data" / folder).glob("*.npz"))
    if not files:
        pytest.skip("no recordings beside the project")
    for file in files:
        with np.load(file) as content, warnings.catch_warnings():
            warnings.simplefilter("error", RecordingWarning)
            time = np.arange(len(content["gyr"])) / content["rate"]
            ImuRecording(file.stem, time, content["gyr"], content["acc"], content.get("mag"))


@pytest.mark.filterwarnings("ignore:x. time. usually 1 s:bingham.errors.RecordingWarning")
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
