"""Pages whose numbers come from the results files."""

import importlib.util
import json
import re
from pathlib import Path

import pytest

from bingham.studies import load_study

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def results():
    spec = importlib.util.spec_from_file_location("study_results", DOCS / "study_results.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", ["glover2013-ball", "madaan2017"])
def test_every_place_of_a_page_has_its_row(results, page):
    text = (DOCS / "studies" / f"{page}.rst").read_text(encoding="utf-8")
    assert len(results.PLACE.findall(text)) > 10
    assert "{{" not in re.sub(r"{{results:[\w-]+}}", "", results.fill_results(text))


@pytest.mark.parametrize("page", ["glover2013", "glover2013-ball", "kurz2013", "kurz2014", "madaan2017"])
def test_results_are_of_the_studies_default_runs(results, page):
    study = load_study(page)
    stored = json.loads((DOCS / "studies" / "results" / f"{page}.json").read_text(encoding="utf-8"))
    assert (stored["study"], stored["runs"], stored["seed"]) == (page, study.default_runs, 1)


def test_a_place_without_a_row_is_an_error(results):
    with pytest.raises(KeyError):
        results.fill_results("{{glover2013-ball | no such case | x | y | .1f}}")


def test_what_the_ball_page_says_is_so(results):
    rows = results.rows_of("glover2013-ball")
    case = "logo noise -200/-200/-100, frame 30"

    def value(name, metric):
        return rows[case, name, metric]["value"]

    assert value("bingham_second_order", "classification_rate") >= 0.98
    assert value("bingham_mixture", "classification_rate") >= 0.995
    assert value("bingham_mixture", "spin_error_rad") <= 0.10
    # At the published noises: what the product of marginals and the girdle for a logo out of sight cost.
    assert value("ekf_mixture", "spin_error_rad") <= 0.10 < 0.75 * value("bingham_mixture_published", "spin_error_rad")
    assert value("ekf_mixture", "classification_rate") >= 0.995
    assert value("bingham_oracle", "spin_error_rad") > 0.9 * value("bingham_mixture_published", "spin_error_rad")
    assumed = "logo noise -40/-40/-10, frame 30"
    joint, apart = (rows[assumed, name, "spin_error_rad"] for name in ("ekf_mixture", "bingham_mixture_published"))
    assert joint["value"] < apart["value"] - 2.0 * joint["stderr"]
    difference = rows[case, "ekf_first_order", "spin_error_rad_above_second_order"]
    assert abs(difference["value"]) < 2.0 * difference["stderr"]
    ahead = rows[case, "bingham_first_order_fair", "spin_error_rad_above_second_order"]
    assert ahead["value"] < -3.0 * ahead["stderr"]


def test_the_page_of_figures_has_no_empty_row():
    lines = (DOCS / "papers.rst").read_text(encoding="utf-8").split("What is printed wrong")[0].splitlines()
    starts = [i for i, line in enumerate(lines) if line.startswith("   * - ")]
    assert len(starts) > 25
    for i in starts:
        assert lines[i][7:].strip() and lines[i + 1].startswith("     - ") and lines[i + 1][7:].strip(), lines[i]
