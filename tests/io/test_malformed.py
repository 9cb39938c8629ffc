"""Malformed input of every reader: one line that names the file, the place and the hint."""

import sys
import warnings

import numpy as np
import pytest

from bingham.errors import InvalidArgumentError, MissingExtraError, RecordingError
from bingham.io import (
    RecordingWarning,
    read_axes,
    read_broad,
    read_csv,
    read_euroc,
    read_npz,
    read_recording,
    read_track,
    read_tum,
    write_track_npz,
)
from bingham.io.checks import jitter

CSV = "t,gx,gy,gz,ax,ay,az,qw,qx,qy,qz\n0.0,1,2,3,0,0,9.8,1,0,0,0\n0.1,1,2,3,0,0,9.8,1,0,0,0\n"
TUM = "# a comment\n0.0 1 2 3 0 0 0 1\n0.1 1 2 3 0 0 0 1\n"
IMU = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n"
    "1403636579758555392,1,2,3,0,0,9.8\n1403636579763555584,1,2,3,0,0,9.8\n"
)
TRUTH = (
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n"
    "1403636579758555392,1,2,3,1,0,0,0\n1403636579763555584,1,2,3,1,0,0,0\n"
)
TEXTS = [
    # reader, text, what to replace, by what, place, problem
    (read_csv, CSV, "gy", "wy", "line 1", "no column gy for the gyroscope"),
    (read_csv, CSV, "t,", "x,", "line 1", "no column t"),
    (read_csv, CSV, "t,gx", "t,t,gx", "line 1", "both mean t"),
    (read_csv, CSV, "gx,gy,gz,", "", "line 1", "accelerometer without gx"),
    (read_csv, CSV, "qw", "ref_qw", "line 1", "no column qw"),
    (read_csv, CSV, "ax,", "ax [furlong],", "line 1", "unknown unit"),
    (read_csv, CSV, "gx,", "gx_furlong,", "line 1", "unknown unit of column 'gx_furlong'; known: rad_s deg_s"),
    (read_csv, CSV, "gx,gy,gz,", "gx_rpm,gy_rpm,gz_rpm,", "line 1", "accelerometer without gx"),
    (read_csv, CSV, "t,", "time_jiffies,", "line 1", "unknown unit of column 'time_jiffies'; known: s ms us ns"),
    (read_csv, CSV, "0.1,1,2", '0.1,1,"2,5"', "line 3, column gy", "'2,5' is not a number; a decimal comma: write"),
    (read_csv, CSV, "0.1,1,2", "0,1,1,2", "line 3", "12 columns where 11 are expected; the file looks cut off"),
    (read_csv, CSV, "0.1", "2024-01-01T00:00:00Z", "line 3, column t", "is not a number; a date: give numbers instead"),
    (read_csv, CSV, "0.1,1,2", "0.1,1,nan", "line 3, columns gx gy gz", "finite"),
    (read_csv, CSV, "0.1,1,2", "0.1,1,", "line 3, columns gx gy gz", "finite"),
    (read_csv, CSV, "0.1,1,2", "0.1,1,two", "line 3, column gy", "'two' is not a number"),
    (read_csv, CSV, "0.1", "", "line 3, column t", "finite seconds"),
    (read_csv, CSV, "0.1", "-0.1", "line 3, column t", "strictly increasing"),
    (read_csv, CSV, "0.1", "0.0", "line 3, column t", "drop duplicates"),
    (read_csv, CSV, "9.8,1,0,0,0\n0.1", "9.8,1,0.1,0,0\n0.1", "line 2, columns qw qx qy qz", "norm 1.00499"),
    (read_csv, CSV, "9.8,1,0,0,0\n0.1", "9.8,1,,0,0\n0.1", "line 2, columns qw qx qy qz", "whole row"),
    (read_csv, CSV, "9.8,1,0,0,0\n0.1", "9.8,0,0,0,0\n0.1", "line 2, columns qw qx qy qz", "norm 0"),
    (read_csv, CSV, "0.1,1,2,3,0,0,9.8,1,0,0,0\n", "0.1,1,2", "line 3", "3 columns where 11.*cut off"),
    (read_csv, CSV, CSV[CSV.index("\n") :], "\n", "", "no rows"),
    (read_tum, TUM, "0 0 0 1\n0.1", "0 0 1\n0.1", "line 2", "7 columns where 8"),
    (read_tum, TUM, "0.1 1", "0.1 one", "line 3, column tx", "'one' is not a number"),
    (read_tum, TUM, "0.1 1 2 3 0", "0.1 1 2 3 nan", "line 3, columns qw qx qy qz", "finite"),
    (read_tum, TUM, "0.1 1 2 3 0", "nan 1 2 3 0", "line 3, column time", "finite"),
    (read_tum, TUM, "0.1 1 2 3 0", "0.1 1 2 3 0.1", "line 3, columns qw qx qy qz", "norm 1.00499"),
    (read_tum, TUM, "0.1", "-1", "line 3, column time", "sort"),
    (read_tum, TUM, "0.1", "0.0", "line 3, column time", "drop duplicates"),
    (read_tum, TUM, "0.1 1 2 3 0 0 0 1", "0.1 1 2", "line 3", "cut off"),
    (read_tum, TUM, TUM[TUM.index("\n") :], "\n", "", "no rows"),
    (read_euroc, IMU, "w_RS_S_y", "w_RS_S_u", "line 1", "no column w_RS_S_y"),
    (read_euroc, IMU, "timestamp", "stamp", "line 1", "no column timestamp"),
    (read_euroc, IMU, "1403636579763555584,1", "1403636579763555584,nan", "line 3, columns w_RS_S_x", "finite"),
    (read_euroc, IMU, "1403636579763555584", "1403636579.76", "line 3, column timestamp", "not an integer"),
    (read_euroc, IMU, "1403636579763555584", "1403636579000000000", "line 3, column timestamp", "sort"),
    (read_euroc, IMU, "1403636579763555584", "1403636579758555392", "line 3, column timestamp", "duplicates"),
    (read_euroc, IMU, "1403636579763555584", "9" * 30, "line 3, column timestamp", "not an integer"),
    (read_euroc, IMU, ",3,0,0,9.8\n1403636579763555584,1,2,3,0,0,9.8", ",3,0,0,9.8\n14036", "line 3", "cut off"),
    (read_euroc, TRUTH, "q_RS_w", "q_w", "line 1", "no column q_RS_w"),
    (
        read_euroc,
        TRUTH,
        "3,1,0,0,0\n1403636579763555584",
        "3,1,0,0,1\n1403636579763555584",
        "line 2, columns q",
        "norm",
    ),
    (
        read_euroc,
        TRUTH,
        "3,1,0,0,0\n1403636579763555584",
        "3,nan,0,0,1\n1403636579763555584",
        "line 2, columns q",
        "fin",
    ),
]


