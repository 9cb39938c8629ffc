"""Orientations without an inertial sensor: bags of poses, KITTI, OpenSim; and inertial sensors in two topics."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bags import KINDS, Bag
from bingham.errors import InvalidArgumentError, RecordingError, RecordingWarning, RepairWarning
from bingham.io import read_recording

N = 30
RNG = np.random.default_rng(11)
STAMPS = 1_700_000_000_000_000_000 + np.arange(N) * 50_000_000
TURNS = Rotation.random(N, rng=RNG)
WXYZ = TURNS.as_quat(scalar_first=True)
XYZ = RNG.standard_normal((N, 3))


def same_turns(recording, expected=WXYZ):
    np.testing.assert_allclose(np.abs(np.sum(recording.orientation * expected, axis=1)), 1.0, atol=1e-9)


def pose(types, k):
    point, quaternion = types["geometry_msgs/msg/Point"], types["geometry_msgs/msg/Quaternion"]
    w, x, y, z = WXYZ[k].tolist()
    return types["geometry_msgs/msg/Pose"](point(*XYZ[k].tolist()), quaternion(x=x, y=y, z=z, w=w))


def transform(types, k, header, child):
    w, x, y, z = WXYZ[k].tolist()
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    moved = types["geometry_msgs/msg/Transform"](vector(*XYZ[k].tolist()), quaternion(x=x, y=y, z=z, w=w))
    return types["geometry_msgs/msg/TransformStamped"](header, child, moved)


def write(kind, path, topics):
    """Write a bag of (topic, type of message) pairs; covariances grow along the recording."""
    with Bag(kind, path) as bag:
        types = bag.types
        for k in range(N):
            header = bag.header(STAMPS[k])
            covariance = np.zeros((6, 6))
            covariance[3:, 3:] = np.diag([1.0, 2.0, 3.0]) * 1e-4 * (k + 1)
            with_covariance = types["geometry_msgs/msg/PoseWithCovariance"](pose(types, k), covariance.ravel())
            for topic, name in topics:
                if name == "tf2_msgs/msg/TFMessage":
                    pairs = [transform(types, k, header, "base"), transform(types, N - 1 - k, header, "camera")]
                    message = types[name](pairs)
                elif name == "geometry_msgs/msg/TransformStamped":
                    message = transform(types, k, header, "base")
                elif name == "geometry_msgs/msg/PoseStamped":
                    message = types[name](header, pose(types, k))
                elif name == "nav_msgs/msg/Odometry":
                    zero = types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
                    twist = types["geometry_msgs/msg/Twist"](zero, zero)
                    moving = types["geometry_msgs/msg/TwistWithCovariance"](twist, np.zeros(36))
                    message = types[name](header, "base", with_covariance, moving)
                else:
                    message = types[name](header, with_covariance)
                bag.message(topic, name, message, STAMPS[k])
    return bag.path


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "name",
    [
        "geometry_msgs/msg/PoseStamped",
        "geometry_msgs/msg/PoseWithCovarianceStamped",
        "nav_msgs/msg/Odometry",
        "geometry_msgs/msg/TransformStamped",
    ],
)
def test_poses_of_bags(tmp_path, kind, name):
    recording = read_recording(write(kind, tmp_path, [("/pose", name)]))
    same_turns(recording)
    np.testing.assert_allclose(recording.position, XYZ)
    np.testing.assert_allclose(recording.time, STAMPS / 1e9, rtol=0, atol=3e-7)
    if "Covariance" in name or "Odometry" in name:
        expected = np.diag([1.0, 2.0, 3.0]) * 1e-4 * np.arange(1, N + 1)[:, None, None]
        np.testing.assert_allclose(recording.covariance, expected)
    else:
        assert recording.covariance is None


@pytest.mark.parametrize("kind", KINDS[1:])
def test_transforms_name_their_frames(tmp_path, kind):
    path = write(kind, tmp_path, [("/tf", "tf2_msgs/msg/TFMessage")])
    with pytest.raises(RecordingError, match=r"pairs of frames: .*imu.base imu.camera; choose one"):
        read_recording(path)
    same_turns(read_recording(path, pose_topic="/tf:imu.base"))
    same_turns(read_recording(path, pose_topic="/tf:imu.camera"), WXYZ[::-1])
    with pytest.raises(RecordingError, match=r"no transform imu\.wheel"):
        read_recording(path, pose_topic="/tf:imu.wheel")


@pytest.mark.parametrize(
    ("topics", "taken"),
    [
        ((("/ground_truth/pose", "PoseStamped"), ("/slam", "PoseStamped")), "/slam"),
        ((("/tf", "TFMessage"), ("/odom", "Odometry")), "/odom"),
        ((("/relay", "PoseStamped"), ("/slam", "PoseStamped")), "/relay"),
    ],
)
def test_what_is_plainly_the_pose_is_taken_and_said(tmp_path, topics, taken):
    folders = {"TFMessage": "tf2_msgs", "Odometry": "nav_msgs"}
    path = write(
        "sqlite", tmp_path, [(name, f"{folders.get(kind, 'geometry_msgs')}/msg/{kind}") for name, kind in topics]
    )
    with pytest.warns(RecordingWarning, match=f"topic {taken} taken for the poses; others by pose_topic="):
        same_turns(read_recording(path))


def test_topics_of_poses_are_chosen(tmp_path):
    path = write("bag", tmp_path, [("/a", "geometry_msgs/msg/PoseStamped"), ("/b", "nav_msgs/msg/Odometry")])
    with pytest.raises(RecordingError, match=r"several topics of poses: /a /b; choose one by pose_topic="):
        read_recording(path)
    assert read_recording(path, pose_topic="/a").covariance is None
    assert read_recording(path, pose_topic="/b").covariance is not None
    with pytest.raises(RecordingError, match=r"topic /c: holds no poses; topics that do: /a /b"):
        read_recording(path, pose_topic="/c")


GYRO = RNG.normal(0, 1, (N, 3))
FORCE = RNG.normal([0, 0, 9.8], 1, (N, 3))


def split(path, names=("/camera/gyro/sample", "/camera/accel/sample")):
    with Bag("bag", path) as bag:
        for k in range(N):
            bag.imu(names[0], STAMPS[k], GYRO[k], np.zeros(3))
            bag.imu(names[1], STAMPS[k] + 4_000_000, np.zeros(3), FORCE[k])
    return bag.path


def test_sensors_in_two_topics(tmp_path):
    for names, options in (
        (("/camera/gyro/sample", "/camera/accel/sample"), {}),
        (("/one", "/two"), {}),
        (("/one", "/two"), {"gyroscope_topic": "/one", "accelerometer_topic": "/two"}),
    ):
        recording = read_recording(split(tmp_path, names), **options)
        np.testing.assert_array_equal(recording.gyroscope, GYRO)
        moved = Rotation.from_rotvec(0.004 * GYRO).apply(FORCE)  # 4 ms before it was measured
        np.testing.assert_allclose(recording.accelerometer, moved, atol=1e-5)
        (tmp_path / "x.bag").unlink()
    with pytest.raises(RecordingError, match=r"topic /no: no .* messages"):
        read_recording(split(tmp_path), gyroscope_topic="/no")


def test_messages_of_zeros_are_no_samples(tmp_path):
    with Bag("bag", tmp_path) as bag:
        for k in range(N):
            bag.imu("/imu", STAMPS[k], GYRO[k], FORCE[k])
            bag.imu("/imu", STAMPS[k] + 25_000_000, np.zeros(3), np.zeros(3))
    with pytest.warns(RepairWarning, match="30 of 60 rows are zero in gyroscope and accelerometer"):
        recording = read_recording(bag.path)
    np.testing.assert_array_equal(recording.gyroscope, GYRO)


def kitti(folder):
    matrices = np.concatenate([TURNS.as_matrix(), XYZ[:, :, None]], axis=2).reshape(N, 12)
    (folder / "00.txt").write_text("".join(" ".join(f"{x:.6e}" for x in row) + "\n" for row in matrices))
    return folder / "00.txt"


def test_kitti_poses(tmp_path):
    path = kitti(tmp_path)
    with pytest.warns(RecordingWarning, match="taken at KITTI's 10 Hz"):
        recording = read_recording(path)
    same_turns(recording)
    np.testing.assert_allclose(recording.position, XYZ, rtol=1e-5)
    np.testing.assert_allclose(recording.time, np.arange(N) / 10)
    np.testing.assert_allclose(read_recording(path, rate=25.0).time, np.arange(N) / 25)
    (tmp_path / "times.txt").write_text("".join(f"{0.1037 * k:e}\n" for k in range(N)))
    np.testing.assert_allclose(read_recording(path).time, 0.1037 * np.arange(N))
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:7], "1 0 0 0 0 1 0 0 0 0 2 0", *lines[8:]]) + "\n")
    with pytest.raises(RecordingError, match="line 8: its 3×3 part is no rotation matrix"):
        read_recording(path)


def test_kitti_oxts(tmp_path):
    folder = tmp_path / "2011_09_26_drive_0001_sync"
    (folder / "oxts" / "data").mkdir(parents=True)
    euler = np.column_stack([0.01 * np.arange(N), -0.02 * np.ones(N), 0.1 * np.arange(N)])  # roll, pitch, yaw
    stamps = []
    for k in range(N):
        row = [49.0, 8.4, 112.8, *euler[k], *[0.0] * 5, *FORCE[k], *FORCE[k], *GYRO[k], *GYRO[k], 0.1, 0.1, 4, 11, 6]
        (folder / "oxts" / "data" / f"{k:010d}.txt").write_text(" ".join(map(str, row)) + "\n")
        stamps.append(f"2011-09-26 13:02:{25 + k / 10:012.9f}\n")
    (folder / "oxts" / "timestamps.txt").write_text("".join(stamps))
    for path in (folder, folder / "oxts"):
        recording = read_recording(path)
        assert recording.name == folder.name
        np.testing.assert_allclose(recording.gyroscope, GYRO)
        np.testing.assert_allclose(recording.accelerometer, FORCE)
        np.testing.assert_allclose(np.diff(recording.time), 0.1, atol=1e-6)
        _, pitch, yaw = euler.T
        forward = Rotation.from_quat(recording.reference, scalar_first=True).apply([1.0, 0.0, 0.0])
        np.testing.assert_allclose(forward[:, 0], np.cos(yaw) * np.cos(pitch), atol=1e-12)  # yaw 0 is east
        np.testing.assert_allclose(forward[:, 2], -np.sin(pitch), atol=1e-12)
    (folder / "oxts" / "data" / "0000000003.txt").write_text("1 2 3\n")
    with pytest.raises(RecordingError, match=r"0000000003\.txt: line 1: 3 cells"):
        read_recording(folder)


def test_opensim_storage(tmp_path):
    file = tmp_path / "walk.sto"
    head = "DataRate=20.000000\nDataType=Quaternion\nversion=3\nOpenSimVersion=4.1\nendheader\n"
    cells = [",".join(f"{x:.12f}" for x in q) for q in WXYZ]
    body = "".join(f"{k / 20:.6f}\t{cells[k]}\t{cells[N - 1 - k]}\n" for k in range(N))
    file.write_text(f"{head}time\ttorso_imu\tpelvis_imu\n{body}")
    with pytest.raises(RecordingError, match=r"line 6: several sensors: torso_imu pelvis_imu; choose one by columns="):
        read_recording(file)
    same_turns(read_recording(file, columns={"orientation": "torso_imu"}))
    same_turns(read_recording(file, columns={"orientation": "pelvis_imu"}), WXYZ[::-1])
    with pytest.raises(InvalidArgumentError, match="torso_imu pelvis_imu"):
        read_recording(file, columns={"orientation": "head"})
    file.write_text(f"{head}time\ttorso_imu\n0.0\t1,0,0,0\n0.05\t1,0,0\n")
    with pytest.raises(RecordingError, match="line 8, column torso_imu: '1,0,0' is no quaternion"):
        read_recording(file)


def test_angles_of_recordings(tmp_path):
    file = tmp_path / "a.csv"
    angles = np.degrees(TURNS.as_euler("ZYX"))  # yaw, pitch, roll
    body = "".join(f"{k / 20},{r!r},{p!r},{y!r}\n" for k, (y, p, r) in enumerate(angles.tolist()))
    file.write_text("t,roll,pitch,yaw\n" + body)
    same_turns(read_recording(file))
    body = "".join(f"{k / 20},{a!r},{b!r},{c!r}\n" for k, (a, b, c) in enumerate(angles.tolist()))
    file.write_text("t,angle1,angle2,angle3\n" + body)
    same_turns(read_recording(file, angles="euler-ZYX"))
    with pytest.raises(RecordingError, match="no columns of phi1 Phi phi2"):
        read_recording(file, angles="bunge")
    with pytest.raises(RecordingError, match="neither gx gy gz nor"):
        read_recording(file)
