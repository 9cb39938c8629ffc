import json

import numpy as np
import pytest
from typer.testing import CliRunner

from bingham.cli.main import app
from bingham.cli.study_table import shown_rows, write_result
from bingham.io import write_csv
from bingham.recording import OrientationRecording
from bingham.studies import STUDIES, load_study
from bingham.studies.study import Row, StudyResult

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
def test_mistakes_end_in_one_line(tmp_path, monkeypatch, arguments, words):
    if "--scheduler" in arguments:
        pytest.importorskip("dask.distributed", reason="extra 'dask' not installed")
    monkeypatch.setattr("bingham.studies.workers.CONNECT_WAIT", 0.2)
    result = run(app, ["reproduce", *arguments, "--runs", "2", "-o", str(tmp_path)])
    assert result.exit_code == 2
    assert words in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def table(cases, published):
    """Rows of two filters and two metrics for each case; for some cases the paper has one metric of one filter."""
    return [
        Row(f"case {k}", name, metric, 1.0, paper=2.0 if k < published and (name, metric) == ("a", "rmse") else None)
        for k in range(cases)
        for name in ("a", "b")
        for metric in ("rmse", "nees")
    ]


def test_of_a_long_table_published_cases_and_metrics_are_printed():
    assert len(shown_rows(table(15, 3))) == 60  # not long
    assert len(shown_rows(table(40, 0))) == 160  # nothing published
    rows = shown_rows(table(16, 3))
    assert [(row.case, row.filter) for row in rows] == [(f"case {k}", name) for k in range(3) for name in ("a", "b")]
    assert {row.metric for row in rows} == {"rmse"}
    # A study's headlines are printed whether published or not.
    more = shown_rows(table(16, 3), ("nees",))
    assert sum(row.metric == "nees" for row in more) == 32 and len(more) == 32 + len(rows)


def test_all_rows_are_in_the_files_and_printed_on_demand(tmp_path, capsys):
    result = StudyResult("kurz2013", 1, 1, table(16, 3))
    for all_rows, printed in ((False, 6), (True, 64)):
        write_result(result, tmp_path, draw_figures=False, as_json=False, all_rows=all_rows)
        said = capsys.readouterr().out
        assert said.count("case ") - said.count("┃ case ") == printed
        assert (
            f"6 of 64 rows, those of cases and metrics with a published value; all are in {tmp_path}" in said
        ) != all_rows
        assert len((tmp_path / "kurz2013.csv").read_text().splitlines()) == 65
        assert len(json.loads((tmp_path / "kurz2013.json").read_text())["table"]) == 64


def test_list_names_the_studies_and_their_runs():
    lines = run(app, ["reproduce", "list"]).stdout.splitlines()
    assert [line.split()[:3] for line in lines] == [[n, str(load_study(n).default_runs), "runs"] for n in STUDIES]
    assert all(line.endswith(load_study(name).title) for name, line in zip(STUDIES, lines, strict=True))
    assert run(app, ["reproduce"]).stdout.splitlines() == lines


def test_json_stays_pure_beside_a_bar(tmp_path, monkeypatch):
    # What Rich takes for a terminal, it then draws on.
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    result = run(app, ["reproduce", "kurz2013", "--runs", "2", "--json", "--no-figures", "-o", str(tmp_path)])
    assert json.loads(result.stdout)["runs"] == 2
    assert "━" in result.stderr
    monkeypatch.delenv("FORCE_COLOR")
    assert (
        run(app, ["reproduce", "kurz2013", "--runs", "2", "--json", "--no-figures", "-o", str(tmp_path)]).stderr == ""
    )


@pytest.mark.parametrize("place", ["file", "file/below", "folder"])
def test_a_file_in_the_way_is_found_before_the_runs(bingham, tmp_path, monkeypatch, place):
    (tmp_path / "file").write_text("kept")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "runs").write_text("kept")
    monkeypatch.setattr("bingham.studies.kurz2013.simulate", None)
    result = bingham("reproduce", "kurz2013", "--runs", 2, "-o", tmp_path / place)
    assert result.exit_code == 2
    in_the_way = tmp_path / ("folder/runs" if place == "folder" else "file")
    assert result.stderr == (
        f"bingham: {in_the_way}: a file, where a folder is to be written; give another name to --output\n"
    )
    assert in_the_way.read_text() == "kept"


