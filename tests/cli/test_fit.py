import json

import numpy as np
import pytest

from bingham import Bingham


@pytest.fixture
def quaternions(tmp_path):
    path = tmp_path / "turns.csv"
    x = Bingham([-60.0, -40.0, -20.0, 0.0], np.eye(4)[:, ::-1]).rvs(400, rng=3)
    np.savetxt(path, x, delimiter=",", header="qw,qx,qy,qz", comments="", fmt="%.17g")
    return path


def test_agrees_with_pmagpy(bingham, data):
    row = json.loads(bingham("fit", data / "axial" / "pmagpy_gobing.csv", "--json").stdout)
    published = json.loads((data / "axial" / "reference.json").read_text())["pmagpy_gobing"]
    assert row["samples"] == published["n"]
    mode = [published["dec"], published["inc"]]
    np.testing.assert_allclose(row["mode_trend_plunge_deg"], mode, atol=2e-3)
    # Axes have no sign: PmagPy gives the upper end of the smallest one.
    pole = [published["Zdec"] + 180, -published["Zinc"]]
    np.testing.assert_allclose(row["plane_pole_trend_plunge_deg"], pole, atol=2e-3)
    # Its table of concentrations ends at −25.55; with that in the place of the fitted ones the published ellipse comes
    # out, 2.45 standard deviations as it says. The fitted concentrations are higher, the true ellipse is smaller.
    w = np.array(row["moments"])
    clamped = np.degrees(2.45 / np.sqrt(2 * 20 * 25.55 * (w[2] - w[:2])))
    np.testing.assert_allclose(clamped, [published["Zeta_deg"], published["Eta_deg"]], rtol=1e-5)
    shrunk = np.sqrt(25.55 / -np.array(row["concentrations"][:2])) * np.sqrt(5.991464547) / 2.45
    np.testing.assert_allclose(row["mode_confidence_95_deg"], clamped * shrunk, rtol=1e-6)


def test_parameters_of_quaternions_lie_within_their_errors(bingham, quaternions):
    row = json.loads(bingham("fit", quaternions, "--json").stdout)
    pull = (np.array(row["concentrations"]) - [-60, -40, -20, 0])[:3] / np.array(row["concentration_errors"])[:3]
    assert np.all(np.abs(pull) < 4)
    distribution = Bingham(row["concentrations"], np.array(row["axes"]).T)
    assert row["entropy"] == pytest.approx(distribution.entropy(), rel=1e-12)
    # The maximum-likelihood distribution has entropy −E log f over its own sample.
    assert row["log_likelihood"] == pytest.approx(-400 * row["entropy"], rel=1e-9)
    assert row["credible_rotation_95_deg"] == pytest.approx(2 * np.degrees(distribution.credible_angle(0.95)), rel=1e-9)


@pytest.mark.parametrize(("d", "names"), [(2, "x,y"), (3, "n,e,d"), (3, "x,y,z"), (4, "qw,qx,qy,qz")])
def test_a_figure_for_every_dimension_on_paper(bingham, tmp_path, d, names):
    path = tmp_path / "axes.csv"
    x = Bingham(np.linspace(-9, 0, d), np.eye(d)).rvs(30, rng=4)
    np.savetxt(path, x, delimiter=",", header=names, comments="", fmt="%.17g")
    result = bingham("fit", path, "-o", tmp_path / "out")
    assert result.exit_code == 0, result.stderr
    (figure,) = (tmp_path / "out").iterdir()
    assert figure.read_bytes().startswith(b"\x89PNG")
    assert "95 % of axes within" in result.stdout
    assert ("trend" in result.stdout) == (names == "n,e,d")


def test_five_dimensions_have_numbers_but_no_figure(bingham, tmp_path):
    path = tmp_path / "five.txt"
    np.savetxt(path, Bingham([-4, -3, -2, -1, 0], np.eye(5)).rvs(50, rng=5), fmt="%.17g")
    assert json.loads(bingham("fit", path, "--json").stdout)["dim"] == 5
    result = bingham("fit", path, "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert "dimension 2, 3 or 4" in result.stderr
    assert not (tmp_path / "out").exists()


def test_axes_on_a_smaller_sphere_are_rejected_with_the_file(bingham, tmp_path):
    path = tmp_path / "flat.csv"
    path.write_text("n,e,d\n1,0,0\n0,1,0\n0.6,0.8,0\n")
    result = bingham("fit", path)
    assert result.exit_code == 2
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"bingham: {path}: 3 rows: on a smaller sphere")
    # What the message advises: the third concentration then is the ceiling.
    advice = line.partition("set one by: bingham ")[2].replace(" Z", " 500").split()
    row = json.loads(bingham(*advice, "--min-points", 1, "--json").stdout)["components"][0]
    assert row["concentrations"][0] == pytest.approx(-500)
    path.write_text("n,e,d\n1,0,0\n0,1,0\n")
    assert bingham("fit", path).stderr == f"bingham: {path}: 2 rows: too few for dimension 3; give 3 or more\n"


def test_fit_and_cluster_print_the_same_sign(bingham, data, quaternions):
    for path, component in ((data / "axial" / "kamb1959_fig7.csv", 2), (quaternions, 0)):
        fitted = json.loads(bingham("fit", path, "--json").stdout)
        options = ("--components", 1, "--no-background", "--restarts", 1, "--json")
        (cluster,) = json.loads(bingham("cluster", path, *options).stdout)["components"]
        np.testing.assert_allclose(fitted["mode"], cluster["mode"], atol=1e-6)
        np.testing.assert_allclose(fitted["axes"], cluster["axes"], atol=1e-6)
        assert min(axis[component] for axis in fitted["axes"]) >= 0


def test_columns_are_chosen_by_name(bingham, tmp_path):
    path = tmp_path / "named.csv"
    path.write_text("a,b,c\n1,0,7\n0.6,0.8,7\n0.8,-0.6,7\n")
    assert bingham("fit", path).exit_code == 2
    assert json.loads(bingham("fit", path, "--columns", "b, a", "--json").stdout)["columns"] == ["b", "a"]


@pytest.mark.parametrize("command", ["fit", "cluster"])
@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        (
            "a,b\n1,0\n",
            (),
            "line 1: names no known set of components; choose by --columns, or name angles by --as; ",
        ),
        (
            "1,0\n0,1\n",
            ("--columns", "x,y"),
            "--columns: expected a file that names its columns, got numbers in line 1",
        ),
        ("a,b\n1,0\n", ("--columns", "a"), "--columns: expected two names or more, got ['a']"),
    ],
)
def test_errors_speak_of_options(bingham, tmp_path, command, text, options, message):
    path = tmp_path / "axes.csv"
    path.write_text(text)
    result = bingham(command, path, *options)
    assert result.exit_code == 2
    (line,) = result.stderr.splitlines()
    assert message in line


def test_an_error_that_reaches_all_around_is_open(bingham, data):
    result = bingham("fit", data / "axial" / "gray1980_poles.csv")
    (line,) = [line for line in result.stdout.splitlines() if line.startswith("95 % confidence of the mode")]
    assert line.split()[-3:] == ["4.54°", "×", "open"]
    row = json.loads(bingham("fit", data / "axial" / "gray1980_poles.csv", "--json").stdout)
    assert row["mode_confidence_95_deg"][1] > 90.0
