import json

import numpy as np
import pytest

from bingham import Bingham


@pytest.fixture
def two_walls(tmp_path):
    """Axes about z and about x, 300 and 200, and 40 strays."""
    rng = np.random.default_rng(3)
    z = Bingham([-200.0, -100.0, 0.0], np.eye(3)).rvs(300, rng=rng)
    x = Bingham([-150.0, -150.0, 0.0], np.eye(3)[:, ::-1]).rvs(200, rng=rng)
    path = tmp_path / "walls.csv"
    rows = np.concatenate([z, x, Bingham.uniform(3).rvs(40, rng=rng)])
    np.savetxt(path, rows, delimiter=",", header="x,y,z", comments="", fmt="%.17g")
    return path


def test_finds_the_walls(bingham, two_walls, tmp_path):
    result = bingham("cluster", two_walls, "--components", "1-4", "--restarts", "3", "--json", "-o", tmp_path / "out")
    assert result.exit_code == 0, result.output
    row = json.loads(result.stdout)
    assert [part["components"] for part in row["tried"]] == [1, 2, 3, 4]
    assert row["bic"] == min(part["bic"] for part in row["tried"] if part["bic"] is not None)
    assert len(row["components"]) == 2
    assert {int(np.argmax(np.abs(part["mode"]))) for part in row["components"]} == {0, 2}
    assert sum(part["count"] for part in row["components"]) + row["outliers"] == row["samples"] == 540
    assert row["background"] == pytest.approx(40 / 540, abs=0.03)
    labels, figure = row["files"]
    label = np.loadtxt(labels, skiprows=1)
    assert np.bincount(label.astype(int)).tolist() == [row["outliers"], *(part["count"] for part in row["components"])]
    with open(figure, "rb") as file:
        assert file.read(4) == b"\x89PNG"


def test_prints_a_table_for_people(bingham, two_walls):
    result = bingham("cluster", two_walls, "--components", "2", "--restarts", "2")
    assert result.exit_code == 0
    assert "outliers" in result.stdout
    assert "BIC" in result.stdout
    assert "try more" not in result.stdout


def test_the_largest_number_tried_and_the_angle_of_rotations_are_named(bingham, tmp_path):
    path = tmp_path / "turns.csv"
    apart = [Bingham([-900.0] * 3 + [0.0], np.roll(np.eye(4), k, axis=1)).rvs(40, rng=k) for k in range(3)]
    np.savetxt(path, np.concatenate(apart), delimiter=",", header="qw,qx,qy,qz", comments="", fmt="%.17g")
    options = ("--components", "1-2", "--restarts", "3")
    part = json.loads(bingham("cluster", path, *options, "--json").stdout)["components"][0]
    assert part["credible_rotation_95_deg"] == 2 * part["credible_angle_95_deg"]
    said = bingham("cluster", path, *options).stdout
    assert f"{part['credible_rotation_95_deg']:.1f}°" in said
    assert "95 % within: angle of the rotation" in said
    assert "try more: --components 2-4" in said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--components", "0"], "at least 1"),
        (["--components", "x"], "a number such as 3"),
        (["--method", "k"], "em or sac"),
        (["--components", "91"], "--components: expected at most 90, got 91 clusters of at least 6 points"),
        (["--min-points", "541"], "--min-points: expected at most 540, the number of rows, got 541"),
        (["--components", "3", "--min-points", "200"], "--components: expected at most 2, got 3 clusters"),
    ],
)
def test_mistakes_end_in_one_line(bingham, two_walls, arguments, words):
    result = bingham("cluster", two_walls, *arguments)
    assert result.exit_code == 2
    assert words in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize(("d", "names"), [(2, "x,y"), (4, "qw,qx,qy,qz"), (5, "a,b,c,d,e")])
def test_every_dimension(bingham, tmp_path, d, names):
    path = tmp_path / "axes.csv"
    x = Bingham([-90.0] * (d - 1) + [0.0], np.eye(d)).rvs(60, rng=4)
    np.savetxt(path, x, delimiter=",", header=names, comments="", fmt="%.17g")
    result = bingham(
        "cluster", path, "--columns", names, "--components", "1", "--restarts", "1", "--json", "-o", tmp_path / "o"
    )
    assert result.exit_code == 0, result.output
    assert len(json.loads(result.stdout)["files"]) == (2 if d <= 4 else 1)


def test_opposite_walls_are_apart_with_signed(bingham, tmp_path):
    rng = np.random.default_rng(0)
    x = np.concatenate([s * Bingham([-300.0, -300.0, 0.0], np.eye(3)[:, p]).rvs(150, rng=rng)
                        for s, p in ((1, [0, 1, 2]), (1, [1, 2, 0]))])  # fmt: skip
    # Rows on both sides of the first axis, on one of the second.
    x[:150] *= np.where(np.arange(150) < 90, 1.0, -1.0)[:, None] * np.sign(x[:150, 2:])
    x[150:] *= np.sign(x[150:, :1])
    np.savetxt(tmp_path / "normals.csv", x, delimiter=",", header="x,y,z", comments="")
    args = ["cluster", tmp_path / "normals.csv", "--components", "1-4", "--json"]
    apart, merged = (json.loads(bingham(*args, *more).stdout) for more in (["--signed"], []))
    assert [c["count"] for c in apart["components"]] == [150, 90, 60]
    assert apart["components"][1]["mode"][2] > 0.99 and apart["components"][2]["mode"][2] < -0.99
    # Negative control: axes merge them.
    assert sorted(c["count"] for c in merged["components"]) == [150, 150]
