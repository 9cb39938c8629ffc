"""No module imports, by way of others, itself: not even for type checkers only, nor inside functions."""

import ast
from pathlib import Path

import pytest

import bingham

ROOT = Path(bingham.__file__).parent


def module_of(path, root):
    return ".".join(path.relative_to(root.parent).with_suffix("").parts).removesuffix(".__init__")


def imports(root):
    """Return module → modules of the same package that it imports anywhere in its file."""
    files = {module_of(path, root): path for path in sorted(root.rglob("*.py"))}
    graph = {}
    for name, path in files.items():
        found = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found.update(a.name for a in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                # What is imported is a module of the package, or a name in one.
                found.update(full if (full := f"{node.module}.{a.name}") in files else node.module for a in node.names)
        graph[name] = (found & files.keys()) - {name}
    return graph


def circles(graph):
    """Return the sets of modules that import one another, by any number of steps."""
    reached = {name: set(targets) for name, targets in graph.items()}
    for middle in graph:
        for targets in reached.values():
            if middle in targets:
                targets |= reached[middle]
    found = {frozenset(n for n in graph if n in reached[name] and name in reached[n]) for name in graph}
    return {group for group in found if group}


def test_there_are_no_circles():
    graph = imports(ROOT)
    assert len(graph) > 100 and graph["bingham.filters.first_order"] >= {"bingham.filters.run", "bingham.filters.track"}
    assert [sorted(group) for group in circles(graph)] == []


@pytest.mark.parametrize(
    "how",
    [
        "from pack import b\n",
        "import pack.b\n",
        "from pack.b import y\n",
        "def f():\n    from pack.b import y\n",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from pack.b import y\n",
    ],
)
def test_a_circle_is_seen(tmp_path, how):
    root = tmp_path / "pack"
    root.mkdir()
    (root / "__init__.py").write_text("")
    (root / "a.py").write_text(how)
    (root / "b.py").write_text("from pack.a import x\n")
    assert circles(imports(root)) == {frozenset({"pack.a", "pack.b"})}
