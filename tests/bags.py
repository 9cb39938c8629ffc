"""ROS bags for tests, written by the rosbags package."""

import hashlib

import numpy as np

DELAY = 7_000_000  # from measurement to recording, ns
KINDS = ["bag", "sqlite", "mcap"]
COMPRESSED = ["bag+lz4", "bag+bz2", "sqlite+file", "sqlite+message", "mcap+storage"]


class Bag:
    """One bag on disk, of any of the kinds."""

    def __init__(self, kind, path, version=9, name="x"):
        from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
        from rosbags.rosbag1 import Writer as Writer1
        from rosbags.rosbag2 import StoragePlugin
        from rosbags.rosbag2 import Writer as Writer2
        from rosbags.rosbag2.enums import CompressionFormat, CompressionMode
        from rosbags.typesys import Stores, get_typestore

        kind, _, compression = kind.partition("+")
        self.ros1 = kind == "bag"
        self.store = get_typestore(Stores.ROS1_NOETIC if self.ros1 else Stores.ROS2_HUMBLE)
        self.path = path / (f"{name}.bag" if self.ros1 else name)
        if self.ros1:
            self.writer = Writer1(self.path)
            if compression:
                self.writer.set_compression(Writer1.CompressionFormat[compression.upper()])
            self.about = {"callerid": "/driver", "latching": 1}
        else:
            plugin = StoragePlugin.MCAP if "mcap" in kind else StoragePlugin.SQLITE3
            self.writer = Writer2(self.path, version=version, storage_plugin=plugin)
            if compression:
                self.writer.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
            self.writer.set_custom_data("place", "hall 3")
            never = QosTime(2147483647, 4294967295)
            quality = Qos(QosHistory.KEEP_LAST, 7, QosReliability.BEST_EFFORT, QosDurability.TRANSIENT_LOCAL, never,
                          never, QosLiveliness.AUTOMATIC, never, False)  # fmt: skip
            self.about = {"offered_qos_profiles": [quality]}

    def __enter__(self):
        self.writer.open()
        self.connections = {}
        return self

    def __exit__(self, *_):
        self.writer.close()

    @property
    def types(self):
        return self.store.types

    def header(self, stamp, frame="imu"):
        time = self.types["builtin_interfaces/msg/Time"](sec=int(stamp // 10**9), nanosec=int(stamp % 10**9))
        return self.types["std_msgs/msg/Header"](stamp=time, frame_id=frame, **({"seq": 17} if self.ros1 else {}))

    def write(self, topic, name, stamp, **fields):
        kind = f"sensor_msgs/msg/{name}"
        header = self.header(stamp, f"{topic.strip('/')}_link")
        self.message(topic, kind, self.types[kind](header=header, **fields), stamp)

    def message(self, topic, kind, message, stamp):
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, kind, typestore=self.store, **self.about)
        serialize = self.store.serialize_ros1 if self.ros1 else self.store.serialize_cdr
        self.writer.write(self.connections[topic], int(stamp + DELAY), serialize(message, kind))

    def vector(self, values):
        return self.store.types["geometry_msgs/msg/Vector3"](*map(float, values))

    def imu(self, topic, stamp, gyro, force, gyro_covariance=0.0, force_covariance=0.0,
            orientation=(1.0, 0.0, 0.0, 0.0), orientation_covariance=0.0):  # fmt: skip
        zero = np.zeros(9)
        w, x, y, z = map(float, orientation)
        self.write(
            topic,
            "Imu",
            stamp,
            orientation=self.store.types["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w),
            orientation_covariance=zero + orientation_covariance,
            angular_velocity=self.vector(gyro),
            angular_velocity_covariance=zero + gyro_covariance,
            linear_acceleration=self.vector(force),
            linear_acceleration_covariance=zero + force_covariance,
        )

    def field(self, topic, stamp, field):
        vector = self.vector(field)
        self.write(topic, "MagneticField", stamp, magnetic_field=vector, magnetic_field_covariance=np.zeros(9))


def messages(path):
    """Everything in a bag, message by message, and what is known about each topic."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
        about = {(c.topic, c.msgtype, c.msgdef, c.digest, repr(c.ext), c.msgcount) for c in bag.connections}
        rows = [(c.topic, received, bytes(data)) for c, received, data in bag.messages()]
        parsed = [bag.deserialize(data, c.msgtype) for c, _, data in bag.messages()]
    return about, rows, parsed


def fingerprint(path):
    """Return names, times of change and content of a bag's files."""
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    return [(f.name, f.stat().st_mtime_ns, hashlib.sha256(f.read_bytes()).hexdigest()) for f in files]
