"""Read a recording of any supported format; the content of the file decides, not its name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from bingham.errors import InvalidArgumentError, RecordingError
from bingham.io.broad import HDF5_SIGNATURE, read_broad
from bingham.io.checks import existing
from bingham.io.csv import read_csv
from bingham.io.euroc import read_euroc
from bingham.io.npz import read_npz
from bingham.io.rosbag import read_rosbag
from bingham.io.text import is_utf16, numbered_lines
from bingham.io.tum import read_tum
from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["detect_format", "read_recording"]

READERS: dict[str, Callable[..., ImuRecording | OrientationRecording]] = {
    "csv": read_csv,
    "tum": read_tum,
    "euroc": read_euroc,
    "broad": read_broad,
    "npz": read_npz,
    "rosbag": read_rosbag,
}
SIGNATURES = {
    b"PK\x03\x04": "npz",
    HDF5_SIGNATURE: "broad",
    b"MATLAB": "broad",
    b"#ROSBAG V": "rosbag",
    b"SQLite format 3\0": "rosbag",
    b"\x89MCAP": "rosbag",
}
SUPPORTED = "supported: CSV with named columns, TUM, EuRoC, BROAD .mat/.hdf5, npz, ROS 1 .bag, ROS 2 folder/.db3/.mcap"


def read_recording(
    path: str | Path, *, format: str | None = None, **options: Any
) -> ImuRecording | OrientationRecording:
    """Read a recording of any supported format.

    Parameters
    ----------
    path : str or Path
        File, or folder of a ROS 2 bag or EuRoC sequence.
    format : {"csv", "tum", "euroc", "broad", "npz", "rosbag"}, optional
        Format, if its recognition is not to be trusted.
    **options
        Passed to the reader of the format.

    Returns
    -------
    ImuRecording or OrientationRecording
        The recording, named after its file.

    Raises
    ------
    RecordingError
        If the format is not recognised or the file not as its format promises.
    """
    if format is None:
        format = detect_format(path)
    elif format not in READERS:
        raise InvalidArgumentError("format", f"one of {', '.join(READERS)}", repr(format))
    return READERS[format](path, **options)


def detect_format(path: str | Path) -> str:
    """Return the key of the format of a file or folder, as `read_recording` takes it.

    Raises
    ------
    RecordingError
        If it is none of the supported ones.
    """
    path = Path(path)
    if path.is_dir():
        if (path / "metadata.yaml").is_file():
            return "rosbag"
        if (path / "mav0").is_dir() or (path / "imu0").is_dir() or path.resolve().name == "imu0":
            return "euroc"
        raise RecordingError(path, "", "a folder that is neither a ROS 2 bag nor an EuRoC sequence", SUPPORTED)
    existing(path)
    with path.open("rb") as file:
        start = file.read(16)
    for signature, name in SIGNATURES.items():
        if start.startswith(signature):
            return name
    if is_utf16(start):
        numbered_lines(path)  # which says so
    try:
        lines = [line.strip() for _, line in numbered_lines(path)[:1000]]
    except RecordingError as error:
        raise RecordingError(path, error.place, "no known format", SUPPORTED) from None
    if lines[0].startswith("#") and "_RS_" in lines[0]:
        return "euroc"
    body = next((line for line in lines if not line.startswith("#")), "")
    if len(body.split()) == 8 and not any(c in body for c in ",;"):
        return "tum"
    if any(c in body for c in ",;\t"):
        return "csv"
    raise RecordingError(path, "line 1", "no known format", SUPPORTED)
