import numpy as np
import pytest

from bingham.errors import InvalidArgumentError
from bingham.rotations import from_rotation_vector
from bingham.studies import load_study
from bingham.studies.execute import run_study

STUDY = load_study("madaan2017")


def test_filtering_a_precessing_body():
    result = run_study(STUDY, runs=2, seed=3)
    # Three rotation axes with variance 4/(2·5e4): the measured error is √(3 · 4e-5) = 0.01095 rad.
    measured = result.value("precession", "measured", "rmse_rad")
    assert measured == pytest.approx(0.01095, rel=0.03)
    # Equal process and measurement noise: the Riccati equation's fixed point leaves (√5 − 1)/2 of the variance.
    expected = measured * np.sqrt((np.sqrt(5.0) - 1.0) / 2.0)
    assert result.value("precession", "bingham", "rmse_rad") == pytest.approx(expected, rel=0.03)
    assert expected < result.value("precession", "bingham_second_order", "rmse_rad") < measured
    assert 0.9 <= result.value("precession", "bingham", "coverage_95") <= 0.99


def test_a_recorded_motion_is_smoothed():
    time = np.cumsum(np.random.default_rng(0).uniform(0.005, 0.015, 1500))
    orientation = from_rotation_vector(np.stack([np.sin(0.2 * time), np.cos(0.3 * time), 0.1 * time], axis=1))
    result = run_study(STUDY, runs=1, seed=3, options={"name": "x", "time": time, "orientation": orientation})
    measured = result.value("recorded motion", "measured", "rmse_rad")
    assert result.value("recorded motion", "bingham", "rmse_rad") < 0.85 * measured


def test_axes_are_refused():
    with pytest.raises(InvalidArgumentError, match="recording: expected quaternions"):
        run_study(
            STUDY, runs=1, options={"name": "x", "time": np.arange(3.0), "orientation": np.tile([1.0, 0.0], (3, 1))}
        )
