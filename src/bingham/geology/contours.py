"""Densities of axes on the sphere as geologists contour them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.inference.result import axes_of
from bingham.validation import check_number, unit_rows

__all__ = ["exponential_density", "fitted_density", "kamb_density"]

FloatArray = NDArray[np.float64]

# Angles between axes and points held at once.
BLOCK = 4_000_000


def kamb_density(x: ArrayLike, at: ArrayLike, *, sigma: float = 3.0) -> FloatArray:
    """Return Kamb's (1959) density of axes x (n, 3) at points (..., 3), in standard deviations of a uniform count.

    A circle that holds the share A = σ²/(n + σ²) of the hemisphere is counted about each point: count/√(n A (1 − A)).
    Axes spread evenly give σ everywhere; deviations beyond 2 from it are hardly chance.
    """
    a, points = _checked(x, at, sigma)
    n = len(a)
    area = sigma**2 / (n + sigma**2)
    count = _summed(a, points, lambda cosine: cosine >= 1.0 - area)
    return count / np.sqrt(n * area * (1.0 - area))


def exponential_density(x: ArrayLike, at: ArrayLike, *, sigma: float = 3.0) -> FloatArray:
    """Return the density of axes x (n, 3) at points (..., 3), as `kamb_density`, with weights exp(k (|cos| − 1)).

    k = 2(1 + n/σ²), so that the weight has the reach of Kamb's circle without its edge; in standard deviations of the
    sum for uniform axes, √(n (k/2 − 1)/k²) (Vollmer, Computers & Geosciences 21 (1995) 31).
    """
    a, points = _checked(x, at, sigma)
    n = len(a)
    k = 2.0 * (1.0 + n / sigma**2)
    weight = _summed(a, points, lambda cosine: np.exp(k * (cosine - 1.0)))
    return weight / np.sqrt(n * (0.5 * k - 1.0) / k**2)


def fitted_density(distribution: Bingham, at: ArrayLike) -> FloatArray:
    """Return the density of a distribution at points (..., 3), in multiples of the uniform one."""
    return 4.0 * np.pi * np.asarray(distribution.pdf(at))


def _summed(a: FloatArray, points: FloatArray, weight: Callable[[FloatArray], NDArray[Any]]) -> FloatArray:
    """Return Σ weight(|cos|) over the axes a (n, 3) at points (..., 3), some axes at a time."""
    total = np.zeros(points.shape[:-1])
    step = max(1, BLOCK // max(1, total.size))
    for start in range(0, len(a), step):
        total += weight(np.abs(points @ a[start : start + step].T)).sum(axis=-1)
    return total


def _checked(x: ArrayLike, at: ArrayLike, sigma: float) -> tuple[FloatArray, FloatArray]:
    check_number(sigma, "sigma", "a number of standard deviations, above 0", above=0.0)
    return axes_of(x, "x", 1), unit_rows(at, 3, "at")
