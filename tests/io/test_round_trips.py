"""What is written comes back bit by bit, and nothing is left half written."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham import Bingham, BinghamFilter, ImuFilter
from bingham.atomic import replaced
from bingham.errors import InvalidArgumentError, RecordingError
from bingham.filters import ImuState
from bingham.io import (
    RecordingWarning,
    read_csv,
    read_npz,
    read_recording,
    read_track,
    read_tum,
    write_csv,
    write_npz,
    write_track_csv,
    write_track_npz,
    write_tum,
)
from bingham.recording import ImuRecording, OrientationRecording
from bingham.simulate import simulate_imu, simulate_tumbling


def planar():
    angle = np.linspace(0, 3, 7)
    axes = np.column_stack([np.cos(angle), np.sin(angle)])
    return OrientationRecording("plane", angle, axes, truth=axes, score=angle > 1)


@pytest.mark.parametrize("which", ["imu", "orientations", "planar"])
@pytest.mark.parametrize(("write", "ending"), [(write_csv, "csv"), (write_npz, "npz")])
def test_recordings_come_back(request, tmp_path, same, which, write, ending):
    recording = planar() if which == "planar" else request.getfixturevalue(which)
    file = tmp_path / f"{recording.name}.{ending}"
    write(file, recording)
    same(read_recording(file), recording, without=())
    assert [p.name for p in tmp_path.iterdir()] == [file.name]


def test_truth_on_its_own_clock_needs_npz(imu, orientations, tmp_path, same):
    with_truth = ImuRecording("x", imu.time, imu.gyroscope, truth=orientations, earth_frame="NED")
    write_npz(tmp_path / "x.npz", with_truth)
    same(read_npz(tmp_path / "x.npz"), with_truth, without=())
    with pytest.raises(InvalidArgumentError, match="npz"):
        write_csv(tmp_path / "x.csv", with_truth)


def test_tum_comes_back(orientations, tmp_path):
    file = tmp_path / "poses.txt"
    write_tum(file, time=orientations.time, orientation=orientations.orientation, position=orientations.position)
    back = read_tum(file)
    for name in ("time", "position", "orientation"):
        np.testing.assert_array_equal(getattr(back, name), getattr(orientations, name))
    line = [float(cell) for cell in file.read_text().splitlines()[1].split()]
    assert line[7] == orientations.orientation[0, 0]  # scalar last in the file
    write_tum(file, time=orientations.time, orientation=orientations.orientation)
    assert not read_tum(file).position.any()


def track(size=20):
    rng = np.random.default_rng(3)
    modes = rng.standard_normal((size, 4))
    modes /= np.linalg.norm(modes, axis=1, keepdims=True)
    z = np.sort(-rng.random((size, 4)) * 1e3)
    z[:, -1] = 0
    covariance = rng.standard_normal((size, 3, 3))
    covariance = covariance @ covariance.transpose(0, 2, 1)
    covariance[4] = np.nan
    accepted = rng.random(size) < 0.9
    return {
        "time": np.cumsum(rng.random(size)),
        "modes": modes,
        "covariance": covariance,
        "covariance_frame": "body",
        "concentrations": z,
        "log_evidence": rng.standard_normal(size),
        "accepted": accepted,
        "reason": np.where(accepted, "", "norm, dip"),
    }


def test_track_csv_names_frame_and_reads_as_orientations(tmp_path):
    written = track()
    file = tmp_path / "track.csv"
    write_track_csv(file, written, fields=["quaternion", "covariance", "concentrations", "evidence", "decision"],
                    frame="body")  # fmt: skip
    lines = file.read_text().splitlines()
    assert any(line.startswith("#") and "frame: body" in line and "rad^2" in line for line in lines)
    header = next(line for line in lines if not line.startswith("#")).split(",")
    assert header == [
        *("time_s", "qw", "qx", "qy", "qz", "cov_xx", "cov_xy", "cov_xz", "cov_yy", "cov_yz", "cov_zz"),
        *("z1", "z2", "z3", "z4", "log_evidence", "accepted", "reason"),
    ]
    back = read_recording(file)
    np.testing.assert_allclose(back.time, written["time"], rtol=0, atol=5e-10)
    np.testing.assert_allclose(back.orientation, written["modes"], rtol=0, atol=2e-9)
    second = lines[-19].split(",")
    assert float(second[6]) == pytest.approx(written["covariance"][1, 0, 1], rel=1e-7)
    assert lines[-16].split(",")[5:11] == [""] * 6  # undefined
    assert {line.rpartition(',"')[2] for line in lines if line.endswith('"')} == {'norm, dip"'}


def test_track_csv_of_an_inertial_track_has_angles_and_deviations_in_degrees(tmp_path):
    recording = simulate_imu(simulate_tumbling(8.0, 50.0, rng=0, rest_s=3.0), rng=1)
    found = ImuFilter().run(recording)
    write_track_csv(tmp_path / "a.csv", found)
    rows = np.genfromtxt(tmp_path / "a.csv", delimiter=",", names=True, skip_header=5)
    expected = Rotation.from_quat(found.modes, scalar_first=True).as_euler("ZYX", degrees=True)
    angles = np.column_stack([rows["yaw_deg"], rows["pitch_deg"], rows["roll_deg"]])
    assert np.max(np.abs((angles - expected + 180) % 360 - 180)) < 1e-5
    np.testing.assert_allclose(rows["heading_std_deg"], np.degrees(found.heading_std), rtol=1e-5)
    np.testing.assert_allclose(rows["inclination_std_deg"], np.degrees(found.inclination_std), rtol=1e-5)
    np.testing.assert_allclose(rows["bias_z_rad_s"], found.bias[:, 2], rtol=1e-6, atol=1e-12)
    # The signs are the filter's, not made continuous or w ≥ 0.
    np.testing.assert_allclose(rows["qw"], found.modes[:, 0], rtol=0, atol=6e-10)


def test_track_csv_of_axes_says_so(tmp_path):
    file = tmp_path / "axes.csv"
    z = -200.0
    angles = Bingham([z, 0.0], np.eye(2)).rvs(4000, rng=1)
    write_track_csv(file, {"time": [0.0, 1.0], "modes": np.eye(2), "concentrations": [[z, 0.0]] * 2})
    lines = file.read_text().splitlines()
    assert "axes in the plane" in lines[1] and "quaternion" not in file.read_text()
    assert lines[2] == "time_s,ux,uy,angle_deg,angle_std_deg"
    # A standard deviation of 4000 samples scatters by 1/√8000.
    reported = float(lines[-1].split(",")[-1])
    assert np.degrees(np.std(np.arcsin(angles[:, 0]))) == pytest.approx(reported, rel=4 / np.sqrt(8000))


def test_track_npz_keeps_every_bit(tmp_path):
    rng = np.random.default_rng(4)
    written = track() | {
        "matrices": rng.standard_normal((20, 4, 4)),
        "state_z": np.array([-5e-324, -1 / 3, -1e-17, 0.0]),
        "state_M": rng.standard_normal((4, 4)),
    }
    write_track_npz(tmp_path / "one.npz", **written)
    back = read_track(tmp_path / "one.npz")
    assert back.keys() == written.keys()
    for name, value in written.items():
        np.testing.assert_array_equal(back[name], value, err_msg=name)
    write_track_npz(tmp_path / "two.npz", **back)
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()
    with pytest.raises(RecordingError, match="bingham-track-1"):
        read_npz(tmp_path / "one.npz")


def test_tracks_of_wrong_shape_are_rejected(tmp_path):
    file = tmp_path / "track.csv"
    for change in (
        {"covariance_frame": None},
        {"modes": np.zeros((20, 3))},
        {"log_evidence": np.zeros(3)},
        {"accepted": [True]},
        {"concentrations": np.zeros((20, 2))},
    ):
        with pytest.raises(InvalidArgumentError, match=next(iter(change))):
            write_track_csv(file, track() | change)
    with pytest.raises(InvalidArgumentError, match="matrices"):
        write_track_npz(tmp_path / "t.npz", time=[0.0], modes=[[1, 0, 0, 0]], matrices=np.eye(4))
    assert not list(tmp_path.iterdir())


def test_a_failed_write_leaves_the_old_file_and_no_other(tmp_path):
    file = tmp_path / "old.csv"
    file.write_text("old")
    with pytest.raises(ZeroDivisionError), replaced(file) as temporary:
        temporary.write_text("half")
        raise ZeroDivisionError
    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]
    for target, words in ((tmp_path / "no" / "x.csv", "create the folder"), (tmp_path, "path of a file")):
        with pytest.raises(RecordingError, match=words):
            write_csv(target, planar())


def test_csv_units_stand_in_names_or_options(tmp_path):
    plain = tmp_path / "a.csv"
    plain.write_text("t,gx,gy,gz,ax,ay,az\n0,1,2,3,0,0,9.80665\n0.5,1,2,3,0,0,9.80665\n")
    expected = read_csv(plain)
    for header, scale in (
        ("time_ms,gx_deg_s,gy_deg_s,gz_deg_s,ax_g,ay_g,az_g", (1e3, 180 / np.pi, 1 / 9.80665)),
        ('"T [ms]";Gx (deg/s);Gy (deg/s);Gz (°/s);Ax [g];Ay [g];Az [g]', (1e3, 180 / np.pi, 1 / 9.80665)),
        ("t_us\tgx_rad_s\tgy_rad_s\tgz_rad_s\tax_m_s2\tay [m/s^2]\taz [m/s²]", (1e6, 1, 1)),
    ):
        separator = next((s for s in "\t;" if s in header), ",")
        rows = np.column_stack([expected.time * scale[0], expected.gyroscope * scale[1]])
        rows = np.column_stack([rows, expected.accelerometer * scale[2]])
        file = tmp_path / "b.csv"
        file.write_text(header + "\n" + "".join(separator.join(map(repr, r)) + "\n" for r in rows.tolist()))
        other = read_csv(file)
        for name in ("time", "gyroscope", "accelerometer"):
            np.testing.assert_allclose(getattr(other, name), getattr(expected, name), rtol=1e-15)
    degrees = read_csv(plain, units={"gyroscope": "deg_s"})
    np.testing.assert_allclose(degrees.gyroscope, np.radians(expected.gyroscope), rtol=1e-15)
    renamed = tmp_path / "c.csv"
    renamed.write_text("Zeit,gx,gy,gz\n0,1,2,3\n")
    assert read_csv(renamed, columns={"t": "Zeit"}).size == 1


HEADERS = [
    "Time (ms),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accel X (g),Accel Y (g),Accel Z (g)",
    "timestamp_ms,wx_dps,wy_dps,wz_dps,acc_x_g,acc_y_g,acc_z_g",
    "t [ms],gyro.x [°/s],gyro.y [°/s],gyro.z [°/s],accelerometer_x (g),accelerometer_y (g),accelerometer_z (g)",
]


@pytest.mark.parametrize("header", HEADERS)
def test_csv_synonyms_of_inertial_columns(tmp_path, header):
    file = tmp_path / "a.csv"
    file.write_text(f"{header}\n0,180,0,90,0,0,1\n10,180,0,90,0,0,1\n")
    recording = read_csv(file)
    np.testing.assert_allclose(recording.time, [0, 0.01], rtol=1e-15)
    np.testing.assert_allclose(recording.gyroscope[0], [np.pi, 0, np.pi / 2], rtol=1e-15)
    np.testing.assert_array_equal(recording.accelerometer[0], [0, 0, 9.80665])


def test_csv_synonyms_change_no_meaning(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("t,qw,qx,qy,qz,wx,wy,wz,acc_x\n0,1,0,0,0,1,2,3,4\n")
    with pytest.warns(RecordingWarning, match="left out: wx, wy, wz, acc_x;"):
        assert isinstance(read_csv(file), OrientationRecording)
    file.write_text("t,gx,gy,gz,gyro_x,acc_x,acc_y,acc_z\n0,1,2,3,4,5,6,7\n")
    with pytest.warns(RecordingWarning, match="left out: gyro_x;"):
        recording = read_csv(file)
    np.testing.assert_array_equal(recording.gyroscope, [[1, 2, 3]])
    np.testing.assert_array_equal(recording.accelerometer, [[5, 6, 7]])


def test_csv_units_of_renamed_columns_and_spellings_of_options(tmp_path):
    file = tmp_path / "a.csv"
    names = ("Drehrate 1 (deg/s)", "Drehrate 2 (deg/s)", "Drehrate 3 (deg/s)")
    file.write_text(f"Zeit [ms],{','.join(names)}\n1000,180,0,0\n")
    columns = {"t": "Zeit [ms]", **dict(zip(("gx", "gy", "gz"), names, strict=True))}
    recording = read_csv(file, columns=columns)
    assert (recording.time[0], recording.gyroscope[0, 0]) == (1.0, np.pi)
    with pytest.warns(RecordingWarning, match=r"180 rad/s"):
        assert read_csv(file, columns=columns, units={"gyroscope": "rad/s"}).gyroscope[0, 0] == 180
    file.write_text("t,gx,gy,gz,ax,ay,az,mx,my,mz\n0,90,0,0,9,0,0,20,0,0\n")
    for gyroscope in ("deg/s", "°/s", "deg_s", "dps"):
        assert read_csv(file, units={"gyroscope": gyroscope}).gyroscope[0, 0] == np.pi / 2
    for acceleration in ("m/s^2", "m/s²", "m_s2"):
        units = {"accelerometer": acceleration, "gyroscope": "rad/s", "magnetometer": "µT"}
        assert read_csv(file, units=units).accelerometer[0, 0] == 9.0


def test_csv_leaves_unknown_columns_out_with_a_warning(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("# made by hand\nt,gx,gy,gz,temperature\n0,1,2,3,hot\n")
    with pytest.warns(RecordingWarning, match="line 2: unknown columns left out: temperature; known: t gx"):
        assert read_csv(file).size == 1


def test_csv_quaternion_is_the_reference_beside_a_gyroscope(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("t,gx,gy,gz,qw,qx,qy,qz\n0,1,2,3,0.6,0,0.8,0\n0.1,1,2,3,,,,\n")
    recording = read_csv(file, earth_frame="NED")
    assert recording.earth_frame == "NED"
    np.testing.assert_array_equal(recording.reference[0], [0.6, 0, 0.8, 0])
    assert np.isnan(recording.reference[1]).all()


def test_tracks_are_written_as_they_are_and_gone_on_from(tmp_path):
    noise = Bingham([-500.0, -200.0, -50.0, 0.0], np.eye(4)[:, [1, 2, 3, 0]])
    f, z = BinghamFilter(noise, noise), noise.rvs(20, rng=1)
    whole, first = f.run(Bingham.uniform(4), z), f.run(Bingham.uniform(4), z[:10])
    with pytest.raises(InvalidArgumentError, match="give time="):
        write_track_npz(tmp_path / "a.npz", first)
    write_track_npz(tmp_path / "a.npz", first, time=np.arange(10.0))
    stored = read_track(tmp_path / "a.npz")
    state = Bingham.from_spectrum(stored["concentrations"][-1], stored["frames"][-1])
    np.testing.assert_array_equal(f.run(state, z[10:]).frames, whole.frames[10:])


def test_inertial_tracks_carry_their_state(tmp_path):
    recording = simulate_imu(simulate_tumbling(4.0, 50.0, rng=1), rng=1)
    track = ImuFilter().run(recording)
    write_track_npz(tmp_path / "a.npz", track)
    stored = read_track(tmp_path / "a.npz")
    np.testing.assert_array_equal(stored["modes"], track.modes)
    assert stored["covariance_frame"] == "world"
    np.testing.assert_array_equal(ImuState.from_json(stored["state"]).covariance, track.final.covariance)


def test_tracks_without_an_estimate_at_the_start_come_back(tmp_path):
    r = simulate_imu(simulate_tumbling(2.0, 50.0, rng=0), rng=1)
    force = np.array(r.accelerometer)
    force[:20] = np.nan
    track = ImuFilter().run(replace(r, accelerometer=force))
    write_track_npz(tmp_path / "late.npz", track)
    copy = read_track(tmp_path / "late.npz")
    np.testing.assert_array_equal(copy["modes"], track.modes)
    np.testing.assert_array_equal(np.isnan(copy["covariance"]).all(axis=(1, 2)), np.arange(r.size) < 20)
    write_track_csv(tmp_path / "late.csv", track, fields=["quaternion", "covariance"], frame="body")
    lines = [line for line in (tmp_path / "late.csv").read_text().splitlines() if not line.startswith("#")]
    assert lines[20].split(",")[1:11] == [""] * 10  # quaternion and covariance
    assert "" not in lines[21].split(",")


def test_only_tracks_are_taken_for_tracks(tmp_path):
    for write in (write_track_npz, write_track_csv):
        with pytest.raises(InvalidArgumentError, match="a Track, an ImuTrack"):
            write(tmp_path / "a.npz", np.eye(4))
        with pytest.raises(InvalidArgumentError, match="time"):
            write(tmp_path / "a.npz", {"modes": [[1.0, 0.0, 0.0, 0.0]]})
    with pytest.raises(InvalidArgumentError, match="or a track"):
        write_track_npz(tmp_path / "a.npz", time=[0.0])
