"""What a test returns, and what the tests share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtrc, fdtrc

from bingham.distributions.algebra import sample_rows
from bingham.errors import InvalidArgumentError
from bingham.notebook import Tabled
from bingham.validation import described

__all__ = ["TestResult", "axes_of", "check_choice", "chi2_pvalue", "hotelling_pvalue", "resampled_pvalue"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TestResult(Tabled):
    """Result of a test of hypotheses.

    Parameters
    ----------
    statistic : float or (...) ndarray
        The statistic; large values speak against the hypothesis.
    pvalue : float or (...) ndarray
        Probability of a statistic as large or larger if the hypothesis holds.
    null : str
        Distribution of the statistic from which the p-value came.
    """

    __test__ = False  # no test of ours: keeps pytest from collecting it

    statistic: Any
    pvalue: Any
    null: str


def axes_of(x: Any, name: str, minimum: int) -> FloatArray:
    """Return unit vectors as rows (..., n, d), at least `minimum` of them."""
    try:
        a = sample_rows(x)
    except InvalidArgumentError as error:
        if error.argument == name:
            raise
        raise InvalidArgumentError(name, "unit vectors as rows, shape (..., n, d)", str(error)) from None
    if a.shape[-2] < minimum:
        raise InvalidArgumentError(name, f"at least {minimum} axes", f"{a.shape[-2]}")
    return a


def check_choice(x: Any, name: str, choices: tuple[str, ...]) -> None:
    """Reject what is none of the choices."""
    if x not in choices:
        got = repr(x) if isinstance(x, str) else described(x)
        raise InvalidArgumentError(name, " or ".join(map(repr, choices)), got)


def chi2_pvalue(statistic: ArrayLike, degrees: float) -> Any:
    """Return P(χ² ≥ statistic)."""
    return chdtrc(degrees, np.maximum(statistic, 0.0))[()]


def hotelling_pvalue(square: ArrayLike, n: float, p: int) -> Any:
    """Return P(T² ≥ square) of Hotelling's T² of n vectors with p components: (n − p)/(p (n − 1)) T² ~ F(p, n − p)."""
    return fdtrc(p, n - p, np.maximum(square, 0.0) * ((n - p) / (p * (n - 1))))[()]


def resampled_pvalue(statistic: ArrayLike, drawn: FloatArray) -> Any:
    """Return (1 + #{drawn ≥ statistic})/(1 + B) for drawn (B, ...): never 0, and exact for exchangeable draws."""
    value = np.asarray(statistic)
    # Permutations that repeat the sample must count in spite of rounding.
    reached = drawn >= value - 1e-12 * np.abs(value)
    return ((1 + reached.sum(axis=0)) / (1 + len(drawn)))[()]
