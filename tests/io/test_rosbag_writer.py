"""Bags written next to their input's topics, read back by the rosbags package."""

import sqlite3

import numpy as np
import pytest

from bags import COMPRESSED, DELAY, KINDS, Bag, fingerprint, messages
from bingham import Bingham
from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io import read_rosbag, read_rosbag_orientation, write_rosbag
from bingham.rotations import to_rotation

pytest.importorskip("rosbags")

N = 30
RNG = np.random.default_rng(5)
STAMPS = 1_700_000_000_000_000_000 + np.arange(N) * 5_000_000 + RNG.integers(-400_000, 400_000, N)
GYRO, FORCE = RNG.standard_normal((2, N, 3))
MODES = Bingham.uniform(4).rvs(N, rng=6)
BODY = np.array([[4e-4, 1e-4, 0.0], [1e-4, 9e-4, 0.0], [0.0, 0.0, 1e-2]])
DISTRIBUTIONS = Bingham.from_covariance(MODES, BODY, frame="body")
WORLD = DISTRIBUTIONS.covariance(frame="world")


def write(kind, path, *, imu_topics=("/imu",), empty_topic=False, version=9, name="x", **more):
    with Bag(kind, path, version, name) as bag:
        for stamp, gyro, force in zip(STAMPS, GYRO, FORCE, strict=True):
            bag.write("/temperature", "Temperature", stamp - 1000, temperature=20.0, variance=0.0)
            for topic in imu_topics:
                bag.imu(topic, stamp, gyro, force, **more)
            bag.field("/mag", stamp + 1000, force)
        if empty_topic:
            kind = "sensor_msgs/msg/Range"
            bag.writer.add_connection("/range", kind, typestore=bag.store, **bag.about)
    return bag.path


def estimates(path, **more):
    return {"time": read_rosbag(path, **more).time, "orientation": MODES, "covariance": WORLD}


def target(path, name="y"):
    return path.with_name(f"{name}{path.suffix}")


def added(path, topic="/imu/bingham"):
    _, rows, parsed = messages(path)
    return [(row, message) for row, message in zip(rows, parsed, strict=True) if row[0] == topic]


@pytest.mark.parametrize("kind", [*KINDS, *COMPRESSED])
def test_the_topics_of_the_input_stay_as_they_are(tmp_path, kind):
    path = write(kind, tmp_path, empty_topic=not kind.startswith("bag"))
    before = fingerprint(path)
    write_rosbag(target(path), path, **estimates(path))
    about, rows, _ = messages(path)
    new_about, new_rows, _ = messages(target(path))
    assert [row for row in new_rows if row[0] != "/imu/bingham"] == rows
    assert {a for a in new_about if a[0] != "/imu/bingham"} == about
    ((_, *like),) = [a for a in about if a[0] == "/imu"]
    assert ("/imu/bingham", *like) in new_about
    assert fingerprint(path) == before
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([path.name, target(path).name])


@pytest.mark.parametrize("kind", [*KINDS, *COMPRESSED])
def test_version_storage_and_compression_stay(tmp_path, kind):
    path = write(kind, tmp_path)
    write_rosbag(target(path), path, **estimates(path))
    if kind.startswith("bag"):
        word = kind.partition("+")[2] or "none"
        assert f"compression={word}".encode() in target(path).read_bytes()[:5000]
        return
    old, new = ((p / "metadata.yaml").read_text().splitlines() for p in (path, target(path)))
    for key in ("version", "storage_identifier", "compression_format", "compression_mode", "place"):
        (line,) = [line for line in old if line.strip().startswith(f"{key}:")]
        assert line in new
    # Of the same endings: .mcap, .db3, .db3.zstd; small bags of mcap's own compression are smaller than plain ones.
    assert {"".join(f.suffixes) for f in path.iterdir()} == {"".join(f.suffixes) for f in target(path).iterdir()}
    if kind == "mcap+storage":
        assert b"zstd" in next(target(path).glob("*.mcap")).read_bytes()


