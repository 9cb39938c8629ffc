"""Likelihood-ratio test of a given mean axis."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError
from bingham.inference.principal import axis_pvalue, axis_ratios, complement, ordered_likelihood
from bingham.inference.result import TestResult, axes_of, check_choice, resampled_pvalue
from bingham.rotations import unit_rows
from bingham.validation import as_generator, integer

__all__ = ["mean_axis_test"]

FloatArray = NDArray[np.float64]


def mean_axis_test(
    x: ArrayLike,
    axis: ArrayLike,
    *,
    index: int = -1,
    null: Literal["asymptotic", "permutation"] = "asymptotic",
    resamples: int = 9999,
    rng: Any = None,
) -> TestResult:
    """Test whether the mean axis, the mode of a Bingham distribution, is a given one.

    The statistic is the likelihood ratio Λ = 2n [ℓ(ω) − ℓ(ω⁰)], ℓ(ω) = max_z (z·ω − log F(z)): ω are the eigenvalues of
    the sample moment S, ω⁰ those with the axis a as the largest one, aᵀSa, beside the eigenvalues of S across it.
    Λ = Λ₁ + Λ₂: that a is a principal axis at all, and that it is this one.

    Parameters
    ----------
    x : (..., n, d) array_like
        Unit vectors whose signs do not matter, n > d.
    axis : (..., d) array_like
        Hypothetical mean axis.
    index : int
        Which principal axis it is, in the order of `Bingham.M`: −1 the mean axis, 0 the pole of the best plane.
    null : {"asymptotic", "permutation"}
        "asymptotic": T² = (n − 1)(e^{Λ₁/n} − 1) as Hotelling's T² with d − 1 components, F distributed; that is exact
        in the limit of narrow distributions, where plain χ² rejects twice too often at n = 10, and it holds where
        concentrations are equal. A twentieth of the error is kept for Λ₂. "permutation": every
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
    >>> x = Bingham([-20.0, -9.0, 0.0], np.eye(3)).rvs(30, rng=4)
    >>> bool(mean_axis_test(x, [0, 0, 1]).pvalue > 0.05), bool(mean_axis_test(x, [0, 0.5, 0.75**0.5]).pvalue > 0.05)
    (True, False)
    """
    check_choice(null, "null", ("asymptotic", "permutation"))
    a = axes_of(x, "x", 3)
    n, d = a.shape[-2:]
    if n <= d:
        raise InvalidArgumentError("x", f"more than d = {d} axes", n)
    k = integer(index, "index", -d) % d
    m = unit_rows(axis, d, "axis")
    ratio, order = axis_ratios(np.swapaxes(a, -1, -2) @ a / n, n, m, k)
    statistic = ratio + order
    if null == "asymptotic":
        return TestResult(statistic, axis_pvalue(ratio, order, n, d), "asymptotic")
    generator = as_generator(rng)
    along = np.einsum("...ni,...i->...n", a, m)
    across = a @ complement(m)
    pinned = 2.0 * n * ordered_likelihood(_moments(along, across)) - statistic
    drawn = np.empty((integer(resamples, "resamples", 1), *np.shape(statistic)))
    for i in range(len(drawn)):
        flipped = along * np.where(generator.random(along.shape) < 0.5, -1.0, 1.0)
        drawn[i] = 2.0 * n * ordered_likelihood(_moments(flipped, across)) - pinned
    return TestResult(statistic, resampled_pvalue(statistic, drawn), "half turns about the axis")


def _moments(along: FloatArray, across: FloatArray) -> FloatArray:
    """Return the eigenvalues (..., d) of the moment of axes with parts (..., n) along and (..., n, d − 1) across."""
    x = np.concatenate([across, along[..., None]], axis=-1)
    return np.asarray(np.linalg.eigvalsh(np.swapaxes(x, -1, -2) @ x / along.shape[-1]), dtype=np.float64)
