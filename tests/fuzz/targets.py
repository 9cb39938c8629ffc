"""What is fuzzed: bytes in, and out comes a result or one of the package's own errors, nothing else."""

import contextlib
import io
import os
import shutil
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

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
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        warnings.filterwarnings("error", category=RuntimeWarning, module="bingham")
        try:
            yield
        except BinghamError as error:
            said.append(error)
    for message in (str(getattr(w, "message", w)) for w in said):
        assert len(message) < LONGEST_MESSAGE, message
        assert message.count("\n") < 4, message


def _reads(kind):
    def target(content):
        from bingham.io import read_recording

        with _only_own_errors():
            read_recording(_file(kind, content))

    return target


def broad(content):
    """HDF5 alone: the signature is put back, so that no input ends up with another reader."""
    from bingham.io import read_broad
    from bingham.io.broad import HDF5_SIGNATURE

    with _only_own_errors():
        read_broad(_file("hdf5", HDF5_SIGNATURE + content[8:]))


def _archive(content):
    """Write an archive of members NAME, zero byte, content, parted by @@@: no checksum stops what is changed."""
    path = PLACE / "input.npz"
    with zipfile.ZipFile(path, "w") as archive:
        for k, part in enumerate(content.split(b"@@@")):
            name, _, data = part.partition(b"\0")
            archive.writestr(zipfile.ZipInfo(f"{name.decode('latin-1')[:60].replace(chr(0), '') or k}.npy"), data)
    return path


def arrays(content):
    """Arrays of an archive that is whole."""
    from bingham.io import read_recording, read_track

    path = _archive(content)
    for read in (read_recording, read_track):
        with _only_own_errors():
            read(path)


def ebsd(content):
    """A map of crystal orientations."""
    from bingham.io import read_ebsd

    with _only_own_errors():
        read_ebsd(_file("text", content))


def bag_poses(content):
    """Orientations of poses in a bag."""
    from bingham.io import read_rosbag_orientation

    with _only_own_errors():
        read_rosbag_orientation(_file("bag", content))


def together(content):
    """A folder with a file for each sensor."""
    from bingham.io import read_recording

    folder = PLACE / "together"
    folder.mkdir(exist_ok=True)
    parts = content.split(b"@@@")
    for name, part in zip(("Gyroscope.csv", "Accelerometer.csv", "Magnetometer.csv"), parts, strict=False):
        (folder / name).write_bytes(part)
    with _only_own_errors():
        read_recording(folder)


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


def points(content):
    """Clouds and depth images; the first byte says by which ending."""
    from bingham.io.points import read_points

    kind = ("pcd", "ply", "cloud")[content[0] % 3] if content else "pcd"
    with _only_own_errors():
        assert read_points(_file(kind, content[1:]))


# Commands that read a file; the first byte of an input says which.
COMMANDS = (
    ("track", "text", "--no-figure"), ("fit", "text"), ("cluster", "text", "--components", "1"), ("planes", "text"),
    ("calibrate", "text"), ("planes", "npz"), ("track", "npz", "--no-figure"), ("fit", "ang"), ("planes", "npy"),
)  # fmt: skip


def command(content):
    """The command line: exit code 0 or 2, never a traceback, nothing written unless it says 0."""
    from typer.testing import CliRunner

    from bingham.cli.main import app

    os.environ["BINGHAM_TRACEBACK"] = "1"
    out = PLACE / "out"
    name, kind, *options = COMMANDS[content[0] % len(COMMANDS) if content else 0]
    path = _file(kind, content[1:])
    result = CliRunner().invoke(app, [name, str(path), *options, "-o", str(out)])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code in (0, 2), result.output
    assert out.exists() == (result.exit_code == 0)
    assert "Traceback" not in result.output
    if out.exists():
        shutil.rmtree(out) if out.is_dir() else out.unlink()


class Target(NamedTuple):
    """What is run, the kinds of seeds it starts from, and how many inputs a repeatable run tries."""

    run: Callable[[bytes], None]
    kinds: tuple[str, ...]
    runs: int


TARGETS = {
    "text": Target(_reads("text"), ("text",), 500),
    "npz": Target(_reads("npz"), ("npz",), 1000),
    "arrays": Target(arrays, ("arrays",), 1000),
    "mat": Target(_reads("mat"), ("mat",), 1500),
    "hdf5": Target(broad, ("hdf5",), 800),
    "bag": Target(_reads("bag"), ("bag",), 600),
    "db3": Target(_reads("db3"), ("db3",), 100),
    "mcap": Target(_reads("mcap"), ("mcap",), 200),
    "poses": Target(bag_poses, ("bag", "mcap"), 500),
    "together": Target(together, ("together",), 300),
    "axes": Target(axes, ("text",), 800),
    "ebsd": Target(ebsd, ("ebsd",), 1500),
    "track": Target(track, ("npz",), 1000),
    "stream": Target(stream, ("stream",), 500),
    "state": Target(state, ("state",), 2000),
    "points": Target(points, ("points",), 1000),
    "command": Target(command, ("command",), 150),
}
