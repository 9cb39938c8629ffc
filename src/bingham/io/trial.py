"""Trials and trajectories kept as plain ``.npz`` arrays.

========== =========================================================== =================================
kind       fields                                                      gives
========== =========================================================== =================================
IMU trial  ``t`` (s) or ``rate`` (Hz), ``gyr``; ``acc``, ``mag``,      `ImuRecording` in SI units
           ``ref_i16`` (quaternion · 32767, zeros: none), ``score``;
           ``mocap_t``, ``mocap_quat``, ``mocap_pos``
measured   ``t``, ``meas``; ``truth``, ``truth_ok``                    `OrientationRecording` with truth
trajectory ``t``, ``quat``; ``t0``, ``pos``                            `OrientationRecording`
========== =========================================================== =================================

Quaternions are scalar first, body to world. ``time``, ``gyroscope``, ``accelerometer`` and ``magnetometer`` are
understood where ``t``, ``gyr``, ``acc`` and ``mag`` are absent.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bingham.errors import RecordingError
from bingham.io.checks import normalised, note
from bingham.io.fields import Fields
from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["trial"]

IMU_FIELDS = ("rate", "t", "gyr", "acc", "mag", "ref_i16", "score", "mocap_t", "mocap_quat", "mocap_pos")
OTHERS = ("phone_i16",)  # what a phone made of its own sensors
LONG_NAMES = {"t": "time", "gyr": "gyroscope", "acc": "accelerometer", "mag": "magnetometer"}
INT16_UNIT = 32767
INT16_ROUNDING = 1e-4  # √4 · ½ / 32767 = 3.1e-5 at worst


def trial(path: Path, content: Mapping[str, Any]) -> ImuRecording | OrientationRecording:
    """Make a recording of the arrays of an npz file; which kind follows from the fields it has.

    Raises
    ------
    RecordingError
        If the fields are of no known kind, or malformed.
    """
    fields = Fields(path, content)
    if _called("gyr", content) in content:
        if unknown := [name for name in content if name not in (*(_called(n, content) for n in IMU_FIELDS), *OTHERS)]:
            note(path, f"unknown fields left out: {', '.join(unknown)}; known: {' '.join(IMU_FIELDS)}")
        return _imu(fields)
    if "meas" in content:
        return _measured(fields)
    if _called("t", content) in content and "quat" in content:
        return _trajectory(fields)
    known = "gyr (IMU trial), t and meas (measured orientations) or t and quat (trajectory)"
    there = " ".join(content) or "none"
    raise RecordingError(path, "", f"fields of no known recording: {there}", f"expected {known}")


def _imu(fields: Fields) -> ImuRecording:
    there = fields.content
    t, gyr, acc, mag = (_called(name, there) for name in ("t", "gyr", "acc", "mag"))
    gyroscope = fields.rows(gyr, 3)
    if t not in there and "rate" not in there:
        hint = f"give times, s, or the sampling rate, Hz; fields in the file: {' '.join(there)}"
        raise RecordingError(fields.path, "field t or rate", "is missing", hint)
    time = fields.rows(t, None) if t in there else np.arange(len(gyroscope)) / fields.positive("rate")
    reference = truth = None
    if "ref_i16" in there:
        reference = fields.rows("ref_i16", 4) / INT16_UNIT
        reference[~reference.any(axis=1)] = np.nan
        reference = normalised(fields.path, "ref_i16", reference, fields.place, rounding=INT16_ROUNDING)
    if "mocap_quat" in there:
        truth = fields.build(
            OrientationRecording,
            {"time": "mocap_t", "orientation": "mocap_quat", "position": "mocap_pos"},
            time=fields.rows("mocap_t", None),
            orientation=fields.quaternions("mocap_quat"),
            position=fields.rows("mocap_pos", 3) if "mocap_pos" in there else None,
        )
    return fields.inertial(
        {"time": t, "gyroscope": gyr, "accelerometer": acc, "magnetometer": mag, "reference": "ref_i16"},
        time=time,
        gyroscope=gyroscope,
        accelerometer=fields.rows(acc, 3) if acc in there else None,
        magnetometer=fields.rows(mag, 3) if mag in there else None,
        reference=reference,
        score=fields.flags("score") if "score" in there else None,
        truth=truth,
    )


def _called(name: str, content: Mapping[str, Any]) -> str:
    """Return the long name of a field where the file has that alone."""
    long = LONG_NAMES.get(name, name)
    return long if name not in content and long in content else name


def _measured(fields: Fields) -> OrientationRecording:
    t = _called("t", fields.content)
    truth = None
    if "truth" in fields.content:
        truth = fields.quaternions("truth")
        if "truth_ok" in fields.content:
            known = fields.flags("truth_ok")
            if known.shape != truth.shape[:1]:
                got = f"{len(known)} rows beside {len(truth)} of truth"
                raise RecordingError(fields.path, "field truth_ok", got, "copy the file again")
            truth = np.where(known[:, None], truth, np.nan)
    return fields.build(
        OrientationRecording,
        {"time": t, "orientation": "meas"},
        time=fields.rows(t, None),
        orientation=fields.quaternions("meas"),
        truth=truth,
    )


def _trajectory(fields: Fields) -> OrientationRecording:
    t = _called("t", fields.content)
    start = fields.as_numbers("t0").ravel() if "t0" in fields.content else np.zeros(1)
    if start.shape != (1,) or not np.isfinite(start[0]):
        raise RecordingError(fields.path, "field t0", f"is {start}", "expected one time in seconds")
    return fields.build(
        OrientationRecording,
        {"time": t, "orientation": "quat", "position": "pos"},
        time=start[0] + fields.rows(t, None),
        orientation=fields.quaternions("quat"),
        position=fields.rows("pos", 3) if "pos" in fields.content else None,
    )
