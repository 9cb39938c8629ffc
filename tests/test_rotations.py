"""Array functions of quaternions: signs across gaps, what is rejected and what is not."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham.errors import InvalidArgumentError
from bingham.rotations import align_signs, compose, from_rotation_vector, rotate, to_rotation_vector

GAP = [np.nan] * 4


def test_signs_are_carried_over_missing_rows():
    q = np.array([GAP, [1.0, 0, 0, 0], GAP, [-1.0, 0, 0, 0], GAP, GAP, [0.6, 0.8, 0, 0], [-0.6, -0.8, 0, 0]])
    expected = np.array([GAP, [1.0, 0, 0, 0], GAP, [1.0, 0, 0, 0], GAP, GAP, [0.6, 0.8, 0, 0], [0.6, 0.8, 0, 0]])
    np.testing.assert_array_equal(align_signs(q), expected)


def test_vectors_turn_as_scipy_turns_them():
    rotation = Rotation.random(20, rng=np.random.default_rng(1))
    v = np.random.default_rng(2).standard_normal((20, 3))
    for q in (rotation, rotation.as_quat(scalar_first=True)):
        np.testing.assert_allclose(rotate(q, v), rotation.apply(v), atol=1e-14)


def test_a_missing_rotation_turns_vectors_into_missing_ones():
    rotated = rotate([[1.0, 0, 0, 0], GAP], [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(rotated, [[0.0, 0.0, 1.0], [np.nan] * 3])


@pytest.mark.parametrize(("call", "message"), [
    (lambda: rotate([2.0, 0, 0, 0], [1.0, 0, 0]), "q: expected unit quaternions within 1e-06, got length 2; normalise"),
    (lambda: rotate([1.0, 0, 0], [2.0, 0, 0, 0]), r"q: expected shape \(..., 4\), got \(3,\)"),
    (lambda: rotate([1.0, 0, 0, 0], [2.0, 0, 0, 0]), r"v: expected shape \(..., 3\), got \(4,\)"),
    (lambda: align_signs([1.0, 0, 0, 0]), r"q: expected one sequence, shape \(T, d\), got \(4,\)"),
    (lambda: align_signs("abc"), "q: expected an array of numbers, got 'abc'"),
    (lambda: from_rotation_vector([1.0, 0.0]), r"r: expected shape \(..., 3\), got \(2,\)"),
    (lambda: to_rotation_vector([1.0, 0.0]), r"q: expected shape \(..., 4\), got \(2,\)"),
    (lambda: compose(1.0, [1.0, 0, 0, 0]), "p, q: expected last axes of length 2 or 4"),
])  # fmt: skip
def test_bad_shapes_and_lengths_are_named(call, message):
    with pytest.raises(InvalidArgumentError, match=message):
        call()
