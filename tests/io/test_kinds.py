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


QUATERNIONS = np.array([[np.cos(t), 0.0, np.sin(t), 0.0] for t in T])


@pytest.mark.parametrize("names", [("W", "X", "Y", "Z"), ("W Element", "X Element", "Y Element", "Z Element")])
def test_w_x_y_z_are_a_quaternion_and_no_rates(tmp_path, names):
    file = tmp_path / "quaternion.csv"
    file.write_text(table(["Time (s)", *names], np.column_stack([T, QUATERNIONS])))
    recording = read_recording(file)
    np.testing.assert_allclose(recording.orientation, QUATERNIONS, atol=1e-12)


def test_x_y_z_of_angles_are_no_rates(tmp_path):
    file = tmp_path / "EulerAngles.csv"
    file.write_text(table(["time", "x", "y", "z"], np.column_stack([T, 20 * GYR])))
    with pytest.raises(RecordingError, match="no rates, by the name of the file"):
        read_recording(file)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordingWarning)
        asked = read_recording(file, columns={"gx": "x", "gy": "y", "gz": "z"})
        other = file.rename(tmp_path / "walk.csv")
        np.testing.assert_array_equal(asked.gyroscope, read_recording(other).gyroscope)


def test_a_preset_loses_no_sensor(tmp_path):
    """Columns of one program's names that another's preset fits, but for its magnetometer."""
    file = tmp_path / "walk.csv"
    field = ACC[:, ::-1] * 4
    names = [f"{kind} {x.upper()} ({unit})" for kind, unit in (("Gyroscope", "deg/s"), ("Accelerometer", "g"),
             ("Magnetometer", "uT")) for x in XYZ]  # fmt: skip
    file.write_text(table(["Time (s)", *names], np.column_stack([T, np.degrees(GYR), ACC / G, field])))
    recording = read_recording(file)
    np.testing.assert_allclose(recording.magnetometer, field)
    np.testing.assert_allclose(recording.gyroscope, GYR)


def test_units_spelled_out_in_names(tmp_path):
    file = tmp_path / "walk.csv"
    names = [f"{kind}{x.upper()}_{unit}" for kind, unit in (("Gyro", "deg_per_s"), ("Accel", "g"), ("Mag", "uT"))
             for x in XYZ]  # fmt: skip
    file.write_text(table(["Time", *names], np.column_stack([T, np.degrees(GYR), ACC / G, 4 * ACC])))
    recording = read_recording(file)
    np.testing.assert_allclose(recording.gyroscope, GYR)
    np.testing.assert_allclose(recording.accelerometer, ACC)
    np.testing.assert_allclose(recording.magnetometer, 4 * ACC)


def test_the_unit_of_a_time_that_the_user_names(tmp_path):
    file = tmp_path / "walk.csv"
    file.write_text(table(["device_clock_ms", *NAMES[1:]], LATE))
    recording = read_recording(file, columns={"t": "device_clock_ms"})
    np.testing.assert_allclose(recording.time, LATE[:, 0] / 1e3)


@pytest.mark.parametrize("acceleration", ["acc_x acc_y acc_z", "ax ay az"])
def test_orientations_beside_an_accelerometer_when_asked_for(tmp_path, acceleration):
    file = tmp_path / "walk.csv"
    names = ["q_w", "q_x", "q_y", "q_z"]
    columns = np.column_stack([T, ACC, QUATERNIONS])
    file.write_text(table(["time", *acceleration.split(), *names], columns))
    with pytest.raises(RecordingError, match=r"without gx gy gz.*to have these alone, by columns={'qw'"):
        read_recording(file)
    with pytest.warns(RecordingWarning, match="left out"):
        recording = read_recording(file, columns=dict(zip(("qw", "qx", "qy", "qz"), names, strict=True)))
    np.testing.assert_allclose(recording.orientation, QUATERNIONS, atol=1e-12)


