"""Machine code on disk is what today's sources give, and a disk that fails costs no result."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import bingham
from bingham.kernels.cache import source_digest
from permissions import RESTRICTED, with_permissions

PACKAGE = Path(bingham.__file__).parent
HELPER = "from bingham.kernels.compile import compiled\n\n@compiled()\ndef helper(x):\n    return x + {}\n"
CALLER = """from bingham.kernels.compile import compiled
from bingham.kernels.made_helper import helper

@compiled()
def caller(x):
    return 10.0 * helper(x)
"""
RUN = """
import resource, signal, sys
if "full" in sys.argv:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))
from bingham.kernels.made_caller import caller
print(caller(1.0), sum(caller.stats.cache_hits.values()))
"""


@pytest.fixture
def copy(tmp_path):
    """A copy of the package with two kernels more, and a function that runs the second one in a new process."""
    package = tmp_path / "bingham"
    (package / "kernels").mkdir(parents=True)
    (package / "__init__.py").write_text("")
    for name in ("__init__.py", "brisk.py", "cache.py", "compile.py"):
        shutil.copy(PACKAGE / "kernels" / name, package / "kernels" / name)
    (package / "kernels" / "made_caller.py").write_text(CALLER)
    (package / "kernels" / "made_helper.py").write_text(HELPER.format("1.0"))

    def run(*arguments, restricted=False, **variables):
        environment = os.environ | {"PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")} | variables
        environment.pop("NUMBA_CACHE_DIR", None)
        command = [*(RESTRICTED if restricted else []), sys.executable, "-c", RUN, *arguments]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
        return done.stdout.split(), done.stderr

    run.package = package
    return run


def kept(copy):
    return sorted((copy.package / "kernels" / "__pycache__").glob("made_*.nb?"))


def test_a_changed_helper_in_another_file_is_compiled_anew(copy):
    assert copy() == (["20.0", "0"], "")
    assert copy() == (["20.0", "1"], "")
    (copy.package / "kernels" / "made_helper.py").write_text(HELPER.format("2.0"))
    assert copy() == (["30.0", "0"], "")
    assert copy() == (["30.0", "1"], "")


def test_the_key_follows_imports_of_imports():
    """`sensors` takes `newton`, which takes `rule`, which takes its nodes from `numpy_rule`; `lcd` takes none."""
    kernels = PACKAGE / "kernels"
    digest = source_digest.__wrapped__
    before = digest(kernels / "sensors.py"), digest(kernels / "lcd.py")
    read = Path.read_bytes
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "read_bytes", lambda path: read(path) + b"#" * (path.name == "numpy_rule.py"))
        after = digest(kernels / "sensors.py"), digest(kernels / "lcd.py")
    assert before[0] != after[0]
    assert before[1] == after[1]


@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
@pytest.mark.parametrize("damage", ["empty", "zeros", "flipped", "short"])
def test_damaged_files_are_made_anew(copy, suffix, damage):
    copy()
    files = [path for path in kept(copy) if path.suffix == suffix and "caller" in path.name]
    assert files
    for path in files:
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 0xFF
        content = {"empty": b"", "zeros": b"\0" * len(data), "flipped": bytes(data), "short": bytes(data[:-9])}
        path.write_bytes(content[damage])
    out, said = copy()
    assert out == ["20.0", "0"]
    assert said.count("RuntimeWarning") == 1
    assert str(copy.package / "kernels" / "__pycache__") in said
    assert copy() == (["20.0", "1"], "")


def test_a_full_disk_is_named_once(copy):
    out, said = copy("full", PYTHONDONTWRITEBYTECODE="1")
    assert out == ["20.0", "0"]
    assert said.count("RuntimeWarning: compiled code cannot be kept in") == 1
    assert str(copy.package / "kernels") in said


def test_without_a_folder_that_can_be_written_it_runs_uncached(copy, tmp_path):
    shutil.rmtree(copy.package / "kernels" / "__pycache__", ignore_errors=True)
    (copy.package / "kernels" / "__pycache__").write_text("no folder")
    (tmp_path / "no folder").write_text("")
    out, said = copy(HOME=str(tmp_path / "no folder"), XDG_CACHE_HOME=str(tmp_path / "no folder"))
    assert out == ["20.0", "0"]
    assert said.count("RuntimeWarning") == 1
    assert "NUMBA_CACHE_DIR" in said


@pytest.fixture
def read_only(copy):
    """Make the package's folders as somebody else's are."""
    folders = [copy.package / "kernels" / "__pycache__", copy.package / "kernels", copy.package]

    def close():
        for folder in folders:
            if folder.exists():
                folder.chmod(0o555)

    yield close
    for folder in reversed(folders):
        if folder.exists():
            folder.chmod(0o755)


@with_permissions
def test_machine_code_of_a_read_only_package_is_loaded_and_if_stale_kept_elsewhere(copy, read_only, tmp_path):
    copy()
    read_only()
    assert copy(restricted=True) == (["20.0", "1"], "")
    assert not list(tmp_path.glob("cache/**/*.nbi"))
    helper = copy.package / "kernels" / "made_helper.py"
    helper.write_text(HELPER.format("2.0"))
    assert copy(restricted=True) == (["30.0", "0"], "")
    assert copy(restricted=True) == (["30.0", "1"], "")
    assert list(tmp_path.glob("cache/**/made_caller*.nbi"))


@with_permissions
def test_a_read_only_package_and_home_run_uncached_and_say_so(copy, read_only, tmp_path):
    home = tmp_path / "home"
    home.mkdir(mode=0o555)
    read_only()
    out, said = copy(restricted=True, HOME=str(home), XDG_CACHE_HOME=str(home / "cache"))
    assert out == ["20.0", "0"]
    assert said.count("RuntimeWarning") == 1
    assert "NUMBA_CACHE_DIR" in said
