"""Whether the uncertainty that filters state is right: probabilities of errors, coverage, uniformity.

Unknown truths: what gives a number for each truth gives NaN for a row of NaN; what summarises rejects NaN.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import erf, gammainc

from bingham.distributions.bingham import Bingham
from bingham.distributions.normalizer import log_normalizer
from bingham.errors import InvalidArgumentError
from bingham.metrics.error import geodesic_error, known

__all__ = [
    "angle_probability",
    "chi_square_probability",
    "coverage",
    "normal_probability",
    "uniformity_statistic",
]

FloatArray = NDArray[np.float64]

NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)


def angle_probability(distribution: Bingham, truth: ArrayLike) -> FloatArray:
    """Return P(angle(x, ±mode) ≤ angle(truth, ±mode)) (...), x ~ distribution: the PIT of the angle.

    Uniform on [0, 1] over many truths if the distribution is right. With t = arccos |xᵀ mode| its density is
    2 sin^{d−2}t F_{d−1}(z_rest sin²t)/F(z).

    Parameters
    ----------
    distribution : Bingham
        A distribution or a batch (...).
    truth : (..., d) array_like
        Unit vectors, broadcast against the batch. A row of NaN is unknown and gives NaN.

    Raises
    ------
    InvalidArgumentError
        If the shapes do not fit together, or a truth has not unit length.
    """
    angle = geodesic_error(distribution.mode, truth)
    shape, d = angle.shape, distribution.dim
    angle = np.atleast_1d(angle).ravel()
    z = np.broadcast_to(distribution.z, (*shape, d)).reshape(-1, d)
    log_f = np.broadcast_to(distribution.log_normalizer, shape).ravel()
    # Panels from the mode outwards, the first as wide as the narrowest axis, each next one twice as far out.
    total, left = np.where(np.isnan(angle), np.nan, 0.0), np.zeros(angle.size)
    width = 2.0 / np.sqrt(1.0 - 2.0 * z[:, 0])
    todo = np.flatnonzero(angle > 0.0)
    while todo.size:
        start = left[todo]
        half = 0.5 * (np.minimum(angle[todo], start + np.maximum(width[todo], start)) - start)
        sine = np.sin(start[:, None] + half[:, None] * (NODES + 1.0))
        rest = sine[..., None] ** 2 * z[todo, None, :-1]
        log_rest = log_normalizer(rest) if d > 2 else np.log(2.0) + rest[..., 0]
        density = 2.0 * sine ** (d - 2) * np.exp(log_rest - log_f[todo, None])
        total[todo] += half * np.sum(WEIGHTS * density, axis=-1)
        left[todo] = start + 2.0 * half
        # Beyond e^{-40} along the widest axis nothing is left; rounding may keep `left` below `angle` for ever.
        todo = todo[(left[todo] < angle[todo] * (1.0 - 1e-14)) & (-z[todo, -2] * np.sin(left[todo]) ** 2 < 40.0)]
    return np.clip(total, 0.0, 1.0).reshape(shape)


def normal_probability(error: ArrayLike, variance: ArrayLike) -> FloatArray:
    """Return P(|e| ≤ |error|) (...), e ~ N(0, variance > 0); an error of NaN, of an unknown truth, gives NaN."""
    v = np.asarray(variance, dtype=np.float64)
    if not np.all(v > 0.0):
        raise InvalidArgumentError("variance", "positive values", f"minimum {v.min():g}")
    return erf(np.abs(np.asarray(error, dtype=np.float64)) / np.sqrt(2.0 * v))


def chi_square_probability(statistic: ArrayLike, degrees: int) -> FloatArray:
    """Return P(χ² ≤ statistic) (...) with the given degrees of freedom; NaN, of an unknown truth, gives NaN."""
    x = np.asarray(statistic, dtype=np.float64)
    if not degrees > 0:
        raise InvalidArgumentError("degrees", "a positive number of degrees of freedom", degrees)
    if np.any(x < 0.0):
        raise InvalidArgumentError("statistic", "values not below 0", f"{np.nanmin(x):g}")
    return gammainc(0.5 * degrees, 0.5 * x)


def coverage(probability: ArrayLike, level: float = 0.95, axis: int | None = None) -> Any:
    """Return the share of truths inside the credible set of the given level: mean(probability ≤ level).

    Parameters
    ----------
    probability : array_like
        From `angle_probability`, `normal_probability` or `chi_square_probability`, in [0, 1]. NaN, from a truth that
        is unknown, is rejected: it is neither inside nor outside.
    level : float
        Of the set, in (0, 1).
    axis : int, optional
        Along which to take the share; over everything unless given.

    Raises
    ------
    InvalidArgumentError
        If a probability is NaN or not in [0, 1], or there is none.

    Examples
    --------
    >>> float(coverage([0.1, 0.94, 0.96, 0.5]))
    0.75
    """
    if not 0.0 < level < 1.0:
        raise InvalidArgumentError("level", "a probability in (0, 1)", level)
    return np.mean(_probabilities(probability) <= level, axis=axis)


def uniformity_statistic(probability: ArrayLike) -> float:
    """Return Kolmogorov's distance sup |empirical − uniform| of probabilities: 0 for perfect calibration.

    Probabilities as for `coverage`; one that is NaN or not in [0, 1] is rejected.
    """
    p = np.sort(_probabilities(probability).ravel())
    n = p.size
    rank = np.arange(1, n + 1)
    return float(np.maximum(rank / n - p, p - (rank - 1) / n).max())


def _probabilities(x: ArrayLike) -> FloatArray:
    p = known(x, "probability")
    if p.min() < 0.0 or p.max() > 1.0:
        raise InvalidArgumentError("probability", "values in [0, 1]", f"{p.min():g} to {p.max():g}")
    return p
