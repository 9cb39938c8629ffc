"""What the documentation and `bingham formats` say is made of the registry."""

import json
import re
import sys
from pathlib import Path

import pytest

import bingham.io
from bingham.errors import RecordingError, RecordingWarning
from bingham.io import detect_format
from bingham.io.angles import ANGLES
from bingham.io.formats import FORMATS, formats_in
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


def test_the_format_of_contributing_is_one_file(tmp_path, monkeypatch):
    text = (DOCS.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    code = next(block for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "FORMAT = Format(" in block)
    package = tmp_path / "more"
    package.mkdir()
    (package / "json_lines.py").write_text(code, encoding="utf-8")
    (package / "other.py").write_text("nothing = 0\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    found = formats_in(package, "more")
    assert list(found) == ["json-lines"]
    monkeypatch.setattr("bingham.io.detect.FORMATS", {**found, **FORMATS})
    file = tmp_path / "walk.jsonl"
    rows = [{"t": k / 100, "gyr": [0.1, 0.2, k / 50], "acc": [0.0, 0.0, 9.81]} for k in range(50)]
    rows[30]["t"] = rows[29]["t"]
    file.write_text("\n".join(map(json.dumps, rows)) + "\n")
    assert detect_format(file) == "json-lines"
    with pytest.warns(RecordingWarning, match="1 of 50 time stamps repeat"):
        recording = bingham.io.read_recording(file)
    assert recording.gyroscope[-1].tolist() == [0.1, 0.2, 49 / 50]
    file.write_text("\n".join(map(json.dumps, rows)) + '\n{"t": 1}\n')
    with pytest.raises(RecordingError, match="line 51: no sample"):
        bingham.io.read_recording(file)


def test_formats_that_take_any_text_come_last():
    assert list(FORMATS)[-2:] == ["tum", "csv"]


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
