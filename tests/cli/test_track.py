import json
import re
import warnings
from dataclasses import replace

import numpy as np
import pytest

from bingham import Bingham, BinghamFilter, Gate
from bingham.cli import tracking
from bingham.filters.imu import ImuFilter, ImuState
from bingham.io import read_csv, read_recording, read_track, read_tum, write_npz
from bingham.models.diffusion import Diffusion
from bingham.models.sensors import OrientationSensor
from bingham.simulate import simulate_imu, simulate_tumbling

KEYS = {"recording", "samples", "duration_s", "wall_s", "us_per_sample", "error_deg"}


def test_json_is_one_object_for_one_recording(bingham, imu, tmp_path):
    result = bingham("track", imu, "--json", "-o", tmp_path / "out")
    assert (result.exit_code, result.stderr) == (0, "")
    row = json.loads(result.stdout)
    assert row.keys() >= KEYS
    assert (row["recording"], row["samples"]) == ("imu", 601)
    assert row["duration_s"] == pytest.approx(12.0, abs=1e-9)
    assert row["error_deg"].keys() == {"total_rmse", "heading_rmse", "inclination_rmse"}
    assert 0 < row["error_deg"]["total_rmse"] < 2
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"imu.track.csv", "imu.track.npz", "imu.png"}


def test_several_recordings_give_a_list_and_planar_axes_are_smoothed(bingham, imu, axes_in_plane, tmp_path):
    result = bingham("track", imu, axes_in_plane, "--json", "--no-figure", "-o", tmp_path / "out")
    rows = json.loads(result.stdout)
    assert [row["recording"] for row in rows] == ["imu", "axis"]
    assert rows[1]["error_deg"].keys() == {"total_rmse"}
    assert rows[1]["error_deg"]["total_rmse"] < 0.9 * rows[1]["measured_error_deg"]["total_rmse"]


def test_files_hold_what_the_filter_said(bingham, axes_in_plane, imu, tmp_path):
    bingham("track", imu, "--plain", "--no-figure", "--tum", "--frame", "world", "--fields", "quaternion,covariance",
            "-o", tmp_path)  # fmt: skip
    header = [line for line in (tmp_path / "imu.track.csv").read_text().splitlines()[:6] if line.startswith("#")]
    assert any("rad^2, frame: world" in line for line in header)
    track = read_track(tmp_path / "imu.track.npz")
    assert str(track["covariance_frame"]) == "world"
    last = Bingham.from_spectrum(track["state_z"], track["state_M"])
    np.testing.assert_array_equal(last.mode, track["modes"][-1])
    np.testing.assert_allclose(last.covariance(frame="world"), track["covariance"][-1], rtol=1e-12, atol=1e-16)
    np.testing.assert_allclose(last.matrix, track["matrices"][-1], rtol=1e-12, atol=1e-9)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        listed = read_csv(tmp_path / "imu.track.csv")
    moved = read_tum(tmp_path / "imu.tum.txt")
    for orientation in (listed.orientation, moved.orientation):
        np.testing.assert_allclose(np.sum(orientation * track["modes"], axis=1), 1, rtol=1e-14)


def test_the_inertial_filter_goes_on_from_the_state_in_the_file(bingham, imu, tmp_path):
    bingham("track", imu, "--no-figure", "-o", tmp_path)
    file = read_track(tmp_path / "imu.track.npz")
    recording = read_recording(imu)
    later = replace(recording, time=recording.time + recording.time[-1] + 0.02)
    onwards = ImuFilter().run(later, state=ImuState.from_json(file["state"]))
    unbroken = ImuFilter().run(later, state=ImuFilter().run(recording).final)
    np.testing.assert_array_equal(onwards.modes, unbroken.modes)
    assert np.isfinite(onwards.modes).all()


def test_the_filter_is_named_and_can_be_the_plain_one(bingham, imu, tmp_path):
    names = []
    for options in ((), ("--plain",)):
        result = bingham("track", imu, *options, "--json", "--no-figure", "-o", tmp_path)
        names.append(json.loads(result.stdout)["filter"])
    assert names == ["imu", "inertial, plain"]


def test_a_camera_is_improved_on_with_the_defaults(bingham, data, tmp_path):
    rows = json.loads(
        bingham("track", *sorted((data / "handeye").glob("*.npz")), "--json", "--no-figure", "-o", tmp_path).stdout
    )
    assert len(rows) == 2
    for row in rows:
        assert row["error_deg"]["total_rmse"] < 0.92 * row["measured_error_deg"]["total_rmse"], row["recording"]


