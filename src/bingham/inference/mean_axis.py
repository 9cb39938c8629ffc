"""Likelihood-ratio test of a given mean axis."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.arguments import as_generator, integer
from bingham.distributions.normalizer import solve_moments
from bingham.errors import InvalidArgumentError
from bingham.inference.result import TestResult, axes_of, check_choice, hotelling_pvalue, resampled_pvalue
from bingham.rotations import unit_rows

__all__ = ["mean_axis_test"]

FloatArray = NDArray[np.float64]


def mean_axis_test(
    x: ArrayLike,
    axis: ArrayLike,
    *,
    null: Literal["asymptotic", "permutation"] = "asymptotic",
    resamples: int = 9999,
    rng: Any = None,
) -> TestResult:
    """Test whether the mean axis, the mode of a Bingham distribution, is a given one.

    The statistic is the likelihood ratio Λ = 2n [ℓ(ω) − ℓ(ω⁰)], ℓ(ω) = max_z (z·ω − log F(z)): ω are the eigenvalues of
    the sample moment S, ω⁰ those with the axis a as the largest one, aᵀSa, beside the eigenvalues of S across it.

    Parameters
    ----------
    x : (..., n, d) array_like
        Unit vectors whose signs do not matter, n > d.
    axis : (..., d) array_like
        Hypothetical mean axis.
    null : {"asymptotic", "permutation"}
        "asymptotic": T² = (n − 1)(e^{Λ/n} − 1) as Hotelling's T² with d − 1 components, F distributed; that is exact
        in the limit of narrow distributions, where plain χ² rejects twice too often at n = 10. "permutation": every
        axis is turned by half a turn about `axis` or left alone, at random; exact for any distribution that this
        symmetry leaves unchanged.
    resamples : int
        Number of random permutations.
    rng : None, int or numpy.random.Generator
        Passed to ``numpy.random.default_rng``.

    Notes
    -----
    The axes that are not rejected at the level α form a confidence region of the mean axis with coverage 1 − α, not
    elliptical where the distribution is nearly a girdle.

    Examples
    --------
    >>> from bingham import Bingham
    >>> x = Bingham([-20.0, -9.0, 0.0], np.eye(3)).rvs(30, rng=1)
    >>> bool(mean_axis_test(x, [0, 0, 1]).pvalue > 0.05), bool(mean_axis_test(x, [0, 0.5, 0.75**0.5]).pvalue > 0.05)
    (True, False)
    """
    check_choice(null, "null", ("asymptotic", "permutation"))
    a = axes_of(x, "x", 3)
    n, d = a.shape[-2:]
    if n <= d:
        raise InvalidArgumentError("x", f"more than d = {d} axes", n)
    m = unit_rows(axis, d, "axis")
    along = np.einsum("...ni,...i->...n", a, m)
    across = a @ _complement(m)
    pinned = _pinned_moments(along, across)
    base = _likelihood(pinned)
    statistic = 2.0 * n * (_likelihood(_moments(along, across)) - base)
    if null == "asymptotic":
        square = (n - 1) * np.expm1(statistic / n)
        return TestResult(statistic, hotelling_pvalue(square, n, d - 1), "asymptotic")
    generator = as_generator(rng)
    drawn = np.empty((integer(resamples, "resamples", 1), *np.shape(statistic)))
    for k in range(len(drawn)):
        flipped = along * np.where(generator.random(along.shape) < 0.5, -1.0, 1.0)
        drawn[k] = 2.0 * n * (_likelihood(_moments(flipped, across)) - base)
    return TestResult(statistic, resampled_pvalue(statistic, drawn), "half turns about the axis")


def _complement(m: FloatArray) -> FloatArray:
    """Return d − 1 orthonormal columns (..., d, d − 1) across unit vectors m (..., d)."""
    return np.linalg.svd(m[..., None, :])[2][..., 1:, :].swapaxes(-1, -2)


def _moments(along: FloatArray, across: FloatArray) -> FloatArray:
    x = np.concatenate([across, along[..., None]], axis=-1)
    return np.linalg.eigvalsh(np.swapaxes(x, -1, -2) @ x / along.shape[-1])


def _pinned_moments(along: FloatArray, across: FloatArray) -> FloatArray:
    """Return ω⁰ (..., d): where the axis is not the heaviest, it is tied with those that are (likelihood's maximum)."""
    n = along.shape[-1]
    rest = np.linalg.eigvalsh(np.swapaxes(across, -1, -2) @ across / n)
    w = np.concatenate([rest, np.mean(along**2, axis=-1)[..., None]], axis=-1)
    d = w.shape[-1]
    # Pool the last k entries for the first k that leaves the row in order.
    pending = np.ones(w.shape[:-1], dtype=bool)
    out = w.copy()
    for k in range(1, d + 1):
        mean = w[..., d - k :].mean(axis=-1)
        fits = pending & (np.ones_like(pending) if k == d else mean >= w[..., d - k - 1])
        tied = np.concatenate([w[..., : d - k], np.repeat(mean[..., None], k, axis=-1)], axis=-1)
        out = np.where(fits[..., None], tied, out)
        pending = pending & ~fits
    return out


def _likelihood(w: FloatArray) -> Any:
    """Return ℓ(ω) = max_z (z·ω − log F(z)) (...) of moments (..., d)."""
    if np.any(w[..., 0] <= w.shape[-1] * np.finfo(np.float64).eps):
        raise InvalidArgumentError("x", "axes that span the space", "a sample on a smaller sphere", "add samples")
    w = w / w.sum(axis=-1, keepdims=True)
    z, log_f, _ = solve_moments(w)
    return np.sum(z * w, axis=-1) - log_f