def rejected(read, file, place, problem):
    """Read; the error must be one line with file, place, problem and a hint."""
    with pytest.raises(RecordingError, match=problem) as caught:
        read(file)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(f"{file}: {place}")
    assert "; " in message  # before the hint
    assert caught.value.path == str(file)


@pytest.mark.filterwarnings("ignore::bingham.io.RecordingWarning")
@pytest.mark.parametrize(("read", "text", "old", "new", "place", "problem"), TEXTS)
def test_text(tmp_path, read, text, old, new, place, problem):
    file = tmp_path / "file.txt"
    file.write_text(text)
    read(file)  # is fine as it stands
    assert old in text
    file.write_text(text.replace(old, new, 1))
    rejected(read, file, place, problem)


@pytest.mark.parametrize("read", [read_csv, read_tum, read_euroc, read_broad, read_npz, read_recording])
def test_empty_binary_and_absent_files(tmp_path, read):
    file = tmp_path / "file.csv"
    rejected(read, file, "", "no such file")
    file.write_bytes(b"")
    rejected(read, file, "", "empty")
    file.write_bytes(b"\xff\xfe\x00\x01" * 50)
    rejected(read, file, "", None)
    folder = tmp_path / "folder"
    folder.mkdir()
    rejected(read, folder, "", None)


