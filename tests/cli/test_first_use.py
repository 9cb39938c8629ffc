"""Whoever waits for a compilation is told so, once."""

import os
import subprocess
import sys

import numpy as np
import pytest

from bingham.cli import first_use
from bingham.errors import BinghamError

SCRIPT = """
from bingham.cli.first_use import announce_compilation
from bingham.kernels.compile import compiled

@compiled()
def one(x):
    return x + 1.0

@compiled()
def two(x):
    return x + 2.0

announce_compilation()
announce_compilation()
one(1.0), two(1.0)
"""


def test_the_first_run_says_that_it_compiles_and_the_next_does_not(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": os.pathsep.join(sys.path)}
    runs = [subprocess.run([sys.executable, script], capture_output=True, text=True, env=environment) for _ in "12"]
    said = "bingham: compiling numerical code; it is kept on disk, later runs start at once\n"
    assert [(run.stdout, run.stderr) for run in runs] == [("", said), ("", "")]


def test_help_does_not_load_the_compiler():
    code = (
        "import sys; from bingham.cli.main import app; app(['track', '-h'], standalone_mode=False); print(*sys.modules)"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    loaded = result.stdout.splitlines()[-1].split()
    assert "typer" in loaded
    assert "numba" not in loaded


@pytest.mark.parametrize("command", ["track", "track -", "fit", "cluster", "tune", "simulate", "reproduce"])
def test_every_command_that_may_compile_is_ready_to_say_so(bingham, imu, tmp_path, monkeypatch, command):
    def told():
        raise BinghamError("told")

    monkeypatch.setattr(first_use, "announce_compilation", told)
    axes = tmp_path / "axes.csv"
    np.savetxt(axes, np.tile(np.eye(3), (4, 1)), delimiter=",", header="x,y,z", comments="")
    out = ("-o", tmp_path / "out")
    arguments = {"track": (imu, *out), "track -": (), "fit": (axes,), "cluster": (axes,), "tune": (imu,)}
    arguments |= {"simulate": ("tumbling", "-o", tmp_path / "x.npz"), "reproduce": ("kurz2013", *out)}
    result = bingham(*command.split(), *arguments[command])
    assert (result.exit_code, result.stderr) == (2, "bingham: told\n")
