"""Axes without times: real files, and what is rejected."""

import warnings

import numpy as np
import pytest

from bingham.errors import InvalidArgumentError, RecordingError, RepairWarning
from bingham.io import RecordingWarning, read_axes
from bingham.io.angles import from_angles


@pytest.mark.parametrize(
    ("file", "columns", "shape"),
    [
        ("axial/fle_b5.csv", ("n", "e", "d"), (52, 3)),
        ("axial/kamb1959_fig7.csv", ("n", "e", "d"), (112, 3)),
        ("axial/fault_surface_normals.csv", ("x1", "x2", "x3"), (64, 3)),
        ("axial/quetico_lineations.csv", ("n", "e", "d"), (84, 3)),
        ("axial/simongomez_fault_slip.csv", ("qw", "qx", "qy", "qz"), (80, 4)),
    ],
)
def test_real_axes(data, file, columns, shape):
    axes = read_axes(data / file)
    assert (axes.columns, axes.values.shape) == (columns, shape)
    np.testing.assert_allclose(np.linalg.norm(axes.values, axis=1), 1, atol=1e-15)


def test_real_quaternions_by_name_and_without_names(data):
    posture = read_axes(data / "drill" / "drill_subjects_1-4.csv", columns=("Q1", "Q2", "Q3", "Q4"))
    assert posture.values.shape[1] == 4
    with pytest.raises(RecordingError, match=r"line 1: names no known set.*columns=.*Q1 Q2 Q3 Q4"):
        read_axes(data / "drill" / "drill_subjects_1-4.csv")
    with warnings.catch_warnings():
        warnings.simplefilter("error", RecordingWarning)  # four decimals, axes that scatter by 0.2 rad or more
        cube = read_axes(data / "riss_bingham_sim" / "cuboid_face_1_init.csv")
    np.testing.assert_allclose(cube.values[0], [0.8323, 0.0187, -0.2554, 0.4917], atol=1e-4)


@pytest.mark.parametrize(("scatter", "decimals", "warned"), [(0.2, 5, False), (0.2, 3, False), (1e-3, 3, True)])
def test_rounding_is_worth_a_warning_where_it_is_not_small_against_the_scatter(tmp_path, scatter, decimals, warned):
    file = tmp_path / "a.csv"
    x = [0.6, 0.48, 0.64] + scatter * np.random.default_rng(0).standard_normal((50, 3))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    np.savetxt(file, x, fmt=f"%.{decimals}f", delimiter=",", header="x,y,z", comments="")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        values = read_axes(file).values
    np.testing.assert_allclose(np.linalg.norm(values, axis=1), 1.0, atol=1e-15)
    assert [("where rows scatter by 0.0" in str(w.message)) for w in caught] == [True] * warned


