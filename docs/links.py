"""Links within the built site lead somewhere, to the place on the page too; a broken one ends the build."""

from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from sphinx.errors import ExtensionError


class Page(HTMLParser):
    """What a page can be linked by, and what it links."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.places: set[str] = set()
        self.links: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect ids and links."""
        found = dict(attrs)
        self.places.update(v for k in ("id", "name") if (v := found.get(k)))
        self.links += [v for k in ("href", "src") if (v := found.get(k))]


def broken_links(folder: Path) -> list[str]:
    """Return ``page: link`` for each link within the folder that leads nowhere."""
    pages = {path.resolve(): Page(path.read_text(encoding="utf-8")) for path in folder.rglob("*.html")}
    broken = []
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            target = target / "index.html" if target.is_dir() else target
            place = unquote(parts.fragment)
            if not target.exists() or (place and target in pages and place not in pages[target].places):
                broken.append(f"{path.relative_to(folder.resolve())}: {link}")
    return broken


def check(app, exception: Exception | None) -> None:
    """End the build with an error if links are broken."""
    if exception is None and app.builder.name == "html" and (broken := broken_links(Path(app.outdir))):
        raise ExtensionError("broken links:\n" + "\n".join(broken))


def setup(app) -> dict[str, bool]:
    """Register the hook."""
    app.connect("build-finished", check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
