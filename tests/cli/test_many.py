"""Many recordings: what is done stays done, what is bad is named, and killed runs end as if they had not been."""

import csv
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from bingham.io import write_npz
from bingham.simulate import simulate_imu, simulate_precession

GIVEN = ("--no-figure",)


@pytest.fixture
def recordings(tmp_path):
    folder = tmp_path / "in"
    (folder / "b").mkdir(parents=True)
    for k, name in enumerate(("one.npz", "two.npz", "b/one.npz", "three.npz")):
        write_npz(folder / name, simulate_imu(simulate_precession(5.0, 50.0, rest_s=2.0), rng=k))
    return folder


def content(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def summary(folder):
    with (folder / "summary.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_folder_is_all_in_it_and_a_bad_file_is_named_at_the_end(bingham, recordings, tmp_path, jobs):
    (recordings / "bad.csv").write_text("t,gx,gy,gz\n0,1,2,x\n")
    (recordings / "notes.txt").write_text("nothing\n")
    out = tmp_path / "out"
    result = bingham("track", recordings, *GIVEN, "--json", "--jobs", jobs, "-o", out)
    assert result.exit_code == 1
    rows = json.loads(result.stdout)
    assert [row["recording"] for row in rows] == ["b-one", "in-one", "three", "two"]
    assert all(row["us_per_sample"] > 0 for row in rows)
    said = result.stderr.splitlines()
    assert said[0] == "bingham: 1 of 5 recordings could not be tracked:"
    assert said[1].startswith(f"bingham: {recordings / 'bad.csv'}: line 2")
    lines = summary(out)
    assert [line["recording"] for line in lines] == ["b-one", "bad", "in-one", "three", "two"]
    assert [line["status"] == "done" for line in lines] == [True, False, True, True, True]
    assert float(lines[0]["median_deviation_deg.inclination"]) > 0


def test_patterns_and_a_pattern_without_a_file(bingham, recordings, tmp_path):
    result = bingham("track", recordings / "*o*.npz", *GIVEN, "--json", "-o", tmp_path / "out")
    assert [row["recording"] for row in json.loads(result.stdout)] == ["one", "two"]
    result = bingham("track", recordings / "*.bag", *GIVEN, "-o", tmp_path / "none")
    assert result.exit_code == 2
    assert "no file has such a name" in result.stderr


def test_what_is_done_is_passed_over_unless_it_has_changed(bingham, recordings, tmp_path):
    out = tmp_path / "out"
    given = ("track", recordings, *GIVEN, "--json", "-o", out)
    bingham(*given)
    before, stamps = content(out), {path.name: path.stat().st_mtime_ns for path in out.iterdir()}

    def again(*more):
        rows = json.loads(bingham(*given, *more).stdout)
        return {row["recording"] for row in rows if not row.get("unchanged")}

    assert again() == set()
    assert content(out) == before
    assert {path.name: path.stat().st_mtime_ns for path in out.glob("*.track.*")} == {
        name: stamp for name, stamp in stamps.items() if ".track." in name
    }
    write_npz(recordings / "two.npz", simulate_imu(simulate_precession(5.0, 50.0, rest_s=2.0), rng=9))
    assert again() == {"two"}
    (out / "three.track.csv").unlink()
    assert again() == {"three"}
    assert again("--fields", "euler") == {"in-one", "b-one", "two", "three"}
    assert again("--fresh", "--fields", "euler") == {"in-one", "b-one", "two", "three"}


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_killed_and_started_again_it_writes_the_same_bytes(recordings, tmp_path, jobs):
    command = [sys.executable, "-m", "bingham", "track", str(recordings), *GIVEN, "--jobs", jobs, "-o"]
    subprocess.run([*command, tmp_path / "whole"], check=True, capture_output=True)
    out = tmp_path / "killed"
    with subprocess.Popen([*command, out], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        end = time.monotonic() + 60
        while not list(out.glob("*.track.csv")) and time.monotonic() < end:
            time.sleep(0.01)
        os.kill(process.pid, signal.SIGKILL)
    done = len(list(out.glob("*.track.npz")))
    assert done >= 1
    time.sleep(2.0 if jobs == "2" else 0.0)  # workers see that they are alone
    subprocess.run([*command, out], check=True, capture_output=True)
    assert content(out) == content(tmp_path / "whole")


def test_an_interruption_says_how_many_are_done(bingham, recordings, tmp_path, monkeypatch):
    from bingham.cli import tracking

    original = tracking._track

    def until_three(path, *rest):
        if path.name == "three.npz":
            raise KeyboardInterrupt
        return original(path, *rest)

    monkeypatch.setattr(tracking, "_track", until_three)
    result = bingham("track", recordings, *GIVEN, "-o", tmp_path / "out")
    assert result.exit_code == 130
    assert "interrupted; 2 of 4 recordings are done; the same command continues from there" in result.stderr
    assert not list((tmp_path / "out").glob(".bingham-*"))
    monkeypatch.undo()
    rows = json.loads(bingham("track", recordings, *GIVEN, "--json", "-o", tmp_path / "out").stdout)
    assert [row.get("unchanged", False) for row in rows] == [True, True, False, False]


def test_pieces_say_what_the_whole_says(bingham, recordings, tmp_path, monkeypatch):
    from bingham.cli import filtering

    given = ("track", recordings / "one.npz", *GIVEN, "--json", "--fields", "quaternion,covariance,bias,evidence,rest")
    one = json.loads(bingham(*given, "-o", tmp_path / "one").stdout)
    monkeypatch.setattr(filtering, "PIECE", 37)
    other = json.loads(bingham(*given, "-o", tmp_path / "other").stdout)
    assert content(tmp_path / "one")["one.track.csv"] == content(tmp_path / "other")["one.track.csv"]
    for name in one.keys() - {"wall_s", "us_per_sample", "files"}:
        assert one[name] == pytest.approx(other[name], rel=1e-12) if isinstance(one[name], float) else True, name
    with np.load(tmp_path / "one" / "one.track.npz") as a, np.load(tmp_path / "other" / "one.track.npz") as b:
        for name in set(a.files) - {"magnetometer_code", "magnetometer_statistic"}:  # those wait at a piece's end
            np.testing.assert_array_equal(a[name], b[name], err_msg=name)


def test_what_telephones_write_beside_their_sensors_is_no_recording(tmp_path, bingham):
    walk = tmp_path / "walk"
    (walk / "meta").mkdir(parents=True)
    made = simulate_imu(simulate_precession(5.0, 50.0, rest_s=2.0), rng=0)
    for name, values in (("Gyroscope", made.gyroscope), ("Accelerometer", made.accelerometer)):
        unit = {"Gyroscope": "rad/s", "Accelerometer": "m/s^2"}[name]
        header = ",".join(['"Time (s)"', *(f'"{name} {axis} ({unit})"' for axis in "xyz")])
        rows = np.column_stack([made.time, values])
        np.savetxt(walk / f"{name}.csv", rows, delimiter=",", header=header, comments="")
    (walk / "meta" / "device.csv").write_text('"property","value"\n"deviceModel","one"\n')
    (walk / "Annotation.csv").write_text("time,seconds_elapsed,text,millisecond_press_duration\n")
    done = bingham("track", walk, "--json", *GIVEN, "-o", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["samples"] == len(made.time)
    (tmp_path / "alone").mkdir()
    (tmp_path / "alone" / "metadata.csv").write_text("a,b\n")
    assert bingham("track", tmp_path / "alone", *GIVEN, "-o", tmp_path / "out").exit_code != 0
