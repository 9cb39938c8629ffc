import numpy as np
import pytest

from bingham import Bingham, InvalidArgumentError
from bingham.plot import plot_density
from bingham.plot.density import _grid, _pointing
from bingham.rotations import rotate


@pytest.mark.parametrize("d", [2, 3, 4])
def test_densities_are_drawn_without_samples(d, tmp_path):
    distribution = Bingham([-20.0, *[-3.0] * (d - 2), 0.0], np.eye(d))
    plot_density(distribution, title="a density").savefig(tmp_path / "density.png")
    assert (tmp_path / "density.png").stat().st_size > 5000


def test_other_dimensions_are_named():
    with pytest.raises(InvalidArgumentError, match="d = 2, 3 or 4"):
        plot_density(Bingham.uniform(5))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_density_of_a_body_axis_is_that_of_samples(axis):
    rng = np.random.default_rng(axis)
    p = Bingham([-60.0, -20.0, -3.0, 0.0], np.linalg.qr(rng.normal(size=(4, 4)))[0])
    directions = np.stack(_grid(), axis=-1)
    values = _pointing(p, np.eye(3)[axis], directions)
    weight = np.sin(np.linspace(0.0, np.pi, 91))[:, None] * (np.pi / 90) * (2.0 * np.pi / 180)
    assert (values[:, :-1] * weight).sum() == pytest.approx(1.0, abs=1e-4)
    drawn = rotate(p.rvs(100_000, rng=rng), np.eye(3)[axis])
    moment = np.einsum("abi,abj,ab->ij", directions[:, :-1], directions[:, :-1], values[:, :-1] * weight)
    assert np.abs(moment - drawn.T @ drawn / len(drawn)).max() < 5e-3
