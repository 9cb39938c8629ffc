import numpy as np
import pytest

from bingham import Bingham
from bingham.sampling.composition_error import composition_error

NEAR = np.eye(4)[:, [1, 2, 3, 0]]


def test_in_the_plane_it_is_the_integral_over_the_circle():
    p, q = Bingham([-5.0, 0.0], np.eye(2)), Bingham([-2.0, 0.0], np.eye(2))
    angle = 2.0 * np.pi * np.arange(4000) / 4000
    x = np.column_stack([np.cos(angle), np.sin(angle)])
    matched = p.compose(q)
    ratio = matched.logpdf(x) - p.composed_logpdf(q, x)
    for reverse, weight in ((False, matched.pdf(x)), (True, -np.exp(p.composed_logpdf(q, x)))):
        assert composition_error(p, q, reverse=reverse) == pytest.approx(
            2.0 * np.pi * np.mean(weight * ratio), rel=5e-3
        )


@pytest.mark.parametrize("z", [(-10.0, -10.0, -1.0), (-50.0, -50.0, -50.0)])
def test_for_rotations_it_is_the_mean_over_samples(z):
    p = Bingham([*z, 0.0], NEAR)
    matched = p.compose(p)
    x = matched.rvs(100_000, rng=0)
    log_r = p.composed_logpdf(p, x) - matched.logpdf(x)
    values = np.expm1(log_r) - log_r
    found = composition_error(p, p)
    assert abs(found - values.mean()) < 4.0 * values.std() / np.sqrt(len(x)) + 5e-3 * found
