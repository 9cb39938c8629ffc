"""What the distributions beside Bingham's share: one protocol, weighted samples, and the choice between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammaln

from bingham.distributions.algebra import sample_rows
from bingham.distributions.bingham import Bingham
from bingham.errors import BinghamError, InvalidArgumentError
from bingham.notebook import Pictured, Tabled
from bingham.validation import as_numbers

__all__ = ["DirectionalDistribution", "Fitted", "Selection", "Uniform", "select", "weighted_sample"]

FloatArray = NDArray[np.float64]


class DirectionalDistribution(Protocol):
    """Distribution of unit vectors x (d,) with a density with respect to surface area."""

    @property
    def dim(self) -> int:
        """Ambient dimension d."""
        ...

    @property
    def parameter_count(self) -> int:
        """Number of free parameters."""
        ...

    def logpdf(self, x: ArrayLike) -> Any:
        """Return log f(x) (...) of unit vectors (..., d)."""
        ...

    def rvs(self, size: int, *, rng: Any = None) -> FloatArray:
        """Return exact, independent samples (size, d)."""
        ...

    @classmethod
    def fit(cls, x: ArrayLike, weights: ArrayLike | None = None) -> Self:
        """Return the distribution of greatest likelihood for unit vectors (n, d)."""
        ...


def weighted_sample(x: ArrayLike, weights: ArrayLike | None) -> tuple[FloatArray, FloatArray]:
    """Return unit rows (n, d) of one sample and their weights (n,), sum 1.

    Raises
    ------
    InvalidArgumentError
        If x is no sample of unit vectors or the weights are no non-negative numbers for them.
    """
    a = sample_rows(x)
    if a.ndim != 2 or len(a) == 0:
        raise InvalidArgumentError("x", "one sample of unit vectors, shape (n, d)", a.shape)
    if weights is None:
        return a, np.full(len(a), 1.0 / len(a))
    w = as_numbers(weights, "weights")
    if w.shape != (len(a),) or not (np.all(w >= 0.0) and 0.0 < w.sum() < np.inf):
        raise InvalidArgumentError("weights", f"{len(a)} finite, non-negative numbers, not all zero", w)
    return a, w / w.sum()


@dataclass(frozen=True, slots=True)
class Uniform(Pictured):
    """The uniform distribution on S^{d−1}, the one without parameters."""

    dim: int
    parameter_count: int = 0

    @classmethod
    def fit(cls, x: ArrayLike, weights: ArrayLike | None = None) -> Self:
        """Return the uniform distribution of the dimension of x (n, d)."""
        return cls(weighted_sample(x, weights)[0].shape[1])

    def logpdf(self, x: ArrayLike) -> Any:
        """Return −log area (...) for x (..., d)."""
        d = self.dim
        area = math.log(2.0) + 0.5 * d * math.log(math.pi) - float(gammaln(0.5 * d))
        return np.full(np.shape(x)[:-1], -area)[()]

    def pdf(self, x: ArrayLike) -> Any:
        """Return 1/area (...) for x (..., d)."""
        return np.exp(self.logpdf(x))

    def rvs(self, size: int, *, rng: Any = None) -> FloatArray:
        """Return independent samples (size, d)."""
        return Bingham.uniform(self.dim).rvs(size, rng=rng)


class Fitted(NamedTuple):
    """One distribution fitted to a sample."""

    name: str
    distribution: Any
    parameter_count: int
    log_likelihood: float
    aic: float
    bic: float


@dataclass(frozen=True, slots=True)
class Selection(Tabled):
    """Distributions fitted to one sample, best first; ``failed`` says why others could not be fitted."""

    criterion: str
    ranking: tuple[Fitted, ...]
    failed: dict[str, str]

    @property
    def best(self) -> Fitted:
        """The first of the ranking."""
        return self.ranking[0]

    def __str__(self) -> str:
        lines = [f"{'model':<26}{'parameters':>10}{'log-likelihood':>16}{'AIC':>12}{'BIC':>12}"]
        lines += [f"{f.name:<26}{f.parameter_count:>10}{f.log_likelihood:>16.2f}{f.aic:>12.2f}{f.bic:>12.2f}"
                  for f in self.ranking]  # fmt: skip
        return "\n".join(lines)


# Name → module and class; the last three need vectors with a sign.
MODELS = {
    "uniform": ("sibling", "Uniform"),
    "watson": ("watson", "Watson"),
    "bingham": ("bingham", "Bingham"),
    "angular_central_gaussian": ("angular_central_gaussian", "AngularCentralGaussian"),
    "von_mises_fisher": ("von_mises_fisher", "VonMisesFisher"),
    "kent": ("kent", "Kent"),
    "fisher_bingham": ("fisher_bingham", "FisherBingham"),
}


def select(
    x: ArrayLike,
    models: Sequence[str] | None = None,
    criterion: Literal["bic", "aic"] = "bic",
    *,
    weights: ArrayLike | None = None,
) -> Selection:
    """Fit several distributions to unit vectors and rank them by an information criterion.

    Parameters
    ----------
    x : (n, d) array_like
        Unit vectors.
    models : sequence of str, optional
        Of "uniform", "watson", "bingham", "angular_central_gaussian" (for axes: the sign of a row does not matter),
        "von_mises_fisher", "kent" (d = 3) and "fisher_bingham" (for directions: it does). All that suit d by default.
    criterion : {"bic", "aic"}
        −2 log L + p log n (Schwarz) or −2 log L + 2p (Akaike); less is better.
    weights : (n,) array_like, optional
        Non-negative counts; n is their sum then.

    Examples
    --------
    >>> import numpy as np
    >>> x = Bingham([-20.0, -3.0, 0.0], np.eye(3)).rvs(200, rng=1)
    >>> select(x, ["uniform", "watson", "bingham"]).best.name
    'bingham'
    """
    a, w = weighted_sample(x, weights)
    if criterion not in ("bic", "aic"):
        raise InvalidArgumentError("criterion", "'bic' or 'aic'", repr(criterion))
    names = [m for m in MODELS if m != "kent" or a.shape[1] == 3] if models is None else list(models)
    if unknown := [m for m in names if m not in MODELS]:
        raise InvalidArgumentError("models", f"some of {', '.join(MODELS)}", repr(unknown[0]))
    if not names:
        raise InvalidArgumentError("models", "one model at least", "none")
    n = float(len(a) if weights is None else np.sum(as_numbers(weights, "weights")))
    fitted: list[Fitted] = []
    failed: dict[str, str] = {}
    for name in names:
        module, kind = MODELS[name]
        try:
            model = getattr(import_module(f"bingham.distributions.{module}"), kind).fit(a, w)
        except BinghamError as error:
            failed[name] = str(error)
            continue
        d = a.shape[1]
        count = d * (d + 1) // 2 - 1 if name == "bingham" else model.parameter_count
        value = n * float(w @ model.logpdf(a))
        fitted.append(Fitted(name, model, count, value, 2.0 * count - 2.0 * value, count * math.log(n) - 2.0 * value))
    if not fitted:
        raise InvalidArgumentError("x", "a sample that some model fits", "; ".join(failed.values()))
    return Selection(criterion, tuple(sorted(fitted, key=lambda f: getattr(f, criterion))), failed)
