"""A few signals at renames of a few commands; ``python tests/fuzz/signals.py 500`` tries all of them."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux") or shutil.which("cc") is None,
    reason="needs a C compiler, and libraries that can be loaded before the C library",
)
DRIVER = Path(__file__).with_name("signals.py")
COMMANDS = ("track", "calibrate", "simulate", "stream")


def drive(*arguments):
    return subprocess.run([sys.executable, DRIVER, *arguments], capture_output=True, text=True, check=False)


def test_every_output_is_old_or_new_whatever_is_signalled_at_a_rename():
    done = drive("12", *COMMANDS)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == "12 signals, 0 wrong"
