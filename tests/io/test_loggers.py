"""Text files as loggers write them: headers after their documentation, numbers invented; the same motion from each."""

import numpy as np
import pytest

from bingham.errors import RecordingError, RecordingWarning
from bingham.io import read_recording
from bingham.io.layout import find_layout
from bingham.io.presets import PRESETS, find_preset
from bingham.io.text import opened_text
from bingham.io.together import together

N, G = 40, 9.80665
RNG = np.random.default_rng(7)
T = np.arange(N) / 100
GYR = RNG.normal(0, 0.5, (N, 3))  # rad/s
ACC = RNG.normal([0, 0, 9.8], 1, (N, 3))  # m/s²
MAG = RNG.normal([0, 20, -40], 10, (N, 3))
QUAT = np.tile([0.6, 0.0, 0.8, 0.0], (N, 1))
EPOCH = 1_709_283_600
NS = 1_000_000_000 * EPOCH
DEG, ONE = np.degrees(1), np.ones(N)


def rows(*columns, separator=",", form="{:.9g}"):
    table = np.column_stack(columns)
    return "".join(separator.join(form.format(x) for x in row) + "\n" for row in table.tolist())


def stamped(stamps, *columns, separator=","):
    """Rows with a text in front."""
    lines = rows(*columns, separator=separator).splitlines()
    return "".join(f"{stamp}{separator}{line}\n" for stamp, line in zip(stamps, lines, strict=True))


def clock(form):
    seconds = np.arange(N) / 100
    return [form.format(s=f"{x:06.3f}") for x in seconds]