def test_options_without_effect_are_rejected(bingham, tmp_path):
    for arguments, message in [
        (("kurz2013", "--recording", tmp_path / "a.csv"), "--recording: expected a study that takes one (madaan2017)"),
        (("kurz2013", "--jobs", 1, "--scheduler", "tcp://10.0.0.5:8786"), "--jobs: expected no --scheduler"),
        (("kurz2013", "--all-rows", "--json"), "--all-rows: expected a table to print, got --json, which has all rows"),
        (("--runs", 5), "--runs: expected the name of a study with it, got list"),
    ]:
        result = bingham("reproduce", *arguments)
        assert result.exit_code == 2
        assert result.stderr.startswith(f"bingham: {message}")
        assert len(result.stderr.splitlines()) == 1


def test_a_recording_is_used_and_part_of_what_is_stored(bingham, tmp_path, axes_in_plane):
    path = tmp_path / "turn.csv"
    half = 0.05 * np.arange(50)
    q = np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
    write_csv(path, OrientationRecording("turn", np.arange(50) / 50.0, q))
    result = bingham("reproduce", "madaan2017", "--runs", 1, "--recording", path, "--json", "--no-figures",
                     "-o", tmp_path / "out")  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "recorded motion" in {row["case"] for row in json.loads(result.stdout)["table"]}
    assert len(list((tmp_path / "out/runs").iterdir())) == 1
    result = bingham("reproduce", "madaan2017", "--runs", 1, "--recording", axes_in_plane, "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert result.stderr.startswith("bingham: --recording: expected quaternions")


def test_errors_speak_of_options(bingham, tmp_path):
    for arguments, message in [
        (("glover2013", "--runs", 3), "--runs: expected at least 9, one signal for each cell of Table 1, got 3"),
        (("kurz1913",), "STUDY: expected one of"),
    ]:
        result = bingham("reproduce", *arguments, "-o", tmp_path / "out")
        assert result.exit_code == 2
        assert result.stderr.startswith(f"bingham: {message}")


def test_fresh_forgets_the_runs_of_this_study_only(bingham, tmp_path):
    def reproduce(*more):
        result = bingham("reproduce", "kurz2013", "--runs", 2, "--json", "--no-figures", "-o", tmp_path, *more)
        return [row for row in json.loads(result.stdout)["table"] if row["metric"] != "us_per_step"]

    kept = reproduce("--seed", 2)
    (other,) = (tmp_path / "runs").glob("*/*.npz")
    first = reproduce()
    (stored,) = set((tmp_path / "runs").glob("*/*.npz")) - {other}
    # Stored runs are taken as they are, here those of another seed.
    stored.write_bytes(other.read_bytes())
    assert reproduce() == kept != first
    assert reproduce("--fresh") == first
    assert other.exists()


def test_an_interruption_says_what_is_kept_and_the_next_call_goes_on(bingham, tmp_path, monkeypatch):
    from bingham.studies.store import RunStore

    save, saved = RunStore.save, []

    def save_two_then_stop(self, key, arrays):
        if len(saved) == 2:
            raise KeyboardInterrupt
        saved.append(key)
        save(self, key, arrays)

    arguments = ("reproduce", "madaan2017", "--runs", 1, "--json", "--no-figures", "-o", tmp_path)
    with monkeypatch.context() as patched:
        patched.setattr(RunStore, "save", save_two_then_stop)
        result = bingham(*arguments)
    assert result.exit_code == 130
    assert result.stdout == ""
    assert result.stderr.startswith("bingham: interrupted; 2 of ")
    assert f"parts are stored in {tmp_path / 'runs'}" in result.stderr
    assert "the same command continues from there" in result.stderr
    assert not (tmp_path / "madaan2017.json").exists()
    times = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").glob("*/*.npz")}
    assert len(times) == 2
    assert bingham(*arguments).exit_code == 0
    assert all(path.stat().st_mtime_ns == before for path, before in times.items())
