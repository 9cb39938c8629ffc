"""What is fuzzed: bytes in, and out comes a result or one of the package's own errors, nothing else."""

import contextlib
import io
import os
import tempfile
import warnings
from pathlib import Path

from seeds import SUFFIXES

from bingham.errors import BinghamError

__all__ = ["TARGETS"]

PLACE = Path(tempfile.mkdtemp(prefix="bingham-fuzz-", dir="/dev/shm" if os.path.isdir("/dev/shm") else None))
LONGEST_MESSAGE = 2000


def _file(kind, content):
    path = PLACE / f"input{SUFFIXES.get(kind, '.txt')}"
    path.write_bytes(content)
    return path


@contextlib.contextmanager
def _only_own_errors():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.filterwarnings("error", category=RuntimeWarning, module="bingham")
        try:
            yield
        except BinghamError as error:
            assert len(str(error)) < LONGEST_MESSAGE
            assert str(error).count("\n") < 4


def _reads(kind):
    def target(content):
        from bingham.io import read_recording

        with _only_own_errors():
            read_recording(_file(kind, content))

    return target


def axes(content):
    """Axes and angles of a text file."""
    from bingham.io import read_axes

    with _only_own_errors():
        read_axes(_file("text", content))


def track(content):
    """A track of an archive."""
    from bingham.io import read_track

    with _only_own_errors():
        read_track(_file("npz", content))


def stream(content):
    """Lines of a stream: every answer is JSON without NaN."""
    import json

    from bingham.cli.stream import Follower, follow
    from bingham.cli.stream_input import lines_of
    from bingham.filters import ImuStream

    out = io.BytesIO()
    blocks = (content[k : k + 997] for k in range(0, len(content), 997))
    follow(Follower(ImuStream(), None, io.StringIO()), lines_of(blocks), out)
    for line in out.getvalue().splitlines():
        answer = json.loads(line, parse_constant=_no_constant)
        assert answer.keys() == {"time", "orientation", "inclination_std_deg", "heading_std_deg", "rest"}


def _no_constant(name):
    raise AssertionError(f"{name} is no JSON")


def state(content):
    """A state file: what is accepted answers finitely."""
    import math

    from bingham.cli.stream_state import opened

    path = _file("state", content)
    with _only_own_errors():
        found = opened(path)
        found.accelerometer(1e9, [0.0, 0.0, 9.81])
        found.gyroscope(1e9, [0.0, 0.0, 0.1])
        assert all(map(math.isfinite, found.orientation))
    assert path.read_bytes() == content


def command(content):
    """The command line: exit code 0, 1 or 2, never a traceback, nothing written unless it says 0."""
    from typer.testing import CliRunner

    from bingham.cli.main import app

    os.environ["BINGHAM_TRACEBACK"] = "1"
    out = PLACE / "out"
    path = _file("text", content)
    result = CliRunner().invoke(app, ["track", str(path), "--no-figure", "-o", str(out)])
    assert result.exit_code in (0, 2), result.output
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    assert out.exists() == (result.exit_code == 0)
    assert "Traceback" not in result.output
    for file in out.iterdir() if out.exists() else ():
        file.unlink()
    if out.exists():
        out.rmdir()


# Name → what is run, and the kinds of seeds it starts from.
TARGETS = {
    "text": (_reads("text"), ("text",)),
    "npz": (_reads("npz"), ("npz",)),
    "mat": (_reads("mat"), ("mat",)),
    "hdf5": (_reads("hdf5"), ("hdf5",)),
    "bag": (_reads("bag"), ("bag",)),
    "db3": (_reads("db3"), ("db3",)),
    "mcap": (_reads("mcap"), ("mcap",)),
    "axes": (axes, ("text",)),
    "track": (track, ("npz",)),
    "stream": (stream, ("stream",)),
    "state": (state, ("state",)),
    "command": (command, ("text",)),
}
