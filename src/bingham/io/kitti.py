"""KITTI: odometry poses (twelve numbers a line) and the OXTS folders of the raw recordings.

Geiger, Lenz, Stiller & Urtasun, "Vision meets robotics: the KITTI dataset", IJRR 32(11), 2013; devkit readme.txt.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingError, Setting
from bingham.io.assemble import Stream, inertial_recording, orientation_recording
from bingham.io.checks import note
from bingham.io.dates import seconds_of_dates
from bingham.io.layout import NUMBER, Layout
from bingham.io.meaning import check_rate
from bingham.io.registry import Format
from bingham.io.table import read_table
from bingham.io.text import opened_text
from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["FORMAT", "read_kitti"]

POSE = [f"r{i}{j}" if j < 4 else f"t{i}" for i in (1, 2, 3) for j in (1, 2, 3, 4)]
RATE = 10.0  # Hz, of the odometry sequences
TOLERANCE = 1e-3  # of RᵀR = I: files round to as few as four decimals
OXTS = (
    *("lat", "lon", "alt", "roll", "pitch", "yaw", "vn", "ve", "vf", "vl", "vu"),
    *("ax", "ay", "az", "af", "al", "au", "wx", "wy", "wz", "wf", "wl", "wu"),
)
LONGEST_FOLDER = 1_000_000  # files


def read_kitti(
    path: str | Path, *, rate: float | None = None, regularise: bool = False
) -> ImuRecording | OrientationRecording:
    """Read poses or an OXTS folder.

    Parameters
    ----------
    path : str or Path
        File of poses, rows of 3×4 matrices camera to first camera, its times in ``times.txt`` or
        ``NAME_times.txt`` beside it; or the folder ``oxts``, or the one that holds it.
    rate : float, optional
        Sampling rate, Hz, of poses without ``times.txt``; KITTI's 10 Hz unless given.
    regularise : bool
        Put times on a straight line between pauses.

    Returns
    -------
    ImuRecording or OrientationRecording
        OXTS: accelerations and rates along the vehicle's axes (forward, left, up) and its orientation against east,
        north, up as the reference. Poses: orientations and positions.

    Raises
    ------
    RecordingError
        If a row is no pose, naming its line.
    """
    check_rate(rate)
    path = Path(path)
    return _oxts(path, regularise) if path.is_dir() else _poses(path, rate, regularise)


def _poses(path: Path, rate: float | None, regularise: bool) -> OrientationRecording:
    text = opened_text(path)
    layout = Layout(None, ".", POSE, [], 0, text.head[0][0], 12)
    table = read_table(text, layout, range(12))
    matrices = table.matrix(range(12), [1.0] * 12).reshape(-1, 3, 4)
    turns, positions = matrices[:, :, :3], matrices[:, :, 3]

    def place(field: str, index: int) -> str:
        return table.place([0], index).partition(",")[0]

    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(np.einsum("nji,njk->nik", turns, turns) - np.eye(3)).max(axis=(1, 2))
        bad = ~(off <= TOLERANCE) | ~(np.linalg.det(turns) > 0)
    if bad.any():
        problem = "its 3×3 part is no rotation matrix"
        raise RecordingError(path, place("", int(np.argmax(bad))), problem, "twelve numbers of a 3×4 pose are expected")
    known = [path.with_name(name) for name in (f"{path.stem}_times.txt", "times.txt")]
    beside = next((file for file in known if file.is_file()), None)
    if rate is None and beside is not None:
        clock = opened_text(beside)
        time = read_table(clock, Layout(None, ".", ["time"], [], 0, clock.head[0][0], 1), [0]).columns[0]
        if len(time) != len(turns):
            problem = f"{len(time)} times for {len(turns)} poses"
            raise RecordingError(beside, "", problem, ("give ", Setting("rate"), " for poses of another file"))
    else:
        if rate is None:
            note(path, f"poses without times: taken at KITTI's {RATE:g} Hz; another by ", Setting("rate"))
        time = np.arange(len(turns)) / (rate or RATE)
    rows = {"time": time, "orientation": _wxyz("matrix", turns), "position": positions}
    return orientation_recording(path, place, rows, regularise=regularise)


def _oxts(path: Path, regularise: bool) -> ImuRecording:
    folder = path if (path / "data").is_dir() else path / "oxts"
    files = sorted((folder / "data").glob("*.txt"))[:LONGEST_FOLDER]
    stamps = folder / "timestamps.txt"
    if not files or not stamps.is_file():
        raise RecordingError(path, "", "no timestamps.txt and data/*.txt of an OXTS folder in it", "copy it again")
    rows: list[list[float]] = []
    for file in files:
        cells = opened_text(file).head[0][1].split()
        if len(cells) < len(OXTS) or not all(NUMBER.fullmatch(c) and "," not in c for c in cells[: len(OXTS)]):
            problem = f"{len(cells)} cells, not all numbers"
            raise RecordingError(file, "line 1", problem, "30 numbers of an OXTS packet are expected")
        rows.append([float(cell) for cell in cells[: len(OXTS)]])
    lines = [line for _, line in opened_text(stamps).lines()]
    time = seconds_of_dates(lines)
    if isinstance(time, int):
        raise RecordingError(stamps, f"line {time + 1}", f"{lines[time][:40]!r} is no date", "copy it again")
    if len(time) != len(rows):
        raise RecordingError(stamps, "", f"{len(time)} stamps for {len(rows)} packets", "copy the folder again")
    values: dict[str, NDArray[np.float64]] = dict(zip(OXTS, np.array(rows).T, strict=True))

    def place(field: str, index: int) -> str:
        return f"data/{files[index].name}"

    def of(*names: str) -> NDArray[np.float64]:
        return np.stack([values[name] for name in names], axis=1)

    reference = _wxyz("euler", "ZYX", of("yaw", "pitch", "roll"))  # yaw 0: east, anticlockwise
    streams = {"gyroscope": Stream(time, of("wx", "wy", "wz")), "accelerometer": Stream(time, of("ax", "ay", "az"))}
    name = path.resolve().parent.name if path.resolve().name == "oxts" else path.resolve().name
    return inertial_recording(
        path, place, streams, {"reference": reference}, regularise=regularise, units=False, name=name
    )


def _wxyz(kind: str, *arguments: Any) -> NDArray[np.float64]:
    """Return quaternions, scalar first, of matrices or Euler angles, by SciPy, which is loaded for them alone."""
    from scipy.spatial.transform import Rotation

    rotations = getattr(Rotation, f"from_{kind}")(*arguments)
    return np.asarray(rotations.as_quat(scalar_first=True), dtype=np.float64)


def _is_poses(head: list[str]) -> bool:
    return all(len(c := line.split()) == 12 and all(map(NUMBER.fullmatch, c)) and "," not in line for line in head[:3])


def _is_folder(path: Path) -> bool:
    return (path / "oxts" / "data").is_dir() or (path.resolve().name == "oxts" and (path / "data").is_dir())


FORMAT = Format(
    name="kitti",
    title="KITTI",
    expects="poses: rows of 3×4 matrices, times in ``times.txt`` beside or ``rate=``; raw recordings: the folder "
    "``oxts`` or the one that holds it",
    functions=("read_kitti",),
    read=read_kitti,
    text=_is_poses,
    folder=_is_folder,
)
