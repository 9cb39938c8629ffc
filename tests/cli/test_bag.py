"""`bingham track --bag`: recordings as bags, written and read back by the rosbags package."""

import json
from dataclasses import replace

import numpy as np
import pytest

from bags import KINDS, Bag, fingerprint, messages
from bingham import Bingham
from bingham.cli.bag import world_covariance
from bingham.filters.track import BinghamTrack
from bingham.io import read_recording, read_rosbag_orientation, read_track
from bingham.metrics import broad_rmse
from bingham.rotations import to_rotation

pytest.importorskip("rosbags")

START = 1_700_000_000_000_000_000


def write(kind, path, recording, *, imu_topics=("/imu",), name="walk", magnetometer=True):
    path.mkdir(exist_ok=True)
    with Bag(kind, path, name=name) as bag:
        for k, t in enumerate(recording.time):
            stamp = START + round(1e9 * t)
            for topic in imu_topics:
                bag.imu(topic, stamp, recording.gyroscope[k], recording.accelerometer[k], orientation_covariance=-1.0)
            if magnetometer:
                bag.field("/mag", stamp, 1e-6 * recording.magnetometer[k])
    return bag.path


@pytest.fixture
def recording(imu):
    return read_recording(imu)


def copy_of(path, folder):
    return folder / ("walk.track" + path.suffix)


@pytest.mark.parametrize("kind", KINDS)
def test_the_track_is_in_the_bag_beside_its_topics(bingham, recording, tmp_path, kind):
    path = write(kind, tmp_path / "in", recording)
    before = fingerprint(path)
    out = tmp_path / "out"
    result = bingham("track", path, "--bag", "--no-figure", "--frame", "body", "--json", "-o", out)
    assert (result.exit_code, result.stderr) == (0, "")
    assert json.loads(result.stdout)["files"][-1] == str(copy_of(path, out))
    assert {p.name for p in out.iterdir()} == {"walk.track.csv", "walk.track.npz", copy_of(path, out).name}
    assert fingerprint(path) == before
    assert [row for row in messages(copy_of(path, out))[1] if row[0] != "/imu/bingham"] == messages(path)[1]

    track = read_track(out / "walk.track.npz")
    reported = read_rosbag_orientation(copy_of(path, out), imu_topic="/imu/bingham")
    np.testing.assert_array_equal(reported.orientation, track["modes"])
    # The npz file has the covariance in the body, the message in the world: the angle between is large here.
    turn = to_rotation(track["modes"]).as_matrix()
    rotated = turn @ track["covariance"] @ np.swapaxes(turn, 1, 2)
    np.testing.assert_allclose(reported.covariance, rotated, rtol=1e-6, atol=1e-12)
    assert np.abs(reported.covariance - track["covariance"]).max() > 0.1 * np.abs(reported.covariance).max()
    rows = [m for m in messages(copy_of(path, out))[2] if m.__msgtype__.endswith("Imu")][1::2]
    rate = [m.angular_velocity.z for m in rows]
    np.testing.assert_allclose(rate, recording.gyroscope[:, 2] - track["bias"][:, 2], rtol=1e-12)
    errors = broad_rmse(reported.orientation[200:], recording.reference[200:])
    assert np.degrees(errors.total) < 2.0


def test_an_unknown_heading_is_a_finite_covariance(bingham, recording, tmp_path):
    path = write("sqlite", tmp_path / "in", replace(recording, magnetometer=None), magnetometer=False)
    assert bingham("track", path, "--bag", "--no-figure", "-o", tmp_path / "out").exit_code == 0
    reported = read_rosbag_orientation(tmp_path / "out/walk.track", imu_topic="/imu/bingham")
    np.testing.assert_allclose(reported.covariance[:, 2, 2], np.pi**2 / 3, rtol=1e-6)
    assert np.max(reported.covariance[100:, 0, 0]) < 1e-2


