"""Hard and soft iron from a recording that turns."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham import InvalidArgumentError
from bingham.filters.imu_calibration import MagnetometerCalibration, calibrate_magnetometer
from bingham.recording import amended
from bingham.simulate import simulate_imu, simulate_tumbling

OFFSET = np.array([12.0, -7.0, 4.0])
IRON = np.array([[1.1, 0.03, 0.0], [0.03, 0.95, -0.02], [0.0, -0.02, 1.0]])


@pytest.fixture(scope="module")
def right():
    return simulate_imu(simulate_tumbling(90.0, 50.0, rng=5), rng=6)


def test_hard_and_soft_iron_are_found_and_taken_away(right):
    bent = amended(right, magnetometer=right.magnetometer @ IRON.T + OFFSET)
    found = MagnetometerCalibration.from_json(calibrate_magnetometer(bent).to_json())
    np.testing.assert_allclose(found.offset, OFFSET, atol=0.3)
    expected = np.linalg.inv(IRON)
    np.testing.assert_allclose(found.matrix / np.cbrt(np.linalg.det(found.matrix)),
                               expected / np.cbrt(np.linalg.det(expected)), atol=0.02)  # fmt: skip
    raw, clean = (np.linalg.norm(m, axis=1) for m in (bent.magnetometer, found.apply(bent.magnetometer)))
    assert np.std(clean) / np.mean(clean) < 0.03 < np.std(raw) / np.mean(raw)


def test_a_body_that_turns_about_one_axis_is_not_enough(right):
    angle = np.linspace(0.0, 40.0, right.size)
    field = np.stack([20.0 * np.cos(angle), 20.0 * np.sin(angle), np.full(right.size, -40.0)], axis=1)
    field += 0.1 * np.random.default_rng(0).standard_normal(field.shape)
    with pytest.raises(InvalidArgumentError, match="turn the sensor slowly"):
        calibrate_magnetometer(amended(right, magnetometer=field))
    with pytest.raises(InvalidArgumentError, match="at least 50 magnetometer samples, got 0"):
        calibrate_magnetometer(amended(right, magnetometer=None))


def test_outliers_do_not_count(right):
    rng = np.random.default_rng(3)
    field = right.magnetometer + OFFSET
    rows = rng.choice(right.size, right.size // 100, replace=False)
    field[rows] += 200.0 * rng.standard_normal((len(rows), 3))
    found = calibrate_magnetometer(amended(right, magnetometer=field))
    np.testing.assert_allclose(found.offset, OFFSET, atol=0.3)


def test_what_shows_no_offset_is_rejected(right):
    rng = np.random.default_rng(4)
    t = right.time
    sway = np.column_stack([np.sin(0.7 * t), np.sin(1.1 * t + 1.0), np.sin(0.9 * t + 2.0)])

    def seen(degrees):
        body = Rotation.from_rotvec(np.radians(degrees) * sway).inv().apply([0.0, 20.0, -40.0])
        return body + OFFSET + 0.3 * rng.standard_normal(sway.shape)

    found = calibrate_magnetometer(amended(right, magnetometer=seen(60.0)))
    np.testing.assert_allclose(found.offset, OFFSET, atol=0.5)
    turning = right.magnetometer + OFFSET
    for field, text in (
        (seen(20.0), "too little motion"),
        (OFFSET + 0.5 * rng.standard_normal(sway.shape), "constant strength"),
        (right.magnetometer * (1.0 + 0.3 * np.sin(0.5 * t))[:, None], "constant strength"),
        (np.minimum(turning, np.quantile(turning, 0.8)), "the end of its range"),
    ):
        with pytest.raises(InvalidArgumentError, match=text):
            calibrate_magnetometer(amended(right, magnetometer=field))


def test_the_command_writes_what_track_takes(right, bingham, tmp_path):
    np.savez(tmp_path / "bent.npz", t=right.time, gyr=right.gyroscope, acc=right.accelerometer,
             mag=right.magnetometer @ IRON.T + OFFSET)  # fmt: skip
    result = bingham("calibrate", tmp_path / "bent.npz", "-o", tmp_path / "m.json")
    assert result.exit_code == 0, result.stderr
    result = bingham("track", tmp_path / "bent.npz", "--calibration", tmp_path / "m.json", "-o", tmp_path / "o",
                     "--no-figure")  # fmt: skip
    assert result.exit_code == 0, result.stderr
    (tmp_path / "m.json").write_text("{}")
    result = bingham("track", tmp_path / "bent.npz", "--calibration", tmp_path / "m.json", "-o", tmp_path / "p")
    assert result.exit_code == 2