def test_degrees_per_second_are_asked_about_beside_g(tmp_path):
    file = tmp_path / "walk.csv"
    file.write_text(table(NAMES, np.column_stack([T, GYR, ACC / G])))
    with pytest.warns(RecordingWarning, match="gyroscope: unit untold"):
        read_recording(file, units={"accelerometer": "g"})
    with warnings.catch_warnings():
        warnings.simplefilter("error", RecordingWarning)
        read_recording(file, units={"accelerometer": "g", "gyroscope": "rad_s"})


def test_scales_are_asked_for_where_they_are_missing(tmp_path):
    file = tmp_path / "walk.csv"
    names = ["t", "gx (deg/s)", "gy (deg/s)", "gz (deg/s)", *NAMES[4:]]
    file.write_text(table(names, np.column_stack([T, GYR, np.round(2048 / G * ACC)])))
    with pytest.raises(RecordingError, match=r"units={'accelerometer': '1/4096g'}"):
        read_recording(file)


def test_json_in_one_line(tmp_path):
    file = tmp_path / "walk.json"
    file.write_text('{"emg": {"frequency": 200, "data": [[' + "-2, -6, 0, 1, " * 50 + "0]]}}\n")
    with pytest.raises(RecordingError, match=r"JSON\?"):
        read_recording(file)


def test_total_acceleration_is_asked_for(tmp_path):
    for name, v in (("Gyroscope", GYR), ("Accelerometer", 0.05 * GYR)):
        text = table(["time", "seconds_elapsed", "z", "y", "x"], np.column_stack([1e9 * T, T, v[:, ::-1]]))
        (tmp_path / f"{name}.csv").write_text(text)
    with pytest.warns(RecordingWarning, match="gravity taken off: export the total acceleration"):
        read_recording(tmp_path)


def test_xsens_text_that_counts_samples_at_a_stated_rate(tmp_path):
    file = tmp_path / "MT.txt"
    names = ["Counter", *(f"{kind}_{x.upper()}" for kind in ("Acc", "Gyr") for x in XYZ)]
    rows = table(names, np.column_stack([1000 + np.arange(N), ACC, GYR]), "\t")
    file.write_text("// Start Time: 0\n// Sample rate: 50.0Hz\n// Firmware Version: 2.5.1\n" + rows)
    recording = read_recording(file)
    np.testing.assert_allclose(np.diff(recording.time), 0.02)
    np.testing.assert_array_equal(recording.gyroscope, GYR)


def test_stamps_in_nanoseconds_that_a_spreadsheet_rounded_are_written_out(tmp_path):
    path = tmp_path / "imu.csv"
    rows = [f"{1.403636579763 + 5e-12 * k:.14f}E+018,0.0{k},0,0,0,0,9.81" for k in range(20)]
    header = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    path.write_text(header + "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n" + "\n".join(rows) + "\n")
    with pytest.warns(RecordingWarning, match="column #?timestamp.*: integers as powers of ten, as spreadsheets"):
        recording = read_recording(path)
    np.testing.assert_allclose(np.diff(recording.time), 5e-3, atol=3e-7)


def test_names_that_begin_with_the_device_are_understood(tmp_path):
    path = tmp_path / "log.csv"
    names = [f"IMU {sensor} {axis}" for sensor in ("Acceleration", "Gyroscope", "Magnetometer") for axis in "XYZ"]
    rows = [f"{k / 100},0.1,0.2,9.8,0.01,0.02,0.{k},0.2,0.1,-0.4" for k in range(20)]
    path.write_text(",".join(["Time", *names]) + "\n" + "\n".join(rows) + "\n")
    recording = read_recording(path)
    np.testing.assert_array_equal(recording.accelerometer[3], [0.1, 0.2, 9.8])
    np.testing.assert_array_equal(recording.gyroscope[3], [0.01, 0.02, 0.3])
    np.testing.assert_array_equal(recording.magnetometer[3], [0.2, 0.1, -0.4])
