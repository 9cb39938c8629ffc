import io
import json

import numpy as np
import pytest

from bingham import ImuFilter
from bingham.cli.stream import follow
from bingham.filters import ImuState, ImuStream
from bingham.io import read_recording


@pytest.fixture
def recording(imu):
    return read_recording(imu)


@pytest.fixture
def lines(recording):
    rows = []
    for t, g, a, m in zip(
        recording.time, recording.gyroscope, recording.accelerometer, recording.magnetometer, strict=True
    ):
        for name, v in (("gyr", g), ("acc", a), ("mag", m)):
            rows.append(f"{name} {t!r} {v[0]!r} {v[1]!r} {v[2]!r}".replace("np.float64(", "").replace(")", ""))
    return rows


def test_every_sample_is_answered_and_garbage_is_skipped_and_counted(bingham, lines, recording, tmp_path):
    garbage = ["gyr 1 2 3", "baro 0 1 2 3", "acc now 0 0 0", "gyr -5 0 0 0", "mag 1e9 nan 0 0"]
    garbage.append("gyr 17000000000000 0 0 0")
    mixed = [*lines[:30], "# comment", "", *garbage, *lines[30:]]
    out, complaints = io.StringIO(), io.StringIO()
    answered, skipped = follow(ImuStream(), mixed, out, complaints, None)
    assert (answered, skipped) == (len(lines), len(garbage))
    reported = complaints.getvalue().splitlines()
    assert [line.split(" skipped")[0] for line in reported] == [f"bingham: line {n}" for n in range(33, 39)]
    answers = [json.loads(line) for line in out.getvalue().splitlines()]
    assert answers[0]["orientation"] is None
    assert answers[0]["time"] == 0.0
    track = ImuFilter().run(recording)
    np.testing.assert_allclose(answers[-1]["orientation"], track.modes[-1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(answers[-1]["heading_std_deg"], np.rad2deg(track.heading_std[-1]), rtol=1e-12)


def test_a_killed_stream_goes_on_from_its_saved_state(lines, tmp_path):
    whole = io.StringIO()
    follow(ImuStream(), lines, whole, io.StringIO(), None)
    state = tmp_path / "imu.state"

    def killed():
        yield from lines[:900]
        raise RuntimeError("killed")

    first = io.StringIO()
    with pytest.raises(RuntimeError):
        follow(ImuStream(), killed(), first, io.StringIO(), state)
    second = io.StringIO()
    follow(ImuStream(state=ImuState.from_json(state.read_text())), lines[900:], second, io.StringIO(), state)
    assert first.getvalue() + second.getvalue() == whole.getvalue()


def test_the_command_reads_standard_input(lines, tmp_path):
    from typer.testing import CliRunner

    from bingham.cli.main import app

    state = tmp_path / "imu.state"
    result = CliRunner().invoke(app, ["track", "-", "--state", str(state)], input="\n".join([*lines[:90], "what?"]))
    assert result.exit_code == 0, result.stderr
    assert len(result.stdout.splitlines()) == 90
    assert "90 samples used, 1 line skipped" in result.stderr
    assert state.exists()
    state.write_text("{}")
    result = CliRunner().invoke(app, ["track", "-", "--state", str(state)], input="")
    assert result.exit_code == 2
    problem = "not a state that this version saved, or damaged; remove the file to start anew"
    assert result.stderr == f"bingham: {state}: {problem}\n"


@pytest.mark.parametrize(
    ("options", "option"), [(("-o", "out"), "--output"), (("--smooth",), "--smooth"), (("--gate", "0.9"), "--gate")]
)
def test_a_stream_takes_no_options_of_files(bingham, tmp_path, options, option):
    result = bingham("track", "-", *options, "--state", tmp_path / "s")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith(f"bingham: {option}: expected recordings in files, got - (standard input")
    assert list(tmp_path.iterdir()) == []


def test_smoothing_from_the_command_line(bingham, imu, axes_in_plane, tmp_path):
    rows = {}
    for option in ([], ["--smooth"]):
        result = bingham("track", imu, axes_in_plane, *option, "--json", "--no-figure", "-o", tmp_path / "out")
        assert result.exit_code == 0, result.stderr
        rows[bool(option)] = json.loads(result.stdout)
    assert [row["filter"] for row in rows[True]] == ["imu, smoothed", "first-order, smoothed"]
    # The inertial recording is short and clean: what is left is the gyroscope's assumed delay, which stays.
    plain, smoothed = ([row["error_deg"]["total_rmse"] for row in rows[kind]] for kind in (False, True))
    assert smoothed[0] < 0.5
    assert smoothed[1] < 0.9 * plain[1]


def test_tune_prints_what_it_found(bingham, imu, tmp_path):
    result = bingham("tune", imu, "--json", "-o", tmp_path / "noise")
    assert result.exit_code == 0, result.stderr
    row = json.loads(result.stdout)
    assert row["magnetometer"] == pytest.approx(0.5, rel=0.15)
    assert row["accelerometer"] == pytest.approx(2e-3, rel=0.15)
    assert [path.name for path in (tmp_path / "noise").iterdir()] == ["imu.tune.png"]
    printed = bingham("tune", imu).stdout
    assert f"accelerometer_noise_density={row['accelerometer']:.4g}" in printed
    for sensor in row["doubts"]:
        assert row["doubts"][sensor] in printed
