"""Test whether several samples share their mean axis."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError
from bingham.inference.result import TestResult, axes_of, check_choice, chi2_pvalue, resampled_pvalue
from bingham.validation import as_generator, integer

__all__ = ["common_axis", "common_axis_test", "samples_of"]

FloatArray = NDArray[np.float64]


def common_axis_test(
    x: ArrayLike,
    *others: ArrayLike,
    null: Literal["asymptotic", "bootstrap"] = "asymptotic",
    resamples: int = 999,
    rng: Any = None,
) -> TestResult:
    """Test whether two or more samples have a common mean axis, whatever else differs between them.

    With Wₛ = Σⱼ mⱼ mⱼᵀ/σⱼ² of each sample, σⱼ the standard deviation of its mean axis towards its principal axis mⱼ,
    the statistic is J = min_a Σₛ aᵀ Wₛ a, the smallest eigenvalue of Σ Wₛ (Prentice 1984 for axes; Fisher, Lewis &
    Embleton 1987, sec. 6.4).

    Parameters
    ----------
    x, *others : (..., nₛ, d) array_like
        Samples of unit vectors whose signs do not matter, n > d in each; the numbers may differ.
    null : {"asymptotic", "bootstrap"}
        "asymptotic": χ² with (k − 1)(d − 1) degrees of freedom, after James's (1954) correction for small samples of
        unequal spread. "bootstrap": each sample is carried to the common axis and drawn from with replacement.
    resamples : int
        Number of bootstrap samples.
    rng : None, int or numpy.random.Generator
        Passed to ``numpy.random.default_rng``.

    Examples
    --------
    >>> from bingham import Bingham
    >>> x, y = (Bingham([-20.0, -9.0, 0.0], np.eye(3)).rvs(30, rng=seed) for seed in (1, 2))
    >>> bool(common_axis_test(x, y).pvalue > 0.05)
    True
    """
    check_choice(null, "null", ("asymptotic", "bootstrap"))
    samples = samples_of(x, others)
    d = samples[0].shape[-1]
    sizes = np.array([a.shape[-2] for a in samples])
    if sizes.min() <= d:
        raise InvalidArgumentError("x", f"more than d = {d} axes in each sample", int(sizes.min()))
    weights = [_precision(a) for a in samples]
    statistic, axis = common_axis(weights)
    if null == "asymptotic":
        return TestResult(statistic, _james_pvalue(statistic, axis, weights, sizes), "asymptotic")
    generator = as_generator(rng)
    centred = [_carried(a, axis) for a in samples]
    drawn = np.empty((integer(resamples, "resamples", 1), *np.shape(statistic)))
    for k in range(len(drawn)):
        again = [a[..., generator.integers(a.shape[-2], size=a.shape[-2]), :] for a in centred]
        drawn[k] = common_axis([_precision(a) for a in again])[0]
    return TestResult(statistic, resampled_pvalue(statistic, drawn), "bootstrap about the common axis")


def samples_of(x: ArrayLike, others: tuple[ArrayLike, ...]) -> list[FloatArray]:
    """Return two or more samples (..., n, d) of the same dimension."""
    if not others:
        raise InvalidArgumentError("others", "one more sample at least", "none", "call it as test(x, y)")
    samples = [axes_of(a, "x" if k == 0 else f"others[{k - 1}]", 2) for k, a in enumerate((x, *others))]
    if len({a.shape[-1] for a in samples}) > 1:
        raise InvalidArgumentError("others", f"axes with d = {samples[0].shape[-1]} as in x", samples[1].shape)
    return samples


def common_axis(weights: list[FloatArray]) -> tuple[Any, FloatArray]:
    """Return J (...) and the axis a (..., d) that minimises Σ aᵀ Wₛ a."""
    values, vectors = np.linalg.eigh(sum(weights))
    return np.maximum(values[..., 0], 0.0)[()], vectors[..., 0]


def _precision(x: FloatArray) -> FloatArray:
    """Return W (..., d, d) of a sample (..., n, d): inverse covariance of its mean axis, zero along that axis.

    σⱼ² = n/(n − 1) · E[(mⱼᵀx)²(m_dᵀx)²] / (n (ω_d − ωⱼ)²), with whole covariances between the components: no model is
    assumed.
    """
    n = x.shape[-2]
    w, frame = np.linalg.eigh(np.swapaxes(x, -1, -2) @ x / n)
    y = x @ frame
    score = y[..., :-1] * y[..., -1:]
    covariance = np.swapaxes(score, -1, -2) @ score / (n - 1)
    gap = w[..., -1:] - w[..., :-1]
    scale = np.sqrt(np.einsum("...ii->...i", covariance))
    if not np.all(scale > 0.0) or not np.all(np.linalg.cond(_scaled(covariance, scale)) < 1e12):
        raise InvalidArgumentError("x", "axes that scatter in every direction about their mean", "some that do not")
    precision = n * gap[..., :, None] * np.linalg.inv(covariance) * gap[..., None, :]
    return frame[..., :-1] @ precision @ np.swapaxes(frame[..., :-1], -1, -2)


def _scaled(covariance: FloatArray, scale: FloatArray) -> FloatArray:
    return covariance / (scale[..., :, None] * scale[..., None, :])


def _james_pvalue(statistic: Any, axis: FloatArray, weights: list[FloatArray], sizes: NDArray[np.int64]) -> Any:
    """James's first-order correction: J exceeds χ (A + B χ) with the probability with which χ² exceeds χ."""
    d = axis.shape[-1]
    degrees = (len(weights) - 1) * (d - 1)
    across = np.linalg.svd(axis[..., None, :])[2][..., 1:, :]
    parts = [across @ w @ np.swapaxes(across, -1, -2) for w in weights]
    total = np.linalg.inv(sum(parts))
    a, b = 1.0, 0.0
    for part, n in zip(parts, sizes, strict=True):
        rest = np.eye(d - 1) - total @ part
        trace = np.einsum("...ii->...", rest)
        square = np.einsum("...ij,...ji->...", rest, rest)
        a = a + trace**2 / (2.0 * degrees * (n - 1))
        b = b + (square + 0.5 * trace**2) / (degrees * (degrees + 2) * (n - 1))
    chi = (np.sqrt(a * a + 4.0 * b * statistic) - a) / (2.0 * b)
    return chi2_pvalue(chi, degrees)


def _carried(x: FloatArray, axis: FloatArray) -> FloatArray:
    """Return x (..., n, d) after the rotation of its mean axis to `axis` in the plane of both."""
    mode = np.linalg.eigh(np.swapaxes(x, -1, -2) @ x)[1][..., -1]
    mode = mode * np.where(np.sum(mode * axis, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    middle = mode + axis
    middle /= np.linalg.norm(middle, axis=-1, keepdims=True)
    # Two reflections make the rotation.
    x = x - 2.0 * np.einsum("...ni,...i->...n", x, mode)[..., None] * mode[..., None, :]
    return x - 2.0 * np.einsum("...ni,...i->...n", x, middle)[..., None] * middle[..., None, :]
