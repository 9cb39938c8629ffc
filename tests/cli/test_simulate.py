import numpy as np
import pytest

from bingham.io import read_recording
from bingham.recording import ImuRecording


@pytest.mark.parametrize("motion", ["tumbling", "precession"])
@pytest.mark.parametrize("suffix", ["npz", "csv"])
def test_same_seed_same_recording(bingham, tmp_path, motion, suffix):
    paths = [tmp_path / f"{name}.{suffix}" for name in "abc"]
    for path, seed in zip(paths, (1, 1, 2), strict=True):
        result = bingham("simulate", motion, "--duration", 3, "--rest", 1, "--seed", seed, "-o", path)
        assert result.exit_code == 0, result.stderr
    one, same, other = (read_recording(path) for path in paths)
    assert isinstance(one, ImuRecording)
    np.testing.assert_array_equal(one.gyroscope, same.gyroscope)
    assert np.any(one.gyroscope != other.gyroscope)


def test_options_reach_the_sensors(bingham, tmp_path):
    still = ("--duration", 20, "--rest", 9.5)
    bingham("simulate", "tumbling", *still, "--bias", 0.02, "--no-magnetometer", "-o", tmp_path / "imu.npz")
    imu = read_recording(tmp_path / "imu.npz")
    assert imu.magnetometer is None
    # 950 samples at rest with standard deviation 1.7e-4 √100 rad/s: four standard errors.
    np.testing.assert_allclose(imu.gyroscope[:950].mean(axis=0), 0.02, atol=4 * 1.7e-3 / np.sqrt(950))
    bingham("simulate", "precession", *still, "--sensor", "orientation", "--noise", 0.1, "-o", tmp_path / "q.npz")
    q = read_recording(tmp_path / "q.npz")
    error = 2 * np.arccos(np.clip(np.abs(np.sum(q.orientation * q.truth, axis=1)), 0, 1))
    # Three axes of variance 0.01 rad²; the mean square of 2001 samples scatters by √(2/3/2001).
    assert np.mean(error**2) == pytest.approx(0.03, rel=4 * np.sqrt(2 / 3 / 2001) + 0.01)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("-o", "x.txt"), "--output: expected a file ending in .npz or .csv, got x.txt"),
        (
            ("--noise", 0.7, "-o", "x.npz"),
            "--noise: expected --sensor orientation, got an inertial unit; leave the option out",
        ),
        (
            ("--sensor", "orientation", "--bias", 0.1, "-o", "x.npz"),
            "--bias: expected an inertial unit, got --sensor orientation; leave the option out",
        ),
        (("--duration", -1, "-o", "x.npz"), "--duration: expected a positive number, got -1.0"),
        (("--rate", 0, "-o", "x.npz"), "--rate: expected a positive number, got 0.0"),
        (("--drop", 2, "-o", "x.npz"), "--drop: expected 0 ≤ probability < 1, got 2.0"),
        (("--bias", "nan", "-o", "x.npz"), "--bias: expected a finite number, rad/s, got nan"),
        (
            ("--rest", 40, "-o", "x.npz"),
            "--rest: expected at least 0 and less than half of the duration, 30 s, got 40.0",
        ),
        (
            ("--duration", 1e9, "-o", "x.npz"),
            "--duration: expected at most 5,000,000 samples, 50000 s at 100 Hz, got 1000000000.0; "
            "simulate several recordings, or lower --rate",
        ),
        (
            ("--sensor", "orientation", "--noise", 3, "-o", "x.npz"),
            "--noise: expected rad, at most about 0.9: with more no orientation is the most probable, got 3.0; "
            "degrees? Multiply by π/180",
        ),
        (("--sensor", "orientation", "--noise", 0, "-o", "x.npz"), "--noise: expected a number > 0, rad, got 0.0"),
    ],
)
def test_mistakes_are_one_line(bingham, tmp_path, monkeypatch, options, message):
    monkeypatch.chdir(tmp_path)
    result = bingham("simulate", "tumbling", *options)
    assert (result.exit_code, result.stderr) == (2, f"bingham: {message}\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("duration", "rest"), [(4, 1.0), (20, 5.0), (40, 5.0)])
def test_the_rest_unless_given_suits_the_duration(bingham, tmp_path, duration, rest):
    path = tmp_path / "x.npz"
    result = bingham("simulate", "precession", "--sensor", "orientation", "--duration", duration, "-o", path)
    assert result.exit_code == 0, result.stderr
    truth = read_recording(path).truth
    still = np.sum(np.all(truth == truth[0], axis=1))
    assert still == 100 * rest + 1


def test_a_negative_seed_is_rejected(bingham, tmp_path):
    result = bingham("simulate", "tumbling", "--seed", -1, "-o", tmp_path / "x.npz")
    assert (result.exit_code, list(tmp_path.iterdir())) == (2, [])
    assert "--seed" in result.stderr
