import re
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from bingham import __version__
from bingham.cli.main import COMMANDS, app

runner = CliRunner()


@pytest.mark.parametrize("command", [[], *([name] for name in COMMANDS)])
def test_every_command_has_help(command):
    result = runner.invoke(app, [*command, "--help"])
    assert result.exit_code == 0
    assert "Usage" in result.stdout


def test_version():
    assert runner.invoke(app, ["--version"]).stdout == f"bingham {__version__}\n"


def test_a_mistake_is_one_line_and_exit_code_2(tmp_path):
    result = runner.invoke(app, ["track", str(tmp_path / "absent.csv"), "-o", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert result.stderr.splitlines() == [f"bingham: {tmp_path}/absent.csv: no such file or folder; check the path"]
    assert list(tmp_path.iterdir()) == []


def test_help_loads_nothing_heavy():
    code = (
        "import sys; from bingham.cli.main import app\n"
        "heavy = {'numba', 'matplotlib', 'scipy', 'pandas', 'h5py', 'rosbags'} & sys.modules.keys()\n"
        "sys.exit(' '.join(heavy) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("command", "wrong", "meant"),
    [
        ("track", "--noise", {"--measurement-noise", "--process-noise"}),
        ("track", "--mesurement-noise", {"--measurement-noise"}),
        ("fit", "--colums", {"--columns"}),
        ("fit", "--angles", {"--as"}),  # what the library calls it
        ("fit", "--out", {"--output"}),
        ("track", "--zzz", set()),
    ],
)
def test_a_wrong_option_names_those_that_are_like_it_and_no_others(command, wrong, meant):
    result = runner.invoke(app, [command, "a.csv", wrong, "1"], env={"COLUMNS": "200"})
    assert result.exit_code == 2
    said = next(line for line in result.stderr.splitlines() if "No such option" in line)
    assert set(re.findall(r"--[a-z-]+", said)) - {wrong} == meant