def test_options_reach_the_filter(bingham, data, tmp_path):
    path = data / "handeye" / "robot_arm.npz"
    options = ("--process-noise", 0.05, "--measurement-noise", 0.005, "--gate", 0.99)
    row = json.loads(bingham("track", path, "--json", "--no-figure", *options, "-o", tmp_path).stdout)
    noise = Bingham.from_covariance([1.0, 0, 0, 0], 0.005**2 * np.eye(3), frame="body")
    recording = read_recording(path)
    track = BinghamFilter(Diffusion(0.05), OrientationSensor(noise), gate=Gate(0.99)).run(
        Bingham.uniform(4), recording.orientation, times=recording.time
    )
    assert row["log_evidence"] == pytest.approx(track.total_log_evidence, rel=1e-12)
    assert row["rejected"] == np.sum(~track.accepted) > 0


def test_summary_for_people(bingham, imu, tmp_path):
    result = bingham("track", imu, "--no-figure", "-o", tmp_path / "out")
    heading, line, details = result.stdout.splitlines()[:3]
    names = "recording samples duration rate gaps rejected heading ± inclination ± total heading inclination"
    assert heading.split() == names.split()
    assert line.split()[:7] == ["imu", "601", "12.0", "s", "50", "Hz", "none"]
    assert details.startswith("imu: gyroscope, accelerometer, magnetometer; gyroscope bias ")
    assert "µs/sample" in bingham("track", imu, "--no-figure", "-v", "-o", tmp_path / "out").stdout


@pytest.mark.parametrize(("reported", "doubted"), [(0.1, False), (0.03, True)])
def test_many_rejected_orientations_put_the_noise_in_doubt(bingham, tmp_path, reported, doubted):
    """Noise of 0.1 rad: reported as a third of that, a gate of 99.9 % rejects much more than 10 %."""
    noise = Bingham.from_covariance([1.0, 0, 0, 0], 0.1**2 * np.eye(3), frame="body")
    rows = np.column_stack([0.01 * np.arange(400), noise.rvs(400, rng=1)])
    path = tmp_path / "still.csv"
    np.savetxt(path, rows, delimiter=",", header="t,qw,qx,qy,qz", comments="", fmt="%.17g")
    result = bingham("track", path, "--no-figure", "--measurement-noise", reported, "-o", tmp_path / "out")
    assert result.exit_code == 0, result.stderr
    assert ("Over 10 % rejected: still. Larger --measurement-noise" in result.stdout) == doubted


def test_without_magnetometer_the_heading_of_the_truth_is_turned_to_suit(bingham, data, tmp_path):
    row = json.loads(bingham("track", data / "tumvi" / "room4.npz", "--json", "--no-figure", "-o", tmp_path).stdout)
    assert "heading_offset_rad" in row
    assert row["error_deg"]["inclination_rmse"] < 2


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("", "the file is empty"),
        ("t,qw,qx,qy\n0,1,0,0\n", "line 1"),
        ("t,qw,qx,qy,qz\n0,1,0,0,0\n1,nan,0,0,0\n", "line 3, columns qw qx qy qz"),
        ("t,qw,qx,qy,qz\n0,1,0,0,0\n1,2,0,0,0\n", "line 3, columns qw qx qy qz"),
        ("t,qw,qx,qy,qz\n1,1,0,0,0\n0,1,0,0,0\n", "line 3, column t"),
        ("t,gx,gy,gz\n0,0,0,0\n0,0,0,0\n", "line 3, column t"),
        (
            "t,a,b\n0,1,2\n",
            "line 1: neither gx gy gz nor qw qx qy qz; name the columns so, or each by --column gx=NAME; the file",
        ),
        (
            "t,gx,gy,gz\n1700000000000000000,0,0,0\n1700000000005000000,0,0,0\n",
            "line 2, column t: expected seconds, got 1.7e+18; are these nanoseconds? State the unit: --unit time=ns",
        ),
        (
            "s,gx,gy,gz\n0,1,2,3\n",
            "line 1: names no column t; add the time in seconds, name it in --column t=NAME",
        ),
    ],
)
def test_a_malformed_recording_ends_in_one_line_and_no_output(bingham, imu, tmp_path, text, place):
    bad = tmp_path / "bad.csv"
    bad.write_text(text)
    before = sorted(tmp_path.iterdir())
    for others in ((), (imu, "--fail-fast")):
        result = bingham("track", bad, *others, "--no-figure", "-o", tmp_path / "new" / "out")
        assert result.exit_code == 2
        assert result.stdout == ""
        (line,) = result.stderr.splitlines()
        assert line.startswith(f"bingham: {bad}: {place}")
        assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--gate", 0), "--gate: expected a probability in (0, 1], got 0.0; 1 switches the gate off"),
        (("--measurement-noise", 0), "--measurement-noise: expected a number > 0, got 0.0"),
        (("--process-noise", "nan"), "--process-noise: expected a number > 0, got nan"),
        (("--column", "gx"), "--column: expected NAME=VALUE, got 'gx'"),
        (("--topic", "imu=/a"), "--topic imu=TOPIC: expected a format that has such"),
        (("--topic", "a=/a"), "--topic: expected imu=TOPIC, gyroscope=TOPIC"),
        (("--format", "mp3"), "--format: expected one of broad, euroc"),
        (("--measurement-noise", 9), "--measurement-noise: expected a recording of orientations, got inertial ones"),
        (("--smooth", "--plain"), "--smooth: expected the filter with bias, got --plain; leave one of the two out"),
    ],
)
def test_a_wrong_option_is_one_line(bingham, imu, tmp_path, options, message):
    result = bingham("track", imu, *options, "-o", tmp_path / "out")
    assert result.exit_code == 2
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"bingham: {message}")
    assert not (tmp_path / "out").exists()


