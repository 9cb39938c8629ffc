"""Confidence intervals of concentrations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtri

from bingham.distributions.bingham import Bingham
from bingham.distributions.marginal import marginal_fit
from bingham.errors import InvalidArgumentError
from bingham.inference.neighbours import gaps, limits, pivot
from bingham.inference.result import axes_of, check_choice
from bingham.notebook import Tabled
from bingham.validation import as_generator, check_number, integer

__all__ = ["ConcentrationIntervals", "concentration_intervals"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ConcentrationIntervals(Tabled):
    """Intervals low ≤ zᵢ ≤ high, each (..., d), of the i-th smallest concentration; the last is 0 by convention.

    ``estimate`` (..., d) are theirs, ascending. Where intervals overlap, ends need not ascend.
    """

    estimate: FloatArray
    low: FloatArray
    high: FloatArray
    level: float
    method: str


def concentration_intervals(
    x: ArrayLike,
    level: float = 0.95,
    method: Literal["profile", "bootstrap"] = "profile",
    *,
    resamples: int = 999,
    rng: Any = None,
) -> ConcentrationIntervals:
    """Return confidence intervals of the concentrations of a Bingham distribution.

    Parameters
    ----------
    x : (..., n, d) array_like
        Unit vectors whose signs do not matter, n > d.
    level : float
        Probability of each interval, in (0, 1).
    method : {"profile", "bootstrap"}
        "profile": all c that the likelihood of the concentrations alone does not reject as zᵢ: the signed root of its
        ratio, less its skewness, within limits that depend on the gaps between the sample's concentrations
        (``bingham.inference.neighbours``). Its maximum is the bias-corrected estimate. "bootstrap": bias-corrected,
        accelerated intervals of `scipy.stats.bootstrap` about the same estimate, axes drawn with replacement; for one
        sample, and only for large ones: their coverage at small n was not simulated.
    resamples : int
        Number of bootstrap samples.
    rng : None, int or numpy.random.Generator
        Passed to ``numpy.random.default_rng``.

    Notes
    -----
    The i-th interval holds the i-th smallest of the true concentrations, counted with their multiplicity, with
    probability `level`; each interval by itself, not all at once. Where concentrations are equal, several intervals are
    for the same number. By simulation "profile" holds it in 0.93 to 0.965 of samples at level 0.95, for d = 3 and 4
    and 10 axes or more, whether concentrations are equal, near or far apart; of 100 intervals for concentrations drawn
    at random three are outside, the worst at 0.925. For d = 5 it is 0.92 to 0.97, for uniform axes up to 0.985; at
    level 0.9 it is 0.89 to 0.94, at 0.99 it is 0.97 to 0.995. An interval that ends at 0 does not exclude a girdle.

    Examples
    --------
    >>> x = Bingham([-20.0, -9.0, 0.0], np.eye(3)).rvs(30, rng=4)
    >>> result = concentration_intervals(x)
    >>> result.low.round(1), result.high.round(1)
    (array([-37. , -21.2,   0. ]), array([-11.7,  -7.1,   0. ]))
    """
    check_number(level, "level", "a probability between 0 and 1", above=0.0)
    if level >= 1.0:
        raise InvalidArgumentError("level", "a probability between 0 and 1", level, "0.95 for 95 %")
    check_choice(method, "method", ("profile", "bootstrap"))
    a = axes_of(x, "x", 3)
    n, d = a.shape[-2:]
    if n <= d:
        raise InvalidArgumentError("x", f"more than d = {d} axes", n)
    if method == "bootstrap":
        if a.ndim > 2:
            raise InvalidArgumentError("x", "one sample (n, d) for the bootstrap", a.shape)
        return _bootstrap(a, level, integer(resamples, "resamples", 1), rng)
    fitted = Bingham.fit(a)
    shape = fitted.shape
    w = fitted.axis_moments.reshape(-1, d)
    z, best = marginal_fit(w, n, np.array(fitted.z.reshape(-1, d)))
    best = np.atleast_1d(best)
    low, high = np.zeros_like(z), np.zeros_like(z)
    goal = float(np.sqrt(chdtri(1, 1.0 - level)))
    near = gaps(fitted.z.reshape(-1, d), w, n)
    for k in range(d - 1):
        at = partial(pivot, k, z=z, w=w, n=n, best=best, bounds=limits(k, near))
        low[:, k] = _end(at, -1.0, z[:, k], goal)
        high[:, k] = _end(at, 1.0, z[:, k], goal)
    return ConcentrationIntervals(
        z.reshape(*shape, d), low.reshape(*shape, d), high.reshape(*shape, d), level, "profile"
    )


def _end(at: Callable[[FloatArray], FloatArray], side: float, z: FloatArray, goal: float) -> FloatArray:
    """Return the c (R,) below z (side −1) or above it (R,) where the pivot `at` reaches `goal` (side −1) or −`goal`.

    The secant method on the pivot, nearly linear in log |c|, kept within the bracket found so far.
    """

    def beyond(c: FloatArray) -> FloatArray:
        return -side * at(c) - goal

    # In t = log(c₀ − c) with c₀ a hair above 0, where every concentration may end.
    offset = 1e-3
    inner = np.log(offset - z)
    at_inner = beyond(z)
    reached = np.zeros(len(z), dtype=bool)
    if side > 0.0:
        outer = np.full(len(z), np.log(offset))
        reached = beyond(np.zeros(len(z))) <= 0.0
    else:
        outer = np.log(offset - z + np.maximum(-z, 2.0))
        for _ in range(60):
            short = beyond(offset - np.exp(outer)) < 0.0
            if not short.any():
                break
            outer = np.where(short, outer + 1.0, outer)
    a, fa, b, fb = inner, at_inner, outer, beyond(np.minimum(offset - np.exp(outer), 0.0))
    for step in range(60):
        # Every third step halves the bracket, lest one end never moves.
        t = 0.5 * (a + b) if step % 3 == 2 else a - fa * (b - a) / np.where(fb - fa == 0.0, 1.0, fb - fa)
        t: FloatArray = np.clip(t, np.minimum(a, b), np.maximum(a, b))
        f = beyond(np.minimum(offset - np.exp(t), 0.0))
        inside = f < 0.0
        a, fa = np.where(inside, t, a), np.where(inside, f, fa)
        b, fb = np.where(inside, b, t), np.where(inside, fb, f)
        if np.all(reached | (np.abs(b - a) < 1e-6) | (np.abs(f) < 1e-6)):
            break
    return np.where(reached, 0.0, np.minimum(offset - np.exp(_nearer(a, fa, b, fb)), 0.0))


def _nearer(a: FloatArray, fa: FloatArray, b: FloatArray, fb: FloatArray) -> FloatArray:
    return np.where(np.abs(fa) < np.abs(fb), a, b)


def _bootstrap(x: FloatArray, level: float, resamples: int, rng: Any) -> ConcentrationIntervals:
    from scipy.stats import bootstrap

    n, d = x.shape
    smallest = 1e-3 * Bingham.fit(x).axis_moments[0]

    def estimate(rows: NDArray[np.int64], axis: int = -1) -> FloatArray:
        samples = x[np.moveaxis(rows, axis, -1)]
        w = np.linalg.eigvalsh(np.swapaxes(samples, -1, -2) @ samples / rows.shape[axis])
        # A resample of few different axes has no spread along some axis; a hair of it keeps its estimate finite.
        w = np.maximum(w, smallest)
        w = (w / w.sum(axis=-1, keepdims=True)).reshape(-1, d)
        from bingham.distributions.normalizer import solve_moments

        z = marginal_fit(w, rows.shape[axis], solve_moments(w)[0])[0]
        return np.moveaxis(z[:, :-1].reshape(*samples.shape[:-2], d - 1), -1, 0)

    options: dict[str, Any] = {"n_resamples": resamples, "confidence_level": level, "vectorized": True, "method": "BCa"}
    with np.errstate(all="ignore"):  # degenerate samples are told below
        result = bootstrap((np.arange(n),), estimate, rng=as_generator(rng), **options)
    interval = result.confidence_interval
    if not np.all(np.isfinite([interval.low, interval.high])):
        raise InvalidArgumentError("method", "'profile' for a sample whose moments are alike", "'bootstrap'")
    z = np.append(estimate(np.arange(n)[None])[:, 0], 0.0)
    return ConcentrationIntervals(z, np.append(interval.low, 0.0), np.append(interval.high, 0.0), level, "bootstrap")
