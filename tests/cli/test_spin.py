import json

import numpy as np
import pytest
from scipy.stats import chi2
from typer.testing import CliRunner

from bingham.cli.main import app
from bingham.rotations import compose, from_rotation_vector

AXIS = np.array([0.6, 0.64, 0.48])
RATE = 6.0 * np.pi * AXIS


def recording(path, seed, rows=200, noise=0.03):
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.005, 0.05, rows))
    truth = compose(from_rotation_vector(t[:, None] * RATE), [0.5, 0.5, 0.5, 0.5])
    q = compose(truth, from_rotation_vector(noise * rng.standard_normal((rows, 3))))
    np.savetxt(path, np.column_stack([t, q]), fmt="%.12f", delimiter=",", header="time,qw,qx,qy,qz", comments="")
    return path


def test_track_spin_prints_axis_rate_and_covariance(tmp_path):
    covered = []
    for seed in range(20):
        path = recording(tmp_path / "top.csv", seed)
        result = CliRunner().invoke(app, ["track", str(path), "--spin", "--json"])
        assert result.exit_code == 0, result.output
        spin = json.loads(result.stdout)["spin"]
        assert np.degrees(np.arccos(min(1.0, AXIS @ spin["axis"]))) < 1.0
        assert spin["revolutions_per_s"] == pytest.approx(3.0, rel=0.005)
        error = RATE - spin["rate_rad_s"]
        covered.append(error @ np.linalg.solve(spin["covariance_rad2_s2"], error) < chi2.ppf(0.95, 3))
    assert np.mean(covered) >= 0.85


def test_track_spin_writes_a_table_and_a_figure(tmp_path):
    path = recording(tmp_path / "top.csv", 1)
    result = CliRunner().invoke(app, ["track", str(path), "--spin", "-o", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    assert "revolutions a second" in result.stdout
    table = np.genfromtxt(tmp_path / "out" / "top.spin.csv", delimiter=",", names=True)
    assert len(table) == 200
    assert table["wz_rad_s"][-1] == pytest.approx(RATE[2], rel=0.02)
    assert (tmp_path / "out" / "top.spin.png").stat().st_size > 1000


def test_other_options_are_named(tmp_path):
    path = recording(tmp_path / "top.csv", 1)
    result = CliRunner().invoke(app, ["track", str(path), "--spin", "--smooth"])
    assert result.exit_code != 0
