"""Names of this package link to their description wherever they stand between single backticks.

A name may be written as it is imported: `BinghamFilter`, `bingham.BinghamFilter`, `bingham.filters.BinghamFilter`,
`BinghamFilter.run`. It is found by its last parts. In the pages a name that is not found, or means several things,
is a warning, and so an error of the build; in docstrings single backticks also mark arguments.
"""

from __future__ import annotations

from collections import defaultdict
from typing import Any

from docutils import nodes
from sphinx.util import logging
from sphinx.util.nodes import make_refnode

log = logging.getLogger(__name__)


def candidates(target: str, objects: dict[str, Any]) -> list[str]:
    """Return the full names that target may mean: its parts in order, the last ones next to each other."""
    parts = target.removesuffix("()").split(".")
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


def resolve(app, env, node, contnode) -> nodes.Node | None:
    """Find what a reference without an exact match means."""
    if node.get("refdomain") != "py" or not node.get("reftarget"):
        return None
    objects = env.domaindata["py"]["objects"]
    if not hasattr(env, "bingham_names"):
        env.bingham_names = defaultdict(list)
    target = node["reftarget"]
    found = candidates(target, objects)
    # Distributions of several libraries share a name: without the library, NumPy's is meant.
    plain = [n for n in found if not n.startswith(("bingham.torch.", "bingham.jax."))]
    chosen = plain if plain and not target.startswith(("bingham.torch", "bingham.jax")) else found
    document = node.get("refdoc", "")
    if len(chosen) != 1:
        page = not document.startswith(("api/generated", "gallery"))
        if page and (chosen or target.startswith("bingham.")):
            log.warning("%r names %s", target, chosen or "nothing", location=node, type="names")
        return None
    place = objects[chosen[0]]
    return make_refnode(app.builder, document, place.docname, place.node_id, contnode, chosen[0])


def setup(app) -> dict[str, bool]:
    """Register the hook."""
    app.connect("missing-reference", resolve)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
