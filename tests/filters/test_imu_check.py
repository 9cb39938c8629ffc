"""Axes, signs and units found from the recording alone."""

import numpy as np
import pytest

from bingham import check_recording
from bingham.recording import amended
from bingham.simulate import simulate_imu, simulate_tumbling


@pytest.fixture(scope="module")
def right():
    return simulate_imu(simulate_tumbling(40.0, 100.0, rng=3, rest_s=3.0), rng=4)


def test_nothing_is_said_of_a_right_recording_or_of_one_that_rests(right):
    assert check_recording(right) == []
    assert check_recording(amended(right, gyroscope=-right.gyroscope))  # the control
    n = 250
    resting = amended(
        right,
        time=right.time[:n],
        gyroscope=right.gyroscope[:n],
        accelerometer=right.accelerometer[:n],
        magnetometer=right.magnetometer[:n],
        reference=None,
        score=None,
    )
    assert check_recording(resting) == []


@pytest.mark.parametrize(
    ("change", "name", "slope"),
    [
        (lambda g: -g, "sign", -1.0),
        (lambda g: np.degrees(g), "unit", np.pi / 180.0),
        (lambda g: np.radians(g), "unit", 180.0 / np.pi),
        (lambda g: g[:, [1, 0, 2]], "axes", None),
        (lambda g: g * [1.0, 1.0, -1.0], "axes", None),
        (lambda g: 1.5 * g, "scale", 1.0 / 1.5),
    ],
)
def test_what_is_wrong_is_named(right, change, name, slope):
    findings = check_recording(amended(right, gyroscope=change(right.gyroscope)))
    assert findings[0].name == name
    if slope is not None:
        assert findings[0].slope == pytest.approx(slope, rel=0.1)
    assert "accelerometer" in findings[0].message


def test_a_magnetometer_of_other_axes_is_found_beside_a_right_accelerometer(right):
    field = np.array(right.magnetometer)[:, [1, 2, 0]]
    (finding,) = check_recording(amended(right, magnetometer=field))
    assert finding.name == "magnetometer axes"
