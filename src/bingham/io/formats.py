"""All formats, each in a file of its own, in the order in which a file is compared with them."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

from bingham.io.registry import Format

NAMED = re.compile(r"^FORMAT\b[^=\n]*=", re.MULTILINE)
__all__ = ["FORMATS", "formats_in", "supported"]


def formats_in(folder: Path, package: str) -> dict[str, Format]:
    """Return the formats of a package: of its files that hold a ``FORMAT``, those that take almost any text last."""
    files = [file for file in sorted(folder.glob("*.py")) if NAMED.search(file.read_text(encoding="utf-8"))]
    found: list[Format] = [import_module(f"{package}.{file.stem}").FORMAT for file in files]
    return {known.name: known for known in sorted(found, key=lambda known: known.last)}


FORMATS = formats_in(Path(__file__).parent, "bingham.io")


def supported() -> str:
    """Return what is supported, in a line."""
    return f"supported: {', '.join(f.title for f in FORMATS.values())}; see bingham formats"
