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
NO_WEIGHTS, NO_WEIGHT = np.empty((0, 0)), np.empty(0)


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
    """Return the isotropic distribution fitted to unit vectors x (..., n, d): one mode, one concentration.

    "likelihood": the mode is the leading eigenvector of the sample moment, c solves E[(mᵀx)²] = its eigenvalue. Of all
    isotropic distributions this is the most probable one. "von_mises_fisher" (Kurz et al. 2014, Appendix C): with
    cos θ = |mᵀx|, the angle 2θ weighted by (2 cos θ)^{d−2} is that of a von Mises–Fisher distribution of concentration
    c/2, whose mean resultant length Σ w cos 2θ / Σ w gives c. For d = 2 both are the same.

    Parameters
    ----------
    x : (..., n, d) array_like or Rotation
        Unit vectors (within 1e-6); signs do not matter. Leading axes are a batch of samples.
    weights : (..., n) array_like, optional
        Non-negative, not all zero.
    method : {"likelihood", "von_mises_fisher"}
        As above.

    Raises
    ------
    InvalidArgumentError
        If x is malformed or all rows of a sample are one axis, which has no finite concentration.

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
    if a.ndim < 2 or not a.shape[-2] or a.shape[-1] < 2:
        raise InvalidArgumentError("x", "samples as rows, shape (..., n, d), n ≥ 1, d ≥ 2", a.shape)
    batch, (n, d) = a.shape[:-2], a.shape[-2:]
    w = NO_WEIGHTS if weights is None else _checked_weights(weights, a.shape[:-1])
    if not batch and d <= RULE_DIMENSION and method == "likelihood":
        from bingham.kernels.isotropic import fit_isotropic_one

        one_z, one_frame, one_log_f, one_spread = fit_isotropic_one(a, w[0] if w.size else NO_WEIGHT)
        if one_spread > 4.0 * EPS and one_z[0] == one_z[0]:
            return Bingham.from_spectrum(one_z, one_frame, one_log_f)
    a = a.reshape(-1, n, d)
    if d > RULE_DIMENSION:
        a = unit_rows(x, None, "x").reshape(-1, n, d)
        spread, frame = _spread(a, w if w.size else np.full((len(a), n), 1.0 / n))
        z, log_f = np.full((len(a), d), np.nan), np.full(len(a), np.nan)
    else:
        from bingham.kernels.isotropic import fit_isotropic_rows

        z, frame, log_f, spread = fit_isotropic_rows(a, w)
        if np.isnan(spread).any():
            a = unit_rows(x, None, "x").reshape(-1, n, d)
            z, frame, log_f, spread = fit_isotropic_rows(a, w)
    if not (spread > 4.0 * EPS).all():
        which = f", sample {int(np.argmin(spread > 4.0 * EPS))}" if batch else ""
        raise InvalidArgumentError("x", "at least two different axes", f"{n} rows of one axis{which}", "add samples")
    if method == "von_mises_fisher":
        shares = w if w.size else np.full((len(a), n), 1.0 / n)
        cosines = np.einsum("kni,ki->kn", a, frame[:, :, -1])
        c = np.array([2.0 * _fisher(cosine, share, d) for cosine, share in zip(cosines, shares, strict=True)])
    elif np.isnan(z[:, 0]).any():
        c = isotropic_concentration(spread, d)
    else:
        return Bingham.from_spectrum(z.reshape(*batch, d), frame.reshape(*batch, d, d), _value(log_f, batch))
    z = np.zeros((len(a), d))
    z[:, :-1] = -c[:, None]
    return Bingham.from_spectrum(z.reshape(*batch, d), np.ascontiguousarray(frame).reshape(*batch, d, d))


def _value(a: FloatArray, batch: tuple[int, ...]) -> Any:
    return a.reshape(batch) if batch else a[0]


def _checked_weights(weights: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Return weights (m, n) with sum 1 for m samples of n rows."""
    w = as_numbers(weights, "weights")
    try:
        w = np.broadcast_to(w, shape).reshape(-1, shape[-1])
    except ValueError:
        raise InvalidArgumentError("weights", f"one for each row, shape {shape}", w.shape) from None
    total = w.sum(axis=1)
    if not (np.all(w >= 0.0) and np.all(total > 0.0) and np.all(total < np.inf)):
        raise InvalidArgumentError("weights", "finite, not negative, not all 0", weights)
    return w / total[:, None]


def _spread(a: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return E[1 − (mᵀx)²] (m,) of samples a (m, n, d), and axes by columns, the mode last."""
    values, frame = np.linalg.eigh(np.swapaxes(a, 1, 2) @ (a * w[..., None]))
    return np.maximum(values[:, :-1], 0.0).sum(axis=1) / values.sum(axis=1), frame


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
