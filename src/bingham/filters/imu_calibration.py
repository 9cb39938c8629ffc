"""Calibration of a magnetometer: hard and soft iron, from a recording in which it turns all ways."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError
from bingham.recording import ImuRecording

__all__ = ["MagnetometerCalibration", "calibrate_magnetometer"]

FloatArray = NDArray[np.float64]

ENOUGH = 50  # samples
COVERED = 0.03  # smallest eigenvalue of the directions' second moment, 1/3 if they are uniform
ROUND = 4.0  # ratio of the ellipsoid's axes beyond which it is none of a magnetometer
FAR = 4.0  # median distances from the middle beyond which a sample is none
OUTLYING = 5.0  # deviations of strength beyond which a sample is left out
ROUNDS = 10
LOOSE = 0.15  # relative deviation of the strength after calibration
SHOWN = 10.0  # the offset is then within about 1 % of the field's strength
CLIPPED = 0.02  # share of samples at exactly the largest or smallest value
HINT = "turn the sensor slowly about all its axes, away from iron, for half a minute"


@dataclass(frozen=True, eq=False)
class MagnetometerCalibration:
    """m_true = matrix (m − offset).

    Attributes
    ----------
    offset : (3,) ndarray
        Hard iron, in the recording's unit.
    matrix : (3, 3) ndarray
        Soft iron and scales, symmetric; it leaves the mean strength of the field as it is.
    residual : float
        Root mean square of |m_true| over its mean, minus one.
    """

    offset: FloatArray
    matrix: FloatArray
    residual: float

    def apply(self, field: ArrayLike) -> FloatArray:
        """Return calibrated samples (..., 3)."""
        return (np.asarray(field, dtype=np.float64) - self.offset) @ self.matrix.T

    def to_json(self) -> str:
        """Return the calibration as text."""
        content = {"offset": self.offset.tolist(), "matrix": self.matrix.tolist(), "residual": self.residual}
        return json.dumps({"magnetometer": content}, indent=2) + "\n"

    @classmethod
    def from_json(cls, text: str) -> MagnetometerCalibration:
        """Return the calibration that `to_json` wrote."""
        try:
            content = json.loads(text)["magnetometer"]
            offset = np.array(content["offset"], dtype=np.float64)
            matrix = np.array(content["matrix"], dtype=np.float64)
            residual = float(content["residual"])
        except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
            got = f"{type(error).__name__}: {error}"
            raise InvalidArgumentError("calibration", "JSON that bingham calibrate wrote", got) from None
        if (
            offset.shape != (3,)
            or matrix.shape != (3, 3)
            or not (np.isfinite(offset).all() and np.isfinite(matrix).all())
        ):
            got = f"offset {offset.shape}, matrix {matrix.shape}"
            raise InvalidArgumentError("calibration", "finite offset (3,) and matrix (3, 3)", got)
        return cls(offset, matrix, residual)


def calibrate_magnetometer(recording: ImuRecording) -> MagnetometerCalibration:
    """Fit the ellipsoid on which the samples of a magnetometer lie when it turns in a constant field.

    Least squares on xᵀA x + bᵀx = 1: offset −A⁻¹b/2, and the square root of A, scaled, makes it a sphere.

    Parameters
    ----------
    recording : ImuRecording
        With magnetometer.

    Raises
    ------
    InvalidArgumentError
        If there is no magnetometer, it clips, it has not turned about enough axes for its noise, or its samples lie on
        no ellipsoid (single outliers are left out).

    Examples
    --------
    >>> from bingham.filters.imu_calibration import calibrate_magnetometer
    >>> from bingham.recording import amended
    >>> from bingham.simulate import simulate_imu, simulate_tumbling
    >>> r = simulate_imu(simulate_tumbling(60.0, 50.0, rng=0), rng=1)
    >>> bent = amended(r, magnetometer=r.magnetometer + [10.0, -5.0, 3.0])
    >>> bool(abs(calibrate_magnetometer(bent).offset - [10.0, -5.0, 3.0]).max() < 0.5)
    True
    """
    rows = recording.magnetometer
    known = np.zeros((0, 3)) if rows is None else rows[np.isfinite(rows[:, 0])]
    if len(known) < ENOUGH:
        raise InvalidArgumentError("recording", f"at least {ENOUGH} magnetometer samples", len(known), HINT)
    _check_range(known)
    centre = np.median(known, axis=0)
    away = np.linalg.norm(known - centre, axis=1)
    size = max(float(np.median(away)), 1e-300)
    x = (known - centre)[away < FAR * size] / size
    kept = np.ones(len(x), dtype=np.bool_)
    matrix, middle, shown = np.eye(3), np.zeros(3), 0.0
    for _ in range(ROUNDS):
        matrix, middle, shown = _ellipsoid(x[kept])
        norm = np.linalg.norm((x - middle) @ matrix.T, axis=1)
        off = np.abs(norm / np.median(norm) - 1.0)
        kept = off <= max(OUTLYING * 1.4826 * float(np.median(off)), 1e-9)
    round_ = (x[kept] - middle) @ matrix.T
    norm = np.linalg.norm(round_, axis=1)
    spread = np.linalg.eigvalsh((round_ / norm[:, None]).T @ (round_ / norm[:, None]) / len(norm))
    residual = float(np.std(norm / norm.mean()))
    if spread[0] < COVERED:
        raise InvalidArgumentError(
            "recording", "rotations about all axes", f"directions near a plane ({spread[0]:.3f})", HINT
        )
    if residual > LOOSE:
        got = f"one that varies by {100 * residual:.0f} % however it is calibrated"
        raise InvalidArgumentError("recording", "a field of constant strength", got, HINT)
    if shown < SHOWN:
        got = "too little motion: the noise of the samples decides about the offset"
        raise InvalidArgumentError("recording", "rotations about all axes", got, HINT)
    return MagnetometerCalibration(centre + size * middle, matrix, residual)


def _check_range(field: FloatArray) -> None:
    """Reject a sensor that clips: samples at the end of its range lie on no ellipsoid."""
    for axis, values in zip("xyz", field.T, strict=True):
        for end in (values.min(), values.max()):
            share = float(np.mean(values == end))
            if share > CLIPPED and len(np.unique(values)) > ENOUGH:
                got = f"{100 * share:.0f} % of them at {end:.6g} on {axis}, the end of its range"
                raise InvalidArgumentError("recording", "magnetometer samples that do not clip", got, HINT)


def _ellipsoid(x: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return the matrix that makes the ellipsoid of samples (N, 3) a sphere, its centre, and how well they show it.

    The latter is the smallest mean square of the design's columns over that of the samples' noise in them, by which
    least squares is biased.
    """
    design = np.column_stack([x**2, 2 * x[:, 0] * x[:, 1], 2 * x[:, 0] * x[:, 2], 2 * x[:, 1] * x[:, 2], x])
    p, _, _, singular = np.linalg.lstsq(design, np.ones(len(x)), rcond=None)
    a = np.array([[p[0], p[3], p[4]], [p[3], p[1], p[5]], [p[4], p[5], p[2]]])
    values, axes = np.linalg.eigh(a)
    if values[0] <= 0.0 or values[2] > ROUND**2 * values[0]:
        raise InvalidArgumentError("recording", "magnetometer samples on an ellipsoid", "none that is nearly one", HINT)
    middle = np.asarray(-0.5 * np.linalg.solve(a, p[6:]), dtype=np.float64)
    noise2 = float(np.mean((design @ p - 1.0) ** 2)) / float(np.mean(np.sum((2.0 * (x - middle) @ a) ** 2, axis=1)))
    # (x − c)ᵀ A (x − c) = 1 + cᵀ A c, the square of a radius of 1 in the directions of `axes`.
    values = values / (1.0 + middle @ a @ middle)
    radius = float(np.prod(values) ** (-1.0 / 6.0))
    matrix = (axes * (np.sqrt(values) * radius)) @ axes.T
    return matrix, middle, float(singular[-1] ** 2 / len(x) / max(noise2, 1e-30))
