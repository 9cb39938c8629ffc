"""Old or new, never neither: whatever is raised or signalled, before or after whichever rename."""

import itertools
import os
import signal
import subprocess
import sys
import time

import pytest

from bingham import atomic
from bingham.atomic import deferred_signals, replaced, staged, sweep
from bingham.errors import RecordingError

RENAMES = ("rename", "replace", "link")


def put(path, text, *, folder):
    if folder:
        path.mkdir()
        (path / "content").write_text(text)
    else:
        path.write_text(text)


def content(path):
    if not path.exists():
        return None
    return (path / "content").read_text() if path.is_dir() else path.read_text()


def write_one(root, folder):
    with replaced(root / "thing", folder=folder) as path:
        put(path, "new", folder=folder)


def write_set(root, folder):
    with staged(root) as path:
        for name in ("a", "thing", "z"):
            put(path / name, "new", folder=folder)


class Injection:
    """Raises or signals before or after the n-th rename."""

    def __init__(self, monkeypatch, number, when, what):
        self.left, self.hit = number, False
        for name in RENAMES:
            monkeypatch.setattr(os, name, self.wrapped(getattr(os, name), when, what))
        if when == "before" or isinstance(what, int):  # an exchange that is done raises nothing but a signal
            monkeypatch.setattr(atomic, "_exchanged", self.wrapped(atomic._exchanged, when, what))

    def wrapped(self, call, when, what):
        def wrapper(*args, **options):
            self.left -= 1
            now = self.left == 0
            if now and when == "before":
                self.strike(what)
            result = call(*args, **options)
            if now and when == "after":
                self.strike(what)
            return result

        return wrapper

    def strike(self, what):
        self.hit = True
        if isinstance(what, int):
            os.kill(os.getpid(), what)
        else:
            raise what


def end(number, _):
    raise SystemExit(128 + number)


@pytest.mark.parametrize("exchange", [True, False])
@pytest.mark.parametrize("old", [True, False])
@pytest.mark.parametrize("folder", [False, True])
@pytest.mark.parametrize("write", [write_one, write_set])
@pytest.mark.parametrize("what", [signal.SIGINT, signal.SIGTERM, KeyboardInterrupt(), OSError(28, "full")], ids=repr)
def test_old_or_new_at_every_rename(tmp_path, monkeypatch, write, folder, old, exchange, what):
    if not exchange:
        monkeypatch.setattr(atomic, "_exchanged", lambda *_: False)
    before = signal.signal(signal.SIGTERM, end)
    names = ("thing",) if write is write_one else ("a", "thing", "z")
    struck = 0
    try:
        for when, number in itertools.product(("before", "after"), range(1, 9)):
            root = tmp_path / f"{when}{number}"
            root.mkdir()
            for name in names if old else ():
                put(root / name, "old", folder=folder)
            with monkeypatch.context() as patch:
                injection = Injection(patch, number, when, what)
                try:
                    write(root, folder)
                except (KeyboardInterrupt, SystemExit, RecordingError):
                    assert injection.hit
            struck += injection.hit
            there = {content(root / name) for name in names}
            assert there == {"new"} if not injection.hit else there in ({"new"}, {"old" if old else None})
            if isinstance(what, int):  # a signal waits: what was begun is finished
                assert there == {"new"}
            assert {path.name for path in root.iterdir()} <= set(names)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert struck >= 1


def test_the_check_sees_a_writer_that_is_not_atomic(tmp_path, monkeypatch):
    """The control: two renames in a row, as a naive writer does them, are caught in between."""
    (tmp_path / "thing").mkdir()
    (tmp_path / "new").mkdir()
    Injection(monkeypatch, 2, "before", KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        os.rename(tmp_path / "thing", tmp_path / "aside")
        os.rename(tmp_path / "new", tmp_path / "thing")
    assert content(tmp_path / "thing") is None


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "state").write_text("old")
    (tmp_path / "link").symlink_to(tmp_path / "real" / "state")
    with replaced(tmp_path / "link") as path:
        path.write_text("new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real" / "state").read_text() == "new"


def test_permissions_of_the_old_file_stay(tmp_path):
    (tmp_path / "secret").write_text("old")
    (tmp_path / "secret").chmod(0o600)
    with replaced(tmp_path / "secret") as path:
        path.write_text("new")
    assert (tmp_path / "secret").stat().st_mode & 0o777 == 0o600


def test_signals_wait_for_the_end_of_the_block():
    seen = []
    with pytest.raises(KeyboardInterrupt):
        with deferred_signals():
            os.kill(os.getpid(), signal.SIGINT)
            seen.append("after the signal")
        seen.append("not reached")  # pragma: no cover
    assert seen == ["after the signal"]


def test_what_killed_processes_left_is_swept_and_nothing_else(tmp_path):
    code = f"import time; from bingham.atomic import staged\nwith staged({str(tmp_path)!r}): print(1); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-uc", code], stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        (left,) = tmp_path.iterdir()
        sweep(tmp_path)
        assert left.exists()  # its process lives
        process.kill()
        process.wait()
    (tmp_path / ".bingham-notes").mkdir()
    sweep(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [".bingham-notes"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_killed_command_leaves_no_temporary_folder(tmp_path, number):
    code = """
import sys, time
from bingham.cli.main import main
import bingham.cli.tracking as track
def slow(*_, **__):
    print(1, flush=True)
    time.sleep(60)
track.opened = slow
main()
"""
    out = tmp_path / "out"
    out.mkdir()
    arguments = [sys.executable, "-c", code, "track", "x.csv", "-o", str(out)]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        assert len(list(out.iterdir())) == 1
        process.send_signal(number)
        time.sleep(0.02)
        process.send_signal(number)
        assert process.wait(timeout=20) == 128 + number
        assert "Traceback" not in process.stderr.read()
    assert list(out.iterdir()) == []


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda root: root / "file" / "x", "its folder does not exist"),
        (lambda root: root / "folder", "a folder, where a file is to be written; give the path of a file"),
        (lambda root: root / "loop" / "x", "loop/x: "),
        (lambda root: root / ("n" * 300), "cannot be written: File name too long"),
    ],
)
def test_one_line_says_what_is_in_the_way(tmp_path, make, words):
    (tmp_path / "file").write_text("")
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    before = sorted(tmp_path.iterdir())
    with pytest.raises(RecordingError, match=words) as caught, replaced(make(tmp_path)) as path:
        path.write_text("x")
    assert "\n" not in str(caught.value)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("name", ["file", "file/below", "loop", "loop/below", "n" * 300])
def test_a_staged_folder_that_cannot_be_is_one_line(tmp_path, name):
    (tmp_path / "file").write_text("")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    before = sorted(tmp_path.iterdir())
    with pytest.raises(RecordingError) as caught, staged(tmp_path / name) as folder:
        (folder / "x").write_text("x")
    assert "\n" not in str(caught.value)
    assert sorted(tmp_path.iterdir()) == before


def test_an_error_in_another_file_names_that_file(tmp_path):
    with pytest.raises(RecordingError, match=r"absent.csv: cannot be") as caught, replaced(tmp_path / "x"):
        open(tmp_path / "absent.csv").close()
    assert not str(caught.value).startswith(str(tmp_path / "x"))