def test_rounded_quaternions_are_normalised_with_a_warning(tmp_path):
    file = tmp_path / "file.txt"
    file.write_text("0 1 2 3 0.5 0.5 0.5 0.5\n1 1 2 3 0.5 0.5 0.5 0.5005\n2 1 2 3 0.5 0.5 0.5 0.5\n")
    with pytest.warns(RecordingWarning, match=r"largest deviation from unit norm 0\.00025 at line 2, columns qw"):
        recording = read_tum(file)
    np.testing.assert_allclose(np.linalg.norm(recording.orientation, axis=1), 1, atol=1e-15)
    file.write_text("0 1 2 3 0 0 0 1.00201\n")
    rejected(read_tum, file, "line 1", "norm 1.00201")


def test_rounding_far_below_the_jitter_is_not_worth_a_warning(tmp_path):
    rng = np.random.default_rng(0)
    half = 0.01 * np.arange(50)[:, None]  # a steady rotation about z, signs mixed, and jitter
    q = np.hstack([0.0 * half, 0.0 * half, np.sin(half), np.cos(half)]) * rng.choice([-1.0, 1.0], (50, 1))
    assert jitter(q) < 1e-4
    noisy = q + 0.005 * rng.standard_normal((50, 4))
    noisy /= np.linalg.norm(noisy, axis=1, keepdims=True)
    assert jitter(noisy) == pytest.approx(0.005 * np.sqrt(3.0), rel=0.2)
    file = tmp_path / "file.txt"
    for rows, warned in ((noisy, False), (q, True)):
        np.savetxt(file, np.hstack([np.arange(50)[:, None], np.zeros((50, 3)), rows]), fmt="%.4f")
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            read_tum(file)
        assert any("rounding matters" in str(w.message) for w in caught) == warned


def broad():
    n = 6
    return {
        "imu_gyr": np.ones((n, 3)),
        "imu_acc": np.ones((n, 3)),
        "imu_mag": np.ones((n, 3)),
        "opt_quat": np.tile([1.0, 0, 0, 0], (n, 1)),
        "movement": np.ones(n),
        "sampling_rate": 100.0,
    }


def plain_arrays():
    return {"t": np.arange(6) / 10, "meas": np.tile([1.0, 0, 0, 0], (6, 1)), "truth": np.tile([0, 1.0, 0, 0], (6, 1))}


def trial():
    n = 6
    reference = np.zeros((n, 4), dtype=np.int16)
    reference[2:, 0] = 32767
    return {"rate": 100.0, "gyr": np.ones((n, 3)), "acc": np.ones((n, 3)), "ref_i16": reference, "score": [True] * n}


def trajectory():
    return {"t0": 5.0, "t": np.arange(6) / 10, "quat": np.tile([1.0, 0, 0, 0], (6, 1)), "pos": np.ones((6, 3))}


def save_mat(file, content):
    from scipy.io import savemat

    savemat(file, content, do_compression=True)


def save_hdf5(file, content, *, transpose=False):
    h5py = pytest.importorskip("h5py")
    with h5py.File(file, "w", userblock_size=512 if transpose else 0) as archive:
        for name, value in content.items():
            if np.ndim(value):
                archive[name] = np.atleast_2d(value).T if transpose else value
            elif transpose:
                archive[name] = [[value]]
            else:
                archive.attrs[name] = value


def save_mat73(file, content):
    save_hdf5(file, content, transpose=True)


def save_npz(file, content):
    np.savez_compressed(file, **content)


