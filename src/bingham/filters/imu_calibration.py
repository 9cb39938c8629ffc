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
        If there is no magnetometer, it has not turned about enough axes, or its samples lie on no ellipsoid.

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
    centre, size = known.mean(axis=0), float(np.linalg.norm(known - known.mean(axis=0), axis=1).mean())
    x = (known - centre) / max(size, 1e-300)
    design = np.column_stack([x**2, 2 * x[:, 0] * x[:, 1], 2 * x[:, 0] * x[:, 2], 2 * x[:, 1] * x[:, 2], x])
    p = np.linalg.lstsq(design, np.ones(len(x)), rcond=None)[0]
    a = np.array([[p[0], p[3], p[4]], [p[3], p[1], p[5]], [p[4], p[5], p[2]]])
    values, axes = np.linalg.eigh(a)
    if values[0] <= 0.0 or values[2] > ROUND**2 * values[0]:
        raise InvalidArgumentError("recording", "magnetometer samples on an ellipsoid", "none that is nearly one", HINT)
    middle = -0.5 * np.linalg.solve(a, p[6:])
    # (x − c)ᵀ A (x − c) = 1 + cᵀ A c, the square of a radius of 1 in the directions of `axes`.
    values = values / (1.0 + middle @ a @ middle)
    radius = float(np.prod(values) ** (-1.0 / 6.0))
    matrix = (axes * (np.sqrt(values) * radius)) @ axes.T
    round_ = (x - middle) @ matrix.T
    norm = np.linalg.norm(round_, axis=1)
    spread = np.linalg.eigvalsh((round_ / norm[:, None]).T @ (round_ / norm[:, None]) / len(x))
    if spread[0] < COVERED:
        raise InvalidArgumentError(
            "recording", "rotations about all axes", f"directions near a plane ({spread[0]:.3f})", HINT
        )
    return MagnetometerCalibration(centre + size * middle, matrix, float(np.std(norm / norm.mean())))
