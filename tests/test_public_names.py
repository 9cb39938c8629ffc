"""The names that `import bingham` promises."""

import ast
import importlib
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import bingham

PACKAGES = ("", ".baselines", ".distributions", ".filters", ".models")


@pytest.mark.parametrize("part", PACKAGES)
def test_every_name_of_the_stub_loads(part):
    package = importlib.import_module(f"bingham{part}")
    tree = ast.parse(Path(package.__file__).with_name("__init__.pyi").read_text(encoding="utf-8"))
    imported = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    names = {a.name for node in imported if node.module for a in node.names}
    assert names == set(package.__all__)
    for name in names:
        assert getattr(package, name).__doc__
    modules = {a.name for node in imported if node.module is None for a in node.names}
    assert set(dir(package)) == names | modules
    for name in modules:
        if name in ("torch", "jax") and find_spec(name) is None:
            continue  # needs what is not installed
        assert getattr(package, name).__name__ == f"bingham.{name}"
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        package.nothing  # noqa: B018


def test_the_main_namespace_is_for_people():
    assert len(bingham.__all__) <= 24


def test_importing_loads_nothing_heavy():
    code = "import sys, bingham; print([m for m in ('numba', 'scipy', 'matplotlib', 'typer') if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "[]"


def test_the_inertial_filter_and_its_readers_load_little_of_scipy():
    code = "import sys, bingham.filters.imu, bingham.cli.tracking, bingham.io.csv; print(sorted(sys.modules))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "'bingham.kernels.imu_loop'" in out
    assert not [name for name in ("scipy.special", "scipy.spatial", "scipy.optimize") if f"'{name}'" in out]


def test_names_of_subpackages_are_found_without_an_import_of_their_own():
    for part in (bingham.plot, bingham.surfaces):
        assert {name for name in part.__all__ if getattr(part, name).__doc__} == set(dir(part)), part.__name__
    assert callable(bingham.surfaces.plane_factors.plane_factor)


def test_importing_plots_loads_no_matplotlib():
    code = "import sys, bingham; bingham.plot.plot_fit; print('matplotlib' in sys.modules)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "False"
