"""Rows, chunks and results of studies, against numbers worked out by hand."""

import numpy as np
import pytest

from bingham.errors import InvalidArgumentError
from bingham.studies.study import Row, StudyResult, generator, joined, mean_row, range_chunks, wins_row


def test_mean_row():
    # Squares of the deviations from 5: 9, 1, 1, 9; s² = 20/3, s.e. = √(20/3)/√4 = √(5/3).
    row = mean_row("2-D", "bingham", "rmse_rad", [2.0, 4.0, 6.0, 8.0], paper=4.5)
    assert row == Row("2-D", "bingham", "rmse_rad", 5.0, pytest.approx(np.sqrt(5.0 / 3.0), rel=1e-14), 4.5)
    # Each value four times: the deviations stay, their number counts.
    many = mean_row("2-D", "bingham", "rmse_rad", np.repeat([2.0, 4.0, 6.0, 8.0], 4))
    assert many.stderr == pytest.approx(np.sqrt(80.0 / 15.0 / 16.0), rel=1e-14)
    assert many.paper is None


def test_mean_row_of_a_single_run_has_no_standard_error():
    assert mean_row("2-D", "bingham", "kl", [0.25]) == Row("2-D", "bingham", "kl", 0.25, None, None)


def test_wins_row():
    # 16 of 20 won: binomial deviation √(20 · 0.8 · 0.2) = √3.2 runs.
    row = wins_row("4-D", "bingham", [True] * 16 + [False] * 4, paper=19)
    assert row == Row("4-D", "bingham", "wins", 16.0, pytest.approx(np.sqrt(3.2), rel=1e-14), 19)
    assert wins_row("4-D", "bingham", [True, True]) == Row("4-D", "bingham", "wins", 2.0, 0.0, None)


def test_range_chunks_cover_every_run_once():
    chunks = range_chunks("runs-", dict, 250, 100, seed=3)
    assert [c.arguments for c in chunks] == [
        {"seed": 3, "first": 0, "last": 100},
        {"seed": 3, "first": 100, "last": 200},
        {"seed": 3, "first": 200, "last": 250},
    ]
    assert [c.key for c in chunks] == sorted(c.key for c in chunks)
    assert len(range_chunks("runs-", dict, 100, 100)) == 1


def test_joined_goes_by_run_whatever_finished_first():
    chunks = range_chunks("a-", dict, 1100, 100)
    results = {c.key: {"x": np.arange(c.arguments["first"], c.arguments["last"])} for c in reversed(chunks)}
    results["b-0000000-0000001"] = {"x": np.array([-1])}
    np.testing.assert_array_equal(joined(results, "a-", "x"), np.arange(1100))


def test_each_run_has_random_numbers_of_its_own():
    draws = {
        key: tuple(generator(*key).standard_normal(3)) for key in ((1, 0), (1, 1), (2, 0), (1, 0, 0), (1, 0, 1), (0, 1))
    }
    assert len(set(draws.values())) == len(draws)
    assert draws[1, 0] == tuple(generator(1, 0).standard_normal(3))


def test_result_as_dict_and_by_name():
    rows = [Row("2-D", "bingham", "rmse_rad", 0.2, 0.01, 0.19), Row("2-D", "bingham", "wins", 9.0)]
    result = StudyResult("demo", 10, 4, rows, {"curve": np.zeros(2)})
    assert result.as_dict() == {
        "study": "demo",
        "runs": 10,
        "seed": 4,
        "table": [
            {"case": "2-D", "filter": "bingham", "metric": "rmse_rad", "value": 0.2, "stderr": 0.01, "paper": 0.19},
            {"case": "2-D", "filter": "bingham", "metric": "wins", "value": 9.0, "stderr": None, "paper": None},
        ],
    }
    assert result.value("2-D", "bingham", "wins") == 9.0
    with pytest.raises(InvalidArgumentError, match="a row of the table"):
        result.value("2-D", "bingham", "kl")
