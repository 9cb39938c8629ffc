"""Names of this package link to their description wherever they stand between single backticks.

A name may be written as it is imported: `BinghamFilter`, `bingham.BinghamFilter`, `bingham.filters.BinghamFilter`,
`BinghamFilter.run`. It is found by its last parts. A name that is not found, or means several things, is a warning, and
so an error of the build; in docstrings single backticks also mark arguments and fields of the module that is described,
and names of Python and other libraries.
"""

from __future__ import annotations

import ast
import builtins
import re
import typing
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.util import logging
from sphinx.util.nodes import make_refnode

import bingham

log = logging.getLogger(__name__)


# Names of others that docstrings mention, which this site has no description of.
OF_OTHERS = {*dir(builtins), *typing.__all__, "Rotation", "scipy", "numpy", "pandas", "torch", "jax"}

# Where a bare method or attribute is meant, in this order.
OWNERS = ("Bingham", "BinghamFilter", "RecursiveFilter", "ImuFilter")


def chosen_of(found: list[str], target: str, names: dict[str, str]) -> list[str]:
    """Return the one that is meant, as far as that is clear: public names first, then methods of the usual classes."""
    # Distributions of several libraries share a name: without the library, NumPy's is meant.
    plain = [n for n in found if not n.startswith(("bingham.torch.", "bingham.jax."))]
    if plain and not target.startswith(("bingham.torch", "bingham.jax")):
        found = plain
    short = target.removesuffix("()").rpartition(".")[2]
    if names.get(short) in found:
        return [names[short]]
    if "." not in target:
        for owner in OWNERS:
            of_owner = [n for n in found if n.endswith(f".{owner}.{short}")]
            if of_owner:
                return of_owner[:1]
    shortest = [n for n in found if n.count(".") == min(m.count(".") for m in found)]
    # One class may be described where it is defined and where it is imported from.
    same_package = len({n.split(".")[1] for n in found}) == 1
    return shortest[:1] if same_package and short[:1].isupper() else found


def candidates(target: str, objects: dict[str, Any]) -> list[str]:
    """Return the full names that target may mean: its parts in order, the last ones next to each other."""
    parts = re.sub(r"\(.*\)$", "", target).split(".")
    capital = next((i for i, p in enumerate(parts) if p[:1].isupper()), len(parts) - 1)
    tail, head = parts[capital:], parts[:capital]
    found = []
    for name in objects:
        own = name.split(".")
        if own[-len(tail) :] == tail and "kernels" not in own:
            rest = iter(own[: -len(tail)])
            if all(part in rest for part in head):
                found.append(name)
    return found


def nearest(found: list[str], module: str | None, described: str | None) -> list[str]:
    """Return those of the class, or else the module, in whose description they stand; all if there are none."""
    for place in (f"{module}.{described}.", f"{module}."):
        if within := [name for name in found if name.startswith(place)]:
            return within
    return found


@cache
def arguments(module: str) -> frozenset[str]:
    """Return names of arguments and fields of a module, or of all modules of a package."""
    found = find_spec(module)
    assert found is not None
    assert found.origin is not None
    path = Path(found.origin)
    names: set[str] = set()
    for file in path.parent.rglob("*.py") if path.name == "__init__.py" else [path]:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.arg):
                names.add(node.arg)
            elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                names.add(node.target.id)
    return frozenset(names)


def needs_no_link(target: str, document: str, module: str | None) -> bool:
    """Whether a name that leads nowhere is an argument of what is described, or somebody else's."""
    if not document.startswith("api/"):
        return document.startswith("gallery")
    # Tables of contents show first lines of descriptions from all modules.
    return target.split(".")[0] in OF_OTHERS or target in arguments(module or "bingham")


def resolve(app, env, node, contnode) -> nodes.Node | None:
    """Find what a reference without an exact match means."""
    if node.get("refdomain") != "py" or not node.get("reftarget"):
        return None
    objects = env.domaindata["py"]["objects"]
    target = node["reftarget"]
    public = {name: f"{getattr(bingham, name).__module__}.{name}" for name in bingham.__all__}
    found = nearest(candidates(target, objects), node.get("py:module"), node.get("py:class"))
    chosen = chosen_of(found, target, public)
    if not chosen and target.split(".")[-2:-1] and target.split(".")[-2][:1].isupper():
        # An inherited method: the class says where from.
        chosen = chosen_of(candidates(target.rpartition(".")[0], objects), target.rpartition(".")[0], public)
    document = node.get("refdoc", "")
    if len(chosen) != 1:
        if not needs_no_link(target, document, node.get("py:module")):
            log.warning("%r names %s", target, chosen or "nothing", location=node, type="names")
        return None
    place = objects[chosen[0]]
    return make_refnode(app.builder, document, place.docname, place.node_id, contnode, chosen[0])


def setup(app) -> dict[str, bool]:
    """Register the hook."""
    app.connect("missing-reference", resolve)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
