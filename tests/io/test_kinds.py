"""Tables as people have them: languages, separators, headers, footers, and what iOS and Android part from gravity."""

import warnings

import numpy as np
import pytest

from bingham.errors import RecordingError, RecordingWarning
from bingham.io import read_recording

N, G = 60, 9.80665
RNG = np.random.default_rng(11)
T = np.arange(N) / 100
GYR = np.round(RNG.normal(0, 0.5, (N, 3)), 5)
ACC = np.round(RNG.normal([0, 0, 9.8], 1, (N, 3)), 4)
DOWN = np.tile([0.0, 0.0, -1.0], (N, 1))
NAMES = ["t", "gx", "gy", "gz", "ax", "ay", "az"]


def table(names, columns, separator=",", form=repr, end=""):
    lines = [separator.join(form(x) for x in row) + end for row in columns.tolist()]
    return "\n".join([*([separator.join(names)] if names else []), *lines]) + "\n"


def comma(x):
    return repr(x).replace(".", ",")


def thousands(x):
    return f'"{x:,.5f}"' if abs(x) >= 1000 else repr(x)


def german_thousands(x):
    return f"{x:,.5f}".translate(str.maketrans(",.", ".,"))


ROWS = np.column_stack([T, GYR, ACC])
LATE = np.column_stack([1e3 * T + 900, GYR, ACC])
XYZ = ("x", "y", "z")
KINDS = {
    "german": table(["Zeit (s)", *(f"Drehrate {x} (rad/s)" for x in XYZ),
                     *(f"Beschleunigung {x} (m/s²)" for x in XYZ)], ROWS, ";", comma),
    "french": table(["Temps (s)", *(f"Gyroscope {x} (rad/s)" for x in XYZ),
                     *(f"Accélération {x} (m/s²)" for x in XYZ)], ROWS, ";", comma),
    "spanish": table(["Tiempo (s)", *(f"Giroscopio {x} (rad/s)" for x in XYZ),
                      *(f"Aceleración {x} (m/s²)" for x in XYZ)], ROWS, "\t", comma),
    "thousands": table(["time_ms", *NAMES[1:]], LATE, ",", thousands),
    "thousands, decimal comma": table(["time_ms", *NAMES[1:]], LATE, ";", german_thousands),
    "footer": table(NAMES, ROWS) + "End of recording\nTotal samples: 60,,,,,,\n",
    "trailing separators": table(NAMES, ROWS, end=","),
    "column twice": table([*NAMES, "gx"], np.column_stack([ROWS, GYR[:, 0]])),
    "names in two rows": "Time,Gyroscope,,,Accelerometer,,\ns,X,Y,Z,X,Y,Z\n" + table([], ROWS),
    "units in the upper row": ",Gyroscope (deg/s),,,Accelerometer (g),,\nTime (s),X,Y,Z,X,Y,Z\n"
    + table([], np.column_stack([T, np.degrees(GYR), ACC / G])),
    "iOS": table(["timestamp", *(f"rotationRate.{x}" for x in XYZ), *(f"userAcceleration.{x}" for x in XYZ),
                  *(f"gravity.{x}" for x in XYZ)], np.column_stack([T, GYR, -ACC / G - DOWN, DOWN])),
    "Android": table(["time", *(f"gyro_{x}" for x in XYZ), *(f"linear_acceleration_{x}" for x in XYZ),
                      *(f"gravity_{x}" for x in XYZ)], np.column_stack([T, GYR, ACC + 9.8 * DOWN, -9.8 * DOWN])),
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_the_motion_comes_back(tmp_path, kind):
    file = tmp_path / "walk.csv"
    file.write_text(KINDS[kind], encoding="utf-8")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        recording = read_recording(file)
    np.testing.assert_allclose(recording.time - recording.time[0], T, atol=1e-9)
    np.testing.assert_allclose(recording.gyroscope, GYR, atol=1e-5)
    np.testing.assert_allclose(recording.accelerometer, ACC, atol=1e-5)
    expected = {"footer": "line 62 and those after it", "iOS": "the sum of 'userAcceleration.x' and 'gravity.x'",
                "Android": "the sum of 'linear_acceleration_x' and 'gravity_x'"}  # fmt: skip
    assert len(said) == (kind in expected)
    assert all(expected[kind] in str(warning.message) for warning in said)


def test_rows_without_a_sample_are_left_out(tmp_path):
    x = ROWS.copy()
    x[20:30, 1:] = np.nan
    file = tmp_path / "walk.csv"
    file.write_text(table(NAMES, x))
    with pytest.warns(RecordingWarning, match="10 of 60 rows hold no sample, left out"):
        recording = read_recording(file)
    np.testing.assert_array_equal(recording.accelerometer, np.delete(ACC, slice(20, 30), axis=0))


def test_gravity_in_a_file_of_its_own(tmp_path):
    for name, v in (("Gyroscope", GYR), ("Accelerometer", ACC + 9.8 * DOWN), ("Gravity", -9.8 * DOWN)):
        text = table(["time", "seconds_elapsed", "z", "y", "x"], np.column_stack([1e9 * T, T, v[:, ::-1]]))
        (tmp_path / f"{name}.csv").write_text(text)
    with pytest.warns(RecordingWarning, match="added to the accelerometer"):
        recording = read_recording(tmp_path)
    np.testing.assert_allclose(recording.accelerometer, ACC, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (table(["t", "q0", "q1", "q2", "q3"], np.tile([0.0, 1, 0, 0, 0], (9, 1))), "do not say which is the scalar"),
        (table([*NAMES, "gx"], np.column_stack([ROWS, T])), "name every one in the order of the file"),
        ('{"t": 0, "gx": 1}\n' * 9, "JSON?"),
        (table(NAMES, ROWS) + "0.6,0.1\n", "2 columns where 7"),
        (table(NAMES, ROWS) + "no numbers\n" * 30, "line 62: 1 columns where 7"),
        (table(NAMES, ROWS).replace("\n0.3,", "\nhalf,", 1), "'half' is not a number"),
    ],
)
def test_errors_name_the_thing(tmp_path, text, problem):
    file = tmp_path / "walk.csv"
    file.write_text(text)
    with warnings.catch_warnings(), pytest.raises(RecordingError) as caught:
        warnings.simplefilter("ignore", RecordingWarning)
        read_recording(file)
    assert problem in str(caught.value)
