"""The names that `import bingham` promises."""

import ast
import subprocess
import sys
from pathlib import Path

import bingham


def test_every_public_name_loads():
    for name in bingham.__all__:
        assert getattr(bingham, name) is not None


def test_type_checkers_see_the_same_names():
    tree = ast.parse(Path(bingham.__file__).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {
        (a.name, n.module.removeprefix("bingham."))
        for n in block.body
        if isinstance(n, ast.ImportFrom)
        for a in n.names
    }
    assert seen == set(bingham._PUBLIC.items())


def test_importing_loads_nothing_heavy():
    code = "import sys, bingham; print([m for m in ('numba', 'scipy', 'matplotlib', 'typer') if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "[]"


def test_names_of_subpackages_are_found_without_an_import_of_their_own():
    for part in (bingham.plot, bingham.surfaces):
        assert {name for name in part.__all__ if getattr(part, name).__doc__} == set(dir(part)), part.__name__
    assert callable(bingham.surfaces.plane_factors.plane_factor)


def test_importing_plots_loads_no_matplotlib():
    code = "import sys, bingham; bingham.plot.plot_fit; print('matplotlib' in sys.modules)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "False"