def test_noise_that_leaves_no_mode_is_named_by_its_option(bingham, tmp_path):
    path = tmp_path / "still.csv"
    path.write_text("t,qw,qx,qy,qz\n0,1,0,0,0\n1,1,0,0,0\n")
    result = bingham("track", path, "--measurement-noise", 2.3, "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert result.stderr.startswith("bingham: --measurement-noise: expected rad, at most about 0.9")
    assert result.stderr.endswith("got 2.3; degrees? Multiply by π/180\n")


def test_tum_of_axes_in_the_plane_is_rejected(bingham, imu, axes_in_plane, tmp_path):
    result = bingham("track", axes_in_plane, "--tum", "--no-figure", "-o", tmp_path / "out")
    assert result.exit_code == 2
    message = f"--tum: expected orientations in space, got {axes_in_plane}, axes in the plane; leave --tum out"
    assert result.stderr == f"bingham: {message}\n"
    assert not (tmp_path / "out").exists()


def test_options_without_effect_on_any_recording_are_rejected(bingham, imu, axes_in_plane, tmp_path):
    given = ("--plain", "--gate", 0.99, "--no-figure", "-o", tmp_path / "out")
    result = bingham("track", axes_in_plane, *given)
    assert result.exit_code == 2
    assert result.stderr.startswith("bingham: --plain: expected an inertial recording, got orientations alone")
    assert not (tmp_path / "out").exists()
    assert bingham("track", axes_in_plane, imu, *given).exit_code == 0


def test_two_recordings_of_one_name_get_their_folders_before_it(bingham, imu, tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "walk.npz").write_bytes(imu.read_bytes())
    given = (tmp_path / "a" / "walk.npz", tmp_path / "b" / "walk.npz", tmp_path / "a" / ".." / "a" / "walk.npz")
    result = bingham("track", *given, "--no-figure", "--json", "-o", tmp_path / "out")
    assert result.exit_code == 0, result.stderr
    assert [row["recording"] for row in json.loads(result.stdout)] == ["a-walk", "b-walk"]


@pytest.mark.parametrize("place", ["", "mav0", "mav0/imu0", "mav0/imu0/data.csv"])
def test_files_of_a_sequence_are_named_after_it(bingham, tmp_path, place):
    columns = ["#timestamp [ns]", *(f"{s}_RS_S_{a}" for s in "wa" for a in "xyz")]
    rows = [f"{10**18 + 5_000_000 * k},0.01,0,0,0,0,9.81" for k in range(20)]
    for name in ("V1_01", "V1_02"):
        folder = tmp_path / name / "mav0" / "imu0"
        folder.mkdir(parents=True)
        (folder / "data.csv").write_text("\n".join([",".join(columns), *rows, ""]))
    result = bingham("track", tmp_path / "V1_01" / place, tmp_path / "V1_02" / place, "--no-figure", "-o",
                     tmp_path / "out")  # fmt: skip
    assert result.exit_code == 0, result.stderr
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == {f"V1_0{k}.track.{kind}" for k in (1, 2) for kind in ("csv", "npz")} | {"summary.csv"}


def test_a_file_in_the_place_of_the_folder_is_rejected(bingham, imu, tmp_path):
    result = bingham("track", imu, "-o", imu)
    assert result.exit_code == 2
    assert "a file, where a folder is to be written" in result.stderr


def test_interruption_leaves_nothing_and_exits_with_130(bingham, imu, tmp_path, monkeypatch):
    def interrupted(path, name, folder, *_):
        (folder / "half").write_text("")
        raise KeyboardInterrupt

    monkeypatch.setattr(tracking, "_track", interrupted)
    before = sorted(tmp_path.iterdir())
    result = bingham("track", imu, "-o", tmp_path / "out")
    assert result.exit_code == 130
    assert result.stderr == "bingham: interrupted; nothing written\n"
    assert sorted(tmp_path.iterdir()) == before


def test_a_warning_is_one_line_and_the_track_is_written(bingham, imu, tmp_path):
    rounded = tmp_path / "rounded.csv"
    rounded.write_text("t,qw,qx,qy,qz\n0,0.7071,0.7071,0,0\n1,0.7071,0.7071,0,0\n")
    result = bingham("track", rounded, "--no-figure", "-o", tmp_path / "out")
    assert result.exit_code == 0
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"bingham: warning: {rounded}: rows normalised")