@pytest.mark.parametrize("kind", KINDS)
def test_a_message_says_what_the_distribution_says(tmp_path, kind):
    path = write(kind, tmp_path)
    write_rosbag(target(path), path, **estimates(path))
    _, _, originals = messages(path)
    originals = [m for m in originals if m.__msgtype__ == "sensor_msgs/msg/Imu"]
    found = added(target(path))
    assert len(found) == N
    for k, ((_, received, _), message) in enumerate(found):
        assert received == STAMPS[k] + DELAY
        assert repr(message.header) == repr(originals[k].header)
        assert message.header.frame_id == "imu_link"
        q = message.orientation
        np.testing.assert_array_equal([q.w, q.x, q.y, q.z], MODES[k])
        np.testing.assert_array_equal(message.orientation_covariance.reshape(3, 3), WORLD[k])
        # Fixed axes: R C_body Rᵀ, with SciPy's scalar-last rotation from the numbers of the message.
        turn = to_rotation([q.w, q.x, q.y, q.z]).as_matrix()
        np.testing.assert_allclose(message.orientation_covariance.reshape(3, 3), turn @ BODY @ turn.T, rtol=1e-9)
        assert repr(message.linear_acceleration) == repr(originals[k].linear_acceleration)
        assert repr(message.angular_velocity) == repr(originals[k].angular_velocity)


@pytest.mark.parametrize("kind", KINDS)
def test_the_distribution_comes_back(tmp_path, kind):
    path = write(kind, tmp_path)
    write_rosbag(target(path), path, **estimates(path))
    back = read_rosbag_orientation(target(path), imu_topic="/imu/bingham")
    np.testing.assert_array_equal(back.time, read_rosbag(path).time)
    np.testing.assert_array_equal(back.orientation, MODES)
    distributions = Bingham.from_covariance(back.orientation, back.covariance, frame="world")
    assert np.max(distributions.kl_divergence(DISTRIBUTIONS)) < 1e-12


def test_the_variance_of_the_heading_is_the_last_entry_whatever_the_tilt(tmp_path):
    path = write("bag", tmp_path)
    heading = np.array([0.0, 0.0, 1.0])
    vague = Bingham.from_covariance(MODES, np.diag([1e-4, 1e-4, 0.25]), frame="world").covariance(frame="world")
    write_rosbag(target(path), path, **estimates(path) | {"covariance": vague})
    for _, message in added(target(path)):
        assert heading @ message.orientation_covariance.reshape(3, 3) @ heading == pytest.approx(0.25)


@pytest.mark.parametrize("kind", KINDS)
def test_no_estimate_is_minus_one_and_comes_back_as_nan(tmp_path, kind):
    path = write(kind, tmp_path)
    rows = estimates(path)
    orientation = rows["orientation"].copy()
    orientation[:4] = np.nan
    write_rosbag(target(path), path, **rows | {"orientation": orientation})
    found = [message for _, message in added(target(path))]
    assert [m.orientation_covariance[0] == -1.0 for m in found] == [k < 4 for k in range(N)]
    back = read_rosbag_orientation(target(path), imu_topic="/imu/bingham")
    assert np.isnan(back.orientation[:4]).all() and np.isnan(back.covariance[:4]).all()
    assert np.isfinite(back.orientation[4:]).all() and np.isfinite(back.covariance[4:]).all()


@pytest.mark.parametrize(
    ("covariance", "quaternion", "there", "known"),
    [
        (0.0, (1, 0, 0, 0), True, False),  # covariance unknown
        (-1.0, (1, 0, 0, 0), False, False),  # no orientation
        (np.nan, (1, 0, 0, 0), False, False),  # REP 145's way to say so
        (0.0, (0, 0, 0, 0), False, False),  # message never filled in
        (np.eye(3).ravel(), (0.6, 0, 0, 0.8), True, True),
    ],
)
def test_what_a_driver_says_about_its_orientation(tmp_path, covariance, quaternion, there, known):
    path = write("sqlite", tmp_path, orientation=quaternion, orientation_covariance=covariance)
    read = read_rosbag_orientation(path)
    assert np.isfinite(read.orientation).all() == there
    assert np.isfinite(read.covariance).all() == known
    if there:
        np.testing.assert_array_equal(read.orientation, np.tile(np.float64(quaternion), (N, 1)))


