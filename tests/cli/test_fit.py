import json

import numpy as np
import pytest

from bingham import Bingham
from bingham.inference import confidence_ellipse
from bingham.io import read_axes


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
    # F in place of χ²: 2 · 19/18 · F(2, 18) = 2 · 19/18 · 3.554557.
    shrunk = np.sqrt(25.55 / -np.array(row["concentrations"][:2])) * np.sqrt(2 * 19 / 18 * 3.554557146) / 2.45
    inside = confidence_ellipse(read_axes(data / "axial" / "pmagpy_gobing.csv").values, method="f").semi_axes
    np.testing.assert_allclose(np.degrees(inside), clamped * shrunk, rtol=1e-6)
    # The region of the likelihood is what is printed; for twenty axes it is a little wider.
    ratio = row["mode_confidence_95_deg"] / np.degrees(inside)
    assert np.all((ratio > 1.02) & (ratio < 1.05))


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
    narrow, wide = np.degrees(confidence_ellipse(read_axes(data / "axial" / "gray1980_poles.csv").values).semi_axes)
    assert wide == pytest.approx(90.0)
    assert line.split()[-3:] == [f"{narrow:.2f}°", "×", "open"]
    row = json.loads(bingham("fit", data / "axial" / "gray1980_poles.csv", "--json").stdout)
    assert row["mode_confidence_95_deg"][1] is None


def test_report_of_a_structural_geologist(bingham, data, tmp_path):
    path = data / "axial" / "quetico_lineations.csv"
    row = json.loads(bingham("fit", path, "--json").stdout)["fabric"]
    np.testing.assert_allclose(row["eigenvalues"], [0.89045, 0.06737, 0.04218], atol=5e-6)
    assert row["woodcock_K"] == pytest.approx(5.515, abs=5e-4)
    assert row["woodcock_C"] == pytest.approx(3.050, abs=5e-4)
    np.testing.assert_allclose(row["mean_axis_trend_plunge_deg"], [69.1, 14.8], atol=0.05)
    assert row["tests"]["rotational_symmetry"]["pvalue"] == pytest.approx(0.170, abs=5e-4)
    assert row["tests"]["uniformity"]["pvalue"] < 1e-20
    result = bingham("fit", path, "-o", tmp_path / "out")
    assert "Woodcock K, C               5.515 (cluster), 3.050" in result.stdout
    assert "mean axis (trend/plunge)    069.1/14.8, 95 % region" in result.stdout
    assert (tmp_path / "out" / "quetico_lineations.fit.png").read_bytes().startswith(b"\x89PNG")
    # Too few for regions and tests, but not for a fit.
    few = tmp_path / "few.csv"
    few.write_text("n,e,d\n1,0,0\n0,1,0\n0,0,1\n")
    assert "fabric" not in json.loads(bingham("fit", few, "--json").stdout)


@pytest.fixture
def crystals(tmp_path):
    """One orientation of a cubic crystal, written by any of its equivalents, and two outliers in ten."""
    from bingham.distributions.symmetric import SymmetricMixture

    frame = np.linalg.qr(np.random.default_rng(0).normal(size=(4, 4)))[0]
    one = Bingham([[-9000.0, -7000.0, -3000.0, 0.0]], [frame])
    x = SymmetricMixture([0.8], one, "432", 0.2).rvs(300, rng=1)
    path = tmp_path / "grain.csv"
    np.savetxt(path, x, delimiter=",", header="qw,qx,qy,qz", comments="", fmt="%.17g")
    return path, one.mode[0]


def test_symmetry_is_hinted_at_and_used(bingham, crystals, quaternions):
    from bingham.distributions.crystal import misorientation

    path, mode = crystals
    plain = bingham("fit", path)
    assert "fit with --symmetry 432" in plain.stderr
    assert "--symmetry" not in bingham("fit", quaternions).stderr
    result = bingham("fit", path, "--symmetry", "m-3m", "--json")
    assert "--symmetry" not in result.stderr
    row = json.loads(result.stdout)
    assert row["outlier_share"] == pytest.approx(0.2, abs=0.06)
    assert row["samples"] + row["outliers"] == 300
    assert np.degrees(misorientation(np.array(row["mode"]), mode, "432").angle) < 0.3
    assert "points are outliers" in bingham("fit", path, "--symmetry", "432").stdout


def test_symmetry_is_of_orientations(bingham, crystals, data):
    wrong = bingham("fit", crystals[0], "--symmetry", "5")
    assert wrong.exit_code == 2
    assert wrong.stderr.startswith("bingham: --symmetry: expected one of 1, 2, 3")
    axes = bingham("fit", data / "axial" / "kamb1959_fig7.csv", "--symmetry", "432")
    assert "--symmetry: expected orientations, d = 4" in axes.stderr


def test_maps_of_orientations_are_read(bingham, tmp_path):
    (tmp_path / "a.ang").write_text(ANG)
    (tmp_path / "a.ctf").write_text(CTF)
    rows = [
        json.loads(bingham("fit", tmp_path / name, "--symmetry", "432", "--json").stdout) for name in ("a.ang", "a.ctf")
    ]
    np.testing.assert_allclose(np.abs(rows[0]["mode"]), np.abs(rows[1]["mode"]), atol=1e-4)
    said = bingham("fit", tmp_path / "a.ang").stderr
    assert "the file states the symmetry 432" in said and "neighbours share their errors" in said
    assert "--columns: expected a table" in bingham("fit", tmp_path / "a.ang", "--columns", "x,y").stderr


ANGLES = [(0.1 + 0.01 * k % 0.03, 0.5 + 0.007 * k % 0.02, 1.2 + 0.003 * k % 0.02) for k in range(12)]
ANG = "# Phase 1\n# MaterialName  Nickel\n# Symmetry              43\n# GRID: SqrGrid\n#\n" + "".join(
    f"{a:9.5f} {b:9.5f} {c:9.5f} {k:9.3f} 0.000 87.3 0.812 0 1 0.6\n" for k, (a, b, c) in enumerate(ANGLES)
)
CTF = (
    "Channel Text File\nPrj\tx\nPhases\t1\n3.524;3.524;3.524\t90;90;90\tNickel\t11\t225\n"
    "Phase\tX\tY\tBands\tError\tEuler1\tEuler2\tEuler3\tMAD\tBC\tBS\n"
) + "".join(
    f"1\t{k}\t0\t8\t0\t{np.degrees(a):.4f}\t{np.degrees(b):.4f}\t{np.degrees(c):.4f}\t0.5\t9\t9\n"
    for k, (a, b, c) in enumerate(ANGLES)
)
