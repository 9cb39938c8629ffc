import io
import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from bingham import ImuFilter
from bingham.cli.stream import SAVE_EVERY_S, Follower, follow
from bingham.cli.stream_input import LONGEST_LINE, lines_of
from bingham.filters import ImuState, ImuStream
from bingham.io import read_recording

COMMAND = [sys.executable, "-m", "bingham", "track", "-"]


@pytest.fixture
def recording(imu):
    return read_recording(imu)


@pytest.fixture
def lines(recording):
    rows = []
    sensors = zip(recording.time, recording.gyroscope, recording.accelerometer, recording.magnetometer, strict=True)
    for t, *vectors in sensors:
        for name, v in zip(("gyr", "acc", "mag"), vectors, strict=True):
            rows.append(f"{name} {float(t)!r} {float(v[0])!r} {float(v[1])!r} {float(v[2])!r}")
    return rows


def run(lines, *, stream=None, state=None):
    """Answers, complaints and the follower of lines of text or bytes."""
    out, stderr = io.BytesIO(), io.StringIO()
    follower = Follower(ImuStream() if stream is None else stream, state, stderr)
    follow(follower, [[line if isinstance(line, bytes) else line.encode() for line in lines]], out)
    return [json.loads(line) for line in out.getvalue().splitlines()], stderr.getvalue().splitlines(), follower


