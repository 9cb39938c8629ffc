"""Isotropic Bingham distributions z = (−c, …, −c, 0): fit by maximum likelihood or through von Mises–Fisher."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.normalizer import log_normalizer_derivatives
from bingham.errors import ConvergenceError, InvalidArgumentError
from bingham.kernels.numpy_rule import RULE_DIMENSION
from bingham.validation import as_numbers, unit_rows

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["fit_isotropic", "isotropic_concentration"]

FloatArray = NDArray[np.float64]

STEPS = 60
EPS = float(np.finfo(np.float64).eps)
NO_WEIGHTS = np.empty(0)


def isotropic_concentration(spread: ArrayLike, d: int) -> FloatArray:
    """Return c ≥ 0 (...) with E[1 − (mᵀx)²] = spread for z = (−c, …, −c, 0) on S^{d−1}.

    With ω = E[(mᵀx)²] = M'(c)/M(c), M(c) = ₁F₁(1/2; d/2; c), Kummer's equation gives the slope
    ω' = (1/2 − (d/2 − c) ω)/c − ω²: Newton on log (1 − ω), from the bounds of Sra & Karp (2013).

    Parameters
    ----------
    spread : (...) array_like
        In (0, 1 − 1/d]; at the upper end c = 0.
    d : int
        Ambient dimension.

    Examples
    --------
    >>> isotropic_concentration([0.75, 0.015], 4).round(3)
    array([  0.   , 100.513])
    """
    s = as_numbers(spread, "spread")
    least = 1.0 - 1.0 / d
    if not np.all((s > 0.0) & (s <= least * (1.0 + 1e-12))):
        raise InvalidArgumentError("spread", f"numbers in (0, 1 − 1/d] = (0, {least:.6g}]", s)
    flat = np.minimum(np.atleast_1d(s).ravel(), least)
    r = 1.0 - flat
    # Lower bound of Sra & Karp, the middle of a few: exact at both ends.
    c = np.maximum((0.5 * d * r - 0.5) / (r * flat) * (1.0 + flat / (0.5 * (d - 1))), 0.0)
    open_rows = c > 1e-8
    for _ in range(STEPS):
        z = np.zeros((int(open_rows.sum()), d))
        if not len(z):
            return c.reshape(np.shape(s))
        at = c[open_rows]
        z[:, :-1] = -at[:, None]
        w = log_normalizer_derivatives(z)[1]
        across = w[:, :-1].sum(axis=1)
        top = 1.0 - across
        slope = (0.5 - (0.5 * d - at) * top) / at - top * top
        # Near 0 and far out the difference cancels; there ω' is known: 2(d−1)/(d²(d+2)), and (1−ω)/c.
        slope = np.where(at < 1e-3, 2.0 * (d - 1) / (d * d * (d + 2.0)), np.where(at > 1e4, across / at, slope))
        # d log(1 − ω)/d log c = −ω' c/(1 − ω).
        step = np.clip(np.log(across / flat[open_rows]) * across / (slope * at), -1.0, 1.0)
        c[open_rows] = at * np.exp(step)
        # Rounding of the spread, seen through the slope, is all that can be left.
        done = np.abs(step) < 2e-12 + 4e-16 / (slope * at)
        open_rows[np.flatnonzero(open_rows)[done]] = False
    raise ConvergenceError(f"isotropic concentration: not found in {STEPS} steps", c.reshape(np.shape(s)))


def fit_isotropic(
    x: ArrayLike | Rotation,
    weights: ArrayLike | None = None,
    *,
    method: Literal["likelihood", "von_mises_fisher"] = "likelihood",
) -> Bingham:
    """Return the isotropic distribution fitted to unit vectors x (n, d): one mode, one concentration.

    "likelihood": the mode is the leading eigenvector of the sample moment, c solves E[(mᵀx)²] = its eigenvalue. Of all
    isotropic distributions this is the most probable one. "von_mises_fisher" (Kurz et al. 2014, Appendix C): with
    cos θ = |mᵀx|, the angle 2θ weighted by (2 cos θ)^{d−2} is that of a von Mises–Fisher distribution of concentration
    c/2, whose mean resultant length Σ w cos 2θ / Σ w gives c. For d = 2 both are the same.

    Parameters
    ----------
    x : (n, d) array_like or Rotation
        Unit vectors (within 1e-6); signs do not matter.
    weights : (n,) array_like, optional
        Non-negative, not all zero.
    method : {"likelihood", "von_mises_fisher"}
        As above.

    Raises
    ------
    InvalidArgumentError
        If x is malformed or all rows are one axis, which has no finite concentration.

    Examples
    --------
    >>> x = Bingham([-40.0, -40.0, -40.0, 0.0], np.eye(4)).rvs(20_000, rng=1)
    >>> fit_isotropic(x).z.round(), fit_isotropic(x, method="von_mises_fisher").z.round()
    (array([-40., -40., -40.,   0.]), array([-40., -40., -40.,   0.]))
    """
    if method not in ("likelihood", "von_mises_fisher"):
        raise InvalidArgumentError("method", "'likelihood' or 'von_mises_fisher'", repr(method))
    # The kernel checks lengths itself; what it does not take is checked, and said, here.
    fast = type(x) is np.ndarray and x.dtype == np.float64 and x.flags.c_contiguous
    a = cast(FloatArray, x) if fast else unit_rows(x, None, "x")
    if a.ndim != 2 or not len(a) or a.shape[1] < 2:
        raise InvalidArgumentError("x", "samples as rows, shape (n, d), d ≥ 2", a.shape)
    n, d = a.shape
    w = NO_WEIGHTS if weights is None else _checked_weights(weights, n)
    if d > RULE_DIMENSION:
        a = unit_rows(x, None, "x")
        spread, frame = _spread(a, w if w.size else np.full(n, 1.0 / n))
        z, log_f = np.full(d, np.nan), None
    else:
        from bingham.kernels.isotropic import fit_isotropic_rows

        z, frame, log_f, spread = fit_isotropic_rows(a, w)
        if spread != spread:
            a = unit_rows(x, None, "x")
            z, frame, log_f, spread = fit_isotropic_rows(a, w)
    if not spread > 4.0 * EPS:
        raise InvalidArgumentError("x", "at least two different axes", f"{n} rows of one axis", "add samples")
    if method == "von_mises_fisher":
        return _isotropic(2.0 * _fisher(a @ frame[:, -1], w if w.size else np.full(n, 1.0 / n), d), frame)
    if z[0] != z[0]:
        return _isotropic(float(isotropic_concentration(spread, d)), frame)
    return Bingham.from_spectrum(z, frame, log_f)


def _checked_weights(weights: ArrayLike, n: int) -> FloatArray:
    w = as_numbers(weights, "weights")
    if w.shape != (n,) or not np.all(w >= 0.0) or not 0.0 < w.sum() < np.inf:
        raise InvalidArgumentError("weights", f"finite, not negative, not all 0, shape ({n},)", weights)
    return w / w.sum()


def _spread(a: FloatArray, w: FloatArray) -> tuple[float, FloatArray]:
    """Return E[1 − (mᵀx)²] of samples a (n, d), and axes by columns, the mode m last."""
    values, frame = np.linalg.eigh(a.T @ (a * w[:, None]))
    return float(np.maximum(values[:-1], 0.0).sum() / values.sum()), frame


def _isotropic(c: float, frame: FloatArray) -> Bingham:
    z = np.full(len(frame), -c)
    z[-1] = 0.0
    return Bingham.from_spectrum(z, np.ascontiguousarray(frame))


def _fisher(cosine: FloatArray, share: FloatArray, d: int) -> float:
    """Return κ with A_d(κ) = the weighted mean of cos 2θ, A_d = I_{d/2}/I_{d/2−1}."""
    from scipy.optimize import brentq
    from scipy.special import ive

    w = share * (2.0 * np.abs(cosine)) ** (d - 2)
    length = float(np.sum(w * (2.0 * cosine**2 - 1.0)) / np.sum(w))
    if length <= 0.0:
        return 0.0

    def excess(log_kappa: float) -> float:
        k = np.exp(log_kappa)
        # 1 − A_d ≈ (d − 1)/(2κ) where the Bessel functions no longer differ.
        return (1.0 - 0.5 * (d - 1) / k if k > 1e9 else float(ive(0.5 * d, k) / ive(0.5 * d - 1.0, k))) - length

    found: Any = brentq(excess, -20.0, 40.0, xtol=1e-14)
    return float(np.exp(found))