def test_a_quaternion_that_is_none_is_rejected(tmp_path):
    path = write("bag", tmp_path, orientation=(2, 0, 0, 0))
    with pytest.raises(RecordingError, match=r"topic /imu, message 1, orientation: norm 2; unit norm within 0.002"):
        read_rosbag_orientation(path)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (0.0, np.zeros(9)),  # unknown stays unknown
        (np.diag([1e-4, 2e-4, 3e-4]).ravel(), np.diag([1e-4 + 1e-6, 2e-4 + 4e-6, 3e-4 + 9e-6]).ravel()),
    ],
)
def test_the_bias_leaves_the_rate_and_widens_a_known_covariance(tmp_path, given, expected):
    path = write("mcap", tmp_path, gyro_covariance=given, force_covariance=-1.0)
    bias = np.tile([0.01, -0.02, 0.03], (N, 1))
    bias[0] = np.nan
    more = {"bias": bias, "bias_std": np.tile([1e-3, 2e-3, 3e-3], (N, 1))}
    write_rosbag(target(path), path, **estimates(path), **more)
    found = [message for _, message in added(target(path))]
    rates = np.array([[m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z] for m in found])
    np.testing.assert_array_equal(rates, GYRO - np.nan_to_num(bias))
    np.testing.assert_allclose(found[1].angular_velocity_covariance, expected, rtol=1e-14)
    assert all(m.linear_acceleration_covariance[0] == -1.0 for m in found)


@pytest.mark.parametrize(("kind", "ending"), [("sqlite", ".db3"), ("mcap", ".mcap")])
def test_single_files_of_ros2_become_a_bag(tmp_path, kind, ending):
    (tmp_path / "out").mkdir()
    (file,) = write(kind, tmp_path).glob(f"*{ending}")
    write_rosbag(tmp_path / "out/y", file, **estimates(file))
    about, rows, _ = messages(file)
    new_about, new_rows, _ = messages(tmp_path / "out/y")
    assert [row for row in new_rows if row[0] != "/imu/bingham"] == rows
    assert {a[:3] for a in about} <= {a[:3] for a in new_about}


def test_version_8_stays_readable_by_what_reads_version_8(tmp_path):
    path = write("sqlite", tmp_path, version=8)
    write_rosbag(target(path), path, **estimates(path))
    assert "version: 8" in (target(path) / "metadata.yaml").read_text()


def without_definitions(path):
    """Turn a bag into what Foxy wrote: no definitions of messages in it."""
    (file,) = path.glob("*.db3")
    with sqlite3.connect(file) as database:
        database.execute("DROP TABLE message_definitions")
        database.execute("UPDATE schema SET schema_version = 3")
    database.close()
    return file


def test_old_bags_without_definitions_get_the_published_ones(tmp_path):
    path = write("sqlite", tmp_path, version=8)
    without_definitions(path)
    write_rosbag(target(path), path, **estimates(path))
    assert [row for row in messages(target(path))[1] if row[0] != "/imu/bingham"] == messages(path)[1]
    assert len(added(target(path))) == N


def test_an_undefined_type_is_one_line_and_leaves_nothing(tmp_path):
    path = write("sqlite", tmp_path, version=8)
    file = without_definitions(path)
    with sqlite3.connect(file) as database:
        database.execute("UPDATE topics SET type = 'ours/msg/Warmth' WHERE name = '/temperature'")
    database.close()
    metadata = path / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("sensor_msgs/msg/Temperature", "ours/msg/Warmth"))
    with pytest.raises(
        RecordingError, match=r"topic /temperature: the bag does not define its type ours/msg/Warmth; convert"
    ):
        write_rosbag(target(path), path, **estimates(path))
    assert [p.name for p in tmp_path.iterdir()] == ["x"]


