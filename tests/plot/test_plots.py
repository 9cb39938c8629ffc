import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham import Bingham, BinghamFilter, BinghamMixture
from bingham.models.diffusion import Diffusion
from bingham.models.sensors import OrientationSensor
from bingham.plot.axes import equal_area, plot_fit
from bingham.plot.mixture import plot_mixture
from bingham.plot.planar_track import plot_planar_track
from bingham.plot.sphere import project
from bingham.plot.style import stride, unbroken
from bingham.plot.track import _half_widths, _spread_of_angles, plot_track
from bingham.plot.tuning import plot_profiles
from bingham.rotations import canonical, from_rotation_vector, to_rotation, yaw_pitch_roll


def test_equal_area_keeps_areas_and_directions():
    rng = np.random.default_rng(1)
    v = rng.normal(size=(40000, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    flat = equal_area(v)
    np.testing.assert_allclose(equal_area(-v), flat)
    # Uniform axes fill the disc uniformly: the square of the radius is uniform on [0, 1].
    square = np.sort(np.sum(flat**2, axis=1))
    assert square[-1] <= 1 + 1e-12
    distance = np.abs(square - (np.arange(40000) + 0.5) / 40000).max()
    assert distance < 1.95 / np.sqrt(40000)  # Kolmogorov's 0.999 quantile
    # 30° below the horizon in the south-east.
    axis = [-np.sqrt(3 / 8), np.sqrt(3 / 8), 0.5]
    np.testing.assert_allclose(equal_area(np.array(axis)), [0.5, -0.5], rtol=1e-12)


def test_euler_angles_and_their_change_with_a_small_turn():
    q = Rotation.random(200, rng=2)
    angle = yaw_pitch_roll(q.as_quat(scalar_first=True))
    np.testing.assert_allclose(angle, q.as_euler("ZYX"), atol=1e-9)
    step, root = 1e-6, np.random.default_rng(4).normal(size=(3, 3))
    variance = np.zeros((200, 3))  # of the angles, for small world rotations with covariance root rootᵀ
    for column in root.T:
        rotated = Rotation.from_rotvec(step * column) * q
        change = yaw_pitch_roll(rotated.as_quat(scalar_first=True)) - angle
        variance += (((change + np.pi) % (2 * np.pi) - np.pi) / step) ** 2
    spread = _spread_of_angles(angle, np.broadcast_to(root @ root.T, (200, 3, 3)))
    assert np.all(np.abs(np.sqrt(variance) - spread) < 1e-4 / np.cos(angle[:, 1:2]) ** 2)


def test_bands_hold_95_percent():
    rng = np.random.default_rng(3)
    a = rng.normal(size=(3, 3))
    covariance = 0.01 * (a @ a.T)[None]
    sample = rng.multivariate_normal(np.zeros(3), covariance[0], size=20000)
    across, around = (np.radians(w[0]) for w in _half_widths(covariance))
    share = np.mean(np.abs(sample[:, 2]) < across)
    error = np.sqrt(0.95 * 0.05 / 20000)
    assert abs(share - 0.95) < 4 * error
    assert np.mean(np.hypot(sample[:, 0], sample[:, 1]) < around) > 0.95 - 4 * error


def test_projection_is_orthogonal():
    right, up, front = project(np.eye(3))
    # Rows of a rotation: the columns that are seen, and the depth that is not.
    depth = np.where(front, 1, -1) * np.sqrt(1 - right**2 - up**2)
    seen = np.stack([right, up, depth])
    np.testing.assert_allclose(seen @ seen.T, np.eye(3), atol=1e-12)


def test_lines_break_where_angles_wrap():
    np.testing.assert_array_equal(unbroken(np.array([170.0, 179, -179, -170])), [170, 179, np.nan, -170])
    assert len(np.empty(9001)[stride(9001)]) <= 3000


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("dim", [2, 4])
def test_tracks_are_drawn_with_and_without_truth(dim, known):
    identity = np.eye(dim)[:, ::-1]
    noise = Bingham([*[-200.0] * (dim - 1), 0], identity)
    measured = noise.rvs(60, rng=4)
    time = np.arange(60.0)
    track = BinghamFilter(Diffusion(0.1, dim), OrientationSensor(noise)).run(Bingham.uniform(dim), measured, times=time)
    truth = np.tile(np.eye(dim)[0], (60, 1))
    truth[:5] = np.nan
    shown = {"truth": truth, "scored": time >= 5, "measured": measured} if known else {}
    draw = plot_track if dim == 4 else plot_planar_track
    figure = draw(time, track.distributions, title="track", **shown)
    figure.draw_without_rendering()
    drawn = {
        text.get_text() for axes in figure.axes for text in (axes.get_legend().get_texts() if axes.get_legend() else [])
    }
    assert "95 % band" in drawn
    assert ("error" in drawn) == known
    assert ("measured" in drawn) == known


def test_a_distribution_that_leaves_the_mode_open_is_drawn_without_ellipse():
    distribution = Bingham([-30.0, 0.0, 0.0], np.eye(3))
    x = distribution.rvs(40, rng=5)
    lines = len(plot_fit(x, distribution, names=("n", "e", "d")).axes[0].lines)
    assert len(plot_fit(x, Bingham([-30.0, -20.0, 0.0], np.eye(3)), names=("n", "e", "d")).axes[0].lines) == lines + 1


def legend(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def turning(degrees_a_second, *, deviation=0.01, count=200):
    time = np.arange(count) / 20.0
    modes = Rotation.from_rotvec(np.radians(degrees_a_second) * time[:, None] * [0.0, 0.0, 1.0]).as_quat(
        scalar_first=True
    )
    covariance = np.tile(deviation**2 * np.eye(3), (count, 1, 1))
    return time, modes, Bingham.from_covariance(modes, covariance, frame="world"), covariance


def test_the_axis_of_the_angles_fits_what_is_there():
    for rate, limits in ((0.5, (-5.0, 10.0)), (40.0, (-185.4, 185.4))):
        time, _, distributions, _ = turning(rate)
        low, high = plot_track(time, distributions).axes[0].get_ylim()
        assert low <= 0.0 and high >= min(rate * time[-1], 180.0)
        assert low >= limits[0] and high <= limits[1]


def test_wide_bands_of_the_first_samples_do_not_set_the_axis():
    time, _, distributions, covariance = turning(0.5)
    covariance[:1] *= 1e4
    low, high = plot_track(time, distributions, covariance=covariance).axes[0].get_ylim()
    assert -5.0 < low < high < 10.0


def test_what_is_grey_is_in_the_legend():
    time, modes, distributions, _ = turning(0.5)
    scored = time > 3.0
    angles, heading, inclination, _ = plot_track(time, distributions, truth=modes, scored=scored).axes
    assert {"yaw", "pitch", "roll", "truth", "95 % band"} == set(legend(angles))
    assert legend(heading) == legend(inclination) == ["95 % band", "error", "not scored"]
    _, heading, _, _ = plot_track(time, distributions, truth=modes).axes
    assert "not scored" not in legend(heading)


def test_an_unknown_heading_is_told_in_words():
    time, modes, distributions, covariance = turning(0.5)
    covariance[:, 2, 2] = np.pi**2 / 3
    _, heading, inclination, _ = plot_track(
        time, distributions, covariance=covariance, truth=modes, note="no magnetometer"
    ).axes
    nothing = "nothing is known: the 95 % band is the whole circle"
    assert {t.get_text() for t in heading.texts} == {nothing, "no magnetometer"}
    assert not inclination.texts and legend(heading) == ["error"]


def test_an_unknown_heading_without_truth_is_drawn_since_the_start():
    time, modes, _, covariance = turning(0.5)
    covariance[:, 2, 2] = np.pi**2 / 3
    heading = plot_track(time, modes, covariance).axes[1]
    (line,) = heading.lines
    yaw = np.unwrap(Rotation.from_quat(modes, scalar_first=True).as_euler("ZYX")[:, 0])
    np.testing.assert_allclose(line.get_ydata(), np.degrees(yaw - yaw[0]), atol=1e-9)
    assert "since" in heading.get_ylabel()


def test_of_a_long_track_every_column_keeps_its_extremes_and_gaps_break_the_lines():
    count = 200_000
    time = np.arange(count) / 100.0
    time[120_000:] += 60.0
    rng = np.random.default_rng(4)
    off = 0.01 * rng.standard_normal((count, 3))
    off[[777, 55_555]] = [0.3, 0.0, 0.2], [0.0, 0.0, -0.3]
    modes = from_rotation_vector(off)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    figure = plot_track(time, modes, np.tile(1e-4 * np.eye(3), (count, 1, 1)), truth=still)
    (line,) = [line for line in figure.axes[1].lines if line.get_label().startswith("error")]
    x, y = line.get_xdata(), line.get_ydata()
    error = np.degrees(off[:, 2])
    edges = np.linspace(0, count, 501).astype(int)  # as wide as four of the columns that are kept
    for a, b in itertools.pairwise(edges):
        inside = (x >= time[a]) & (x <= time[b - 1])
        assert np.nanmin(y[inside]) <= error[a:b].min() + 1e-6 and np.nanmax(y[inside]) >= error[a:b].max() - 1e-6
    assert np.isnan(y[(x >= time[119_999]) & (x <= time[120_000])]).sum() == 1
    assert len(x) < 10_000


def test_profiles_show_the_interval_and_legible_ticks():
    narrow, wide = np.exp(0.009 * np.linspace(-4, 4, 13)), np.exp(0.7 * np.linspace(-4, 4, 13))
    drop = -0.5 * np.linspace(-4, 4, 13) ** 2
    profiles = {"accelerometer": (2e-3 * narrow, drop), "gyroscope": (2e-4 * wide, drop - 1e4)}
    figure = plot_profiles(profiles, units=dict.fromkeys(profiles, "unit"))
    figure.canvas.draw()
    for axes, (values, _) in zip(figure.axes, profiles.values(), strict=True):
        bottom, top = axes.get_ylim()
        assert bottom == pytest.approx(-10) and 0 < top < 1
        left, right = axes.get_xlim()
        assert left < values[0] and right > values[-1]
        boxes = [label.get_window_extent() for label in axes.get_xticklabels() if label.get_text()]
        assert len(boxes) > 2
        assert not any(a.overlaps(b) for a, b in itertools.pairwise(boxes))


def test_errors_beyond_the_panel_are_marked_and_the_farthest_is_told():
    time = np.arange(400) / 20
    modes = np.tile([1.0, 0.0, 0.0, 0.0], (400, 1))
    modes[200] = from_rotation_vector([0.0, 0.0, np.radians(-20.0)])
    distributions = Bingham.from_covariance(modes, 1e-4 * np.eye(3), frame="body")
    _, heading, inclination, _ = plot_track(time, distributions, truth=np.tile([1.0, 0.0, 0.0, 0.0], (400, 1))).axes
    assert "error, up to 20° ▾" in heading.get_legend_handles_labels()[1]
    assert "error" in inclination.get_legend_handles_labels()[1]
    (mark,) = [line for line in heading.lines if line.get_marker() == "v" and len(line.get_xdata())]
    assert mark.get_xdata().tolist() == [10.0]
    assert heading.get_ylim()[0] < mark.get_ydata()[0] < 0.95 * heading.get_ylim()[0]


def test_a_peak_between_the_samples_drawn_is_marked():
    time, none = np.arange(9000) / 100, np.tile([1.0, 0.0, 0.0, 0.0], (9000, 1))
    modes = none.copy()
    modes[4001] = from_rotation_vector([0.0, 0.0, np.radians(35.0)])
    heading = plot_track(time, Bingham.from_covariance(modes, 1e-4 * np.eye(3), frame="body"), truth=none).axes[1]
    assert "error, up to 35° ▴" in heading.get_legend_handles_labels()[1]


def test_a_density_that_is_not_to_be_used_says_so_over_its_panel():
    values = np.linspace(0.9, 1.1, 5)
    profiles = dict.fromkeys(("gyroscope", "accelerometer"), (values, -500.0 * (values - 1.0) ** 2))
    units = dict.fromkeys(profiles, "unit")
    doubts = {"gyroscope": "884 times the scatter from sample to sample: motion or disturbances, not noise"}
    marked, clean = plot_profiles(profiles, units=units, doubts=doubts).axes
    assert marked.get_title().replace("\n", " ") == "not to be used: " + doubts["gyroscope"]
    assert clean.get_title() == ""


def test_labels_of_modes_that_nearly_coincide_lie_apart():
    frame = np.eye(3)
    tilted = from_rotation_vector([0.02, 0.0, 0.0])
    distributions = Bingham([[-90.0, -9.0, 0.0], [-5.0, -4.0, 0.0]], [frame, to_rotation(tilted).as_matrix() @ frame])
    mixture = BinghamMixture([0.5, 0.5], distributions)
    figure = plot_mixture(mixture.rvs(50, rng=1), mixture)
    figure.canvas.draw()
    one, two = (t.get_window_extent() for t in figure.axes[1].texts if t.get_text() in ("1", "2"))
    assert not one.overlaps(two)
    assert {"+y", "+x", "−y", "−x"} <= {t.get_text() for t in figure.axes[1].texts}
    assert "hemisphere +z" in figure.axes[1].get_title()


def test_axes_without_names_are_drawn_as_x_y_z():
    distribution = Bingham([-9.0, -3.0, 0.0], np.eye(3))
    axes = plot_fit(distribution.rvs(30, rng=1), distribution).axes[0]
    assert "hemisphere +z" in axes.get_title()


@pytest.mark.parametrize("mode", [[0.6, -0.2, 0.7], [0.6, -0.2, -0.7], [-0.6, 0.2, 0.7]])
def test_the_hemisphere_is_that_of_the_printed_mode(mode):
    distribution = Bingham.from_matrix(40.0 * np.outer(mode, mode))
    axes = plot_fit(distribution.rvs(30, rng=1), distribution).axes[0]
    x, y, z = canonical(distribution.mode)
    assert f"hemisphere {'+' if z > 0.0 else '−'}z" in axes.get_title()
    (star,) = (line for line in axes.lines if line.get_marker() == "*")
    # x to the right, y up, where the printed mode is: from above.
    np.testing.assert_allclose(star.get_xydata()[0], np.array([x, y]) / np.sqrt(1.0 + abs(z)), atol=1e-12)