BARE = np.arange(N)
FILES = {
    # preset: (name of the file, text, quantities that are in it)
    "xsens-mt-manager": (
        "MT_0080.txt",
        "// Start Time: Unknown\n// Update Rate: 100.0Hz\n// Filter Profile: human (46.1)\n// Firmware Version: 4.6.0\n"
        "PacketCounter\tSampleTimeFine\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\tMag_X\tMag_Y\tMag_Z\t"
        "Quat_q0\tQuat_q1\tQuat_q2\tQuat_q3\n"
        + "".join(
            f"{(65_530 + k) % 65_536}\t\t" + "\t".join(f"{x:.9g}" for x in row) + "\n"
            for k, row in enumerate(np.column_stack([ACC, GYR, MAG, QUAT]))
        ),
        "am",
    ),
    "movella-dot": (
        "dot.csv",
        "DeviceTag:,Left\nOutputRate:,100Hz\n© Movella\n\n"
        "PacketCounter,SampleTimeFine,Quat_W,Quat_X,Quat_Y,Quat_Z,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z\n"
        + rows(BARE, 1e6 * T + 5e6, QUAT, ACC, DEG * GYR),
        "a",
    ),
    "x-imu": (
        "CalInertialAndMag.csv",
        "Packet number,Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),"
        "Accelerometer Y (g),Accelerometer Z (g),Magnetometer X (G),Magnetometer Y (G),Magnetometer Z (G)\n"
        + rows(BARE, DEG * GYR, ACC / G, MAG),
        "am",
    ),
    "ngimu": (
        "sensors.csv",
        "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),"
        "Accelerometer Z (g),Magnetometer X (uT),Magnetometer Y (uT),Magnetometer Z (uT),Barometer (hPa)\n"
        + rows(T, DEG * GYR, ACC / G, MAG, 1000 * ONE),
        "am",
    ),
    "x-imu3": (
        "Inertial.csv",
        "Timestamp (us),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),"
        "Accelerometer Y (g),Accelerometer Z (g)\n" + rows(1e6 * T, DEG * GYR, ACC / G),
        "a",
    ),
    "shimmer": (
        "shimmer.csv",
        '"sep=\\t"\n'
        + "\t".join(
            f"Shimmer_8665_{name}_CAL"
            for name in (
                *("Timestamp_Unix", "Accel_LN_X", "Accel_LN_Y", "Accel_LN_Z", "Battery"),
                *("Gyro_X", "Gyro_Y", "Gyro_Z", "Mag_X", "Mag_Y", "Mag_Z"),
            )
        )
        + "\t\nms\tm/(s^2)\tm/(s^2)\tm/(s^2)\tmV\tdeg/s\tdeg/s\tdeg/s\tlocal_flux\tlocal_flux\tlocal_flux\t\n"
        + "".join(
            f"{1000 * EPOCH + 10 * k}\t{line}\t\n"
            for k, line in enumerate(rows(ACC, 3700 * ONE, DEG * GYR, MAG, separator="\t").splitlines())
        ),
        "am",
    ),
    "apdm": (
        "opal.csv",
        "# APDM Motion Studio\nTime (s),Accelerometer X (m/s^2),Accelerometer Y (m/s^2),Accelerometer Z (m/s^2),"
        "Gyroscope X (rad/s),Gyroscope Y (rad/s),Gyroscope Z (rad/s),Magnetometer X (uT),Magnetometer Y (uT),"
        "Magnetometer Z (uT)\n" + rows(T, ACC, GYR, MAG),
        "am",
    ),
    "metawear": (
        "MetaWear_2024_Gyroscope_100.000Hz_1.7.3.csv",
        "epoc (ms),timestamp (+0100),elapsed (s),x-axis (deg/s),y-axis (deg/s),z-axis (deg/s)\n"
        + "".join(
            f"{1000 * EPOCH + 10 * k},2024-03-01T10.00.00.{10 * k:03d},{k / 100:.3f},{line}\n"
            for k, line in enumerate(rows(DEG * GYR).splitlines())
        ),
        "",
    ),
    "axivity": (
        "ax6.csv",
        "Time,Accel-X (g), Accel-Y (g), Accel-Z (g), Gyro-X (d/s), Gyro-Y (d/s), Gyro-Z (d/s)\n"
        + stamped(clock("2024-03-01 09:59:{s}"), ACC / G, DEG * GYR),
        "a",
    ),
    "phyphox": (
        "Gyroscope.csv",
        '"Time (s)","Gyroscope x (rad/s)","Gyroscope y (rad/s)","Gyroscope z (rad/s)","Absolute (rad/s)"\n'
        + rows(T, GYR, ONE, form="{:.15E}"),
        "",
    ),
    "sensor-logger": (
        "Gyroscope.csv",
        "time,seconds_elapsed,z,y,x\n" + rows(1e9 * (EPOCH + T), T, GYR[:, ::-1]),
        "",
    ),
    "sensorlog": (
        "log.csv",
        "loggingTime(txt),loggingSample(N),gyroTimestamp_sinceReboot(s),"
        + ",".join(f"accelerometerAcceleration{x}(G)" for x in "XYZ")
        + ","
        + ",".join(f"gyroRotation{x}(rad/s)" for x in "XYZ")
        + "\n"
        + stamped(clock("2024-03-01 10:00:{s} +0100"), BARE, T + 4321.0, -ACC / G, GYR),
        "a",
    ),
    "matlab-mobile": (
        "AngularVelocity.csv",
        "Timestamp,X,Y,Z\n" + stamped(clock("01-Mar-2024 10:00:{s}"), GYR),
        "",
    ),
    "ulog2csv": (
        "log_sensor_combined_0.csv",
        "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],gyro_integral_dt,accelerometer_timestamp_relative,"
        "accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2],accelerometer_clipping\n"
        + rows(1e6 * T + 6e7, GYR, 10_000 * ONE, 0 * ONE, ACC, 0 * ONE),
        "a",
    ),
    "ardupilot": (
        "IMU.csv",
        "timestamp,TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz\n"
        + "".join(
            f"{EPOCH + k / 100:.2f},{60_000_000 + 10_000 * k},0,{line},0,0,41.2,1,1,1000,1000\n"
            for k, line in enumerate(rows(GYR, ACC).splitlines())
        ),
        "a",
    ),
    "blackbox": (
        "btfl_001.bbl.csv",
        '"Product","Blackbox flight data recorder by Nicholas Sherlock"\n"acc_1G","2048"\n"gyro_scale","0x3f800000"\n'
        '"loopIteration","time","axisP[0]","gyroADC[0]","gyroADC[1]","gyroADC[2]",'
        '"accSmooth[0]","accSmooth[1]","accSmooth[2]"\n' + rows(BARE, 1e6 * T, ONE, DEG * GYR, 2048 * ACC / G),
        "a",
    ),
    "gcsv": (
        "clip.gcsv",
        "GYROFLOW IMU LOG\nversion,1.3\nid,some_logger\norientation,YxZ\ntscale,0.001\ngscale,0.001\nascale,0.0005\n"
        "t,gx,gy,gz,ax,ay,az\n" + rows(1e3 * T, 1e3 * GYR, 2000 * ACC / G),
        "a",
    ),
    "rostopic": (
        "imu.csv",
        "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.orientation.x,field.orientation.y,"
        "field.orientation.z,field.orientation.w,field.orientation_covariance0,field.angular_velocity.x,"
        "field.angular_velocity.y,field.angular_velocity.z,field.linear_acceleration.x,field.linear_acceleration.y,"
        "field.linear_acceleration.z\n"
        + "".join(
            f"{NS + 10_000_000 * k + 1234},{k},{NS + 10_000_000 * k},imu_link,0,0,0,1,-1,{line}\n"
            for k, line in enumerate(rows(GYR, ACC).splitlines())
        ),
        "a",
    ),
    "plotjuggler": (
        "export.csv",
        "__time,/imu/data/angular_velocity/x,/imu/data/angular_velocity/y,/imu/data/angular_velocity/z,"
        "/imu/data/header/seq,/imu/data/linear_acceleration/x,/imu/data/linear_acceleration/y,"
        "/imu/data/linear_acceleration/z\n" + rows(EPOCH + T, GYR, BARE, ACC, form="{:.17g}"),
        "a",
    ),
}


