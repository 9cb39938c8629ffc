"""Links within the built site lead somewhere, to the place on the page too; a broken one ends the build."""

from __future__ import annotations

import re
from functools import cache
from html import unescape
from os.path import dirname, join, normpath
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote, urlsplit

from sphinx.errors import ExtensionError

# Quotes in text are escaped, so that this is found in tags alone.
ATTRIBUTE = re.compile(r'\s(id|name|href|src)="([^"]*)"')


class Page(NamedTuple):
    """What a page can be linked by, and what it links."""

    places: frozenset[str]
    links: list[str]

    @classmethod
    def of(cls, text: str) -> Page:
        """Return the ids and links of a page."""
        found = [(name, unescape(value)) for name, value in ATTRIBUTE.findall(text)]
        places = frozenset(value for name, value in found if name in ("id", "name"))
        return cls(places, [value for name, value in found if name in ("href", "src") and value])


def broken_links(folder: Path) -> list[str]:
    """Return ``page: link`` for each link within the folder that leads nowhere."""
    files = {str(path.relative_to(folder)): path for path in folder.rglob("*")}
    pages = {name: Page.of(path.read_text(encoding="utf-8")) for name, path in files.items() if path.suffix == ".html"}

    @cache
    def target_of(start: str, path: str) -> str | None:
        """Return what a path on pages in the folder `start` leads to, None for nothing."""
        name = normpath(join(start, unquote(path)))
        if name == "." or (name in files and files[name].is_dir()):
            name = normpath(join(name, "index.html"))
        return name if name in files else None

    broken = []
    for name, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = target_of(dirname(name), parts.path) if parts.path else name
            place = unquote(parts.fragment)
            if target is None or (place and target in pages and place not in pages[target].places):
                broken.append(f"{name}: {link}")
    return broken


def check(app, exception: Exception | None) -> None:
    """End the build with an error if links are broken."""
    if exception is None and app.builder.name == "html" and (broken := broken_links(Path(app.outdir))):
        raise ExtensionError("broken links:\n" + "\n".join(broken))


def setup(app) -> dict[str, bool]:
    """Register the hook."""
    app.connect("build-finished", check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
