"""Sensors of users: what they answer is checked."""

import numpy as np
import pytest

from bingham import Bingham, BinghamFilter
from bingham.errors import InvalidArgumentError
from bingham.models import Likelihood


class Answering:
    """A sensor that answers as it is told."""

    def __init__(self, answer):
        self.answer = answer

    def likelihood(self, z, predicted):
        return self.answer


@pytest.mark.parametrize(
    ("answer", "got"),
    [
        (np.zeros((4, 4)), "an array of shape (4, 4)"),
        (Likelihood(np.zeros((3, 3)), 0.0, 3), "shape (3, 3)"),
        (Likelihood(np.full((4, 4), np.nan), 0.0, 3), "NaN or infinity"),
        (Likelihood(np.zeros((4, 4)), np.inf, 3), "NaN or infinity"),
        (Likelihood(np.triu(np.ones((4, 4))), 0.0, 3), "one that is not symmetric"),
        (Likelihood(50.0 * np.eye(4), 0.0, 3), "50"),
    ],
)
def test_what_a_sensor_answers_is_checked_and_the_sensor_named(answer, got):
    f = BinghamFilter(Bingham([-9.0, -9.0, -9.0, 0.0], np.eye(4)), Answering(answer))
    for use in (lambda: f.update(Bingham.uniform(4), np.zeros(4)), lambda: f.run(Bingham.uniform(4), np.zeros((3, 4)))):
        with pytest.raises(InvalidArgumentError) as caught:
            use()
        assert caught.value.argument == "likelihood" and "Answering" in caught.value.expected
        assert caught.value.got == got
