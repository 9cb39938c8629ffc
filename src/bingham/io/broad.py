"""Trials of the BROAD benchmark in its authors' ``.mat`` and ``.hdf5`` files.

Laidig, Caruso, Cereatti & Seel, "BROAD – A benchmark for robust inertial orientation estimation", Data 6(7):72, 2021.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bingham.errors import RecordingError
from bingham.io.checks import existing
from bingham.io.fields import Fields
from bingham.io.hdf5 import read_hdf5
from bingham.io.mat5 import read_mat5
from bingham.io.registry import Format
from bingham.recording import ImuRecording

__all__ = ["read_broad"]

FIELDS = ("imu_gyr", "imu_acc", "imu_mag", "opt_quat", "movement", "sampling_rate")
HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"


def read_broad(path: str | Path) -> ImuRecording:
    """Read a trial.

    Parameters
    ----------
    path : str or Path
        ``.mat`` file (any version) or ``.hdf5`` file.

    Returns
    -------
    ImuRecording
        Reference against ENU with y towards magnetic north, NaN where the cameras lost the sensor; `score` marks
        samples of the movement phase with a reference; time starts at 0 s.

    Raises
    ------
    RecordingError
        If the file is damaged or a field is missing or malformed.
    MissingExtraError
        If an HDF5 file is given and h5py is not installed.
    """
    path = existing(path)
    with path.open("rb") as file:
        start = file.read(520)
    hdf5 = HDF5_SIGNATURE in (start[:8], start[512:])  # MATLAB 7.3 puts 512 bytes of its own before it
    content = _read_hdf5(path) if hdf5 else read_mat5(path, FIELDS)
    if not content:
        hint = "other MATLAB and HDF5 files are not read: write a text file with columns t gx gy gz ax ay az mx my mz"
        raise RecordingError(path, "", f"no trial of BROAD, whose fields are {' '.join(FIELDS)}", hint)
    fields = Fields(path, content)
    gyroscope = fields.rows("imu_gyr", 3)
    reference = fields.quaternions("opt_quat")
    return fields.inertial(
        {"gyroscope": "imu_gyr", "accelerometer": "imu_acc", "magnetometer": "imu_mag", "reference": "opt_quat"},
        time=np.arange(len(gyroscope)) / fields.positive("sampling_rate"),
        gyroscope=gyroscope,
        accelerometer=fields.rows("imu_acc", 3),
        magnetometer=fields.rows("imu_mag", 3),
        reference=reference,
        score=fields.flags("movement") & np.isfinite(reference).all(axis=1),
    )


def _read_hdf5(path: Path) -> Mapping[str, Any]:
    content = read_hdf5(path, FIELDS)
    if path.suffix == ".mat":  # MATLAB stores arrays column by column
        content = {name: value.T for name, value in content.items()}
    return content


FORMAT = Format(
    name="broad",
    title="BROAD",
    expects="``.mat`` and ``.hdf5`` trials",
    functions=("read_broad",),
    read=read_broad,
    signatures=(HDF5_SIGNATURE, b"MATLAB"),
)
