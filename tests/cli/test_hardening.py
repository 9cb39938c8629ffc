"""Closed and full streams, disks and folders that do not take anything: one line that names the right thing."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time

import pytest

from bingham.cli.ending import SIGNALS, Terminated, ending_in_order
from bingham.studies.study import Chunk
from bingham.studies.workers import in_processes
from permissions import RESTRICTED, with_permissions

BINGHAM = [sys.executable, "-m", "bingham"]
STREAM = "".join(f"gyr {k / 50} 0 0 0.1\nacc {k / 50} 0 0 9.81\n" for k in range(200)).encode()
FULL = "/dev/full"
full = pytest.mark.skipif(not os.path.exists(FULL), reason="no device that is always full here")


def shell(command, **more):
    return subprocess.run(["sh", "-c", command, "sh", *BINGHAM], capture_output=True, check=False, **more)


@full
@pytest.mark.parametrize("arguments", ["formats", "--help", "track --help", "doctor"])
def test_a_full_standard_output(arguments):
    done = shell(f'"$@" {arguments} > {FULL}')
    assert done.returncode == 2
    assert done.stderr.decode().splitlines() == [
        "bingham: standard output: No space left on device; check the disk or the pipe behind it"
    ]


@full
def test_a_full_standard_output_of_a_stream_saves_the_state(tmp_path):
    done = shell(f'"$@" track - --state {tmp_path}/s > {FULL}', input=STREAM)
    assert done.returncode == 2
    assert b"standard output: No space left" in done.stderr
    assert (tmp_path / "s").exists()


def test_a_closed_standard_output():
    done = shell('"$@" formats >&-')
    assert done.returncode == 2
    assert done.stderr.startswith(b"bingham: standard output: closed")


def test_a_closed_standard_input():
    done = shell('"$@" track - <&-')
    assert done.returncode == 2
    assert done.stderr.splitlines() == [b"bingham: standard input: cannot be read: closed; pipe samples into it"]


@pytest.mark.parametrize("how", ["2>&-", pytest.param(f"2> {FULL}", marks=full)])
def test_a_standard_error_that_takes_nothing_changes_nothing(how):
    done = shell(f'"$@" track - {how}', input=STREAM + b"what?\n")
    assert done.returncode == 0
    assert len(done.stdout.splitlines()) == 400


def test_a_reader_that_has_seen_enough():
    done = shell('{ "$@" formats; echo "exit $?" >&2; } | true')
    assert done.stderr.splitlines() in ([b"exit 0"], [])


def test_an_ascii_terminal(imu, tmp_path):
    more = {"env": os.environ | {"PYTHONIOENCODING": "ascii"}, "capture_output": True, "check": True}
    printed = subprocess.run([*BINGHAM, "track", imu, "-v", "--no-figure", "-o", tmp_path], **more).stdout
    assert b"us/sample" in printed and b"heading +/-" in printed


def test_names_that_would_move_the_cursor_are_shown_as_escapes(bingham, imu, tmp_path):
    path = tmp_path / "a\x1b[2J[bold]b.npz"
    shutil.copy(imu, path)
    result = bingham("track", path, "--no-figure", "-o", tmp_path / "out")
    assert result.exit_code == 0
    assert "\x1b" not in result.stdout and "a\\x1b[2J[bold]b" in result.stdout


def small_disk(folder):
    folder.mkdir()
    if (
        not shutil.which("mount")
        or subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", folder], capture_output=True, check=False
        ).returncode
    ):
        pytest.skip("mounting a small disk is not allowed here")


@pytest.mark.parametrize("command", ["track", "track --bag", "simulate", "stream", "cluster"])
def test_a_full_disk_keeps_the_old_and_names_the_place(imu, tmp_path, command):
    disk = tmp_path / "disk"
    small_disk(disk)
    try:
        (disk / "old").write_text("old")
        fill = os.open(disk / "fill", os.O_CREAT | os.O_WRONLY)
        with pytest.raises(OSError, match="space"):
            while True:
                os.write(fill, bytes(512))
        os.close(fill)
        before = {path.name: path.read_bytes() for path in disk.iterdir()}
        if command == "stream":
            done = subprocess.run([*BINGHAM, "track", "-", "--state", disk / "old"], input=STREAM, capture_output=True,
                                  check=False)  # fmt: skip
            assert done.returncode == 2
            assert {path.name: path.read_bytes() for path in disk.iterdir()} == before
            return
        axes = tmp_path / "axes.csv"
        axes.write_text("n,e,d\n" + "0,0,1\n0,0.6,0.8\n0.6,0,0.8\n" * 9)
        arguments = {
            "track": ["track", imu, "--no-figure", "-o", disk],
            "track --bag": ["track", imu, "--no-figure", "--bag", "-o", disk],
            "simulate": ["simulate", "tumbling", "-o", disk / "old.npz"],
            "cluster": ["cluster", axes, "--components", "1", "-o", disk],
        }[command]
        done = subprocess.run([*BINGHAM, *arguments], capture_output=True, text=True, check=False)
        assert done.returncode == 2
        line = [line for line in done.stderr.splitlines() if "compiling" not in line][-1]
        if command != "track --bag":  # no bag: refused before
            assert line.startswith(f"bingham: {disk}") and "No space left on device" in line
        assert {path.name: path.read_bytes() for path in disk.iterdir()} == before
    finally:
        subprocess.run(["umount", disk], check=False)


@pytest.mark.parametrize("name", ["loop", "n" * 300, "file/x"])
def test_inputs_and_outputs_that_cannot_be(bingham, imu, tmp_path, name):
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "file").write_text("")
    for arguments in ((imu, "-o", tmp_path / name), (tmp_path / name, "-o", tmp_path / "out")):
        result = bingham("track", *arguments, "--no-figure")
        assert result.exit_code == 2
        (line,) = result.stderr.splitlines()
        assert line.startswith(f"bingham: {tmp_path}")
        assert "unexpected" not in line


def wait_and_tell(folder):
    (folder / f"{os.getpid()}").write_text("")
    time.sleep(120)
    return {}


def test_workers_end_with_the_process_that_started_them(tmp_path):
    """Killed outright, it can tell them nothing: they look."""
    code = (
        "import sys; sys.path[:0] = [sys.argv[2]]\nfrom pathlib import Path\nfrom test_hardening import *\n"
        "list(in_processes([Chunk(str(k), wait_and_tell, {'folder': Path(sys.argv[1])}) for k in range(2)], 2))"
    )
    here = os.path.dirname(__file__)
    paths = [here, os.path.dirname(here), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    with subprocess.Popen([sys.executable, "-c", code, str(tmp_path), here], env=environment) as process:
        end = time.monotonic() + 60
        while len(list(tmp_path.iterdir())) < 2 and time.monotonic() < end:
            time.sleep(0.05)
        workers = [int(path.name) for path in tmp_path.iterdir()]
        assert len(workers) == 2
        process.kill()
    end = time.monotonic() + 10
    while any(map(_alive, workers)) and time.monotonic() < end:
        time.sleep(0.05)
    assert not any(map(_alive, workers))


def _alive(process):
    try:
        with open(f"/proc/{process}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


__all__ = ["Chunk", "in_processes", "wait_and_tell"]


@pytest.fixture
def locked(tmp_path):
    """A folder that cannot be searched, with a file in it."""
    folder = tmp_path / "locked"
    folder.mkdir()
    (folder / "x.csv").write_text("t,gx,gy,gz\n")
    folder.chmod(0)
    yield folder
    folder.chmod(0o755)


@with_permissions
@pytest.mark.parametrize(
    ("command", "place"),
    [
        ("track IMU --no-figure -o LOCKED", "LOCKED"),
        ("track LOCKED/x.csv -o OUT", "LOCKED/x.csv"),
        ("calibrate IMU -o LOCKED/x/m.json", "LOCKED/x/m.json"),
        ("fit LOCKED/x.csv", "LOCKED/x.csv"),
        ("track - --state LOCKED/s", "LOCKED/s"),
    ],
)
def test_a_folder_that_cannot_be_searched_is_named(imu, tmp_path, locked, command, place):
    names = {"IMU": imu, "LOCKED": locked, "OUT": tmp_path / "out"}
    for name, path in names.items():
        command, place = command.replace(name, str(path)), place.replace(name, str(path))
    more = {"input": b"acc 0 0 0 9.81\n", "capture_output": True, "check": False}
    done = subprocess.run([*RESTRICTED, *BINGHAM, *command.split()], **more)
    lines = [line for line in done.stderr.decode().splitlines() if "compiling" not in line]
    assert done.returncode == 2
    assert len(lines) == 1
    assert lines[0].startswith(f"bingham: {place}") and "Permission denied; " in lines[0]
    assert not (tmp_path / "out").exists()


@with_permissions
def test_a_home_that_cannot_be_written_changes_nothing(imu, tmp_path):
    home = tmp_path / "home"
    home.mkdir(mode=0o555)
    environment = os.environ | {"HOME": str(home)}
    for name in ("XDG_CACHE_HOME", "XDG_CONFIG_HOME", "BINGHAM_CACHE"):
        environment.pop(name, None)
    command = [*RESTRICTED, *BINGHAM, "track", imu, "--no-figure", "-o", tmp_path / "out"]
    done = subprocess.run(command, capture_output=True, check=False, env=environment)
    assert done.returncode == 0
    assert [line for line in done.stderr.decode().splitlines() if "compiling" not in line] == []
    assert len(list((tmp_path / "out").iterdir())) == 2


@pytest.mark.parametrize("twice", [False, True], ids=["", "and in what sees to that"])
@pytest.mark.parametrize(("number", "raised"), [(signal.SIGTERM, Terminated), (signal.SIGINT, KeyboardInterrupt)])
def test_a_signal_that_lands_in_a_destructor_is_not_lost(number, raised, twice, monkeypatch):
    if twice:
        start = threading.Thread.start
        monkeypatch.setattr(threading.Thread, "start", lambda self: (start(self), signal.raise_signal(number)))

    class Signalled:
        def __del__(self):
            signal.raise_signal(number)
            time.sleep(0.001)

    before = {each: signal.signal(each, signal.default_int_handler) for each in SIGNALS}
    try:
        with pytest.raises(raised), ending_in_order():
            for _ in range(1000):
                Signalled()
                time.sleep(0.01)
                Signalled.__del__ = lambda self: None  # that one was dropped
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
