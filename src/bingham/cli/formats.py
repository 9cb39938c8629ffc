"""``bingham formats``: what can be read, made from the registry of formats and the presets of loggers."""

from __future__ import annotations

import json
import re

import typer

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command()(formats)


def formats(as_json: bool = typer.Option(False, "--json", help="Print one JSON object on standard output.")) -> None:
    """List the formats of recordings, the loggers whose files are known by their header, and the kinds of angles."""
    from bingham.io.angles import ANGLES
    from bingham.io.columns import COLUMNS
    from bingham.io.formats import FORMATS
    from bingham.io.presets import PRESETS
    from bingham.io.units import UNITS

    tables = {
        "formats": [{"name": f.name, "title": f.title, "expects": _plain(f.expects)} for f in FORMATS.values()],
        "loggers": [{"name": p.name, "title": p.title} for p in PRESETS],
        "angles": [{"name": k.name, "title": k.title, "columns": " ".join(k.columns)} for k in ANGLES.values()],
        "columns": [
            {"name": q, "columns": " ".join(c), "units": " ".join(UNITS.get(q, {}))} for q, c in COLUMNS.items()
        ],
    }
    if as_json:
        typer.echo(json.dumps(tables, indent=2, ensure_ascii=False))
        return
    said = {
        "formats": "Formats, recognised by content (--format NAME says so)",
        "loggers": "Loggers whose text files are known by their header",
        "angles": "Angles, by the names of columns or --as KIND (track, fit, cluster); also euler-ZXZ and the like",
        "columns": "Columns of text files and their units; --column NAME=COLUMN, --unit QUANTITY=UNIT",
    }
    for key, rows in tables.items():
        typer.echo(f"{said[key]}:")
        width = max(len(row["name"]) for row in rows)
        for row in rows:
            rest = "; ".join(value for name, value in row.items() if name != "name" and value)
            typer.echo(f"  {row['name']:<{width}}  {rest}")
        typer.echo("")


def _plain(text: str) -> str:
    """Return reStructuredText without its marks."""
    return re.sub(r"`+|_(?=[;,.\s]|$)|\*", "", text)
