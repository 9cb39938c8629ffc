"""Errors go through pickle, as they do between processes, with message and fields."""

import pickle

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
