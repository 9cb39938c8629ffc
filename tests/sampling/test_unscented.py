import numpy as np
import pytest

from bingham import Bingham, InvalidArgumentError
from bingham.sampling import Unscented, with_antipodes

SPECTRA = [
    [0.0, 0.0],
    [-3.0, 0.0],
    [-1e6, 0.0],
    [0.0, 0.0, 0.0],
    [-40.0, 0.0, 0.0],
    [-1e6, -1e6, 0.0],
    [0.0, 0.0, 0.0, 0.0],
    [-9.0, -5.0, -1e-3, 0.0],
    [-1e6, -1e6, -1e6, 0.0],
    [-1e6, -1e3, 0.0, 0.0],
    [-30.0, -20.0, -10.0, -5.0, 0.0],
]


def frame(d, seed=0):
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(d, d)))[0]


@pytest.mark.parametrize("z", SPECTRA)
@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
def test_second_moment_is_exact_and_points_are_unit(z, share):
    distribution = Bingham(z, frame(len(z)))
    x, w = Unscented(mode_share=share).sample(distribution)
    assert x.shape == (2 * len(z) - 1, len(z))
    assert abs(w.sum() - 1.0) < 1e-15 and np.all(w >= 0.0)
    assert np.abs((x.T * w) @ x - distribution.moment()).max() < 1e-14
    assert np.abs(np.linalg.norm(x, axis=1) - 1.0).max() < 1e-14
    # Small moments keep their digits in the principal axes.
    y = Unscented(mode_share=share).sample(Bingham(z, np.eye(len(z))))
    relative = ((y.points.T * y.weights) @ y.points).diagonal() / distribution.axis_moments
    assert np.abs(relative - 1.0).max() < 1e-13


def test_mirrored_points_have_mean_zero_and_the_same_second_moment():
    distribution = Bingham([-8.0, -3.0, -1.0, 0.0], frame(4))
    sample = Unscented().sample(distribution)
    x, w = with_antipodes(sample)
    assert np.abs(w @ x).max() < 1e-16
    assert np.abs(sample.weights @ sample.points).max() > 0.1
    assert np.abs((x.T * w) @ x - distribution.moment()).max() < 1e-14


def test_three_equal_weights_on_the_circle():
    distribution = Bingham([-2.5, 0.0], frame(2))
    x, w = Unscented(uniform=True).sample(distribution)
    assert np.allclose(w, 1.0 / 3.0, rtol=0, atol=1e-16)
    assert np.abs(x.T @ x / 3.0 - distribution.moment()).max() < 1e-15


def test_bad_arguments_are_rejected():
    with pytest.raises(InvalidArgumentError, match="mode_share"):
        Unscented(mode_share=1.0)
    with pytest.raises(InvalidArgumentError, match="circle"):
        Unscented(uniform=True).sample(Bingham.uniform(4))
    with pytest.raises(InvalidArgumentError, match="single distribution"):
        Unscented().sample(Bingham([[-1.0, 0.0], [-2.0, 0.0]], np.eye(2)))
