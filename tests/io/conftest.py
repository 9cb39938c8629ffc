"""Small recordings to write and read back, and the folder of real ones."""

from pathlib import Path

import numpy as np
import pytest

from bingham.recording import ImuRecording, OrientationRecording


@pytest.fixture(scope="session")
def data():
    """Folder of the real recordings, beside the project."""
    folder = Path(__file__).resolve().parents[2] / "../shared/data"
    if not folder.is_dir():
        pytest.skip("the folder of real recordings is not here")
    return folder


def unit_quaternions(rng, size):
    q = rng.standard_normal((size, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


@pytest.fixture
def imu():
    """Irregular times, gaps in magnetometer and reference."""
    rng = np.random.default_rng(1)
    n = 40
    magnetometer = rng.standard_normal((n, 3))
    magnetometer[1::3] = np.nan
    reference = unit_quaternions(rng, n)
    reference[5:9] = np.nan
    return ImuRecording(
        "imu",
        1.7e9 + np.cumsum(rng.uniform(0.002, 0.01, n)),
        rng.standard_normal((n, 3)),
        accelerometer=6.0 * rng.standard_normal((n, 3)),
        magnetometer=magnetometer,
        reference=reference,
        score=rng.random(n) < 0.5,
    )


@pytest.fixture
def orientations():
    rng = np.random.default_rng(2)
    n = 30
    truth = unit_quaternions(rng, n)
    truth[3] = np.nan
    time = np.cumsum(rng.uniform(0.01, 0.1, n))
    return OrientationRecording("poses", time, unit_quaternions(rng, n), rng.standard_normal((n, 3)), truth)


@pytest.fixture
def same():
    """Compare two recordings field by field, bit by bit."""

    def compare(one, two, *, without=("name",)):
        assert type(one) is type(two)
        for name in one.__dataclass_fields__:
            left, right = getattr(one, name), getattr(two, name)
            if name in without:
                continue
            if name == "truth" and isinstance(left, OrientationRecording):
                compare(left, right, without=without)
            elif isinstance(left, np.ndarray):
                np.testing.assert_array_equal(left, right, err_msg=name)
            else:
                assert left == right, name

    return compare