BINARY = [
    (read_broad, "x.mat", save_mat, broad, "imu_gyr", "imu_mag", "opt_quat"),
    (read_broad, "x.mat", save_mat73, broad, "imu_gyr", "imu_mag", "opt_quat"),
    (read_broad, "x.hdf5", save_hdf5, broad, "imu_gyr", "imu_mag", "opt_quat"),
    (read_npz, "x.npz", save_npz, plain_arrays, "meas", "truth", "truth"),
    (read_npz, "x.npz", save_npz, trial, "gyr", "acc", "ref_i16"),
    (read_npz, "x.npz", save_npz, trajectory, "quat", "pos", "quat"),
]


def changed(values, index, value):
    values = np.array(values, dtype=float)
    values[index] = value
    return values


@pytest.mark.parametrize(("read", "name", "save", "content", "main", "other", "quaternion"), BINARY)
def test_binary(tmp_path, read, name, save, content, main, other, quaternion):
    file = tmp_path / name
    good = content()

    def reject_options(change, place, problem):
        save(file, good | change)
        rejected(read, file, place, problem)

    save(file, good)
    assert read(file).size == 6
    whole = file.read_bytes()
    for keep in (len(whole) // 3, len(whole) - 40):
        file.write_bytes(whole[:keep])
        rejected(read, file, "", None)
    save(file, {k: v for k, v in good.items() if k != main})
    rejected(read, file, "", "is missing|no known recording")
    reject_options({main: np.array(good[main])[:, :2]}, f"field {main}", r"shape \(6, 2\)")
    reject_options({main: np.array(good[main])[:0]}, f"field {main}", None)
    reject_options({main: changed(good[main], (3, 1), np.nan)}, f"field {main}, index 3", "finite")
    reject_options({other: np.array(good[other])[:4]}, f"field {other}", "4 rows beside 6 times")
    reject_options({other: changed(good[other], (3, 1), np.nan)}, f"field {other}, index 3", "whole row")
    reject_options({quaternion: 1.002 * np.array(good[quaternion])}, f"field {quaternion}, index", "norm")
    if name.endswith("npz"):
        reject_options({main: np.full((6, 3), "text")}, f"field {main}", "of type <U4")
        save(file, good | {main: np.full((6, 3), None)})
        rejected(read, file, "", "holds objects")


LONG = {"t": "time", "gyr": "gyroscope", "acc": "accelerometer", "mag": "magnetometer"}


@pytest.mark.parametrize("content", [plain_arrays, trajectory, lambda: inertial_arrays()])
@pytest.mark.filterwarnings("error::bingham.io.RecordingWarning")
def test_arrays_have_short_and_long_names(tmp_path, same, content):
    file = tmp_path / "x.npz"
    save_npz(file, content())
    short = read_npz(file)
    save_npz(file, {LONG.get(name, name): value for name, value in content().items()})
    same(read_npz(file), short)
    save_npz(file, {LONG.get(name, name): value for name, value in content().items()} | {"time": np.zeros(6)})
    rejected(read_npz, file, "field time, index 1", "strictly increasing")


def inertial_arrays():
    rng = np.random.default_rng(1)
    arrays = {name: rng.standard_normal((6, 3)) for name in ("gyr", "acc", "mag")}
    return {"t": np.arange(6) / 100} | arrays | {"acc": arrays["acc"] + [0.0, 0.0, 9.81]}


def test_arrays_without_times_name_both_ways_to_give_them(tmp_path):
    save_npz(tmp_path / "x.npz", {name: value for name, value in inertial_arrays().items() if name != "t"})
    rejected(read_npz, tmp_path / "x.npz", "field t or rate", "is missing; give times, s, or the sampling rate")


@pytest.mark.parametrize("content", [plain_arrays, trajectory])
def test_times_of_archives(tmp_path, content):
    file = tmp_path / "x.npz"
    for index, value, problem in ((3, np.nan, "finite"), (3, 0.2, "drop duplicates"), (3, 0.1, "sort")):
        save_npz(file, content() | {"t": changed(content()["t"], index, value)})
        rejected(read_npz, file, "field t", problem)


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"rate": 0.0}, "field rate"),
        ({"rate": np.array([1.0, 2.0])}, "field rate"),
        ({"score": np.full(6, 2)}, "field score, index 0"),
        ({"mocap_quat": np.tile([1.0, 0, 0, 0], (6, 1))}, "field mocap_t"),
    ],
)
def test_fields_of_trials(tmp_path, change, place):
    save_npz(tmp_path / "x.npz", trial() | change)
    rejected(read_npz, tmp_path / "x.npz", place, None)


