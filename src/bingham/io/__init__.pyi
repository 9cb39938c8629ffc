from .axes import Axes as Axes
from .axes import read_axes as read_axes
from .broad import read_broad as read_broad
from .checks import RecordingWarning as RecordingWarning
from .csv import read_csv as read_csv
from .csv import write_csv as write_csv
from .detect import detect_format as detect_format
from .detect import read_recording as read_recording
from .ebsd import EbsdMap as EbsdMap
from .ebsd import read_ebsd as read_ebsd
from .euroc import read_euroc as read_euroc
from .kitti import read_kitti as read_kitti
from .npz import read_npz as read_npz
from .npz import write_npz as write_npz
from .opensim import read_opensim as read_opensim
from .pieces import read_pieces as read_pieces
from .rosbag import read_rosbag as read_rosbag
from .rosbag_orientation import RosbagOrientation as RosbagOrientation
from .rosbag_orientation import read_rosbag_orientation as read_rosbag_orientation
from .rosbag_writer import write_rosbag as write_rosbag
from .track import read_track as read_track
from .track import write_track_npz as write_track_npz
from .track_csv import write_track_csv as write_track_csv
from .tum import read_tum as read_tum
from .tum import write_tum as write_tum

__all__: list[str]
