"""Calls of users' functions with their contracts checked; messages name the function and the step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import InvalidArgumentError
from bingham.validation import UNIT_TOLERANCE

__all__ = ["checked_log_likelihood", "checked_motion"]

FloatArray = NDArray[np.float64]


def _label(role: str, function: Callable[..., Any], step: str) -> str:
    return f"{role} '{getattr(function, '__qualname__', type(function).__qualname__)}' in {step}"


def _array(result: Any, shape: tuple[int, ...], label: str) -> FloatArray:
    a = np.asarray(result, dtype=np.float64)
    if a.shape != shape:
        raise InvalidArgumentError(label, f"an array of shape {shape}", f"shape {a.shape}",
                                   "it gets all samples as rows and answers for each")  # fmt: skip
    return a


def checked_motion(
    function: Callable[..., Any], points: FloatArray, control: Any, dt: float | None, step: str
) -> FloatArray:
    """Return function(points, control, dt), unit vectors (m, d)."""
    label = _label("motion", function, step)
    points.flags.writeable = False
    moved = _array(function(points, control, dt), points.shape, label)
    norm = np.sqrt(np.einsum("ij,ij->i", moved, moved))
    if not np.all(np.abs(norm - 1.0) <= UNIT_TOLERANCE):
        bad = int(np.argmax(np.where(np.isnan(norm), np.inf, np.abs(norm - 1.0))))
        raise InvalidArgumentError(
            label, f"unit vectors within {UNIT_TOLERANCE:g}", f"length {norm[bad]:.9g} for sample {bad}"
        )
    return moved / norm[:, None]


def checked_log_likelihood(
    function: Callable[..., Any], z: Any, points: FloatArray, weights: FloatArray, step: str
) -> FloatArray:
    """Return function(z, points), log f(z | x) (m,): no NaN, no +∞, not −∞ for every sample of positive weight."""
    label = _label("log_likelihood", function, step)
    points.flags.writeable = False
    values = _array(function(z, points), (len(points),), label)
    wrong = np.isnan(values) | (values == np.inf)
    if wrong.any():
        bad = int(np.argmax(wrong))
        raise InvalidArgumentError(label, "numbers below +∞", f"{values[bad]} for sample {bad} of {len(values)}")
    if not np.any(values[weights > 0.0] > -np.inf):
        raise InvalidArgumentError(label, "a likelihood above 0 for some sample", "−∞ (all weights zero)",
                                   "z contradicts the prediction: widen the noise or use more samples")  # fmt: skip
    return values
