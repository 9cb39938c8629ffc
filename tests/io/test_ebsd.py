"""Maps of crystal orientations."""

import numpy as np
import pytest

from bingham.errors import RecordingError
from bingham.io import RecordingWarning, read_ebsd

ANG = "# Phase 1\n# Symmetry              43\n#\n"
CTF = "Channel Text File\nPhases\t1\n3;3;3\t90;90;90\tTitanium\t9\t194\nPhase\tX\tY\tEuler1\tEuler2\tEuler3\tMAD\n"


def test_ang(tmp_path):
    path = tmp_path / "map.ang"
    path.write_text(ANG + "1.57080 0.0 0.0 1.0 2.0 90.0 0.9 0\n12.56637 12.56637 12.56637 2.0 2.0 0.0 -1 0\n")
    with pytest.warns(RecordingWarning, match="1 of 2 points have no orientation"):
        found = read_ebsd(path)
    # A quarter turn about z takes the crystal's x axis to the sample's y axis.
    np.testing.assert_allclose(found.quaternions, [[0.5**0.5, 0, 0, 0.5**0.5]], atol=1e-5)
    np.testing.assert_array_equal(found.position, [[1.0, 2.0]])
    assert found.symmetry == {1: "432"}
    assert found.phase.tolist() == [1]
    assert found.skipped == 1


def test_ctf(tmp_path):
    path = tmp_path / "map.ctf"
    path.write_text(CTF + "1\t0\t0\t10\t20\t30\t0.4\n1\t1\t0\t0,0\t90,0\t0\t0.4\n")
    found = read_ebsd(path)
    assert found.symmetry == {1: "622"}
    a, b, c = np.radians([10.0, 20.0, 30.0]) / 2
    # Rz(φ₁) Rx(Φ) Rz(φ₂) in closed form.
    expected = [
        np.cos(b) * np.cos(a + c),
        np.sin(b) * np.cos(a - c),
        np.sin(b) * np.sin(a - c),
        np.cos(b) * np.sin(a + c),
    ]
    np.testing.assert_allclose(found.quaternions[0], expected, atol=1e-12)
    np.testing.assert_allclose(found.quaternions[1], [0.5**0.5, 0.5**0.5, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ANG, "no points below its header"),
        (ANG + "1 2 3 4 5 6 0.5\n", "line 4: not 8 numbers"),
        (ANG + "1 2 3 4 5 6 x 0\n", "line 4: not 8 numbers"),
        (ANG + "1\n", "line 4: not 8 numbers"),
        (ANG + "1 2 3 4 5 6 0.5 1_0\n", "line 4: not 8 numbers"),
        (ANG + "1 2 3 4 5 6 0.5 1e300\n", "line 4: phase 1e\\+300"),
        (ANG + "1 2 3 4 5 6 0.5 0.5\n", "line 4: phase 0.5"),
        (ANG + "nan 2 3 4 5 6 0.5 0\n", "line 4: not finite"),
        (ANG + "1 2 3 4 5 6 -1 0\n", "none of its 1 points has an orientation"),
        (CTF.replace("Euler2", "Beta") + "1\t0\t0\t1\t2\t3\t0.4\n", "line 4: no column Euler2"),
        ("", "the file is empty"),
    ],
)
def test_malformed_maps_are_named(tmp_path, text, message):
    path = tmp_path / "map.ang"
    path.write_text(text)
    with pytest.raises(RecordingError, match=message):
        read_ebsd(path)
