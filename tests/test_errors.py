"""Errors go through pickle, as they do between processes, with message and fields."""

import pickle

import numpy as np
import pytest

from bingham.errors import BinghamError, ConvergenceError, InvalidArgumentError, MissingExtraError, RecordingError


@pytest.mark.parametrize(
    "error",
    [
        InvalidArgumentError("runs", "at least 1", 0, "give more"),
        ConvergenceError("no convergence", 0.25),
        RecordingError("a.csv", "line 3", "not a number"),
        MissingExtraError("joblib", "cli", "running"),
        BinghamError("a message"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_errors_survive_pickling(error):
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert vars(again) == vars(error)


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (-1.5, "-1.5"),
        (np.eye(2), "[[1. 0.] [0. 1.]]"),
        (np.full((200, 3), 0.5), "shape (200, 3): 0.5, 0.5, 0.5, 0.5, …"),
        (list(range(1000)), f"{str(list(range(1000)))[:100]}…"),
        (np.random.default_rng, None),
        ("a" * 300, "a" * 300),
        ("two\nlines", "two lines"),
        ("b" * 9999, "b" * 400 + "…"),
    ],
)
def test_values_are_one_line_of_bounded_length(value, said):
    error = InvalidArgumentError("x", "something else", value)
    assert error.got is value
    assert str(error) == f"x: expected something else, got {value if said is None else said}"


def test_a_long_result_that_was_reached_is_named_only():
    class Distribution:
        def __repr__(self):
            return "Distribution(" + "0, " * 100 + ")"

    error = ConvergenceError("no convergence", distribution := Distribution(), "more steps")
    assert error.reached is distribution
    assert str(error) == "no convergence; reached a Distribution; more steps"
