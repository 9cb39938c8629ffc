"""Axes, signs and units of an inertial recording, found from the recording alone."""

from __future__ import annotations

from itertools import permutations, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.recording import ImuRecording

__all__ = ["Finding", "check_recording"]

FloatArray = NDArray[np.float64]

WINDOW = 0.1  # s over which directions are averaged; they are compared over twice that
MOVED = 0.03  # change of a direction that tells something
ENOUGH = 25  # windows in which it did
CLEAR = 0.6  # correlation of a rotation that is seen; noise and linear acceleration leave a right one above
FOUND = 0.8  # correlation of other axes that convinces
SCALE = 0.25  # relative error of a scale that is worth a word,
SCALE_CLEAR = 0.95  # if the correlation leaves no other reason
SMALL = 0.6  # rad, rotation between windows up to which the linear relation holds
DEGREE = np.pi / 180.0


class Finding(NamedTuple):
    """What a recording's sensors contradict each other in.

    Attributes
    ----------
    name : str
        "sign", "axes", "unit" or "scale", of the magnetometer "magnetometer sign" and so on.
    slope : float
        Of the change of the measured direction, regressed on what the gyroscope says; 1 if all is right.
    message : str
        One sentence with a hint.
    """

    name: str
    slope: float
    message: str


def check_recording(recording: ImuRecording) -> list[Finding]:
    """Return what the sensors contradict each other in; an empty list if nothing, or if the body hardly turned.

    A direction u that is fixed in the world changes in body axes by −∫ω dt × u. The changes of gravity's (and of the
    field's) measured direction over 0.2 s are regressed on that: slope and correlation are 1 if axes, signs and units
    are right, and only half of the turning, about the vertical, is without effect.

    Parameters
    ----------
    recording : ImuRecording
        With accelerometer or magnetometer, and a body that turns for some seconds.

    Examples
    --------
    >>> from bingham import check_recording
    >>> from bingham.recording import amended
    >>> from bingham.simulate import simulate_imu, simulate_tumbling
    >>> right = simulate_imu(simulate_tumbling(20.0, 100.0, rng=0), rng=1)
    >>> check_recording(right)
    []
    >>> wrong = amended(right, gyroscope=-right.gyroscope)
    >>> [(f.name, round(f.slope, 1)) for f in check_recording(wrong)]
    [('sign', -1.0), ('magnetometer sign', -1.0)]
    """
    found: list[Finding] = []
    for sensor, rows in (("", recording.accelerometer), ("magnetometer ", recording.magnetometer)):
        finding = None if rows is None else _compare(recording, rows, sensor)
        if finding is not None:
            found.append(finding)
    return found


def _compare(recording: ImuRecording, rows: FloatArray, sensor: str) -> Finding | None:
    what = "magnetometer" if sensor else "accelerometer"
    changes, directions, turns = _changes(recording.time, recording.gyroscope, rows)
    small = np.linalg.norm(turns, axis=1) < SMALL
    if np.count_nonzero(small & (np.linalg.norm(changes, axis=1) > MOVED)) >= ENOUGH:
        changes, directions, turns = changes[small], directions[small], turns[small]
    plain = -np.cross(turns, directions)
    if np.count_nonzero(np.linalg.norm(changes, axis=1) > MOVED) < ENOUGH or not plain.any():
        return None
    slope, correlation = _regress(changes, plain)
    best = max(_axes(changes, directions, turns), key=lambda tried: tried[0])
    other = best[0] > max(FOUND, correlation + 0.1) and abs(best[1] - 1.0) < 0.3
    if correlation > CLEAR and abs(slope - 1.0) < SCALE and not other:
        return None
    says = (
        f"the {what}'s direction changes by {slope:.3g} times what the gyroscope says (correlation {correlation:.2f})"
    )
    if abs(correlation) > CLEAR:
        for name, expected, hint in (
            ("sign", -1.0, f"the gyroscope's or the {what}'s sign is flipped"),
            ("unit", DEGREE, "is the gyroscope in degrees/s? Multiply by π/180"),
            ("unit", 1.0 / DEGREE, "was the gyroscope converted from degrees/s twice? Multiply by 180/π"),
        ):
            if abs(slope / expected - 1.0) < 0.25:
                return Finding(sensor + name, slope, f"{says}: {hint}")
    if other:
        return Finding(sensor + "axes", slope, f"{says}: axes disagree; the gyroscope fits as ({best[2]})")
    if correlation > SCALE_CLEAR and not sensor:  # hard iron changes the field's directions, too
        return Finding(sensor + "scale", slope, f"{says}: check the scale, or the unit, of the gyroscope")
    return None


def _changes(time: FloatArray, rate: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return changes of the mean direction between next but one windows, directions between, rotation vectors."""
    known = np.isfinite(rows[:, 0]) & rows.any(axis=1)
    index = np.floor((time - time[0]) / WINDOW).astype(np.int64)
    _, index = np.unique(index, return_inverse=True)
    size = int(index[-1]) + 1 if len(index) else 0
    count = np.bincount(index[known], minlength=size)
    mean = np.stack([np.bincount(index[known], rows[known, i], minlength=size) for i in range(3)], axis=1)
    norm = np.linalg.norm(mean, axis=1)
    steps = np.clip(np.diff(time, prepend=time[0]), 0.0, WINDOW)
    turned = np.cumsum(np.where(np.isfinite(rate), rate, 0.0) * steps[:, None], axis=0)
    middle = np.stack([np.bincount(index, turned[:, i], minlength=size) for i in range(3)], axis=1)
    middle /= np.maximum(np.bincount(index, minlength=size), 1)[:, None]
    centre = np.bincount(index, time, minlength=size) / np.maximum(np.bincount(index, minlength=size), 1)
    u = mean / np.where(norm > 0.0, norm, 1.0)[:, None]
    near = (centre[2:] - centre[:-2] < 3.0 * WINDOW) & (count[2:] > 0) & (count[:-2] > 0) & (norm[2:] * norm[:-2] > 0)
    size_usual = norm / np.maximum(count, 1)
    usual = float(np.median(size_usual[count > 0])) if (count > 0).any() else 0.0
    near &= (np.abs(size_usual[2:] - usual) < 0.2 * usual) & (np.abs(size_usual[:-2] - usual) < 0.2 * usual)
    return (u[2:] - u[:-2])[near], (0.5 * (u[2:] + u[:-2]))[near], (middle[2:] - middle[:-2])[near]


def _regress(y: FloatArray, x: FloatArray) -> tuple[float, float]:
    """Return slope and correlation of y (n, 3) on x (n, 3), both through the origin."""
    xx, yy, xy = float(np.sum(x * x)), float(np.sum(y * y)), float(np.sum(x * y))
    return xy / max(xx, 1e-300), xy / max(np.sqrt(xx * yy), 1e-300)


def _axes(y: FloatArray, u: FloatArray, turns: FloatArray) -> list[tuple[float, float, str]]:
    """Return correlation, slope and name of every signed permutation of the gyroscope's axes."""
    tried: list[tuple[float, float, str]] = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            slope, correlation = _regress(y, -np.cross(turns[:, order] * signs, u))
            names = [("-" if sign < 0 else "") + "xyz"[k] for sign, k in zip(signs, order, strict=True)]
            tried.append((correlation, slope, ", ".join(names)))
    return tried
