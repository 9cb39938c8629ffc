"""Mean orientation of a map whose points' errors are linked to their neighbours'."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham import InvalidArgumentError
from bingham.inference import mean_rotation

SIDE = 16
GRID = np.stack(np.meshgrid(np.arange(SIDE), np.arange(SIDE)), axis=-1).reshape(-1, 2) * 0.2


def scan(rng, reach):
    """Return orientations of a square map about the identity: errors of 0.3°, equal within `reach` points."""
    blocks = -(-SIDE // reach)
    error = rng.normal(size=(blocks, blocks, 3)).repeat(reach, axis=0).repeat(reach, axis=1)[:SIDE, :SIDE]
    error = 0.8 * error + 0.6 * rng.normal(size=(SIDE, SIDE, 3))
    return Rotation.from_rotvec(np.radians(0.3) * error.reshape(-1, 3)).as_quat(scalar_first=True)


def squares(reach, position, runs=60):
    """Return Σ δᵀ C⁻¹ δ/3 over repeated scans, δ the deviation of the mean from the truth and C its covariance."""
    rng = np.random.default_rng(1)
    out = []
    for _ in range(runs):
        found = mean_rotation(scan(rng, reach), robust=False, position=position)
        delta = Rotation.from_quat(found.mean, scalar_first=True).as_rotvec()
        out.append(delta @ np.linalg.solve(found.covariance(frame="body"), delta) / 3)
    return np.mean(out)


def test_linked_points_say_how_little_they_know():
    assert 0.6 < squares(4, GRID) < 2.2
    assert squares(4, None) > 6  # the control: points taken for independent


def test_independent_points_lose_little():
    assert 0.45 < squares(1, GRID, 40) < 1.3


def test_positions_do_not_depend_on_unit_or_order():
    rng = np.random.default_rng(2)
    q = scan(rng, 4)
    mixed = rng.permutation(len(q))
    a, b = mean_rotation(q, position=GRID), mean_rotation(q[mixed], position=1e3 * GRID[mixed])
    np.testing.assert_allclose(a.body_covariance, b.body_covariance, rtol=1e-5)


@pytest.mark.parametrize("position", [GRID[:5], np.full((SIDE * SIDE, 2), np.nan), np.arange(SIDE * SIDE)])
def test_bad_positions_are_named(position):
    with pytest.raises(InvalidArgumentError, match="position: expected finite coordinates, one row for each of 256"):
        mean_rotation(scan(np.random.default_rng(0), 1), position=position)
