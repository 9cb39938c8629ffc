"""Test of a cluster against a girdle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

from bingham.distributions.bingham import Bingham
from bingham.distributions.normalizer import log_normalizer_derivatives
from bingham.errors import InvalidArgumentError
from bingham.inference.result import TestResult, axes_of

__all__ = ["ShapeTestResult", "cluster_girdle_test"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ShapeTestResult(TestResult):
    """Result of `cluster_girdle_test`: also p-values against each side, `pvalue_cluster` and `pvalue_girdle`."""

    pvalue_cluster: Any
    pvalue_girdle: Any


def cluster_girdle_test(x: ArrayLike) -> ShapeTestResult:
    """Test whether axes in space are a cluster or a girdle, against the border between the two.

    The border is z₂ = z₁/2: the middle concentration halfway between that of a cluster with rotational symmetry
    (z₂ = z₁) and that of a girdle with it (z₂ = 0) (Mardia & Jupp 2000, sec. 9.4.3). The statistic is the signed root
    of the likelihood ratio, standard normal on the border: positive for clusters, negative for girdles.

    Parameters
    ----------
    x : (..., n, 3) array_like
        Unit vectors whose signs do not matter.

    Returns
    -------
    ShapeTestResult
        ``pvalue`` against both sides; ``pvalue_cluster`` small where the axes are a cluster, ``pvalue_girdle`` small
        where they are a girdle.

    Examples
    --------
    >>> x = Bingham([-20.0, -1.0, 0.0], np.eye(3)).rvs(40, rng=1)
    >>> bool(cluster_girdle_test(x).pvalue_girdle < 0.05)
    True
    """
    a = axes_of(x, "x", 4)
    if a.shape[-1] != 3:
        raise InvalidArgumentError("x", "axes in space, d = 3", f"d = {a.shape[-1]}")
    n = a.shape[-2]
    fitted = Bingham.fit(a)
    w, z = fitted.axis_moments, fitted.z
    likelihood = np.sum(w * z, axis=-1) - fitted.log_normalizer
    side = np.where(z[..., 0] < 2.0 * z[..., 1], -1.0, 1.0)
    ratio = np.maximum(2.0 * n * (likelihood - _border_likelihood(w.reshape(-1, 3)).reshape(fitted.shape)), 0.0)
    statistic = (side * np.sqrt(ratio))[()]
    return ShapeTestResult(
        statistic, 2.0 * ndtr(-np.abs(statistic)), "asymptotic", ndtr(-np.asarray(statistic))[()], ndtr(statistic)
    )


def _border_likelihood(w: FloatArray) -> FloatArray:
    """Return max_c (z·ω − log F(z)) (R,) over z = c (−2, −1, 0), c ≥ 0: the root of a falling slope."""
    line = np.array([-2.0, -1.0, 0.0])
    goal = w @ line
    # The slope at c is goal − line·ω(c); line·ω rises from −1 at c = 0 to 0.
    low, high = np.zeros(len(w)), np.full(len(w), 1.0)
    for _ in range(100):
        short = log_normalizer_derivatives(high[:, None] * line)[1] @ line < goal
        if not short.any():
            break
        low, high = np.where(short, high, low), np.where(short, 2.0 * high, high)
    c = 0.5 * (low + high)
    for _ in range(60):
        _, moments, hessian = log_normalizer_derivatives(c[:, None] * line)
        gap = goal - moments @ line
        low, high = np.where(gap > 0.0, c, low), np.where(gap > 0.0, high, c)
        newton = c + gap / np.einsum("i,rij,j->r", line, hessian, line)
        new = np.where((newton > low) & (newton < high), newton, 0.5 * (low + high))
        if np.all(np.abs(new - c) <= 1e-10 * (1.0 + c)):
            break
        c = new
    return c * goal - log_normalizer_derivatives(c[:, None] * line)[0]