@pytest.fixture
def tumbling():
    return simulate_imu(simulate_tumbling(20.0, 50.0, rng=0, rest_s=3.0), rng=1)


@pytest.mark.parametrize("smooth", [(), ("--smooth",)])
def test_a_late_accelerometer_begins_the_track_late(bingham, tumbling, tmp_path, smooth):
    force = np.array(tumbling.accelerometer)
    force[:100] = np.nan
    write_npz(tmp_path / "late.npz", replace(tumbling, accelerometer=force))
    result = bingham("track", tmp_path / "late.npz", *smooth, "--tum", "--json", "-o", tmp_path / "out")
    assert result.exit_code == 0, result.stderr
    assert "late: no orientation before the first accelerometer sample: 100 samples, 2 s, left out" in result.stderr
    track = read_track(tmp_path / "out" / "late.track.npz")
    np.testing.assert_array_equal(track["time"], tumbling.time[100:])
    assert np.isfinite(track["modes"]).all() and np.isfinite(track["covariance"]).all()
    assert json.loads(result.stdout)["error_deg"]["inclination_rmse"] < 3


def test_without_an_accelerometer_only_the_plain_filter_runs(bingham, tumbling, tmp_path):
    write_npz(tmp_path / "gyro.npz", replace(tumbling, accelerometer=None, magnetometer=None))
    np.savez(tmp_path / "typo.npz", t=tumbling.time, gyr=tumbling.gyroscope, accel=tumbling.accelerometer)
    given = ("--no-figure", "-o", tmp_path / "out")
    for name in ("gyro", "typo"):
        result = bingham("track", tmp_path / f"{name}.npz", *given, "--json")
        assert result.exit_code == 0, result.stderr
        assert json.loads(result.stdout)["filter"] == "inertial, plain"
        assert f"warning: {name}: no accelerometer: rotations are followed from a start that nothing" in result.stderr
        assert ("typo.npz: unknown fields left out: accel; known: " in result.stderr) == (name == "typo")
        smoothed = bingham("track", tmp_path / f"{name}.npz", *given, "--smooth")
        assert smoothed.exit_code == 2
        assert f"expected at least one accelerometer sample, got {name} without one; gravity shows" in smoothed.stderr
    write_npz(tmp_path / "empty.npz", replace(tumbling, accelerometer=np.full((tumbling.size, 3), np.nan)))
    assert "got empty without one" in bingham("track", tmp_path / "empty.npz", *given).stderr
    result = bingham("track", tmp_path / "gyro.npz", "--plain", *given)
    assert result.exit_code == 0
    assert "warning: gyro: no accelerometer: rotations are followed from a start that nothing shows" in result.stderr


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_magnetometer_mostly_rejected_is_doubted(bingham, tumbling, tmp_path, sign):
    """Mirrored, its field rotates the wrong way."""
    write_npz(tmp_path / "m.npz", replace(tumbling, magnetometer=np.array(tumbling.magnetometer) * [1.0, 1.0, sign]))
    result = bingham("track", tmp_path / "m.npz", "--no-figure", "-o", tmp_path / "out")
    assert result.exit_code == 0
    said = re.search(r"m: (\d+) % of the magnetometer's samples rejected: .*units, axes and handedness", result.stderr)
    assert (said is not None) == (sign < 0)


def test_report_and_figure_format(bingham, imu, axes_in_plane, tmp_path):
    result = bingham("track", imu, "-o", tmp_path, "--report", "--figure-format", "svg", "--no-csv")
    assert result.exit_code == 0, result.stderr
    page = (tmp_path / "imu.html").read_text(encoding="utf-8")
    assert "gyroscope bias" in page and '"total rmse"' in page
    assert (tmp_path / "imu.svg").read_text(encoding="utf-8").startswith("<?xml")
    assert not (tmp_path / "imu.png").exists()
    plane = bingham("track", axes_in_plane, "-o", tmp_path / "plane", "--report")
    assert plane.exit_code == 2 and "--report" in plane.stderr
