"""Test of rotational symmetry about the mean axis (a cluster) or about the pole of the best plane (a girdle)."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError
from bingham.inference.result import TestResult, axes_of, check_choice, chi2_pvalue, resampled_pvalue
from bingham.validation import as_generator, integer

__all__ = ["symmetry_test"]

FloatArray = NDArray[np.float64]


def symmetry_test(
    x: ArrayLike,
    *,
    kind: Literal["auto", "bipolar", "girdle"] = "auto",
    null: Literal["asymptotic", "simulation"] = "asymptotic",
    resamples: int = 9999,
    rng: Any = None,
) -> TestResult:
    """Test whether the distribution of axes has rotational symmetry about its principal axis.

    With y the part of x across the axis, p = d − 1 components in principal coordinates, and ωᵢ its moments,

        P = n p (p + 2) / (2 E‖y‖⁴) Σ (ωᵢ − ω̄)²,

    χ² with (p − 1)(p + 2)/2 degrees of freedom for large n; nothing is assumed but the symmetry. For d = 3 it is
    2n (ω₂ − ω₁)²/(1 − 2ω₃ + Γ), Γ = E[(m₃ᵀx)⁴], χ²₂ (Prentice 1984; Fisher, Lewis & Embleton 1987, sec. 6.3.1).

    Parameters
    ----------
    x : (..., n, d) array_like
        Unit vectors whose signs do not matter, d ≥ 3.
    kind : {"auto", "bipolar", "girdle"}
        Symmetry about the axis of the largest moment or of the smallest one; "auto" takes, sample by sample, the one
        whose moment has the larger ratio to its neighbour (Woodcock's K above or below 1).
    null : {"asymptotic", "simulation"}
        "simulation" turns every y at random, which the hypothesis allows.
    resamples : int
        Samples to draw.
    rng : None, int or numpy.random.Generator
        Passed to ``numpy.random.default_rng``.

    Examples
    --------
    >>> from bingham import Bingham
    >>> x = Bingham([-9.0, -9.0, 0.0], np.eye(3)).rvs(60, rng=1)
    >>> bool(symmetry_test(x).pvalue > 0.05)
    True
    """
    check_choice(kind, "kind", ("auto", "bipolar", "girdle"))
    check_choice(null, "null", ("asymptotic", "simulation"))
    a = axes_of(x, "x", 2)
    n, d = a.shape[-2:]
    if d < 3:
        raise InvalidArgumentError("x", "d ≥ 3, where an axis has something about it to rotate in", f"d = {d}")
    w, frame = np.linalg.eigh(np.swapaxes(a, -1, -2) @ a / n)
    last = {"bipolar": True, "girdle": False}.get(kind, w[..., -1] * w[..., 0] >= w[..., -2] * w[..., 1])
    across = np.where(np.asarray(last)[..., None, None], frame[..., :-1], frame[..., 1:])
    y = a @ across
    if np.any(np.max(np.abs(y), axis=(-1, -2)) < 1e-12):
        raise InvalidArgumentError("x", "axes that scatter about their principal axis", "axes all alike")
    p = d - 1
    statistic = _anisotropy(y)
    if null == "asymptotic":
        return TestResult(statistic, chi2_pvalue(statistic, (p - 1) * (p + 2) / 2), "asymptotic")
    generator = as_generator(rng)
    length = np.linalg.norm(y, axis=-1, keepdims=True)
    drawn = np.empty((integer(resamples, "resamples", 1), *np.shape(statistic)))
    for k in range(len(drawn)):
        turned = generator.standard_normal(y.shape)
        drawn[k] = _anisotropy(length * turned / np.linalg.norm(turned, axis=-1, keepdims=True))
    return TestResult(statistic, resampled_pvalue(statistic, drawn), "random rotations about the axis")


def _anisotropy(y: FloatArray) -> Any:
    """Return P (...) of the parts y (..., n, p) across the axis, in any coordinates."""
    n, p = y.shape[-2:]
    moment = np.swapaxes(y, -1, -2) @ y / n
    trace = np.einsum("...ii->...", moment)
    spread = np.sum(moment**2, axis=(-1, -2)) - trace**2 / p
    fourth = np.mean(np.sum(y**2, axis=-1) ** 2, axis=-1)
    return (n * p * (p + 2) / 2 * spread / fourth)[()]
