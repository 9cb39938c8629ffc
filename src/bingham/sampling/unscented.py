"""Unscented transform on the sphere: the smallest symmetric point set with the right second moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.sampling.protocol import WeightedPoints, single
from bingham.validation import check_number

__all__ = ["Unscented"]


@dataclass(frozen=True)
class Unscented:
    """2d − 1 points: the mode and, for every other axis i, cos αᵢ · mode ± sin αᵢ · mᵢ.

    With ω the axis moments, the pair of axis i has the weight pᵢ = ωᵢ + (1 − λ) ω_d/(d − 1) together and the mode
    p₀ = λ ω_d; sin²αᵢ = ωᵢ/pᵢ then gives Σ w x xᵀ = E[x xᵀ] for every distribution, girdle and uniform included.

    Parameters
    ----------
    mode_share : float
        λ in [0, 1), the mode's share of its own moment; smaller gives the others more weight and smaller angles αᵢ.
    uniform : bool
        For d = 2 only: three points of weight 1/3, sin²α = 3ω₁/2.

    References
    ----------
    Gilitschenski, Kurz, Julier & Hanebeck, IEEE Trans. Autom. Control 61(1), 2016.

    Examples
    --------
    >>> from bingham.distributions.bingham import Bingham
    >>> distribution = Bingham([-30.0, -20.0, -10.0, 0.0], np.eye(4))
    >>> x, w = Unscented().sample(distribution)
    >>> x.shape, bool(np.allclose((x.T * w) @ x, distribution.moment(), atol=1e-15))
    ((7, 4), True)
    """

    mode_share: float = 0.5
    uniform: bool = False

    def __post_init__(self) -> None:
        check_number(self.mode_share, "mode_share", "a number in [0, 1)")
        if not 0.0 <= self.mode_share < 1.0:
            raise InvalidArgumentError("mode_share", "a number in [0, 1)", self.mode_share)

    def sample(self, distribution: Bingham) -> WeightedPoints:
        """Return points (2d − 1, d), the mode first, and their weights."""
        w = single(distribution).axis_moments
        d = w.size
        if self.uniform and d != 2:
            raise InvalidArgumentError("distribution", "a distribution on the circle for uniform weights", f"d = {d}",
                                       "use Unscented() or RiemannianSampling(m)")  # fmt: skip
        n = d - 1
        if self.uniform:
            pair, rest = np.array([2.0 / 3.0]), np.array([2.0 / 3.0 - w[0]])
        else:
            rest = np.full(n, (1.0 - self.mode_share) * w[n] / n)
            pair = w[:n] + rest
        y = np.zeros((2 * n + 1, d))
        y[0, n] = 1.0
        i = np.arange(n)
        # cos²α = 1 − sin²α without the cancellation.
        y[1 + i, i] = np.sqrt(w[:n] / pair)
        y[1 + i, n] = np.sqrt(rest / pair)
        y[1 + n + i, i] = -y[1 + i, i]
        y[1 + n + i, n] = y[1 + i, n]
        weights = np.concatenate(
            [[1.0 - pair.sum() if self.uniform else self.mode_share * w[n]], 0.5 * pair, 0.5 * pair]
        )
        return WeightedPoints(y @ distribution.M.T, weights)
