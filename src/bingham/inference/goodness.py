"""Goodness of fit of the Bingham distribution to a sample."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.normalizer import log_normalizer
from bingham.inference.result import TestResult, axes_of, resampled_pvalue
from bingham.validation import as_generator, integer

__all__ = ["goodness_of_fit_test", "mode_angle_statistic"]

FloatArray = NDArray[np.float64]

# Nodes of the distribution function of the angle: its error, 1e-4, is far below the statistic's spread.
NODES = 160
# Beyond this exponent along the weakest axis nothing is left of the density.
TAIL = 30.0
# Axes and nodes held at once.
BLOCK = 1_000_000


def goodness_of_fit_test(x: ArrayLike, *, resamples: int = 999, rng: Any = None) -> TestResult:
    """Test whether axes follow a Bingham distribution, by their angles to the fitted mode.

    The statistic is Anderson and Darling's A² between the angles φ = arccos |xᵀ mode| and their distribution under the
    fitted parameters, whose density 2 sin^{d−2}φ F_{d−1}(z_rest sin²φ)/F(z) is exact. Its null distribution, with the
    parameters fitted anew, comes from a parametric bootstrap: samples of the fitted distribution.

    Parameters
    ----------
    x : (..., n, d) array_like
        Unit vectors whose signs do not matter.
    resamples : int
        Number of bootstrap samples.
    rng : None, int or numpy.random.Generator
        Passed to ``numpy.random.default_rng``.

    Examples
    --------
    >>> from bingham import Bingham, BinghamMixture
    >>> p = Bingham([-20.0, -9.0, 0.0], np.eye(3))
    >>> bool(goodness_of_fit_test(p.rvs(50, rng=1), rng=0).pvalue > 0.05)
    True
    >>> outliers = np.concatenate([p.rvs(40, rng=1), Bingham.uniform(3).rvs(10, rng=2)])
    >>> bool(goodness_of_fit_test(outliers, rng=0).pvalue > 0.05)
    False
    """
    a = axes_of(x, "x", 2)
    generator = as_generator(rng)
    count = integer(resamples, "resamples", 1)
    n, d = a.shape[-2:]
    fitted = Bingham.fit(a)
    statistic = mode_angle_statistic(a, fitted)
    shape = fitted.shape
    z = fitted.z.reshape(-1, d)
    drawn = np.empty((count, len(z)))
    block = max(1, BLOCK // (n + NODES * d))
    # The statistic does not depend on the frame, so samples are drawn in that of the axes.
    for k, row in enumerate(z):
        null = Bingham(row, np.eye(d))
        for start in range(0, count, block):
            sample = null.rvs((min(block, count - start), n), rng=generator)
            drawn[start : start + block, k] = mode_angle_statistic(sample, Bingham.fit(sample))
    return TestResult(statistic, resampled_pvalue(statistic, drawn.reshape(count, *shape)), "parametric bootstrap")


def mode_angle_statistic(x: FloatArray, fitted: Bingham) -> Any:
    """Return A² (...) of the angles between x (..., n, d) and the mode of `fitted` (...)."""
    n = x.shape[-2]
    sine = np.sqrt(np.maximum(1.0 - np.einsum("...ni,...i->...n", x, fitted.mode) ** 2, 0.0))
    share = _distribution(fitted.z, np.arcsin(np.minimum(sine, 1.0)))
    u = np.clip(np.sort(share, axis=-1), 1e-9, 1.0 - 1e-9)
    weight = (2.0 * np.arange(1, n + 1) - 1.0) / n
    return (-n - np.sum(weight * (np.log(u) + np.log1p(-u[..., ::-1])), axis=-1))[()]


def _distribution(z: FloatArray, angle: FloatArray) -> FloatArray:
    """Return P(φ ≤ angle) (..., n) for angles (..., n) to the mode and concentrations z (..., d)."""
    d = z.shape[-1]
    far = np.arcsin(np.sqrt(np.minimum(1.0, TAIL / np.maximum(-z[..., -2], TAIL))))
    step = far / NODES
    grid = step[..., None] * (np.arange(NODES) + 0.5)
    square = np.sin(grid)[..., None] ** 2 * z[..., None, :-1]
    log_rest = log_normalizer(square) if d > 2 else np.log(2.0) + square[..., 0]
    log_density = (d - 2) * np.log(np.sin(grid)) + log_rest
    density = np.exp(log_density - log_density.max(axis=-1, keepdims=True))
    total = np.concatenate([np.zeros((*z.shape[:-1], 1)), np.cumsum(density, axis=-1)], axis=-1)
    total /= total[..., -1:]
    # Linear between the edges of the grid.
    position = np.minimum(angle / step[..., None], NODES - 1e-9)
    left = position.astype(np.int64)
    low = np.take_along_axis(total, left, axis=-1)
    high = np.take_along_axis(total, left + 1, axis=-1)
    return low + (position - left) * (high - low)
