"""Test of a cluster against a girdle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

from bingham.distributions.bingham import Bingham
from bingham.distributions.marginal import marginal_fit, marginal_log_likelihood
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
    of the likelihood ratio, standard normal on the border: positive for clusters, negative for girdles. The likelihood
    is that of the concentrations alone (`bingham.distributions.marginal`).

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
    w = fitted.axis_moments.reshape(-1, 3)
    z, best = marginal_fit(w, n, np.array(fitted.z.reshape(-1, 3)))
    border = _border_likelihood(w, n, z)
    side = np.where(z[:, 0] + z[:, 2] < 2.0 * z[:, 1], -1.0, 1.0)
    statistic = (side * np.sqrt(np.maximum(2.0 * (best - border), 0.0))).reshape(fitted.shape)[()]
    return ShapeTestResult(
        statistic, 2.0 * ndtr(-np.abs(statistic)), "asymptotic", ndtr(-np.asarray(statistic))[()], ndtr(statistic)
    )


def _border_likelihood(w: FloatArray, n: int, start: FloatArray) -> FloatArray:
    """Return the largest log L (R,) of z = (−2c, −c, 0), c ≥ 0, by Newton's method in log c, damped."""
    direction = np.array([-2.0, -1.0, 0.0])
    u = np.log(np.maximum(-0.5 * start[:, 0], 1e-3))

    def at(u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        c = np.exp(u)
        value, gradient, hessian = marginal_log_likelihood(c[:, None] * direction, w, np.full(len(c), float(n)))
        slope = gradient @ direction
        return value, c * slope, c * slope + c * c * np.einsum("i,rij,j->r", direction, hessian, direction)

    value, slope, bend = at(u)
    for _ in range(100):
        step = np.clip(slope / np.maximum(np.abs(bend), 1e-12), -1.0, 1.0)
        if np.max(np.abs(step * slope)) < 1e-10 or np.all(u + step < -30.0):
            break
        for _ in range(30):
            trial = at(u + step)
            worse = trial[0] < value - 1e-12 * np.abs(value)
            if not worse.any():
                break
            step = np.where(worse, 0.3 * step, step)
        u = u + step
        value, slope, bend = trial
    return value
