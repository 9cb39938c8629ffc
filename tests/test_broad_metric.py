import importlib.util
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham.errors import InvalidArgumentError
from bingham.metrics import broad_errors, broad_rmse, heading_offset

DATA = Path(__file__).resolve().parents[1] / "../shared/data"


def rotation(*angles_deg):
    return Rotation.from_euler("ZXY", angles_deg, degrees=True).as_quat(scalar_first=True)


def test_a_turn_about_the_vertical_is_heading_and_the_rest_inclination():
    reference = Rotation.random(50, rng=1)
    tilt = Rotation.from_rotvec([np.radians(3) * np.array([0.6, 0.8, 0.0])])
    turn = Rotation.from_rotvec([[0.0, 0.0, np.radians(-7)]])
    estimate = (turn * tilt * reference).as_quat(scalar_first=True)
    total, heading, inclination = np.degrees(broad_errors(-estimate, reference.as_quat(scalar_first=True)))
    np.testing.assert_allclose(heading, 7, rtol=1e-12)
    np.testing.assert_allclose(inclination, 3, rtol=1e-12)
    half = np.radians([7, 3]) / 2
    np.testing.assert_allclose(np.cos(np.radians(total) / 2), np.cos(half).prod(), rtol=1e-14)


def test_agrees_with_the_definition_beside_the_recordings():
    if not (DATA / "broad_metric.py").is_file():
        pytest.skip("no recordings beside the project")
    spec = importlib.util.spec_from_file_location("broad_metric", DATA / "broad_metric.py")
    definition = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(definition)
    rng = np.random.default_rng(2)
    estimate = Rotation.random(500, rng=rng).as_quat(scalar_first=True)
    reference = Rotation.random(500, rng=rng).as_quat(scalar_first=True)
    reference[40:60] = np.nan
    score = rng.random(500) < 0.7
    expected = definition.broad_rmse(estimate, reference, score)
    np.testing.assert_allclose(np.degrees(broad_rmse(estimate, reference, score)), expected, rtol=1e-12)


def test_offset_of_the_heading_is_found_under_noise_and_with_gaps():
    rng = np.random.default_rng(3)
    reference = Rotation.random(2000, rng=rng)
    noise = Rotation.from_rotvec(rng.normal(scale=0.02, size=(2000, 3)))
    known = reference.as_quat(scalar_first=True)
    known[::7] = np.nan
    for offset in (-3.0, -0.4, 0.0, 1.5, 3.1):
        rotated = Rotation.from_rotvec([0, 0, offset]) * noise * reference
        found = heading_offset(rotated.as_quat(scalar_first=True), known)
        # The mean of 1714 angles of 0.02 rad: four standard errors.
        assert abs(np.angle(np.exp(1j * (found - offset)))) < 4 * 0.02 / np.sqrt(1714)


def test_nothing_to_count_is_rejected():
    q = rotation(1, 2, 3)[None]
    with pytest.raises(InvalidArgumentError, match="score: expected at least one sample"):
        broad_rmse(q, q, [False])
    with pytest.raises(InvalidArgumentError, match="reference"):
        heading_offset(q, np.full((1, 4), np.nan))


def test_rows_that_do_not_belong_together_are_rejected():
    q = np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))
    with pytest.raises(InvalidArgumentError, match="reference: expected a shape that broadcasts"):
        broad_rmse(q, q[:2])
    with pytest.raises(InvalidArgumentError, match=r"score: expected one for each sample, shape \(3,\), got \(2,\)"):
        broad_rmse(q, q, [True, True])
