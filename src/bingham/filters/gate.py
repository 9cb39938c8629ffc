"""A gate rejects measurements that the prediction and the sensor's noise together cannot explain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from scipy.special import chdtri

from bingham.errors import InvalidArgumentError
from bingham.validation import check_number, described

__all__ = ["Gate", "check_gate"]


@dataclass(frozen=True)
class Gate:
    """Accept a measurement whose NIS stays below the χ² quantile of `probability`.

    The NIS is −2 max_x log[f(x) f(z|x) / (max f · max f(z|·))] = −2 λ_max(A + L): what the best compromise
    between prediction and measurement costs. For narrow distributions it is the squared Mahalanobis distance of the
    innovation; for wide ones it is smaller, so that a vague state never rejects.

    Parameters
    ----------
    probability : float
        Share of regular measurements to let through, in (0, 1). Raising it admits more outliers.
    """

    probability: float = 0.999

    def __post_init__(self) -> None:
        check_number(self.probability, "probability", "a number in (0, 1)")
        if not 0.0 < self.probability < 1.0:
            raise InvalidArgumentError("probability", "a number in (0, 1)", self.probability)

    def threshold(self, rank: int) -> float:
        """Return the largest NIS accepted for a likelihood of the given rank."""
        return float(chdtri(rank, 1.0 - self.probability))


def check_gate(gate: Any) -> None:
    """Raise unless it is a `Gate` or None."""
    if gate is not None and not isinstance(gate, Gate):
        hint = f"write gate=Gate({gate})" if isinstance(gate, float) else "Gate(0.999)"
        raise InvalidArgumentError("gate", "a Gate", described(gate), hint)
