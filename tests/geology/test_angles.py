"""Compass angles and axes: values from the compass itself, round trips, and what has no answer."""

import numpy as np
import pytest

from bingham.errors import InvalidArgumentError
from bingham.geology import (
    from_declination_inclination,
    from_dip_direction,
    from_strike_dip,
    from_trend_plunge,
    to_declination_inclination,
    to_dip_direction,
    to_strike_dip,
    to_trend_plunge,
)

ROOT = np.sqrt(0.5)


@pytest.mark.parametrize(
    ("trend", "plunge", "axis"),
    [
        (0, 0, [1, 0, 0]),
        (90, 0, [0, 1, 0]),
        (45, 0, [ROOT, ROOT, 0]),
        (123, 90, [0, 0, 1]),
        (180, 45, [-ROOT, 0, ROOT]),
        (270, -45, [0, -ROOT, -ROOT]),
    ],
)
def test_lines(trend, plunge, axis):
    np.testing.assert_allclose(from_trend_plunge(trend, plunge), axis, atol=1e-15)
    np.testing.assert_allclose(from_declination_inclination(trend, plunge), axis, atol=1e-15)


def test_a_pole_is_normal_to_two_lines_in_its_plane():
    strike, dip = np.meshgrid(np.arange(0, 360, 7.0), np.arange(0, 91, 9.0))
    pole = from_strike_dip(strike, dip)
    along, steepest = from_trend_plunge(strike, 0), from_trend_plunge(strike + 90, dip)
    np.testing.assert_allclose(np.einsum("...i,...i", pole, along), 0, atol=1e-15)
    np.testing.assert_allclose(np.einsum("...i,...i", pole, steepest), 0, atol=1e-15)
    np.testing.assert_array_equal(pole[..., 2] >= 0, True)
    np.testing.assert_allclose(from_dip_direction(dip, strike + 90), pole, atol=1e-15)
    wrong = from_strike_dip(strike - 180, dip)  # the left-hand rule: another plane
    assert np.abs(np.einsum("...i,...i", wrong, steepest)).max() > 0.9


def test_round_trips_of_lower_ends():
    rng = np.random.default_rng(5)
    trend, plunge = rng.uniform(0, 360, 500), rng.uniform(0.001, 89.999, 500)
    for x in (from_trend_plunge(trend, plunge), -3.0 * from_trend_plunge(trend, plunge)):
        np.testing.assert_allclose(to_trend_plunge(x), (trend, plunge), atol=1e-10)
        np.testing.assert_allclose(to_strike_dip(x), ((trend + 90) % 360, 90 - plunge), atol=1e-10)
        np.testing.assert_allclose(to_dip_direction(x), (90 - plunge, (trend + 180) % 360), atol=1e-10)
    np.testing.assert_allclose(from_trend_plunge(*to_trend_plunge(-x)), from_trend_plunge(trend, plunge), atol=1e-14)
    inclination = rng.uniform(-90, 90, 500)
    there = to_declination_inclination(from_declination_inclination(trend, inclination))
    np.testing.assert_allclose(there, (trend, inclination), atol=1e-10)


def test_ends_of_the_range():
    for x, expected in (
        ([0, 0, 1], (0, 90)),
        ([0, 0, -2], (0, 90)),
        ([-1, 0, 0], (0, 0)),
        ([0, -1, 0], (90, 0)),
        ([1, -1e-18, 0], (0, 0)),
        ([1, 1e-300, 1e-300], (0, 0)),
    ):
        for end in (np.array(x, dtype=float), -np.array(x, dtype=float)):
            np.testing.assert_allclose(to_trend_plunge(end), expected, atol=1e-290)


def test_shapes_broadcast():
    assert from_trend_plunge(np.zeros((4, 1)), np.zeros(3)).shape == (4, 3, 3)
    assert to_trend_plunge(np.ones((2, 5, 3)))[1].shape == (2, 5)


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: from_trend_plunge(10, 91), "plunge"),
        (lambda: from_trend_plunge(10, -90.1), "plunge"),
        (lambda: from_dip_direction(20, np.inf), "dip_direction"),
        (lambda: from_dip_direction(210, 20), "dip"),
        (lambda: from_strike_dip(10, -1), "dip"),
        (lambda: from_declination_inclination([1, np.nan], 3), "declination"),
        (lambda: from_trend_plunge("N", 3), "trend"),
        (lambda: to_trend_plunge([0, 0, 0]), "x"),
        (lambda: to_trend_plunge([0, 1]), "x"),
        (lambda: to_trend_plunge([0, 1, np.nan]), "x"),
    ],
)
def test_what_is_no_angle_is_named(call, argument):
    with pytest.raises(InvalidArgumentError, match=rf"^{argument}: expected"):
        call()
