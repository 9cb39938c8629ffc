"""EuRoC MAV sequences (also TUM VI): IMU and ground truth as CSV with nanosecond stamps, quaternions scalar first.

Burri et al., "The EuRoC micro aerial vehicle datasets", IJRR 35(10), 2016.
"""

from __future__ import annotations

from pathlib import Path

from bingham.errors import RecordingError
from bingham.io.checks import build, existing, normalised, time_from_nanoseconds
from bingham.io.text import TextTable, numbered_lines
from bingham.recording import ImuRecording, OrientationRecording, amended

__all__ = ["read_euroc", "sequence_name"]

STAMP = "timestamp"
GYROSCOPE = [f"w_RS_S_{a}" for a in "xyz"]
ACCELEROMETER = [f"a_RS_S_{a}" for a in "xyz"]
POSITION = [f"p_RS_R_{a}" for a in "xyz"]
ORIENTATION = [f"q_RS_{a}" for a in "wxyz"]
# Folders whose poses are those of the IMU frame, in the order of preference.
TRUTH_FOLDERS = ("state_groundtruth_estimate0", "mocap0")


def read_euroc(path: str | Path) -> ImuRecording | OrientationRecording:
    """Read a sequence folder, an IMU file or a ground truth file.

    Parameters
    ----------
    path : str or Path
        The folder that holds ``mav0``, ``mav0`` or its ``imu0``, or one ``data.csv``.

    Returns
    -------
    ImuRecording or OrientationRecording
        An IMU file gives gyroscope and accelerometer; a folder adds its ground truth as `truth`, on a clock of its
        own; a ground truth file gives orientations. The world's z axis points up; its heading is arbitrary.

    Raises
    ------
    RecordingError
        If a file or column is missing or malformed.
    """
    path = Path(path)
    return _sequence(path) if path.is_dir() else _table(path)


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


def _sequence(folder: Path) -> ImuRecording:
    if folder.resolve().name == "imu0":
        root = folder.resolve().parent
    else:
        root = folder if (folder / "imu0").is_dir() else folder / "mav0"
    file = root / "imu0" / "data.csv"
    if not file.is_file():
        raise RecordingError(folder, "", "no mav0/imu0/data.csv in it", "give the folder that holds mav0")
    imu = _table(file)
    if not isinstance(imu, ImuRecording):
        raise RecordingError(file, "line 1", "no gyroscope columns", f"expected {' '.join(GYROSCOPE)}")
    name = sequence_name(folder) or folder.resolve().name
    for truth_folder in TRUTH_FOLDERS:
        file = root / truth_folder / "data.csv"
        if file.exists():
            truth = _table(file)
            if not isinstance(truth, OrientationRecording):
                raise RecordingError(file, "line 1", "no orientations", f"expected {' '.join(ORIENTATION)}")
            return amended(imu, name=name, truth=truth)
    return amended(imu, name=name)


def _table(path: Path) -> ImuRecording | OrientationRecording:
    lines = numbered_lines(existing(path))
    first, header = lines[0]
    # "#timestamp [ns],w_RS_S_x [rad s^-1],..." -> timestamp, w_RS_S_x, ...
    names = [cell.partition("[")[0].strip() for cell in header.lstrip("# ").split(",")]
    table = TextTable.parse(path, names, lines[1:], ",")

    def need(columns: list[str]) -> list[str]:
        if missing := [c for c in columns if c not in names]:
            hint = "the header of an EuRoC file is expected"
            raise RecordingError(path, f"line {first}", f"no column {' '.join(missing)}", hint)
        return columns

    need([STAMP])
    time = time_from_nanoseconds(table.integers(STAMP))
    if GYROSCOPE[0] in names:
        fields = {"gyroscope": need(GYROSCOPE), "accelerometer": need(ACCELEROMETER)}
    else:
        fields = {"orientation": need(ORIENTATION), "position": need(POSITION)}

    def place(field: str, index: int) -> str:
        return table.place(fields.get(field, [STAMP]), index)

    name = sequence_name(path) or path.stem
    values = {field: table.as_numbers(columns) for field, columns in fields.items()}
    if "gyroscope" in values:
        return build(ImuRecording, path, place, name=name, time=time, **values)
    values["orientation"] = normalised(path, "orientation", values["orientation"], place)
    return build(OrientationRecording, path, place, name=name, time=time, **values)
