"""ROS 1 and ROS 2 bags, written by the rosbags package and read back."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bags import DELAY, KINDS, Bag
from bingham.errors import InvalidArgumentError, RecordingError, RepairWarning
from bingham.io import RecordingWarning, detect_format, read_recording

pytest.importorskip("rosbags")

RATE = 200
RNG = np.random.default_rng(0)
START = 1_700_000_000_000_000_000
STAMPS = START + np.arange(60) * 5_000_000 + RNG.integers(-400_000, 400_000, 60)
GYRO = RNG.standard_normal((60, 3))
FORCE = RNG.standard_normal((60, 3))
FIELD_STAMPS = STAMPS[1::4] + 300_000  # slower, and late
FIELD = RNG.standard_normal((15, 3)) * 1e-5


def write(kind, path, *, imu_topics=("/imu",), field_topics=("/mag",), stamps=STAMPS, **absent):
    with Bag(kind, path) as bag:
        for topic in imu_topics:
            for stamp, gyro, force in zip(stamps, GYRO, FORCE, strict=True):
                bag.imu(topic, stamp, gyro, force, **absent)
        for topic in field_topics:
            for stamp, field in zip(FIELD_STAMPS, FIELD, strict=True):
                bag.field(topic, stamp, field)
        temperature = {"temperature": 20.0, "variance": 0.0}
        bag.write("/temperature", "Temperature", STAMPS[0], **temperature)  # not of interest
    return bag.path


@pytest.mark.parametrize("kind", KINDS)
def test_bags_come_back(tmp_path, kind):
    path = write(kind, tmp_path)
    assert detect_format(path) == "rosbag"
    recording = read_recording(path)
    np.testing.assert_allclose(recording.time, STAMPS / 1e9, rtol=0, atol=3e-7)
    np.testing.assert_array_equal(recording.gyroscope, GYRO)
    np.testing.assert_array_equal(recording.accelerometer, FORCE)
    there = np.isfinite(recording.magnetometer[:, 0])
    np.testing.assert_array_equal(np.flatnonzero(there), np.arange(1, 60, 4))
    there_and_then = Rotation.from_rotvec(3e-4 * GYRO[1::4]).apply(FIELD)  # 0.3 ms earlier than measured
    np.testing.assert_allclose(recording.magnetometer[there], there_and_then, atol=2e-11)  # stamps: 2e-7 s
    assert np.abs(there_and_then - FIELD).max() > 1e-9
    late = read_recording(path, stamps="bag")
    np.testing.assert_allclose(late.time - recording.time, DELAY / 1e9, atol=5e-7)


@pytest.mark.parametrize(("kind", "ending"), [("sqlite", ".db3"), ("mcap", ".mcap")])
def test_single_files_of_ros2(tmp_path, kind, ending):
    write(kind, tmp_path)
    (file,) = tmp_path.glob(f"x/*{ending}")
    np.testing.assert_array_equal(read_recording(file).gyroscope, GYRO)


@pytest.mark.parametrize("kind", KINDS)
def test_topics_are_chosen_or_asked_for(tmp_path, kind):
    path = write(kind, tmp_path, imu_topics=("/front/imu", "/rear/imu"))
    with pytest.raises(RecordingError, match=r"several topics.*/front/imu /rear/imu; choose one by imu_topic="):
        read_recording(path)
    assert read_recording(path, imu_topic="/rear/imu").size == 60
    with pytest.raises(RecordingError, match=r"topic /no: no .* messages; .* /front/imu /rear/imu"):
        read_recording(path, imu_topic="/no")
    with pytest.raises(InvalidArgumentError, match="'header' or 'bag'"):
        read_recording(path, imu_topic="/rear/imu", stamps="message")


def test_no_magnetometer_no_accelerometer_no_gyroscope(tmp_path):
    for folder in "abcd":
        (tmp_path / folder).mkdir()
    for name, absent in (("a", -1.0), ("d", np.nan)):  # as Imu.msg and as REP 145 have it
        path = write("sqlite", tmp_path / name, field_topics=(), force_covariance=absent)
        recording = read_recording(path)
        assert recording.magnetometer is None
        assert recording.accelerometer is None
    path = write("bag", tmp_path / "b", gyro_covariance=-1.0)
    with pytest.raises(RecordingError, match="topic /imu: its driver says it has no gyroscope"):
        read_recording(path)
    path = write("bag", tmp_path / "c", imu_topics=())
    with pytest.raises(
        RecordingError, match=r"no topic of sensor_msgs/msg/Imu; topics in the bag: /mag .* /temperature"
    ):
        read_recording(path)


def test_field_samples_without_a_gyroscope_time_are_counted(tmp_path):
    stamps = STAMPS.copy()
    stamps[30:] += 2_000_000_000  # a gap that the magnetometer does not have
    path = write("bag", tmp_path, stamps=stamps)
    with pytest.warns(RecordingWarning, match="7 of 15 samples of the magnetometer left out"):
        recording = read_recording(path)
    assert np.isfinite(recording.magnetometer[:, 0]).sum() == 8


@pytest.mark.parametrize("kind", KINDS)
def test_times_must_increase(tmp_path, kind):
    stamps = STAMPS.copy()
    stamps[10] = stamps[9]
    path = write(kind, tmp_path, stamps=stamps)
    with pytest.warns(RepairWarning, match="1 of 60 time stamps repeat the one before"):
        recording = read_recording(path)
    assert recording.size == 59
    with pytest.raises(RecordingError, match=r"1 of 60 time stamps repeat .*; leave strict=True out"):
        read_recording(path, strict=True)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("part", [0.0, 0.02, 0.5, 0.95])
def test_damaged_bags(tmp_path, kind, part):
    path = write(kind, tmp_path)
    file = path if kind == "bag" else next(f for f in path.iterdir() if f.suffix in (".db3", ".mcap"))
    whole = file.read_bytes()
    file.write_bytes(whole[: int(part * len(whole))])
    with pytest.raises(RecordingError) as caught:
        read_recording(path)
    message = str(caught.value)
    assert message.startswith(f"{path}")
    assert "; " in message
    assert "\n" not in message


def test_nan_in_a_message(tmp_path, monkeypatch):
    gyro = GYRO.copy()
    gyro[20, 1] = np.nan
    monkeypatch.setitem(globals(), "GYRO", gyro)
    path = write("bag", tmp_path)
    with pytest.raises(RecordingError, match="topic /imu, message 21: expected finite numbers"):
        read_recording(path)


@pytest.mark.parametrize("kind", KINDS)
def test_a_field_as_a_plain_vector_is_taken_by_its_name_or_when_asked_for(tmp_path, kind):
    with Bag(kind, tmp_path) as bag:
        vector = "geometry_msgs/msg/Vector3Stamped"
        for stamp, gyro, force in zip(STAMPS, GYRO, FORCE, strict=True):
            bag.imu("/imu", stamp, gyro, force)
        for topic, scale in (("/imu/mag", 1.0), ("/goal", 2.0)):
            for stamp, field in zip(STAMPS, RNG.standard_normal((60, 3)), strict=True):
                message = bag.types[vector](header=bag.header(stamp), vector=bag.vector(scale * field))
                bag.message(topic, vector, message, stamp)
    with pytest.warns(RecordingWarning, match=r"topic /imu/mag of geometry_msgs/msg/Vector3Stamped: taken for"):
        found = read_recording(bag.path)
    assert np.isfinite(found.magnetometer).all()
    asked = read_recording(bag.path, magnetometer_topic="/goal")
    assert np.abs(asked.magnetometer - found.magnetometer).max() > 0.1