def test_every_preset_has_a_file_here():
    assert {preset.name for preset in PRESETS} == set(FILES)


@pytest.mark.filterwarnings("error::bingham.io.RecordingWarning")
@pytest.mark.parametrize("preset", FILES)
def test_the_motion_comes_back(tmp_path, preset):
    name, text, sensors = FILES[preset]
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    recording = read_recording(file, **({"rate": 100} if preset == "x-imu" else {}))
    np.testing.assert_allclose(recording.time - recording.time[0], T, atol=1e-6)
    np.testing.assert_allclose(recording.gyroscope, GYR, rtol=1e-7)
    assert (recording.accelerometer is None) == ("a" not in sensors)
    assert (recording.magnetometer is None) == ("m" not in sensors)
    if "a" in sensors:
        np.testing.assert_allclose(recording.accelerometer, ACC, rtol=1e-7)
    if "m" in sensors:
        np.testing.assert_allclose(recording.magnetometer, MAG, rtol=1e-7)
    assert recording.reference is None  # what a device makes of its own sensors is no truth


def test_presets_tell_files_apart(tmp_path):
    for preset, (name, text, _) in FILES.items():
        file = tmp_path / name
        file.write_text(text, encoding="utf-8")
        layout = find_layout(opened_text(file))
        assert find_preset(layout.names, layout.preamble).name == preset
        assert sum(p.fits(layout.names, layout.preamble) for p in PRESETS) <= 2


def test_lost_packets_leave_their_time_out(tmp_path):
    name, text, _ = FILES["xsens-mt-manager"]
    lines = text.splitlines(keepends=True)
    file = tmp_path / name
    file.write_text("".join(lines[:15] + lines[18:]))  # three packets after the tenth, where the counter overflows
    steps = np.diff(read_recording(file).time)
    np.testing.assert_allclose(steps[9], 0.04)
    np.testing.assert_allclose(np.delete(steps, 9), 0.01)


