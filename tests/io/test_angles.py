"""Angles in and out: values that can be drawn, other libraries' conventions, round trips, files."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io import read_axes
from bingham.io.angles import ANGLES, angle_kind, from_angles, recognised, to_angles

RNG = np.random.default_rng(4)
TURNS = Rotation.random(50, rng=RNG)
S = np.sqrt(0.5)


@pytest.mark.parametrize(
    ("kind", "angles", "axis"),
    [
        ("trend-plunge", [90, 30], [0, np.sqrt(0.75), 0.5]),
        ("plunge-trend", [30, 90], [0, np.sqrt(0.75), 0.5]),
        ("strike-dip", [0, 90], [0, -1, 0]),
        ("dip-direction", [45, 90], [0, -S, S]),
        ("declination-inclination", [180, -45], [-S, 0, -S]),
        ("azimuth", [60], [0.5, np.sqrt(0.75)]),
    ],
)
def test_axes(kind, angles, axis):
    np.testing.assert_allclose(from_angles(kind, [angles]), [axis], atol=1e-15)


def test_rotations_by_hand():
    x, y, z = np.eye(3)

    def turned(kind, angles, v):
        return Rotation.from_quat(from_angles(kind, [angles])[0], scalar_first=True).apply(v)

    np.testing.assert_allclose(turned("roll-pitch-yaw", [0, 0, 90], x), y, atol=1e-15)
    np.testing.assert_allclose(turned("roll-pitch-yaw", [90, 0, 0], y), z, atol=1e-15)
    np.testing.assert_allclose(turned("roll-pitch-yaw", [0, 90, 0], z), x, atol=1e-15)
    np.testing.assert_allclose(turned("bunge", [90, 90, 0], x), y, atol=1e-15)  # about z, then about the new x
    np.testing.assert_allclose(turned("bunge", [90, 90, 0], z), x, atol=1e-15)
    np.testing.assert_allclose(turned("relion", [90, 0, 0], y), x, atol=1e-15)  # world to particle
    np.testing.assert_allclose(turned("rotation-vector", [0, 0, np.pi / 2], x), y, atol=1e-15)
    np.testing.assert_allclose(turned("matrix", [0, -1, 0, 1, 0, 0, 0, 0, 1], x), y, atol=1e-15)
    np.testing.assert_allclose(turned("euler-zyx", [0, 0, 90], y), z, atol=1e-15)  # about the world's z, y, x


@pytest.mark.parametrize("kind", [k for k in ANGLES if len(ANGLES[k].vector) == 4] + ["euler-XYX", "euler-zyz"])
def test_rotations_round_trip(kind):
    q = TURNS.as_quat(scalar_first=True)
    back = from_angles(kind, to_angles(kind, q))
    np.testing.assert_allclose(np.abs(np.sum(back * q, axis=1)), 1.0, atol=1e-12)


@pytest.mark.parametrize("kind", [k for k in ANGLES if len(ANGLES[k].vector) < 4])
def test_axes_round_trip(kind):
    x = RNG.standard_normal((50, len(ANGLES[kind].vector)))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    back = from_angles(kind, to_angles(kind, x))
    np.testing.assert_allclose(np.abs(np.sum(back * x, axis=1)), 1.0, atol=1e-12)


def test_bunge_agrees_with_orix():
    quaternion = pytest.importorskip("orix.quaternion")
    angles = np.column_stack([RNG.uniform(0, 360, 20), RNG.uniform(0, 180, 20), RNG.uniform(0, 360, 20)])
    theirs = quaternion.Orientation.from_euler(angles, degrees=True).data  # sample to crystal: the inverse
    ours = from_angles("bunge", angles) * [1, -1, -1, -1]
    np.testing.assert_allclose(np.abs(np.sum(ours * theirs, axis=1)), 1.0, atol=1e-12)


@pytest.mark.parametrize(
    ("names", "kind"),
    [
        (("Trend", "Plunge"), "trend-plunge"),
        (("id", "plunge", "trend"), "trend-plunge"),
        (("STRIKE", "DIP", "rake"), "strike-dip"),
        (("dip", "DipDirection"), "dip-direction"),
        (("Dip (deg)", "Dip Direction (deg)"), "dip-direction"),
        (("dec", "inc", "a95"), "declination-inclination"),
        (("phi1", "Phi", "phi2"), "bunge"),
        (("phi1", "PHI", "phi2"), "bunge"),
        (("Euler1", "Euler2", "Euler3"), "bunge"),
        (("_rlnAngleRot", "_rlnAngleTilt", "_rlnAnglePsi"), "relion"),
        (("roll", "pitch", "yaw", "yaw_rate"), "roll-pitch-yaw"),
        (("azimuth",), "azimuth"),
        (("r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33"), "matrix"),
    ],
)
def test_names_tell_the_kind(names, kind):
    assert recognised(names)[0].name == kind


def test_other_names_tell_nothing():
    assert recognised(("a", "b")) is None
    assert recognised(("trend", "dip")) is None


def test_files(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("name;dip;dip_direction\nA;20,5;135\nB;22;140,25\n")
    axes = read_axes(file)
    assert (axes.angles, axes.columns) == ("dip-direction", ("n", "e", "d"))
    np.testing.assert_allclose(axes.values, from_angles("dip-direction", [[20.5, 135], [22, 140.25]]))
    np.testing.assert_allclose(read_axes(file, columns=["dip", "dip_direction"]).values, axes.values)
    file.write_text("20.5 135\n22 140.25\n")
    np.testing.assert_allclose(read_axes(file, angles="dip-direction").values, axes.values)
    np.testing.assert_allclose(read_axes(file, angles="plunge/trend").values[:, 2], np.sin(np.radians([20.5, 22])))
    file.write_text("a,b\n20.5,135\n22,140.25\n")
    np.testing.assert_allclose(read_axes(file, angles="Dip_Direction").values, axes.values)
    file.write_text("trend,plunge\n10,20\n30,95\n")
    with pytest.raises(RecordingError, match=r"line 3, columns trend plunge: .* plunge: expected -90 to 90"):
        read_axes(file)
    file.write_text("roll_rad,pitch_rad,yaw_rad\n0.1,0.2,0.3\n")
    np.testing.assert_allclose(
        read_axes(file).values, from_angles("roll-pitch-yaw", np.degrees([[0.1, 0.2, 0.3]])), atol=1e-15
    )
    file.write_text("azimuth\n10\n190\n")
    np.testing.assert_allclose(abs(np.dot(*read_axes(file).values)), 1.0)  # one axis
    file.write_text("x,y,z,trend,plunge\n1,0,0,0,0\n")
    assert read_axes(file).angles == ""  # components win


@pytest.mark.parametrize("kind", ["", "euler", "euler-ZZX", "euler-ZYx", "dip"])
def test_unknown_kinds_are_named(kind):
    with pytest.raises(InvalidArgumentError, match="trend-plunge, plunge-trend"):
        angle_kind(kind)


def test_matrices_that_are_none():
    with pytest.raises(InvalidArgumentError, match="row 2"):
        from_angles("matrix", [np.eye(3).ravel(), np.diag([1.0, 1.0, -1.0]).ravel()])
    with pytest.raises(InvalidArgumentError, match=r"shape \(N, 9\)"):
        from_angles("matrix", np.eye(3))
    with pytest.raises(InvalidArgumentError, match="finite"):
        from_angles("azimuth", [[np.nan]])
