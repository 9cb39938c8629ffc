import json

import pytest
from typer.testing import CliRunner

from bingham.cli.main import app

run = CliRunner().invoke


def test_json_contract(tmp_path):
    result = run(app, ["reproduce", "kurz2013", "--runs", "3", "--json", "-o", str(tmp_path)])
    assert result.exit_code == 0, result.output
    report = json.loads(result.stdout)
    assert list(report) == ["study", "runs", "seed", "table", "figures"]
    assert (report["study"], report["runs"]) == ("kurz2013", 3)
    assert all(list(row) == ["case", "filter", "metric", "value", "stderr", "paper"] for row in report["table"])
    assert {"rmse_rad", "wins", "coverage_95", "kl", "us_per_step"} <= {row["metric"] for row in report["table"]}
    assert len(report["figures"]) == 3
    for path in report["figures"]:
        with open(path, "rb") as file:
            assert file.read(4) == b"\x89PNG"
    with open(tmp_path / "kurz2013.json") as file:
        assert json.load(file) == report


def test_the_table_is_printed_and_stored_runs_are_used(tmp_path, monkeypatch):
    arguments = ["reproduce", "kurz2013", "--runs", "3", "--no-figures", "-o", str(tmp_path)]
    said = run(app, arguments).stdout
    assert "scalar_kalman" in said
    assert " 60000 " in said
    assert "wins: number of runs" in said
    monkeypatch.setattr("bingham.studies.kurz2013.simulate", None)
    (stored,) = (tmp_path / "runs").glob("*/*.npz")
    before = stored.stat().st_mtime_ns
    run(app, arguments)
    assert stored.stat().st_mtime_ns == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(["kurz1813"], "expected one of kurz2013"), (["kurz2013", "--scheduler", "nowhere:1"], "scheduler: expected")],
)
def test_mistakes_end_in_one_line(tmp_path, arguments, words):
    result = run(app, ["reproduce", *arguments, "--runs", "2", "-o", str(tmp_path)])
    assert result.exit_code == 2
    assert words in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_list_names_the_studies():
    assert "kurz2013" in run(app, ["reproduce", "list"]).stdout


def test_errors_speak_of_options(bingham, tmp_path):
    for arguments, message in [
        (("glover2013", "--runs", 3), "--runs: expected at least 9, one signal for each cell of Table 1, got 3"),
        (("kurz1913",), "STUDY: expected one of"),
    ]:
        result = bingham("reproduce", *arguments, "-o", tmp_path / "out")
        assert result.exit_code == 2
        assert result.stderr.startswith(f"bingham: {message}")
