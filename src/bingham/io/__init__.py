"""Recordings in, tracks out: readers with errors that name file, place and hint, and writers that leave no halves."""

from bingham.io.axes import Axes, read_axes
from bingham.io.broad import read_broad
from bingham.io.checks import RecordingWarning
from bingham.io.csv import read_csv, write_csv
from bingham.io.detect import detect_format, read_recording
from bingham.io.ebsd import EbsdMap, read_ebsd
from bingham.io.euroc import read_euroc
from bingham.io.kitti import read_kitti
from bingham.io.npz import read_npz, write_npz
from bingham.io.opensim import read_opensim
from bingham.io.rosbag import read_rosbag
from bingham.io.rosbag_orientation import RosbagOrientation, read_rosbag_orientation
from bingham.io.rosbag_writer import write_rosbag
from bingham.io.track import read_track, write_track_npz
from bingham.io.track_csv import write_track_csv
from bingham.io.tum import read_tum, write_tum

__all__ = [
    "Axes",
    "EbsdMap",
    "RecordingWarning",
    "RosbagOrientation",
    "detect_format",
    "read_axes",
    "read_broad",
    "read_csv",
    "read_ebsd",
    "read_euroc",
    "read_kitti",
    "read_npz",
    "read_opensim",
    "read_recording",
    "read_rosbag",
    "read_rosbag_orientation",
    "read_track",
    "read_tum",
    "write_csv",
    "write_npz",
    "write_rosbag",
    "write_track_csv",
    "write_track_npz",
    "write_tum",
]
