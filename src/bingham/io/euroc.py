"""EuRoC MAV sequences (also TUM VI): IMU and ground truth as CSV with nanosecond stamps, quaternions scalar first.

Burri et al., "The EuRoC micro aerial vehicle datasets", IJRR 35(10), 2016.
"""

from __future__ import annotations

from pathlib import Path

from bingham.errors import RecordingError
from bingham.io.assemble import Stream, inertial_recording, orientation_recording
from bingham.io.checks import normalised, time_from_nanoseconds
from bingham.io.layout import Layout
from bingham.io.registry import Format
from bingham.io.table import read_table
from bingham.io.text import opened_text
from bingham.recording import ImuRecording, OrientationRecording, amended

__all__ = ["read_euroc", "sequence_name"]

STAMP = "timestamp"
GYROSCOPE = [f"w_RS_S_{a}" for a in "xyz"]
ACCELEROMETER = [f"a_RS_S_{a}" for a in "xyz"]
POSITION = [f"p_RS_R_{a}" for a in "xyz"]
ORIENTATION = [f"q_RS_{a}" for a in "wxyz"]
# Folders whose poses are those of the IMU frame, in the order of preference.
TRUTH_FOLDERS = ("state_groundtruth_estimate0", "mocap0")


def read_euroc(path: str | Path, *, regularise: bool = False) -> ImuRecording | OrientationRecording:
    """Read a sequence folder, an IMU file or a ground truth file.

    Parameters
    ----------
    path : str or Path
        The folder that holds ``mav0``, ``mav0`` or its ``imu0``, or one ``data.csv``.
    regularise : bool
        Put times on a straight line between pauses: for samples taken regularly and stamped on arrival.

    Returns
    -------
    ImuRecording or OrientationRecording
        An IMU file gives gyroscope and accelerometer; a folder adds its ground truth as ``truth``, on a clock of its
        own; a ground truth file gives orientations. The world's z axis points up; its heading is arbitrary.

    Raises
    ------
    RecordingError
        If a file or column is missing or malformed.
    """
    path = Path(path)
    return _sequence(path, regularise) if path.is_dir() else _table(path, regularise)


def sequence_name(path: str | Path) -> str | None:
    """Return the name of the sequence to which a folder ``mav0`` or ``imu0``, or the file in it, belongs.

    The name of another sensor's ``data.csv`` has the sensor's after it; None: `path` is no part of a sequence.
    """
    path = Path(path).resolve()
    folder = path.parent if path.name == "data.csv" else path
    above = folder.parent if folder.name in ("imu0", *TRUTH_FOLDERS) else folder
    if above == folder and folder.name != "mav0":
        return None
    name = above.parent.name if above.name == "mav0" else above.name
    return f"{name}-{folder.name}" if folder.name in TRUTH_FOLDERS else name


def _sequence(folder: Path, regularise: bool) -> ImuRecording:
    if folder.resolve().name == "imu0":
        root = folder.resolve().parent
    else:
        root = folder if (folder / "imu0").is_dir() else folder / "mav0"
    file = root / "imu0" / "data.csv"
    if not file.is_file():
        raise RecordingError(folder, "", "no mav0/imu0/data.csv in it", "give the folder that holds mav0")
    imu = _table(file, regularise)
    if not isinstance(imu, ImuRecording):
        raise RecordingError(file, "line 1", "no gyroscope columns", f"expected {' '.join(GYROSCOPE)}")
    name = sequence_name(folder) or folder.resolve().name
    for truth_folder in TRUTH_FOLDERS:
        file = root / truth_folder / "data.csv"
        if file.exists():
            truth = _table(file, regularise)
            if not isinstance(truth, OrientationRecording):
                raise RecordingError(file, "line 1", "no orientations", f"expected {' '.join(ORIENTATION)}")
            return amended(imu, name=name, truth=truth)
    return amended(imu, name=name)


def _table(path: Path, regularise: bool) -> ImuRecording | OrientationRecording:
    text = opened_text(path)
    header, line = text.head[0]
    # "#timestamp [ns],w_RS_S_x [rad s^-1],..." -> timestamp, w_RS_S_x, ...
    names = [cell.partition("[")[0].strip() for cell in line.lstrip("# ").split(",")]
    place = f"line {header}"

    def at(columns: list[str]) -> list[int]:
        if missing := [c for c in columns if c not in names]:
            hint = "the header of an EuRoC file is expected"
            raise RecordingError(path, place, f"no column {' '.join(missing)}", hint)
        return [names.index(c) for c in columns]

    stamp = at([STAMP])
    if GYROSCOPE[0] in names:
        fields = {"gyroscope": at(GYROSCOPE), "accelerometer": at(ACCELEROMETER)}
    else:
        fields = {"orientation": at(ORIENTATION), "position": at(POSITION)}
    if len(text.head) < 2:
        raise RecordingError(path, "", "no rows of numbers", "record or copy it again")
    layout = Layout(",", ".", names, [], header, text.head[1][0], len(names))
    table = read_table(text, layout, [k for columns in fields.values() for k in columns], integers=stamp)

    def where(field: str, index: int) -> str:
        return table.place(fields.get(field, stamp), index)

    name = sequence_name(path) or path.stem
    time = time_from_nanoseconds(table.columns[stamp[0]])
    values = {field: table.matrix(columns, [1.0] * len(columns)) for field, columns in fields.items()}
    if "gyroscope" in values:
        streams = {field: Stream(time, samples) for field, samples in values.items()}
        return inertial_recording(path, where, streams, regularise=regularise, units=False, name=name)
    values["orientation"] = normalised(path, "orientation", values["orientation"], where)
    return orientation_recording(path, where, {"time": time, **values}, regularise=regularise, name=name)


def _is_folder(path: Path) -> bool:
    return (path / "mav0").is_dir() or (path / "imu0").is_dir() or path.resolve().name == "imu0"


FORMAT = Format(
    name="euroc",
    title="EuRoC",
    expects="the sequence's folder, its ``mav0`` or ``imu0``, or a ``data.csv``: IMU and ground truth, nanoseconds, "
    "scalar first; named after the sequence",
    functions=("read_euroc",),
    read=read_euroc,
    text=lambda head: head[0].startswith("#") and "_RS_" in head[0],
    folder=_is_folder,
)
