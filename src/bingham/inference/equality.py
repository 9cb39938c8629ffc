"""Test whether several samples of axes come from one distribution."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import fdtrc

from bingham.errors import InvalidArgumentError
from bingham.inference.common_axis import samples_of
from bingham.inference.result import TestResult, check_choice, resampled_pvalue
from bingham.validation import as_generator, integer

__all__ = ["equality_test"]

FloatArray = NDArray[np.float64]


def equality_test(
    x: ArrayLike,
    *others: ArrayLike,
    null: Literal["asymptotic", "permutation"] = "permutation",
    resamples: int = 999,
    rng: Any = None,
) -> TestResult:
    """Test whether two or more samples of axes have the same second moment, as they have if their distributions agree.

    Each axis becomes the vector of the p = d(d + 1)/2 − 1 independent entries of x xᵀ; the statistic is
    −n log Λ, Λ Wilks's ratio of the determinants of their scatter within the samples and in all (a multivariate
    analysis of variance, no model assumed; after Wellner 1979). It does not depend on the frame.

    Parameters
    ----------
    x, *others : (..., nₛ, d) array_like
        Samples of unit vectors whose signs do not matter, together at least p + 3 of them.
    null : {"asymptotic", "permutation"}
        "permutation": axes change samples at random, exact at every n. "asymptotic": Rao's F, its degrees of freedom
        scaled so that Pillai's trace has the variance that permutations of the sample give it (Mardia 1971).
    resamples : int
        Number of random permutations.
    rng : None, int or numpy.random.Generator
        Passed to ``numpy.random.default_rng``.

    Examples
    --------
    >>> from bingham import Bingham
    >>> x, y = (Bingham([-20.0, -9.0, 0.0], np.eye(3)).rvs(30, rng=seed) for seed in (4, 5))
    >>> z = Bingham([-90.0, -30.0, 0.0], np.eye(3)).rvs(30, rng=3)
    >>> bool(equality_test(x, y, rng=0).pvalue > 0.05), bool(equality_test(x, z, rng=0).pvalue > 0.05)
    (True, False)
    """
    check_choice(null, "null", ("asymptotic", "permutation"))
    samples = samples_of(x, others)
    d = samples[0].shape[-1]
    p = d * (d + 1) // 2 - 1
    sizes = [a.shape[-2] for a in samples]
    n, k = sum(sizes), len(samples)
    if n < p + k + 1:
        raise InvalidArgumentError("x", f"at least {p + k + 1} axes in all samples together", n)
    shape = np.broadcast_shapes(*(a.shape[:-2] for a in samples))
    y = np.concatenate([np.broadcast_to(_entries(a), (*shape, a.shape[-2], p)) for a in samples], axis=-2)
    y = y - y.mean(axis=-2, keepdims=True)
    # Whitened by the scatter of all, Λ = |I − B| with B the scatter between the samples.
    total = np.swapaxes(y, -1, -2) @ y
    try:
        y = y @ np.swapaxes(np.linalg.inv(np.linalg.cholesky(total)), -1, -2)
    except np.linalg.LinAlgError:
        raise InvalidArgumentError("x", "axes that do not all lie on a smaller sphere", "a singular scatter") from None
    edges = np.cumsum([0, *sizes])
    statistic = -n * _log_wilks(y, edges)
    if null == "asymptotic":
        return TestResult(statistic, _rao_pvalue(np.exp(-statistic / n), n, p, k, _scale(y, sizes)), "asymptotic")
    generator = as_generator(rng)
    drawn = np.empty((integer(resamples, "resamples", 1), *np.shape(statistic)))
    for i in range(len(drawn)):
        drawn[i] = -n * _log_wilks(y[..., generator.permutation(n), :], edges)
    return TestResult(statistic, resampled_pvalue(statistic, drawn), "permutations")


def _entries(x: FloatArray) -> FloatArray:
    """Return the entries of x xᵀ (..., n, p) on and above the diagonal, the last one, 1 less the others, left out."""
    i, j = np.triu_indices(x.shape[-1])
    return (x[..., i] * x[..., j])[..., :-1]


def _log_wilks(y: FloatArray, edges: NDArray[np.int64]) -> Any:
    """Return log Λ (...) of whitened, centred rows (..., n, p)."""
    between = np.zeros((*y.shape[:-2], y.shape[-1], y.shape[-1]))
    for a, b in pairwise(edges):
        total = y[..., a:b, :].sum(axis=-2)
        between += total[..., :, None] * total[..., None, :] / (b - a)
    return np.linalg.slogdet(np.eye(y.shape[-1]) - between)[1][()]


def _scale(y: FloatArray, sizes: list[int]) -> Any:
    """Return Mardia's factor (...) of the degrees of freedom, for whitened, centred rows y (..., n, p).

    Pillai's trace V = Σ aᵢⱼ bᵢⱼ of two projections, A on the samples' means and B = y yᵀ, has over permutations the
    mean p (k − 1)/(n − 1) of normal theory, but a variance with the rows' fourth moments in it (Kazi-Aoual et al. 1995,
    for projections: Mardia 1971, Biometrika 58, 105). V as beta variable with both its mean and variance has the
    factor.
    """
    n, p = y.shape[-2:]
    q = len(sizes) - 1
    a = sum(m * (1.0 / m - 1.0 / n) ** 2 for m in sizes)
    b = np.sum(np.sum(y * y, axis=-1) ** 2, axis=-1)
    normal = 2.0 * q * (n - 1 - q) * p * (n - 1 - p) / ((n - 1) ** 2 * (n + 1) * (n - 2))
    fourth = (n * (n + 1) * a - (n - 1) * q * (q + 2)) * (n * (n + 1) * b - (n - 1) * p * (p + 2))
    variance = normal + fourth / ((n + 1) * n * (n - 1) * (n - 2) * (n - 3))
    # A sample that permutations can hardly change has no variance left; normal theory is the limit then.
    ratio = np.divide(normal, variance, out=np.ones_like(variance), where=variance > 1e-3 * normal)
    return np.maximum(((n + 1) * ratio - 2.0) / (n - 1), 0.1)


def _rao_pvalue(wilks: Any, n: int, p: int, k: int, scale: Any) -> Any:
    """Rao's (1951) F approximation of Wilks's Λ, exact for k = 2 or 3 normal samples, degrees of freedom scaled."""
    q = k - 1
    s = math.sqrt((p * p * q * q - 4) / (p * p + q * q - 5)) if p * p + q * q > 5 else 1.0
    m = n - 1 - 0.5 * (p + k)
    df1, df2 = p * q, m * s - 0.5 * p * q + 1
    root = np.asarray(wilks) ** (1.0 / s)
    return fdtrc(scale * df1, scale * df2, (1.0 - root) / root * (df2 / df1))[()]