@pytest.mark.parametrize("save", [save_mat, save_hdf5])
def test_other_files_of_matlab_are_told_from_broad(tmp_path, save):
    file = tmp_path / ("x.mat" if save is save_mat else "x.hdf5")
    save(file, {"vals": np.zeros((6, 9)), "ts": np.arange(9.0)})
    with pytest.raises(RecordingError, match=r"no trial of BROAD.*write a text file with columns t gx"):
        read_broad(file)


def test_lost_references_are_legal_in_broad(tmp_path):
    content = broad()
    content["opt_quat"][1:3] = np.nan
    save_mat(tmp_path / "x.mat", content)
    recording = read_broad(tmp_path / "x.mat")
    assert recording.scored.tolist() == [True, False, False, True, True, True]


def test_fixed_files_of_the_wrong_kind(tmp_path):
    np.save(tmp_path / "x.npy", np.eye(3))
    rejected(read_npz, tmp_path / "x.npy", "", "not an npz archive")
    save_npz(tmp_path / "y.npz", {"format": "bingham-imu-9"})
    rejected(read_npz, tmp_path / "y.npz", "field format", "bingham-imu-9")
    save_npz(tmp_path / "z.npz", {"format": "bingham-imu-1", "gyroscope": np.ones((2, 3))})
    rejected(read_npz, tmp_path / "z.npz", "field time", "missing")


def test_numbers_beyond_double_precision_are_no_warning(tmp_path):
    if np.finfo(np.longdouble).max < np.longdouble("1e400"):
        pytest.skip("long double is no wider than double here")
    wide = {"time": np.arange(2.0), "gyroscope": np.full((2, 3), np.longdouble("1e400"))}
    save_npz(tmp_path / "wide.npz", {"format": "bingham-imu-1"} | wide)
    with np.errstate(all="raise"):
        rejected(read_npz, tmp_path / "wide.npz", "field gyroscope", None)


def test_tracks(tmp_path):
    file = tmp_path / "track.npz"
    good = {"time": np.arange(3.0), "modes": np.eye(4)[:3], "matrices": np.zeros((3, 4, 4))}
    write_track_npz(file, **good)
    assert read_track(file)["time"].shape == (3,)
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    rejected(read_track, file, "", "not a readable npz")
    save_npz(file, good)
    rejected(read_track, file, "field format", "absent")
    for change, place in (
        ({"time": np.zeros(3)}, "field time, index 1"),
        ({"time": np.arange(2.0)}, "field modes"),
        ({"modes": np.ones((3, 4))}, "field modes, index 0"),
        ({"modes": np.full((3, 4), np.nan)}, "field modes, index 0"),
        ({"matrices": np.zeros((2, 4, 4))}, "field matrices"),
        ({"matrices": np.zeros((3, 4, 3))}, "field matrices"),
        ({"matrices": np.full((3, 4, 4), np.inf)}, "field matrices"),
        ({"matrices": np.full((3, 4, 4), "x")}, "field matrices"),
        ({"rotation_covariance_upper": np.zeros((3, 5))}, "field rotation_covariance_upper"),
        ({"rotation_covariance_upper": np.full((3, 6), 1e300)}, "field rotation_covariance_upper"),
        ({"rotation_covariance_upper": np.full((3, 6), np.inf)}, "field rotation_covariance_upper"),
    ):
        save_npz(file, good | {"format": "bingham-track-1"} | change)
        rejected(read_track, file, place, None)