def test_a_distribution_without_a_mode_is_a_finite_covariance():
    tilt, heading = 0.01, np.pi**2 / 3
    about_the_vertical = np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [1, 0, 0, 0]], dtype=float).T
    girdle = Bingham([-2 / tilt, -2 / tilt, 0.0, 0.0], about_the_vertical)
    clear = Bingham.from_covariance([1.0, 0, 0, 0], 0.01 * np.eye(3), frame="world")
    each = [girdle, Bingham.uniform(4), clear]
    states = Bingham.from_spectrum(np.array([p.z for p in each]), np.array([p.M for p in each]))
    nothing = np.zeros(3)
    track = BinghamTrack(time=None, modes=states.mode, log_evidence=nothing, nis=nothing,
                         decision=nothing.astype(np.int8), final=clear, states=states)  # fmt: skip
    found = world_covariance(track)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found[0], np.diag([tilt, tilt, heading]), rtol=0.02, atol=1e-9)
    np.testing.assert_allclose(found[1], heading * np.eye(3), atol=1e-9)
    np.testing.assert_array_equal(found[2], clear.covariance(frame="world"))


def test_topics_are_chosen(bingham, recording, tmp_path):
    path = write("bag", tmp_path / "in", recording, imu_topics=("/front", "/rear"))
    run = ("track", path, "--bag", "--no-figure", "-o", tmp_path / "out")
    result = bingham(*run)
    assert result.exit_code == 2
    assert result.stderr == (
        f"bingham: {path}: several topics of sensor_msgs/msg/Imu: /front /rear; choose one by --topic imu=TOPIC, "
        "or --topic gyroscope=TOPIC and --topic accelerometer=TOPIC\n"
    )
    assert not (tmp_path / "out").exists()
    assert bingham(*run, "--topic", "imu=/rear", "--topic", "orientation=/imu/data").exit_code == 0
    about, _, _ = messages(tmp_path / "out/walk.track.bag")
    assert {a[0] for a in about} == {"/front", "/rear", "/mag", "/imu/data"}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ("--bag", "--topic", "orientation=/mag"),
            "topic /mag: is in the bag already; give the new topic another name",
        ),
        (("--topic", "orientation=/a"), "--topic: expected --bag beside orientation=, got /a"),
    ],
)
def test_a_wrong_topic_is_one_line_and_no_output(bingham, recording, tmp_path, options, message):
    path = write("mcap", tmp_path / "in", recording)
    result = bingham("track", path, *options, "--no-figure", "-o", tmp_path / "out")
    assert result.exit_code == 2
    (line,) = result.stderr.splitlines()
    assert message in line
    assert not (tmp_path / "out").exists()


def test_what_is_no_bag_is_rejected(bingham, imu, tmp_path):
    result = bingham("track", imu, "--bag", "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert result.stderr == f"bingham: --bag: expected ROS bags only, got {imu}; leave --bag out\n"


def test_a_copy_replaces_an_older_copy_but_no_recording_and_no_other_folder(bingham, recording, tmp_path):
    path = write("sqlite", tmp_path / "in", recording)
    out = tmp_path / "out"
    for _ in range(2):
        assert bingham("track", path, "--bag", "--no-figure", "-o", out).exit_code == 0
    other = write("sqlite", tmp_path / "in", recording, name="walk.track")
    before = fingerprint(other)
    result = bingham("track", path, other, "--bag", "--no-figure", "-o", tmp_path / "in")
    assert result.exit_code == 2
    assert "the copy of" in result.stderr and "would replace a recording" in result.stderr
    assert fingerprint(other) == before
    (tmp_path / "new/walk.track").mkdir(parents=True)
    result = bingham("track", path, "--bag", "--no-figure", "-o", tmp_path / "new")
    assert result.exit_code == 2
    assert "a folder that is no bag is in the way" in result.stderr
    assert list((tmp_path / "new").iterdir()) == [tmp_path / "new/walk.track"]
