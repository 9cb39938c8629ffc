"""What values show in notebooks: well-formed HTML with the right picture, for every distribution, track and result."""

import re
import warnings
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
import pytest

from bingham import Bingham, BinghamFilter, BinghamMixture
from bingham.distributions.kent import Kent
from bingham.distributions.matrix_fisher import MatrixFisher
from bingham.distributions.watson import Watson
from bingham.inference import uniformity_test
from bingham.notebook import Tabled, curves, project

IDENTITY = np.eye(4)[:, [1, 2, 3, 0]]
NARROW = Bingham([-4e4, -4e4, -4e4, 0.0], IDENTITY)


def parsed(value):
    return ElementTree.fromstring(value._repr_html_())


def dots(value):
    """Points (n, 2), right and up, of every cloud by its colour."""
    found = {}
    for path in parsed(value).iter("path"):
        points = [(float(a), -float(b)) for a, b in re.findall(r"M(\S+?) (\S+?)h0", path.get("d"))]
        found.setdefault(path.get("stroke"), []).extend(points)
    return {colour: np.array(points) for colour, points in found.items()}


def test_dots_of_rotations_lie_where_the_axes_point():
    clouds = dots(NARROW)
    assert len(clouds) == 3
    for points, tip in zip(clouds.values(), np.eye(3), strict=True):
        assert points.shape == (150, 2)
        np.testing.assert_allclose(points.mean(axis=0), project(tip)[:2], atol=0.01)


def test_every_kind_has_its_picture():
    three = np.eye(3)
    for value, clouds in (
        (Bingham([-8.0, 0.0], np.eye(2)), 1),
        (Bingham([-8.0, -1.0, 0.0], three), 1),
        (MatrixFisher(np.diag([5.0, 4.0, 3.0])), 3),
        (Watson(three[2], 4.0), 1),
        (BinghamMixture([0.5, 0.5], Bingham([[-80.0, -50.0, -50.0, 0.0]] * 2, np.stack([IDENTITY] * 2))), 3),
        (Bingham(np.zeros(5), np.eye(5)), 0),
        (Bingham(np.zeros((2, 4)), np.stack([IDENTITY] * 2)), 0),
    ):
        assert len(dots(value)) == clouds, value
        assert "".join(parsed(value).itertext()).strip() == repr(value)
    assert issubclass(Kent, type(NARROW).__mro__[1])


@pytest.mark.parametrize("d", [2, 4])
def test_a_track_draws_its_angles(d):
    frame = IDENTITY if d == 4 else np.eye(2)[:, ::-1]
    noise = Bingham([*[-400.0] * (d - 1), 0.0], frame)
    track = BinghamFilter(noise, noise).run(Bingham.uniform(d), noise.rvs(30, rng=1))
    assert len(list(parsed(track).iter("path"))) == (3 if d == 4 else 1)
    assert repr(track) in "".join(parsed(track).itertext())


def test_curves_keep_extremes_and_break_at_jumps():
    y = np.zeros(5000)
    y[1234], y[4321] = 170.0, -175.0
    d = ElementTree.fromstring(curves([y], half=180.0)).find("path").get("d")
    ups = [float(v) for v in re.findall(r"[ML]\S+ (\S+?)(?=[ML]|$)", d)]
    assert min(ups) == pytest.approx(45.0 * (1 - 170 / 180), abs=0.05)
    assert max(ups) == pytest.approx(45.0 * (1 + 175 / 180), abs=0.05)
    turning = (np.linspace(0.0, 900.0, 500) + 180.0) % 360.0 - 180.0
    assert ElementTree.fromstring(curves([turning], half=180.0)).find("path").get("d").count("M") == 3


def test_a_result_shows_its_fields_and_escapes_them():
    x = Bingham([-8.0, -1.0, 0.0], np.eye(3)).rvs(40, rng=1)
    found = uniformity_test(x)
    told = dict(zip(*(["".join(e.itertext()) for e in parsed(found).iter(tag)] for tag in ("th", "td")), strict=True))
    assert float(told["pvalue"]) == pytest.approx(found.pvalue, rel=1e-5)

    @dataclass
    class Odd(Tabled):
        name: str = "<b>&"

    assert "".join(parsed(Odd()).itertext()) == "Oddname<b>&"


def test_a_figure_shows_itself_and_touches_nothing_global():
    plt = pytest.importorskip("matplotlib.pyplot", reason="matplotlib is not installed")
    from bingham.plot.style import new_figure

    figure = new_figure(3.0, 2.0)
    figure.add_subplot().plot([0, 1])
    assert figure._repr_png_().startswith(b"\x89PNG")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        figure.show()
    assert plt.get_fignums() == []
