"""Axes, signs and units of an inertial recording, found from the recording alone."""

from __future__ import annotations

from itertools import permutations, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.recording import ImuRecording

__all__ = ["Finding", "RecordingCheck", "check_recording"]

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
    check = RecordingCheck()
    check.add(recording)
    return check.findings()


class RecordingCheck:
    """`check_recording` of a recording that comes in pieces: keeps sums over windows."""

    def __init__(self) -> None:
        self._start = self._last = np.nan
        self._turned = np.zeros(3)
        # Of each window: its number, samples, sum of times (n, 1) and of the rotation since the start (n, 3).
        self._windows: list[tuple[NDArray[np.int64], FloatArray, FloatArray, FloatArray]] = []
        # Of each sensor and window: number of its samples (n, 1) and their sum (n, 3).
        self._sensors: dict[str, list[tuple[FloatArray, FloatArray]]] = {"": [], "magnetometer ": []}

    def add(self, piece: ImuRecording) -> None:
        """Take the next piece."""
        time = piece.time
        if not self._windows:
            self._start = self._last = time[0]
        turned = piece.gyroscope * np.clip(np.diff(time, prepend=self._last), 0.0, WINDOW)[:, None]
        turned[0] += self._turned
        np.cumsum(turned, axis=0, out=turned)
        self._last, self._turned = time[-1], turned[-1].copy()
        index = np.floor((time - self._start) / WINDOW).astype(np.int64)
        first = np.flatnonzero(np.diff(index, prepend=index[0] - 1))
        size = np.diff(np.append(first, len(time))).astype(np.float64)[:, None]
        sums = np.add.reduceat(time[:, None], first), np.add.reduceat(turned, first)
        self._windows.append((index[first], size, *sums))
        for parts, rows in zip(self._sensors.values(), (piece.accelerometer, piece.magnetometer), strict=True):
            if rows is not None:
                x, y, z = rows.T
                known = ((x != 0.0) | (y != 0.0) | (z != 0.0)) & np.isfinite(x)
                if not known.all():
                    rows = np.where(known[:, None], rows, 0.0)
                parts.append((np.add.reduceat(known[:, None].astype(np.float64), first), np.add.reduceat(rows, first)))

    def findings(self) -> list[Finding]:
        """Return what the sensors contradict each other in, in all pieces."""
        found = [_compare(*self._changes(parts), sensor) for sensor, parts in self._sensors.items() if parts]
        return [finding for finding in found if finding is not None]

    def _changes(self, parts: list[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return changes of the mean direction between next but one windows, directions between, rotation vectors."""
        index = np.concatenate([part[0] for part in self._windows])
        first = np.flatnonzero(np.diff(index, prepend=index[0] - 1))  # pieces may share a window
        size = _summed([part[1] for part in self._windows], first)
        time = _summed([part[2] for part in self._windows], first)
        turned = _summed([part[3] for part in self._windows], first)
        count, total = (_summed([part[k] for part in parts], first) for k in (0, 1))
        centre, middle, count = time[:, 0] / size[:, 0], turned / size, count[:, 0]
        norm = np.linalg.norm(total, axis=1)
        u = total / np.where(norm > 0.0, norm, 1.0)[:, None]
        near = (centre[2:] - centre[:-2] < 3.0 * WINDOW) & (count[2:] > 0) & (count[:-2] > 0)
        near &= norm[2:] * norm[:-2] > 0
        usual_norm = norm / np.maximum(count, 1)
        usual = float(np.median(usual_norm[count > 0])) if (count > 0).any() else 0.0
        near &= (np.abs(usual_norm[2:] - usual) < 0.2 * usual) & (np.abs(usual_norm[:-2] - usual) < 0.2 * usual)
        return (u[2:] - u[:-2])[near], (0.5 * (u[2:] + u[:-2]))[near], (middle[2:] - middle[:-2])[near]


def _summed(parts: list[FloatArray], first: NDArray[np.intp]) -> FloatArray:
    return np.add.reduceat(np.concatenate(parts), first)


def _compare(changes: FloatArray, directions: FloatArray, turns: FloatArray, sensor: str) -> Finding | None:
    what = "magnetometer" if sensor else "accelerometer"
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