def test_a_row_that_ends_before_its_time(tmp_path):
    file = tmp_path / "Gyroscope.csv"
    file.write_text("time,a,seconds_elapsed,b,z,y,x\n10?000,0.2\n100000000")
    rejected(lambda file: read_recording(file.parent), file, "line 2", "2 columns where 7 are expected")


def test_folders_and_unknown_files(tmp_path):
    rejected(read_recording, tmp_path, "", "neither a ROS 2 bag, nor an EuRoC or KITTI sequence")
    (tmp_path / "mav0").mkdir()
    rejected(read_recording, tmp_path, "", "no mav0/imu0/data.csv")
    file = tmp_path / "notes"
    file.write_text("dear diary\n")
    rejected(read_recording, file, "line 1", "no known format.*supported: .*ROS bag")
    with pytest.raises(InvalidArgumentError, match=r"broad, euroc, .*, rosbag, tum, csv"):
        read_recording(file, format="xml")
    with pytest.raises(InvalidArgumentError, match="deg_s"):
        file.write_text(CSV)
        read_csv(file, units={"gyroscope": "rpm"})
    with pytest.raises(InvalidArgumentError, match="file has"):
        read_csv(file, columns={"t": "clock"})


def test_euroc_sequences_bring_their_truth(tmp_path):
    for folder, text in (("imu0", IMU), ("state_groundtruth_estimate0", TRUTH)):
        (tmp_path / "V1_01" / "mav0" / folder).mkdir(parents=True)
        (tmp_path / "V1_01" / "mav0" / folder / "data.csv").write_text(text)
    recording = read_recording(tmp_path / "V1_01")
    assert recording.name == "V1_01"
    assert recording.time[1] - recording.time[0] == pytest.approx(0.005, abs=1e-6)
    assert recording.time[0] == pytest.approx(1403636579.758555392, rel=1e-15)
    np.testing.assert_array_equal(recording.truth.orientation, [[1, 0, 0, 0]] * 2)
    np.testing.assert_array_equal(recording.accelerometer[1], [0, 0, 9.8])
    assert read_recording(tmp_path / "V1_01" / "mav0").name == "V1_01"
    assert read_recording(tmp_path / "V1_01" / "mav0" / "imu0").name == "V1_01"
    np.testing.assert_array_equal(read_recording(tmp_path / "V1_01" / "mav0" / "imu0").truth.time, recording.time)
    alone = read_recording(tmp_path / "V1_01" / "mav0" / "imu0" / "data.csv")
    assert (alone.name, alone.truth) == ("V1_01", None)
    truth = tmp_path / "V1_01" / "mav0" / "state_groundtruth_estimate0" / "data.csv"
    assert read_recording(truth).name == "V1_01-state_groundtruth_estimate0"
    (tmp_path / "V1_01" / "mav0" / "imu0" / "data.csv").write_text(TRUTH)
    with pytest.raises(RecordingError, match="no gyroscope columns"):
        read_recording(tmp_path / "V1_01")


def test_an_absent_extra_names_itself(tmp_path, monkeypatch):
    save_hdf5(tmp_path / "x.hdf5", broad())
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(MissingExtraError, match=r"'h5py'.*bingham\[io\]"):
        read_broad(tmp_path / "x.hdf5")
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    (tmp_path / "x.bag").write_text("#ROSBAG V2.0\n")
    with pytest.raises(MissingExtraError, match=r"'rosbags'.*bingham\[io\]"):
        read_recording(tmp_path / "x.bag")


def inertial(tmp_path, *, time=(0.0, 0.1, 0.2, 0.3, 0.4), gyroscope=1.0, accelerometer=9.81):
    path = tmp_path / "imu.csv"
    rows = "".join(f"{t},{gyroscope},0,0,0,0,{accelerometer}\n" for t in time)
    path.write_text("t,gx,gy,gz,ax,ay,az\n" + rows)
    return path


