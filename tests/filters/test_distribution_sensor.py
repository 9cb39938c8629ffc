"""Measurements with uncertainties of their own, against the filter of one noise and against simulated errors."""

import numpy as np
import pytest

from bingham import Bingham, BinghamFilter, Diffusion
from bingham.cli.filtering import Filtering, FilterOptions
from bingham.models import DistributionSensor
from bingham.recording import OrientationRecording
from bingham.rotations import compose, from_rotation_vector

T = np.arange(600) / 30
TRUTH = from_rotation_vector(np.stack([0.4 * np.sin(0.5 * T), 0.3 * np.sin(0.7 * T + 1), 0.5 * np.sin(0.3 * T)], 1))


def measured(deviations, rng):
    """Rotations with errors about the world's axes, deviations (N, 3), rad, and their covariances."""
    errors = np.random.default_rng(rng).normal(size=(len(T), 3)) * deviations
    return compose(from_rotation_vector(errors), TRUTH), np.einsum("ni,ij->nij", deviations**2, np.eye(3))


def error(track):
    angle = 2 * np.arccos(np.clip(np.abs(np.sum(track.modes * TRUTH, axis=1)), 0, 1))
    return np.degrees(np.sqrt(np.mean(angle**2)))


def test_equal_isotropic_covariances_are_one_noise():
    z, c = measured(np.full((len(T), 3), 0.05), 1)
    noise = Bingham.from_covariance([1.0, 0, 0, 0], c[0], frame="body")
    own = DistributionSensor.rows(Bingham.from_covariance(z, c, frame="world"))
    one = BinghamFilter(Diffusion(0.3), noise).run(Bingham.uniform(4), z, times=T)
    each = BinghamFilter(Diffusion(0.3), DistributionSensor(4)).run(Bingham.uniform(4), own, times=T)
    np.testing.assert_allclose(np.abs(np.sum(one.modes * each.modes, axis=1)), 1.0, atol=1e-12)
    np.testing.assert_allclose(one.log_evidence, each.log_evidence, atol=1e-8)


@pytest.mark.filterwarnings("ignore::bingham.errors.RecordingWarning")
def test_the_command_line_weighs_each_by_its_covariance():
    deviations = np.where(np.arange(len(T)) // 20 % 2 == 0, 0.01, 0.15)[:, None] * np.array([1.0, 1.0, 0.2])
    z, c = measured(deviations, 2)
    c[::7] = np.nan
    options = FilterOptions(0.3, 0.04, 0.999, plain=False, smooth=False)

    def tracked(covariance):
        return Filtering(options).run(OrientationRecording("pose", T, z, covariance=covariance))[1]

    assert error(tracked(c)) < 0.7 * error(tracked(None))


def test_a_row_is_checked():
    with pytest.raises(ValueError, match=r"a row \(11,\) of DistributionSensor.rows"):
        DistributionSensor(4).likelihood([1.0, 0.0, 0.0, 0.0], Bingham.uniform(4))
    with pytest.raises(ValueError, match="dim: expected 2 or 4"):
        DistributionSensor(3)
