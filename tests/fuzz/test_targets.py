"""Every target on its seeds and on some hundred damaged ones, always the same; `make fuzz` goes on from there."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import seeds
from targets import TARGETS

DAMAGED = 60  # inputs for each seed
# Inputs that have broken a target.
BROKE = [
    ("text", b"#\r3\r5*16,[,ax,,#\xb5E\x081\n\n"),
    ("together", b"seconds\n0.0\n0.1\n0.2\n@@@time,z,y,x\n1,0,0,0\n2,0,0,0\n3,0,0,0\n"),
    ("together", b"z,y,x\n0.1,0.1,0.2\n0.1,0.1,0.2\n0.1,0.1,0.2\n@@@time,z,y,x\n1,0,0,0\n2,0,0,0\n3,0,0,0\n"),
    ("arrays", b"name of\n\n\n\n\nlines\0" + b"x" * 9),
    ("stream", b"acc 1000 0 0 9.81\ngyr 1000 0 0 0\n"
     + b"".join(b"acc 0.%02d 0 0 9.81\n" % k for k in range(12)) + b"gyr 0.12 0.1 0 0\ngyr 0.13 0.1 0 0\n"),
]  # fmt: skip


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return seeds.make(tmp_path_factory.mktemp("fuzz"))


def damaged(content, rng):
    """Bits flipped, parts cut out, repeated, moved or replaced by what readers stumble over."""
    data = bytearray(content)
    for _ in range(int(rng.integers(1, 5))):
        if not data:
            break
        at, to = sorted(rng.integers(0, len(data) + 1, 2).tolist())
        to = min(to, at + 64)
        kind = rng.integers(0, 6)
        if kind == 0 and at < len(data):
            data[at] ^= 1 << int(rng.integers(0, 8))
        elif kind == 1:
            del data[at:to]
        elif kind == 2:
            data[at:at] = data[at:to] * 3
        elif kind == 3:
            data = data[:at] if rng.random() < 0.3 else data
        elif kind == 4:
            data[at:to] = rng.integers(0, 256, to - at).astype(np.uint8).tobytes()
        else:
            odd = [b"nan", b"1e400", b"\xff\xfe", b"1_0", b"-", b"\0", b"9" * 400, b'"', b"\n\n", "\u0661".encode()]
            data[at:to] = odd[int(rng.integers(0, len(odd)))]
    return bytes(data)


@pytest.mark.parametrize("name", TARGETS)
def test_seeds_and_damaged_ones_are_read_or_refused_in_words(made, name):
    target = TARGETS[name].run
    files = [path for kind in TARGETS[name].kinds for path in made.get(kind, [])]
    if not files:
        pytest.skip(f"no seeds of {name}: a package that writes them is not installed")
    rng = np.random.default_rng(7)
    for path in files:
        content = path.read_bytes()
        target(content)
        for _ in range(DAMAGED if name != "command" else DAMAGED // 20):
            target(damaged(content, rng))


@pytest.mark.parametrize(("name", "content"), BROKE, ids=range(len(BROKE)))
def test_what_broke_a_target_no_longer_does(name, content):
    TARGETS[name].run(content)


def test_the_check_sees_an_error_that_is_not_the_packages_own(monkeypatch):
    """The control: a reader that fails in a way of its own is found."""
    from bingham import io

    monkeypatch.setattr(io, "read_recording", lambda _: {}["absent"])
    with pytest.raises(KeyError):
        TARGETS["text"].run(b"t,gx\n")
