"""What the documentation and `bingham formats` say is made of the registry."""

import json
import re
import sys
from pathlib import Path

import bingham.io
from bingham.io.angles import ANGLES
from bingham.io.formats import FORMATS
from bingham.io.presets import PRESETS

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_tables_of_the_documentation(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    sys.modules.pop("generated", None)
    import generated

    page = (DOCS / "formats.rst").read_text(encoding="utf-8")
    tables = generated.tables()
    assert set(re.findall(r"{{table:(\w+)}}", page)) == set(tables)
    for known, table in ((FORMATS, "formats"), (ANGLES, "angles")):
        for name, item in known.items():
            assert item.title in tables[table], name
    assert all(preset.name in tables["loggers"] for preset in PRESETS)


def test_public_functions_are_there():
    for known in FORMATS.values():
        assert all(hasattr(bingham.io, function) for function in known.functions)


def test_the_command_lists_them():
    from typer.testing import CliRunner

    from bingham.cli.main import app

    result = CliRunner().invoke(app, ["formats", "--json"])
    told = json.loads(result.stdout)
    assert [row["name"] for row in told["formats"]] == list(FORMATS)
    assert [row["name"] for row in told["loggers"]] == [preset.name for preset in PRESETS]
    plain = CliRunner().invoke(app, ["formats"]).stdout
    assert all(name in plain for name in (*FORMATS, *ANGLES, *(preset.name for preset in PRESETS)))
    assert "``" not in plain
