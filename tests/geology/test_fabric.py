"""Fabric, maps and contours against published numbers and closed forms."""

import numpy as np
import pytest

from bingham import Bingham, InvalidArgumentError
from bingham.geology import (
    exponential_density,
    fabric,
    fitted_density,
    from_trend_plunge,
    kamb_density,
    project,
    to_trend_plunge,
    unproject,
)


def test_quetico_lineations(published):
    result = fabric(published("quetico_lineations"))
    np.testing.assert_allclose(result.eigenvalues, [0.89045, 0.06737, 0.04218], atol=5e-6)
    assert pytest.approx(5.515, abs=5e-4) == result.K
    assert pytest.approx(3.050, abs=5e-4) == result.C
    np.testing.assert_allclose(result.mean_axis, [69.1, 14.8], atol=0.05)
    assert pytest.approx(1.0) == result.P + result.G + result.R


def test_gray_poles_are_a_girdle(published):
    result = fabric(published("gray1980_poles"))
    assert pytest.approx(0.0092, abs=5e-5) == result.K
    assert result.G > 0.9
    strike, dip = result.best_plane
    trend, plunge = result.fold_axis
    assert (strike + 270) % 360 == pytest.approx(trend)
    assert dip == pytest.approx(90 - plunge)


def test_errors_of_eigenvalues_are_those_of_repeated_samples():
    p = Bingham([-12.0, -5.0, 0.0], np.eye(3))
    result = fabric(p.rvs((400, 200), rng=1))
    spread = result.eigenvalues.std(axis=0)
    np.testing.assert_allclose(result.eigenvalue_errors.mean(axis=0), spread, rtol=0.12)


@pytest.mark.parametrize("projection", ["equal-area", "equal-angle"])
def test_maps_and_back(projection):
    x = Bingham.uniform(3).rvs(500, rng=1)
    points = project(x, projection)
    assert np.linalg.norm(points, axis=1).max() <= 1.0
    back = unproject(points, projection)
    np.testing.assert_allclose(np.abs(np.sum(back * x, axis=1)), 1.0, atol=1e-12)
    # East of north, outwards as the plunge falls.
    assert project(from_trend_plunge(90.0, 30.0), projection)[0] > 0
    np.testing.assert_allclose(np.linalg.norm(project(from_trend_plunge(17.0, 0.0), projection)), 1.0)
    angle = np.radians(60.0)
    radius = {"equal-area": np.sqrt(2) * np.sin(angle / 2), "equal-angle": np.tan(angle / 2)}[projection]
    assert np.linalg.norm(project(from_trend_plunge(17.0, 30.0), projection)) == pytest.approx(radius)


def test_densities_of_uniform_axes_are_level():
    x, at = Bingham.uniform(3).rvs(50_000, rng=1), Bingham.uniform(3).rvs(300, rng=2)
    # n A axes in each circle, σ standard deviations √(n A (1 − A)) of them.
    k = kamb_density(x, at, sigma=3.0)
    assert k.mean() == pytest.approx(3.0, abs=0.2)
    assert k.std() == pytest.approx(1.0, abs=0.2)
    e = exponential_density(x, at, sigma=3.0)
    assert e.std() == pytest.approx(1.0, abs=0.25)
    np.testing.assert_allclose(fitted_density(Bingham.uniform(3), at), 1.0)


def test_kamb_counts_what_is_within_the_circle():
    at = np.array([[0.0, 0.0, 1.0]])
    n, sigma = 12, 3.0
    area = sigma**2 / (n + sigma**2)
    limit = np.degrees(np.arccos(1 - area))
    x = from_trend_plunge(np.arange(n) * 30.0, np.repeat([90 - limit + 0.01, 90 - limit - 0.01], 6))
    assert kamb_density(x, at)[0] == pytest.approx(6 / np.sqrt(n * area * (1 - area)))


@pytest.mark.parametrize("projection", ["equal-area", "equal-angle", "stereonet"])
def test_nets_are_drawn_on_given_axes(projection, published):
    figure_module = pytest.importorskip("matplotlib.figure")
    from bingham.geology import draw_axes, draw_contours, draw_ellipse, draw_great_circle, draw_net

    if projection == "stereonet":
        pytest.importorskip("mplstereonet")
        axes = figure_module.Figure().add_subplot(projection="stereonet")
    else:
        axes = figure_module.Figure().add_subplot()
    x = published("vollmer1981_poles")
    result = fabric(x)
    kind = "equal-area" if projection == "stereonet" else projection
    draw_net(axes, projection=kind)
    before = len(axes.lines)
    draw_axes(axes, x, projection=kind)
    draw_great_circle(axes, result.eigenvectors[:, 2], projection=kind)
    draw_ellipse(axes, result.pole_ellipse, projection=kind)
    points, circle, ellipse = axes.lines[before:]
    if projection == "stereonet":
        # Its own functions put lines and planes at the same places.
        import mplstereonet.stereonet_math as theirs

        trend, plunge = to_trend_plunge(x)
        inside = plunge > 0.01  # on the edge either end will do
        expected = np.array(theirs.line(plunge[inside], trend[inside]))
        np.testing.assert_allclose(np.array(points.get_data())[:, inside], expected, atol=1e-9)
    else:
        assert np.nanmax(np.hypot(*circle.get_data())) == pytest.approx(1.0)
        np.testing.assert_allclose(np.transpose(points.get_data()), project(x, kind))
        # Every point of the drawn plane lies in it.
        drawn = np.transpose(circle.get_data())
        drawn = drawn[np.isfinite(drawn).all(axis=1)]
        np.testing.assert_allclose(unproject(drawn, kind) @ result.eigenvectors[:, 2], 0.0, atol=1e-9)
    assert np.isnan(ellipse.get_xdata()).any()
    for what, method in ((x, "kamb"), (x, "exponential"), (result.distribution, "exponential")):
        assert draw_contours(axes, what, method, projection=kind).levels.size > 1
    axes.figure.canvas.draw()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fabric(np.eye(4)), "x: expected axes in space"),
        (lambda: fabric(np.eye(3)), "x: expected at least 4 axes, got 3"),
        (
            lambda: project([[0, 0, 1.0]], "schmidt"),
            "projection: expected 'equal-area' or 'equal-angle', got 'schmidt'",
        ),
        (lambda: kamb_density(np.eye(3), [[0, 0, 1.0]], sigma=0), "sigma: expected a number of standard deviations"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(InvalidArgumentError, match=message):
        call()


def test_angles_are_not_taken_for_axes():
    for angles in ([212.0, 14.0], [[212.0, 14.0], [205.0, 18.0], [31.0, 4.0]]):
        with pytest.raises(InvalidArgumentError, match=r"north, east, down.*from_trend_plunge"):
            fabric(angles)
