"""Names of a package that load when first used, so that importing it stays fast; the package's stub lists them."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

__all__ = ["attach"]


def attach(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package from the stub ``__init__.pyi`` beside its file.

    ``from .module import Name as Name`` in the stub is a public name, ``from . import module as module`` a module that
    needs no import of its own. Type checkers and editors read the same file.
    """
    names: dict[str, str] = {}
    modules: set[str] = set()
    for node in ast.parse(Path(file).with_name("__init__.pyi").read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            if node.module is None:
                modules.update(a.name for a in node.names)
            else:
                names.update((a.name, node.module) for a in node.names)

    def load(name: str) -> Any:
        if name in names:
            value = getattr(import_module(f"{package}.{names[name]}"), name)
            setattr(sys.modules[package], name, value)
            return value
        if name in modules:
            return import_module(f"{package}.{name}")
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return load, lambda: sorted({*names, *modules}), sorted(names)
