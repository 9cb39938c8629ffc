"""bingham track GYROSCOPE CAMERA --fuse."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp
from typer.testing import CliRunner

from bingham.cli.main import app
from bingham.io import read_track, write_tum

BIAS = np.array([0.02, -0.02, 0.02])


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A gyroscope with a bias, an accelerometer and a mounted camera with outliers, in two formats."""
    folder = tmp_path_factory.mktemp("fusion")
    rng = np.random.default_rng(4)
    t = np.arange(4000) / 100.0
    rate = 1.2 * np.sin(2.0 * np.pi * np.outer(t, [0.11, 0.27, 0.4]) + [0.0, 1.0, 2.0])
    q = [Rotation.identity()]
    for step in Rotation.from_rotvec(rate[1:] / 100.0):
        q.append(q[-1] * step)
    truth = Rotation.concatenate(q)
    force = truth.inv().apply([0.0, 0.0, 9.81]) + 0.05 * rng.standard_normal((4000, 3))
    rows = np.column_stack([t, rate + BIAS + 2e-3 * rng.standard_normal((4000, 3)), force])
    np.savetxt(folder / "imu.csv", rows, delimiter=",", header="t,gx,gy,gz,ax,ay,az", comments="", fmt="%.8f")
    np.savetxt(folder / "gyro.csv", rows[:, :4], delimiter=",", header="t,gx,gy,gz", comments="", fmt="%.8f")
    times = np.sort(rng.uniform(0.05, 39.9, 80))
    seen = Rotation.from_rotvec(0.01 * rng.standard_normal((80, 3))) * Slerp(t, truth)(times)
    wrong = np.arange(80) % 10 == 7
    seen = np.where(wrong[:, None], Rotation.random(80, random_state=3).as_quat(), seen.as_quat())
    turned = Rotation.from_quat(seen) * Rotation.from_rotvec([0.2, 1.0, -0.4])
    for name, quaternions in (("camera.tum", seen), ("mounted.txt", turned.as_quat())):
        write_tum(folder / name, time=times, orientation=np.roll(quaternions, 1, axis=1))
    np.save(folder / "truth.npy", truth.as_quat(scalar_first=True))
    return folder


def run(*arguments: object) -> tuple[dict[str, object], str]:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout), result.stderr


@pytest.mark.parametrize(
    ("first", "second", "options"),
    [
        ("gyro.csv", "camera.tum", ()),
        ("camera.tum", "imu.csv", ()),
        ("gyro.csv", "mounted.txt", ("--align", "mounting")),
        ("imu.csv", "mounted.txt", ("--align", "both", "--smooth")),
    ],
)
def test_two_files_make_one_track(files: Path, tmp_path: Path, first: str, second: str, options: tuple[str]) -> None:
    row, _ = run("track", files / first, files / second, "--fuse", *options, "--json", "--no-figure", "-o", tmp_path)
    told = row["orientations"]
    assert (told["count"], told["rejected"]) == (80, 8)
    assert 0.4 < told["noise_deg"] < 0.8
    bias, std = (np.radians(list(row[name].values())) for name in ("bias_deg_s", "bias_std_deg_s"))
    assert np.all(np.abs(bias - BIAS) < 3.0 * std)
    name = "imu" if "imu.csv" in (first, second) else "gyro"
    track = read_track(tmp_path / f"{name}.track.npz")
    truth = np.load(files / "truth.npy")[-len(track["time"]) :]
    e = Rotation.from_quat(track["modes"], scalar_first=True) * Rotation.from_quat(truth, scalar_first=True).inv()
    late = e[track["time"] > 20.0]
    assert np.degrees(np.sqrt(np.mean(late.magnitude() ** 2))) < (1.0 if options else 0.5)


def test_a_camera_that_is_rotated_is_named(files: Path, tmp_path: Path) -> None:
    row, said = run(
        "track", files / "imu.csv", files / "mounted.txt", "--fuse", "--json", "--no-figure", "-o", tmp_path
    )
    assert row["orientations"]["rejected"] > 30
    assert "camera and sensor are rotated by 6" in said  # 62.8°, as built
    assert "--align mounting" in said


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("gyro.csv", "--fuse"), "--fuse: expected two recordings"),
        (("gyro.csv", "imu.csv", "--fuse"), "--fuse: expected one recording of orientations, got two inertial ones"),
        (("camera.tum", "mounted.txt", "--fuse"), "--fuse: expected one inertial recording"),
        (("gyro.csv", "camera.tum", "--fuse", "--align", "world"), "--align mounting"),
        (("gyro.csv", "camera.tum", "--align", "world"), "--align: expected --fuse"),
        (("gyro.csv", "camera.tum", "--fuse", "--gate", "0.9"), "--gate: expected no --fuse"),
    ],
)
def test_mistakes(files: Path, tmp_path: Path, arguments: tuple[str, ...], text: str) -> None:
    given = [str(files / a) if "." in a and not a.startswith("0") else a for a in arguments]
    result = CliRunner().invoke(app, ["track", *given, "-o", str(tmp_path / "o")])
    assert result.exit_code == 2
    assert text in " ".join(result.stderr.split())
    assert not (tmp_path / "o").exists()


def test_drift_since_the_start_without_a_magnetometer(files: Path, tmp_path: Path) -> None:
    fields = "quaternion,relative_heading"
    row, _ = run("track", files / "imu.csv", "--fields", fields, "--json", "--no-figure", "-o", tmp_path)
    assert 0.0 < row["relative_heading_std_deg"] < 30.0 < row["final_deviation_deg"]["heading"]
    lines = (tmp_path / "imu.track.csv").read_text().splitlines()
    header = next(line for line in lines if not line.startswith("#"))
    assert header.endswith("relative_heading_deg,relative_heading_std_deg")
    assert float(lines[-1].split(",")[-1]) == pytest.approx(row["relative_heading_std_deg"], rel=1e-3)


def test_the_report_shows_what_was_rejected_and_warned_of(files: Path, tmp_path: Path) -> None:
    row, _ = run(
        "track", files / "gyro.csv", files / "camera.tum", "--fuse", "--report", "--json", "--no-figure", "-o", tmp_path
    )
    page = (tmp_path / "gyro.html").read_text(encoding="utf-8")
    found = re.search(r'id="content">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    content = json.loads(found[1])
    assert content["warnings"] == row["warnings"]
    assert any("no orientation before" in text for text in content["warnings"])
    assert len(content["rejected"]) == row["orientations"]["rejected"] == 8
    camera = np.loadtxt(files / "camera.tum")[7::10, 0]
    np.testing.assert_allclose(np.array(content["rejected"]) + content["start"], camera, atol=0.011)
