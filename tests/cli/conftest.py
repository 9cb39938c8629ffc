from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from bingham import Bingham
from bingham.cli import first_use
from bingham.cli.main import app
from bingham.io import write_csv, write_npz
from bingham.recording import OrientationRecording
from bingham.simulate import simulate_imu, simulate_precession

DATA = Path(__file__).resolve().parents[2] / "../shared/data"


@pytest.fixture(autouse=True)
def no_word_of_compiling(monkeypatch):
    """Whether a test is the first to need a kernel is not its business."""
    monkeypatch.setattr(first_use, "NOTICE", "")


@pytest.fixture
def bingham():
    """The command line, called in this process."""
    runner = CliRunner()
    return lambda *arguments: runner.invoke(app, [str(a) for a in arguments])


@pytest.fixture
def data():
    if not DATA.is_dir():
        pytest.skip("no recordings beside the project")
    return DATA


@pytest.fixture
def imu(tmp_path):
    path = tmp_path / "imu.npz"
    write_npz(path, simulate_imu(simulate_precession(12.0, 50.0, rest_s=3.0), rng=1))
    return path


@pytest.fixture
def axes_in_plane(tmp_path):
    """A turning axis measured with noise of the concentration that 0.04 rad stands for."""
    time = np.arange(200) / 20.0
    angle = 0.3 * time
    truth = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    noise = Bingham([-0.5 / 0.04**2, 0.0], np.eye(2)[:, ::-1]).rvs(200, rng=2)
    rotated = np.stack([truth[:, 0] * noise[:, 0] - truth[:, 1] * noise[:, 1],
                       truth[:, 0] * noise[:, 1] + truth[:, 1] * noise[:, 0]], axis=1)  # fmt: skip
    path = tmp_path / "axis.csv"
    write_csv(path, OrientationRecording("axis", time, rotated, truth=truth))
    return path