def test_every_sample_is_answered_and_what_makes_no_sense_is_skipped_and_counted(lines, recording):
    wrong = [
        "gyr 1 2 3",
        "baro 0 1 2 3",
        "acc now 0 0 0",
        "gyr -5 0 0 0",
        "mag 0.3 nan 0 0",
        "gyr 17000000000000 0 0 0",
    ]
    wrong += ["gyr 0.2 1_000 0 0", "gyr 0.2 \u0661 0 0", b"acc 0.2 \xff 0 0", "gyr 0.2 1e160 0 0", "gyr inf 0 0 0"]
    answers, said, follower = run([*lines[:30], "# comment", "", *wrong, *lines[30:]])
    assert (follower.used, follower.skipped) == (len(lines), len(wrong))
    assert not any("skipped: line" in line for line in said)
    assert [line.split(" skipped")[0] for line in said] == [f"bingham: line {n}" for n in range(33, 33 + len(wrong))]
    assert answers[0]["orientation"] is None
    assert answers[0]["time"] == 0.0
    track = ImuFilter().run(recording)
    np.testing.assert_allclose(answers[-1]["orientation"], track.modes[-1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(answers[-1]["heading_std_deg"], np.rad2deg(track.heading_std[-1]), rtol=1e-12)


def test_a_killed_stream_goes_on_from_its_saved_state(lines, tmp_path):
    whole, _, _ = run(lines)
    state = tmp_path / "imu.state"

    def killed():
        yield [line.encode() for line in lines[:900]]
        raise RuntimeError("killed")

    out = io.BytesIO()
    with pytest.raises(RuntimeError):
        follow(Follower(ImuStream(), state, io.StringIO()), killed(), out)
    first = [json.loads(line) for line in out.getvalue().splitlines()]
    second, _, _ = run(lines[900:], stream=ImuStream(state=ImuState.from_json(state.read_text())), state=state)
    assert first + second == whole


@pytest.mark.parametrize("glitch", [4.0, 60.0, 1e9])
def test_a_line_from_the_future_blocks_its_sensor_for_seconds_at_most(lines, glitch):
    at = float(lines[900].split()[1])
    extra = f"gyr {at + glitch!r} 0 0 0"
    _, said, follower = run([*lines[:900], extra, *lines[900:]])
    assert follower.skipped == (1 if glitch > 10 else sum(x.startswith("gyr") and float(x.split()[1]) <= at + glitch
                                                           for x in lines[900:]))  # fmt: skip
    assert "taken as a gap if the sensor's next line agrees" in said[0] or glitch < 10


def test_a_real_gap_and_a_clock_set_back_are_followed(lines):
    shifted = [f"{x.split()[0]} {float(x.split()[1]) + 3600!r} {' '.join(x.split()[2:])}" for x in lines]
    answers, _, follower = run([*lines[:900], *shifted[900:]])
    assert follower.skipped == 3  # one line of each sensor at most
    assert answers[-1]["time"] > 3600
    answers, said, follower = run([*shifted[:900], *lines[900:]])
    assert answers[-1]["time"] < 20
    assert follower.skipped <= 30
    assert sum("the clock was set back by 3" in line for line in said) == 1


def test_an_endless_line_is_not_kept():
    source = (b"x" * 60_000 for _ in range(100))
    (batch,) = lines_of(source)
    assert len(batch[0]) == LONGEST_LINE + 1
    assert list(lines_of([b"a\nb", b"c\n", b"d"])) == [[b"a"], [b"bc"], [b"d"]]


def test_the_command_reads_standard_input(lines, tmp_path):
    state = tmp_path / "imu.state"
    text = "\n".join([*lines[:90], "what?"]).encode() + b"\ngyr 1\xff 2 3 4\n"
    done = subprocess.run([*COMMAND, "--state", state], input=text, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 90
    assert b"90 samples used, 2 lines skipped" in done.stderr
    assert state.exists()


DAMAGE = {
    "{}": None,
    "deep": "[" * 100_000,
    "infinite": lambda s: s["covariance"][0].__setitem__(0, 1e999),
    "nan": lambda s: s["covariance"][0].__setitem__(0, float("nan")),
    "bigint": lambda s: s["covariance"][0].__setitem__(0, 10**400),
    "huge": lambda s: s["last"].__setitem__(0, 1e18),
    "negative": lambda s: s["covariance"][3].__setitem__(3, -1.0),
    "indefinite": lambda s: (s["covariance"][0].__setitem__(1, 9.0), s["covariance"][1].__setitem__(0, 9.0)),
    "asymmetric": lambda s: s["covariance"][0].__setitem__(1, 0.01),
    "text": lambda s: s["last"].__setitem__(0, "now"),
    "short": lambda s: s["covariance"].pop(),
    "large": " " * (2 << 20),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_state_that_makes_no_sense_is_rejected_with_a_hint_and_left_alone(bingham, lines, tmp_path, damage):
    state = tmp_path / "imu.state"
    run(lines[:300], state=state)
    content = json.loads(state.read_text())
    change = DAMAGE[damage]
    if callable(change):
        change(content)
        state.write_text(json.dumps(content))
    else:
        state.write_text(change or "{}")
    before = state.read_bytes()
    result = bingham("track", "-", "--state", state)
    assert (result.exit_code, result.stdout) == (2, "")
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"bingham: {state}: ")
    assert line.endswith("; give another --state, or remove the file to start anew")
    assert state.read_bytes() == before


def test_a_state_that_cannot_be_written_is_said_at_once(bingham, tmp_path):
    result = bingham("track", "-", "--state", tmp_path / "absent" / "s")
    assert result.exit_code == 2
    assert "its folder does not exist" in result.stderr


def test_a_linked_state_stays_a_link(lines, tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "real")
    run(lines[:90], state=tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert ImuState.from_json((tmp_path / "real").read_text()).started


@pytest.mark.parametrize("numbers", [(signal.SIGTERM,) * 2, (signal.SIGINT, signal.SIGTERM), (signal.SIGTERM,) * 5])
def test_signals_save_and_end_cleanly(lines, tmp_path, numbers):
    state = tmp_path / "imu.state"
    with subprocess.Popen([*COMMAND, "--state", state], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE) as process:  # fmt: skip
        process.stdin.write("\n".join(lines[:300]).encode() + b"\n")
        process.stdin.flush()
        for _ in range(300):
            answer = process.stdout.readline()
        for number in numbers:
            process.send_signal(number)
        assert process.wait(timeout=20) == 0
        assert b"300 samples used, 0 lines skipped" in process.stderr.read()
    saved = ImuState.from_json(state.read_text())
    assert np.nanmax(saved.last) == json.loads(answer)["time"]
    _, _, follower = run(lines[300:], stream=ImuStream(state=saved))
    assert follower.skipped == 0


def test_a_state_holds_what_was_answered_wherever_a_signal_comes(lines, tmp_path):
    """The last sample that a state claims is the last one that was applied: going on equals not having stopped."""
    whole, _, _ = run(lines)
    state = tmp_path / "imu.state"
    for pause in (0.0, 0.002, 0.01, 0.03):
        state.unlink(missing_ok=True)
        with subprocess.Popen([*COMMAND, "--state", state], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL, bufsize=0) as process:  # fmt: skip
            process.stdin.write("\n".join(lines[:300]).encode() + b"\n")
            process.stdin.flush()
            first = [json.loads(process.stdout.readline())]
            process.stdin.write("\n".join(lines[300:]).encode() + b"\n")
            process.stdin.flush()
            time.sleep(pause)
            process.send_signal(signal.SIGTERM)
            rest, _ = process.communicate(timeout=30)
        first += [json.loads(line) for line in rest.splitlines()]
        assert first == whole[: len(first)]
        second, _, _ = run(lines[len(first) :], stream=ImuStream(state=ImuState.from_json(state.read_text())))
        assert first + second == whole


def test_a_closed_reader_ends_it_as_head_expects(lines, tmp_path):
    text = "\n".join(lines).encode()
    with subprocess.Popen(COMMAND, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdin.write(text[:2000])
        process.stdin.flush()
        process.stdout.readline()
        process.stdout.close()
        try:
            process.stdin.write(text[2000:])
            process.stdin.close()
        except BrokenPipeError:
            pass
        process.stdin = None
        assert process.wait(timeout=20) == 0
        assert b"Traceback" not in process.stderr.read()


def test_saving_is_seldom(lines, tmp_path, monkeypatch):
    saves = []
    monkeypatch.setattr(Follower, "save", lambda self: saves.append(self.used))
    follower = Follower(ImuStream(), tmp_path / "s", io.StringIO())
    follow(follower, [[line.encode()] for line in lines], io.BytesIO())
    assert SAVE_EVERY_S == 1.0
    assert saves[0] == 1 and saves[-1] == len(lines)
    assert len(saves) < 30


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