def test_the_callers_word_wins_over_the_preset(tmp_path):
    name, text, _ = FILES["ulog2csv"]
    file = tmp_path / name
    file.write_text(text)
    recording = read_recording(file, columns={"gx": "gyro_rad[2]"}, units={"time": "ms", "gyroscope": "deg_s"})
    np.testing.assert_allclose(np.diff(recording.time), 10.0)
    np.testing.assert_allclose(recording.gyroscope[:, 0], np.radians(GYR[:, 2]), rtol=1e-8)
    np.testing.assert_allclose(recording.gyroscope[:, 1], np.radians(GYR[:, 1]), rtol=1e-8)


def test_gravity_taken_off_is_no_accelerometer(tmp_path):
    file = tmp_path / "Linear Acceleration.csv"
    file.write_text(
        '"Time (s)","Linear Acceleration x (m/s^2)","Linear Acceleration y (m/s^2)","Linear Acceleration z (m/s^2)"\n'
        + rows(T, ACC - [0, 0, 9.8])
    )
    with pytest.raises(RecordingError, match="neither gx gy gz nor qw qx qy qz"):
        read_recording(file)


@pytest.mark.parametrize("form", ["{}_{}", "{} {}"])
def test_fields_of_a_ros_message_have_gravity(tmp_path, form):
    names = [form.format(field, x) for field in ("angular_velocity", "linear_acceleration") for x in "xyz"]
    file = tmp_path / "imu.csv"
    file.write_text(",".join(["time", *names]) + "\n" + rows(T, GYR, ACC))
    with pytest.warns(RecordingWarning, match="with gravity as in sensor_msgs/Imu"):
        recording = read_recording(file)
    np.testing.assert_allclose(recording.accelerometer, ACC, rtol=1e-8)


def split(folder, prefix=""):
    """Sensor Logger's files: acceleration at its own times, 3 ms late; orientation that the phone made."""
    paths = []
    late = T + 0.003
    for name, text in (
        ("Gyroscope", "time,seconds_elapsed,z,y,x\n" + rows(1e9 * (EPOCH + T), T, GYR[:, ::-1])),
        ("TotalAcceleration", "time,seconds_elapsed,z,y,x\n" + rows(1e9 * (EPOCH + late), late, ACC[:, ::-1])),
        ("Accelerometer", "time,seconds_elapsed,z,y,x\n" + rows(1e9 * (EPOCH + T), T, 0.1 * ACC)),
        ("Orientation", "time,seconds_elapsed,qz,qy,qx,qw,roll,pitch,yaw\n" + rows(T, T, QUAT[:, ::-1], ACC)),
    ):
        file = folder / f"{prefix}{name}.csv"
        file.write_text(text)
        paths.append(file)
    return paths


def test_files_of_one_sensor_each_are_one_recording(tmp_path):
    paths = split(tmp_path)
    for given in (paths, paths[::-1], tmp_path):
        with pytest.warns(RecordingWarning, match=r"left out.*Accelerometer\.csv"):
            recording = read_recording(given)
        np.testing.assert_allclose(recording.gyroscope, GYR, rtol=1e-8)
        # 3 ms earlier the same vector stood elsewhere in the body: rotated by the rate, to first order.
        moved = ACC + 0.003 * np.cross(GYR, ACC)
        np.testing.assert_allclose(recording.accelerometer, moved, atol=1e-4)
        assert np.abs(recording.accelerometer - ACC).max() > 5e-3
        assert recording.name == tmp_path.name
    alone = read_recording(paths[0])
    assert alone.accelerometer is None
    with pytest.raises(RecordingError, match="accelerometer without gx gy gz"):
        read_recording(paths[1])
    with pytest.raises(RecordingError, match="no file of a gyroscope"):
        read_recording(paths[1:3])


def test_which_files_belong_together(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
    paths = split(tmp_path / "a", "walk_") + split(tmp_path / "b", "walk_") + [tmp_path / "other.csv"]
    found = together(paths)
    assert [(name, len(files)) for name, files in found] == [("walk", 4), ("walk", 4), ("other", 1)]
    assert [len(files) for _, files in together([tmp_path / "gyro_run.csv", tmp_path / "run2_acc.csv"])] == [1, 1]
