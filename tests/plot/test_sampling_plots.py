import numpy as np
import pytest

from bingham import Bingham
from bingham.sampling import RiemannianSampling

pytest.importorskip("matplotlib")

from bingham.plot.sampling import draw_circle_samples, draw_sphere_samples, draw_tangent_samples, tangent
from bingham.plot.studies.style import new_figure


def test_tangent_vectors_have_the_angle_from_the_mode_and_no_sign():
    distribution = Bingham([-5.0, -4.0, -3.0, 0.0], np.linalg.qr(np.random.default_rng(1).normal(size=(4, 4)))[0])
    x = distribution.rvs(50, rng=2)
    t = tangent(distribution, x)
    assert np.allclose(np.linalg.norm(t, axis=1), np.arccos(np.abs(x @ distribution.mode)), atol=1e-12)
    assert np.allclose(t, tangent(distribution, -x)) and np.allclose(
        tangent(distribution, distribution.mode[None]), 0.0
    )


def test_points_are_drawn_where_they_are():
    sampler = RiemannianSampling(20)
    figure, axes = new_figure(6.0, 2.0, 1, 3)
    circle = Bingham([-4.0, 0.0], np.eye(2))
    points = sampler.sample(circle).points
    draw_circle_samples(axes[0], circle, points)
    drawn = np.concatenate([np.column_stack(line.get_data()) for line in axes[0].lines[1:]])
    assert np.allclose(drawn, np.concatenate([points, -points]))
    sphere = Bingham([-9.0, -4.0, 0.0], np.eye(3))
    points = sampler.sample(sphere).points
    draw_sphere_samples(axes[1], sphere, points)
    offsets = np.asarray(axes[1].collections[-1].get_offsets())
    # One of each pair is in front; about the mode these are the samples themselves.
    assert len(offsets) == 20 and np.allclose(np.sort(offsets[:, 0]), np.sort(points[:, 1]))
    rotation = Bingham([-4.0, -4.0, -4.0, 0.0], np.eye(4))
    draw_tangent_samples(axes[2], rotation, sampler.sample(rotation).points)
    assert len(axes[2].lines[-1].get_data()[0]) == 20
    figure.canvas.draw()
