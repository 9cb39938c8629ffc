"""Writing a bag message by message as another bag is read: same version of ROS, storage, compression, topics."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

from bingham.errors import RecordingError

__all__ = ["Copy"]

SEPARATOR = "=" * 80 + "\n"  # between definitions in IDL, as rosbags looks for it


class Copy:
    """A bag that is written like the one that is read.

    Parameters
    ----------
    bag : rosbags.highlevel.AnyReader
        The bag that is read, open.
    source : Path
        Where it is.
    path : Path
        File (ROS 1) or folder (ROS 2) to write; it must not exist.
    """

    def __init__(self, bag: Any, source: Path, path: Path) -> None:
        self._bag = bag
        self._source = source
        self._connections: dict[tuple[str, str, str], Any] = {}
        self._writer = _like_ros2(bag, source, path) if bag.is2 else _like_ros1(source, path)

    def __enter__(self) -> Copy:
        self._writer.open()
        for connection in self._bag.connections:  # topics without messages stay, too
            self._connection(connection)
        return self

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        if kind is None:
            self._writer.close()
        elif self._bag.is2:
            self._writer.abort()
        else:
            self._writer.bio.close()

    def write(self, connection: Any, received: int, data: bytes) -> None:
        """Write a message of a connection of the source, or of one that `like` made, as it is."""
        self._writer.write(self._connection(connection), received, data)

    def like(self, connection: Any, topic: str) -> Any:
        """Return a connection with another topic and everything else as in `connection`."""
        return connection._replace(topic=topic)

    def serialised(self, message: Any) -> bytes:
        """Return a message as bytes of the bag's version of ROS."""
        store = self._bag.typestore
        serialise = store.serialize_cdr if self._bag.is2 else store.serialize_ros1
        return bytes(serialise(message, message.__msgtype__))

    def _connection(self, like: Any) -> Any:
        key = (like.topic, like.msgtype, repr(like.ext))
        if key not in self._connections:
            definition, digest = self._definition(like)
            if self._bag.is2:
                about = {
                    "rihs01": digest,
                    "serialization_format": like.ext.serialization_format,
                    "offered_qos_profiles": like.ext.offered_qos_profiles,
                }
            else:
                about = {"md5sum": digest, "callerid": like.ext.callerid, "latching": like.ext.latching}
            self._connections[key] = self._writer.add_connection(like.topic, like.msgtype, msgdef=definition, **about)
        return self._connections[key]

    def _definition(self, connection: Any) -> tuple[str, str]:
        """Return a message's definition and digest: the bag's own; for old ROS 2 bags without, the published ones."""
        text, format = connection.msgdef.data, connection.msgdef.format.name
        if format == "IDL" and not text.startswith(f"{SEPARATOR}IDL: "):
            text = f"{SEPARATOR}IDL: {connection.msgtype}\n{text}"
        if format != "NONE" and connection.digest:
            return text, connection.digest
        types = import_module("rosbags.typesys")
        for store in (self._bag.typestore, types.get_typestore(types.Stores.ROS2_HUMBLE)):
            if connection.msgtype in store.fielddefs:
                published, _ = store.generate_msgdef(connection.msgtype, ros_version=2)
                return (published if format == "NONE" else text), store.hash_rihs01(connection.msgtype)
        raise RecordingError(
            self._source,
            f"topic {connection.topic}",
            f"the bag does not define its type {connection.msgtype}",
            "convert the bag first (ros2 bag convert), which adds definitions",
        )


def _like_ros1(source: Path, path: Path) -> Any:
    writers = import_module("rosbags.rosbag1")
    writer = writers.Writer(path)
    with source.open("rb") as file:
        start = file.read(4500)  # the header's record is padded to 4096 bytes; the first chunk follows
    compression = re.search(rb"compression=(bz2|lz4)", start)
    if compression:
        writer.set_compression(writers.Writer.CompressionFormat[compression[1].decode().upper()])
    return writer


def _like_ros2(bag: Any, source: Path, path: Path) -> Any:
    writers = import_module("rosbags.rosbag2")
    storage = bag.readers[0].storage
    files = getattr(storage, "storages", [storage])
    mcap = type(files[0]).__name__ == "McapReader"
    plugin = writers.StoragePlugin.MCAP if mcap else writers.StoragePlugin.SQLITE3
    # Version 9 writes quality of service in a way that older releases cannot read.
    metadata = source / "metadata.yaml"
    version = (
        re.search(r"^\s*version:\s*(\d+)", metadata.read_text(encoding="utf-8"), re.M) if source.is_dir() else None
    )
    writer = writers.Writer(path, version=9 if version and int(version[1]) >= 9 else 8, storage_plugin=plugin)
    enums = import_module("rosbags.rosbag2.enums")
    mode = storage.metadata.compression_mode
    if mode in ("file", "message"):
        writer.set_compression(enums.CompressionMode[mode.upper()], enums.CompressionFormat.ZSTD)
    elif mcap and any(chunk.compression for file in files for chunk in file.chunks):
        writer.set_compression(enums.CompressionMode.STORAGE, enums.CompressionFormat.ZSTD)
    for key, value in (storage.metadata.custom or {}).items():
        writer.set_custom_data(key, value)
    return writer
