"""What README and documentation show must run: code blocks, examples in prose, names of commands."""

from __future__ import annotations

import ast
import doctest
import importlib.util
import pkgutil
import re
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted(p for p in (ROOT / "docs").rglob("*.rst") if not {"_build", "gallery", "generated"} & set(p.parts))
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
# A command line, not the name of the package in prose: in a shell block, or in literal marks.
COMMAND = re.compile(r"(?:^|[`\n]) *(?:\$ )?bingham ([a-z]+)\b(?! import)", re.MULTILINE)


def identity(path: Path) -> str:
    return str(path.relative_to(ROOT))


def test_readme_code_runs(capsys):
    blocks = BLOCK.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    assert blocks
    for block in blocks:
        exec(compile(block, "README.md", "exec"), {})
    assert "degrees about x, y, z" in capsys.readouterr().out


@pytest.mark.parametrize("page", PAGES, ids=identity)
def test_examples_in_pages_give_what_they_show(page):
    needed = {"learning.rst": ("torch", "jax"), "deep-learning.rst": ("torch",)}.get(page.name, ())
    if missing := [name for name in needed if not find_spec(name)]:
        pytest.skip(f"not installed: {', '.join(missing)}")
    flags = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    result = doctest.testfile(str(page), module_relative=False, optionflags=flags, encoding="utf-8")
    assert result.failed == 0


def test_pages_have_examples():
    # Without any, the test above would pass whatever the pages say.
    count = sum(len(doctest.DocTestParser().get_examples(p.read_text(encoding="utf-8"))) for p in PAGES)
    assert count > 20


def test_commands_in_documents_exist():
    typer_main = pytest.importorskip("typer.main")
    from bingham.cli.main import app

    known = set(typer_main.get_command(app).commands)
    texts = [ROOT / "README.md", *PAGES]
    named = {(identity(p), c) for p in texts for c in COMMAND.findall(p.read_text(encoding="utf-8"))}
    assert {c for _, c in named} & known
    assert sorted((place, c) for place, c in named if c not in known) == []


def test_code_that_pages_include_exists():
    pattern = re.compile(r"literalinclude:: (\S+)\n +:pyobject: (\w+)")
    included = [(page, *found) for page in PAGES for found in pattern.findall(page.read_text(encoding="utf-8"))]
    assert included
    for page, source, name in included:
        tree = ast.parse((page.parent / source).resolve().read_text(encoding="utf-8"))
        assert name in {getattr(node, "name", None) for node in tree.body}, f"{identity(page)}: {name} in {source}"


def test_public_names_in_pages_are_links():
    # Between double backticks a name is code that leads nowhere; whether links lead somewhere, the build says.
    names = set()
    for stub in (ROOT / "src/bingham").rglob("__init__.pyi"):
        for node in ast.parse(stub.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ImportFrom) and node.module:
                names.update(a.name for a in node.names if a.name[0].isupper())
    assert "BinghamFilter" in names
    literal = re.compile(r"(?<!`)``([A-Za-z_.]+)(?:\(\))?``(?!`)")
    unlinked = [
        f"{identity(page)}: {found}"
        for page in PAGES
        for found in literal.findall(page.read_text(encoding="utf-8"))
        if names & set(found.split("."))
    ]
    assert unlinked == []


def test_every_public_name_has_a_task():
    import bingham

    page = (ROOT / "docs/api/index.rst").read_text(encoding="utf-8")
    listed = [name for group in re.findall(r"{{names:([^}]*)}}", page) for name in group.split()]
    assert sorted(listed) == sorted(set(bingham.__all__) - {"__version__"})


def test_all_modules_are_in_the_reference():
    import bingham

    page = (ROOT / "docs/api/index.rst").read_text(encoding="utf-8")
    listed = set(re.findall(r"^   bingham\.(\w+)$", page, re.MULTILINE))
    modules = {m.name for m in pkgutil.iter_modules(bingham.__path__) if not m.name.startswith("_")}
    assert listed == modules - {"kernels", "cli"}


def test_links_in_the_readme_lead_to_files():
    links = re.findall(r"\]\((?!https?:)([^)#]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []
    # What the site fills in is not there for a reader of the repository.
    pages = [link for link in links if link.endswith((".rst", ".md"))]
    assert pages and [link for link in pages if "{{" in (ROOT / link).read_text(encoding="utf-8")] == []


def test_public_names_resolve_and_are_documented():
    import bingham

    for name in bingham.__all__:
        assert name == "__version__" or getattr(bingham, name).__doc__, name


def test_the_page_of_commands_is_made_from_the_program():
    typer_main = pytest.importorskip("typer.main")
    from bingham.cli.main import app

    spec = importlib.util.spec_from_file_location("generated", ROOT / "docs/generated.py")
    generated = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generated)
    text = generated.commands()
    for name, command in typer_main.get_command(app).commands.items():
        assert f".. program:: bingham {name}\n" in text
        for parameter in command.params:
            for option in (*parameter.opts, *parameter.secondary_opts):
                assert parameter.param_type_name == "argument" or option in text, (name, option)


def test_table_of_npz_arrays_is_the_one_of_the_reader():
    from bingham.io.trial import IMU_FIELDS, LONG_NAMES

    page = (ROOT / "docs/formats.rst").read_text(encoding="utf-8")
    section = page.split("Arrays of an npz file\n---")[1].split("\n---")[0].partition("measured orientations")[0]
    cells = re.findall(r"^   \* -.*\n     - (.+)$", section, re.M)
    assert {name for cell in cells for name in re.findall(r"``(\w+)``", cell)} == {*IMU_FIELDS, *LONG_NAMES.values()}