def test_nanoseconds_in_a_csv_are_found_and_their_unit_can_be_told(tmp_path):
    stamps = [1_700_000_000_000_000_000 + 5_000_000 * k for k in range(5)]
    path = inertial(tmp_path, time=stamps)
    message = (
        r"line 2, column t: expected seconds, got 1\.7e\+18; are these nanoseconds\? State .* units=\{'time': 'ns'\}"
    )
    with pytest.raises(RecordingError, match=message):
        read_csv(path)
    np.testing.assert_allclose(np.diff(read_csv(path, units={"time": "ns"}).time), 0.005, atol=3e-7)
    relative = inertial(tmp_path, time=[t - stamps[0] for t in stamps])
    with pytest.raises(RecordingError, match=r"line 3, column t: expected seconds of a gyroscope, got steps of 5e\+06"):
        read_csv(relative)


@pytest.mark.parametrize(
    ("since_1970", "word", "unit"), [(1.7e12, "milli", "ms"), (1.7e15, "micro", "us"), (1.7e18, "nano", "ns")]
)
def test_the_unit_that_times_have_is_the_one_to_state(tmp_path, since_1970, word, unit):
    path = inertial(tmp_path, time=[f"{since_1970 + since_1970 * 5e-12 * k:.0f}" for k in range(3000)])
    with pytest.raises(
        RecordingError, match=rf"line 2, .* {word}seconds\? State the unit: units=\{{'time': '{unit}'\}}$"
    ):
        read_csv(path)
    assert read_csv(path, units={"time": unit}).size == 3000


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
def test_utf_16_is_named(tmp_path, encoding):
    path = tmp_path / "x.csv"
    path.write_text(CSV, encoding=encoding)
    for read in (read_csv, read_recording, read_axes):
        rejected(read, path, "", "UTF-16 text; save it as UTF-8")


def test_decimal_commas_between_commas_are_suspected(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text("t,qw,qx,qy,qz\n0,0,1,0,0,0,0,0,0,0\n0,1,1,0,0,0,0,0,0,0\n")
    rejected(read_csv, path, "line 2", "10 columns where 5 are expected; decimal commas\\?")
    path.write_text("t;qw;qx;qy;qz\n0,25;1,0;0,0;0,0;0,0\n")
    assert read_csv(path).time.tolist() == [0.25]
    path.write_text("t;qw;qx;qy;qz\n0.25;1.0;0.0;0.0;0.0\n0,5;1;0;0;0\n")
    rejected(read_csv, path, "line 3, column t", "'0,5' is not a number; a decimal comma")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"accelerometer": 1.0},
            r"imu\.csv: accelerometer: usually 1 m/s².* is it in g\? State the unit: units={'accelerometer': 'g'}",
        ),
        (
            {"gyroscope": 250.0},
            r"imu\.csv: gyroscope: up to 250 rad/s, 40 revolutions a second: degrees/s\? State the unit: .*'deg_s'",
        ),
        ({"time": range(0, 50, 10)}, r"time: usually 10 s between .*: is it in milliseconds\? State the unit: .*'ms'"),
    ],
)
def test_numbers_in_other_units_are_doubted(tmp_path, values, message):
    values = {"gyroscope": 0.1} | values
    with pytest.warns(RecordingWarning, match=message) as caught:
        read_csv(inertial(tmp_path, **values))
    assert len(caught) == 1


def test_a_motion_that_milliseconds_hide_is_rejected(tmp_path):
    path = inertial(tmp_path, time=range(0, 50, 10), gyroscope=0.5)
    message = r"line 3, column t: expected less than half a rotation.* 10 s with 5 rad.*units=\{'time': 'ms'\}"
    with pytest.raises(RecordingError, match=message):
        read_csv(path)
    assert read_csv(path, units={"time": "ms"}).duration_s == 0.04


def test_numbers_in_si_units_are_not_doubted(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for values in ({}, {"accelerometer": 6.0}, {"accelerometer": 19.0}, {"gyroscope": 35.0}):
            read_csv(inertial(tmp_path, **values))
