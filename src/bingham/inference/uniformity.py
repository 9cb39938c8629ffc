"""Tests of uniformity for axes: Bingham's S, Giné's G, and Rayleigh's test of doubled angles."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaln

from bingham.errors import InvalidArgumentError
from bingham.inference.result import TestResult, axes_of, check_choice, chi2_pvalue, resampled_pvalue
from bingham.inference.weighted_chi2 import sine_kernel_weights, weighted_chi2_pvalue
from bingham.validation import as_generator, integer

__all__ = ["bingham_statistic", "gine_statistic", "uniformity_test"]

FloatArray = NDArray[np.float64]

# Numbers held at once.
BLOCK = 4_000_000


def uniformity_test(
    x: ArrayLike,
    *,
    method: Literal["bingham", "gine", "rayleigh"] = "bingham",
    null: Literal["asymptotic", "simulation"] = "asymptotic",
    resamples: int = 9999,
    rng: Any = None,
) -> TestResult:
    """Test whether axes are uniform on the sphere.

    Parameters
    ----------
    x : (..., n, d) array_like
        Unit vectors whose signs do not matter.
    method : {"bingham", "gine", "rayleigh"}
        "bingham": S = d(d + 2)/2 · n Σ (ωᵢ − 1/d)², ωᵢ the eigenvalues of the sample moment; E[S] = (d − 1)(d + 2)/2
        exactly (Bingham 1974). It sees second moments only. "gine": G = n/2 − c/n Σ_{i<j} sin θᵢⱼ, θᵢⱼ the angle
        between two axes, consistent against every alternative (Giné 1975). "rayleigh", d = 2: n R̄² of the doubled
        angles, R̄ their resultant length; S = 2 n R̄² there.
    null : {"asymptotic", "simulation"}
        Where the p-value comes from. Asymptotically S is χ² with (d − 1)(d + 2)/2 degrees of freedom, used after
        Jupp's (2001) correction of order 1/n; G is a weighted sum of χ²; n R̄² is exponential, with Wilkie's (1983)
        correction. "simulation" draws uniform samples of the same size: exact at every n.
    resamples : int
        Samples to draw.
    rng : None, int or numpy.random.Generator
        Passed to ``numpy.random.default_rng``.

    Returns
    -------
    TestResult
        ``statistic`` and ``pvalue`` (...).

    Examples
    --------
    >>> from bingham import Bingham
    >>> x = Bingham([-3.0, -1.0, 0.0], np.eye(3)).rvs(20, rng=1)
    >>> result = uniformity_test(x)
    >>> round(float(result.statistic), 2), round(float(result.pvalue), 5)
    (7.98, 0.15464)

    References
    ----------
    Mardia & Jupp, Directional Statistics (2000), sec. 10.4.1, 10.7; Jupp, Ann. Statist. 29 (2001) 544.
    """
    check_choice(method, "method", ("bingham", "gine", "rayleigh"))
    check_choice(null, "null", ("asymptotic", "simulation"))
    a = axes_of(x, "x", 2)
    n, d = a.shape[-2:]
    if method == "rayleigh" and d != 2:
        raise InvalidArgumentError("x", "axes in the plane, d = 2, for Rayleigh's test", f"d = {d}", 'try "bingham"')
    measure = {"bingham": bingham_statistic, "gine": gine_statistic, "rayleigh": _rayleigh_statistic}[method]
    statistic = measure(a)
    if null == "simulation":
        generator = as_generator(rng)
        drawn = np.empty(integer(resamples, "resamples", 1))
        block = max(1, BLOCK // (n * (n if method == "gine" else d)))
        for start in range(0, drawn.size, block):
            y = generator.standard_normal((min(block, drawn.size - start), n, d))
            drawn[start : start + block] = measure(y / np.linalg.norm(y, axis=-1, keepdims=True))
        shape = (-1, *([1] * np.ndim(statistic)))
        return TestResult(statistic, resampled_pvalue(statistic, drawn.reshape(shape)), "uniform samples")
    if method == "bingham":
        pvalue = chi2_pvalue(_jupp(statistic, n, d), (d - 1) * (d + 2) / 2)
    elif method == "gine":
        # Two orthogonal rows give the factor of its sines: G = 1 − c/2.
        factor = 2.0 * (1.0 - float(gine_statistic(np.eye(d)[:2])))
        pvalue = weighted_chi2_pvalue(statistic, *sine_kernel_weights(d, factor))
    else:
        # P(R ≥ r) ≈ exp(√(1 + 4n + 4(n² − r²)) − (1 + 2n)), r² = n · statistic.
        square = n * np.asarray(statistic)
        pvalue = np.exp(np.sqrt(1.0 + 4.0 * n + 4.0 * (n * n - square)) - (1.0 + 2.0 * n))[()]
    return TestResult(statistic, pvalue, "asymptotic")


def bingham_statistic(x: FloatArray) -> Any:
    """Return S (...) of unit rows (..., n, d)."""
    n, d = x.shape[-2:]
    moment = np.swapaxes(x, -1, -2) @ x / n
    return (0.5 * d * (d + 2) * n * (np.sum(moment**2, axis=(-1, -2)) - 1.0 / d))[()]


def gine_statistic(x: FloatArray) -> Any:
    """Return G (...) = n/2 − (d − 1)/(2n) (Γ((d−1)/2)/Γ(d/2))² Σ_{i<j} sin θᵢⱼ of unit rows (..., n, d)."""
    n, d = x.shape[-2:]
    # In blocks of rows: all pairs at once need memory ∝ n².
    step = max(1, BLOCK // max(1, n * math.prod(x.shape[:-2])))
    pairs = np.zeros(x.shape[:-2])
    for start in range(0, n, step):
        rows = x[..., start : start + step, :]
        cosine = rows @ np.swapaxes(x, -1, -2)
        sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
        own = np.arange(start, start + rows.shape[-2])
        sine[..., own - start, own] = 0.0
        pairs += 0.5 * sine.sum(axis=(-1, -2))
    c = 0.5 * (d - 1) * math.exp(2.0 * float(gammaln(0.5 * (d - 1)) - gammaln(0.5 * d)))
    return (0.5 * n - c / n * pairs)[()]


def _rayleigh_statistic(x: FloatArray) -> Any:
    doubled = np.stack([x[..., 0] ** 2 - x[..., 1] ** 2, 2.0 * x[..., 0] * x[..., 1]], axis=-1)
    return (x.shape[-2] * np.sum(doubled.mean(axis=-2) ** 2, axis=-1))[()]


def _jupp(s: Any, n: int, d: int) -> Any:
    """S with the error of its χ² distribution reduced from order 1/n (Mardia & Jupp 2000, eq. 10.7.2).

    The correction is a cubic that bends down far in the tail; from where its slope has fallen to a half it goes on
    straight. Where that is at once, n is too small for it.
    """
    b0 = (2 * d**2 + 3 * d + 4) / (6 * (d + 4))
    b1 = -(4 * d**2 + 3 * d - 4) / (3 * (d + 4) * (d**2 + d + 2))
    b2 = 4 * (d**2 - 4) / (3 * (d + 4) * (d**2 + d + 2) * (d**2 + d + 6))

    def cubic(s: Any) -> Any:
        return s * (1.0 - (b0 + b1 * s + b2 * s * s) / n)

    if b0 > 0.5 * n:
        return s
    if b2 == 0.0:
        return cubic(s)
    turn = (-b1 + math.sqrt(b1 * b1 - 3.0 * b2 * (b0 - 0.5 * n))) / (3.0 * b2)
    return cubic(np.minimum(s, turn)) + 0.5 * np.maximum(s - turn, 0.0)