@pytest.mark.parametrize("kind", KINDS)
def test_an_older_result_is_replaced_and_nothing_else_is(tmp_path, kind):
    path = write(kind, tmp_path)
    for modes in (MODES[::-1], MODES):
        write_rosbag(target(path), path, **estimates(path) | {"orientation": modes})
    np.testing.assert_array_equal(read_rosbag_orientation(target(path), imu_topic="/imu/bingham").orientation, MODES)
    occupied = target(path, "z")
    if path.is_dir():
        occupied.mkdir()
        (occupied / "letter.txt").write_text("dear")
    else:
        occupied.mkdir()
    with pytest.raises(RecordingError, match="something that is no bag is in the way"):
        write_rosbag(occupied, path, **estimates(path))
    assert occupied.exists()


@pytest.mark.parametrize("kind", KINDS)
def test_the_input_cannot_be_the_output(tmp_path, kind):
    path = write(kind, tmp_path)
    before = fingerprint(path)
    with pytest.raises(RecordingError, match="is the bag that is read"):
        write_rosbag(path, path, **estimates(path))
    assert fingerprint(path) == before
    wrong = tmp_path / ("y" if kind == "bag" else "y.bag")
    with pytest.raises(InvalidArgumentError, match="ROS 1" if kind == "bag" else "ROS 2"):
        write_rosbag(wrong, path, **estimates(path))


@pytest.mark.parametrize("kind", KINDS)
def test_failures_leave_nothing(tmp_path, kind):
    path = write(kind, tmp_path, imu_topics=("/front", "/rear"))
    rows = estimates(path, imu_topic="/rear")
    short = {name: values[:-3] for name, values in rows.items()}
    before = sorted(p.name for p in tmp_path.iterdir())
    for more, message in [
        ({}, r"several topics.*/front /rear; choose one by imu_topic="),
        ({"imu_topic": "/left"}, "topic /left: no sensor_msgs/msg/Imu messages"),
        ({"imu_topic": "/front", "topic": "/mag"}, "topic /mag: is in the bag already"),
        ({"imu_topic": "/front", **short}, r"topic /front, stamp 17\d+ ns: no estimate of this time; filter the same"),
    ]:
        with pytest.raises(RecordingError, match=message) as caught:
            write_rosbag(target(path), path, **rows | more)
        assert "\n" not in str(caught.value)
    with pytest.raises(RecordingError, match="its folder does not exist"):
        write_rosbag(tmp_path / "no" / target(path).name, path, **rows)
    assert sorted(p.name for p in tmp_path.iterdir()) == before


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("part", [0.02, 0.5, 0.95])
def test_damaged_input_leaves_nothing(tmp_path, kind, part):
    path = write(kind, tmp_path)
    rows = estimates(path)
    file = path if kind == "bag" else next(f for f in path.iterdir() if f.suffix in (".db3", ".mcap"))
    whole = file.read_bytes()
    file.write_bytes(whole[: int(part * len(whole))])
    with pytest.raises(RecordingError) as caught:
        write_rosbag(target(path), path, **rows)
    assert str(caught.value).startswith(f"{path}")
    assert "\n" not in str(caught.value)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("orientation", lambda a: 2 * a, "orientation: expected unit quaternions"),
        ("orientation", lambda a: a[:-1], r"orientation: expected shape \(30, 4\)"),
        ("covariance", lambda a: a * np.nan, "covariance: expected finite, positive variances"),
        ("covariance", lambda a: a * 0, "covariance: expected finite, positive variances"),  # zeros would mean unknown
    ],
)
def test_arrays_that_do_not_fit(tmp_path, name, change, message):
    path = write("bag", tmp_path)
    rows = estimates(path)
    with pytest.raises(InvalidArgumentError, match=message):
        write_rosbag(target(path), path, **rows | {name: change(rows[name])})
