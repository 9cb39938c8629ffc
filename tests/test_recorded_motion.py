"""The inertial filter on recorded fast rotation with an optical reference: accuracy on real motion in a clean clone."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bingham import ImuFilter
from bingham.io import read_recording
from bingham.metrics import broad_rmse

EXCERPT = Path(__file__).parent / "data" / "broad_06_excerpt.npz"


@pytest.fixture(scope="module")
def recording():
    return read_recording(EXCERPT)


def rmse_deg(track, recording):
    return np.degrees(broad_rmse(track.modes, recording.reference, recording.scored))


def test_errors_online_and_smoothed(recording):
    """VQF 2.1 has 3.62° in total here, nearly all of it the field's declination, and 0.71° of inclination."""
    online, smoothed = ImuFilter().run(recording), ImuFilter().smooth(recording)
    for track in (online, smoothed):
        total, _, inclination = rmse_deg(track, recording)
        assert total < 4.0 and inclination < 0.71


def test_a_gyroscope_of_the_wrong_sign_is_far_off(recording):
    wrong = replace(recording, gyroscope=-recording.gyroscope)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert rmse_deg(ImuFilter().run(wrong), recording)[0] > 20.0