def test_lengths_other_than_one_are_no_axes_and_the_way_out_is_named(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("x,y,z\n3,0,4\n0,2,0\n0,0,1\n")
    with pytest.raises(
        RecordingError, match=r"norm 5; unit norm.*: divide each row by its norm if lengths mean nothing"
    ):
        read_axes(file)


@pytest.mark.parametrize("blank", [",,", " , , ", "nan,nan,nan", "\n", ""])
def test_rows_of_nothing_are_no_names(tmp_path, blank):
    file = tmp_path / "a.csv"
    file.write_text(f"{blank}\n0.6,0.8,0\n0,0.6,0.8\n0.8,0,0.6\n")
    axes = read_axes(file)
    assert axes.columns == ("x1", "x2", "x3") and axes.values.shape == (3, 3)
    file.write_text(f"{blank}\nx,y,z\n{blank}\n0.6,0.8,0\n0,0.6,0.8\n0.8,0,0.6\n")
    axes = read_axes(file)
    assert axes.columns == ("x", "y", "z") and axes.values.shape == (3, 3)


def test_separators_and_planar_axes(tmp_path):
    file = tmp_path / "a.txt"
    for text in ("X;Y\n0.6;0.8\n", "x\ty\n0.6\t0.8\n", "# white space\n0.6 0.8\n", "id,ux,uy\na,0.6,0.8\n"):
        file.write_text(text)
        np.testing.assert_array_equal(read_axes(file).values, [[0.6, 0.8]])


@pytest.mark.parametrize(
    ("text", "place", "problem"),
    [
        ("", "", "empty"),
        ("# nothing\n", "", "only comments"),
        ("x,y,z\n", "", "no rows"),
        ("x,y,z\n1,0,0\n1,0\n", "line 3", "2 columns where 3.*cut off"),
        ("x,y,z\n1,0,0\n1,0,zero\n", "line 3, column z", "not a number"),
        ("x,y,z\n1,0,0\nnan,0,1\n", "line 3, columns x y z", "not finite"),
        ("x,y,z\n1,0,0\n,0,1\n", "line 3, columns x y z", "not finite"),
        ("x,y,z\n1,0,0\n1,0,1\n", "line 3, columns x y z", "norm 1.41421"),
        ("x,y,z\n1,0,0\n0,0,0\n", "line 3, columns x y z", "norm 0"),
        ("x,y,z,n,e,d\n1,0,0,1,0,0\n", "line 1", "names n e d and x y z; choose by columns="),
        ("1\n1\n", "line 1", "one column"),
    ],
)
def test_malformed(tmp_path, text, place, problem):
    file = tmp_path / "a.csv"
    file.write_text(text)
    with pytest.raises(RecordingError, match=problem) as caught:
        read_axes(file)
    assert str(caught.value).startswith(f"{file}: {place}")
    assert "; " in str(caught.value)


def test_columns_must_be_there(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("a,b\n1,0\n")
    with pytest.raises(RecordingError, match=r"no column c; columns in the file: a b"):
        read_axes(file, columns=("a", "c"))
    with pytest.raises(InvalidArgumentError, match="two names"):
        read_axes(file, columns=("a",))
    file.write_text("1,0\n")
    with pytest.raises(InvalidArgumentError, match="names its columns"):
        read_axes(file, columns=("a", "b"))


def test_an_azimuth_beside_a_dip_is_not_taken_for_an_axis_in_the_plane(tmp_path):
    path = tmp_path / "planes.csv"
    for text in ("azimuth;dip\n212,5;14,0\n205,0;18,0\n31,0;4,0\n", "Azimuth,Plunge angle,Dip\n212,4,14\n205,3,18\n"):
        path.write_text(text)
        with pytest.raises(RecordingError, match=r"line 1"):
            read_axes(path)
    path.write_text("azimuth;dip\n212,5;14,0\n205,0;18,0\n31,0;4,0\n")
    with pytest.raises(RecordingError, match=r"azimuth and dip: of lines or of planes\?; say it by angles="):
        read_axes(path)
    assert read_axes(path, angles="trend-plunge").values.shape == (3, 3)
    path.write_text("station,azimuth\n1,212\n2,205\n3,31\n")
    assert read_axes(path).values.shape == (3, 2)


DIRECTIONS = [[358.7, 46.3], [354.3, 55.2], [11.7, 26.7], [9.4, 39.5]]


@pytest.mark.parametrize("names", ["dir_dec\tdir_inc", "site_dec\tsite_inc", "Dec.\tInc."])
def test_tables_of_paleomagnetism(tmp_path, names):
    """Rows of a MagIC table without a direction hold an intensity."""
    first, second = names.split("\t")
    lines = [f"mc{k:02}\t{dec}\t{inc}\tA" for k, (dec, inc) in enumerate(DIRECTIONS)]
    file = tmp_path / "sites.txt"
    file.write_text("\n".join([f"site\t{first}\t{second}\tcomp", lines[0], "mc09\t\t\tB", *lines[1:]]) + "\n")
    with pytest.warns(RepairWarning, match="1 of 5 rows hold no angles"):
        axes = read_axes(file)
    assert axes.angles == "declination-inclination"
    np.testing.assert_allclose(axes.values, from_angles("declination-inclination", DIRECTIONS))
    file.write_text(file.read_text().replace("\t26.7", "\t"))
    with pytest.warns(RepairWarning), pytest.raises(RecordingError, match="line 5, columns"):
        read_axes(file)


def test_columns_without_names_by_their_numbers(tmp_path):
    file = tmp_path / "di.dat"
    file.write_text("".join(f"{dec} {inc} 105 22\n" for dec, inc in DIRECTIONS))
    with pytest.raises(RecordingError, match=r"columns=\['1', '2'\] angles='trend-plunge'"):
        read_axes(file)
    with pytest.raises(RecordingError, match="4 columns, where declination-inclination has 2; choose"):
        read_axes(file, angles="declination-inclination")
    axes = read_axes(file, columns=["1", "2"], angles="declination-inclination")
    np.testing.assert_allclose(axes.values, from_angles("declination-inclination", DIRECTIONS))
    with pytest.raises(InvalidArgumentError, match="2 numbers, declination inclination"):
        read_axes(file, columns=["1"], angles="declination-inclination")


def test_names_of_a_field_book_in_a_comment(tmp_path):
    rows = "045\t61S\t80E\n036\t59S\t80W\n189\t47W\t115\n"
    file = tmp_path / "faults.txt"
    file.write_text("# Crete\n#Strike\tDip\tRake\n" + rows)
    axes = read_axes(file)
    np.testing.assert_allclose(axes.values, from_angles("strike-dip", [[45, 61], [36, 59], [189, 47]]), atol=1e-12)
