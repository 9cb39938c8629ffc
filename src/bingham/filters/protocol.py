"""What all recursive filters of the package share, so that one study or one loop runs any of them."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Filter", "HasMode", "UpdateInfo"]


class UpdateInfo(NamedTuple):
    """What an update says about itself.

    ``log_evidence``: log f(z | past), a density with respect to the measurement's own surface measure.
    ``statistic``: −2 log of the best joint density of prior and likelihood relative to their maxima; χ² with as many
    degrees of freedom as the likelihood has rank when the law is narrow. ``threshold``: what the gate allows (infinite
    without a gate). ``accepted``: whether the state was updated. ``reason``: why not, in words; empty otherwise.
    """

    log_evidence: float
    statistic: float
    threshold: float
    accepted: bool
    reason: str


class HasMode(Protocol):
    """A filter's state: whatever it is, it names its most probable value."""

    @property
    def mode(self) -> NDArray[np.float64]:
        """Unit vector (d,)."""
        ...


State = TypeVar("State", bound=HasMode)


class Filter(Protocol[State]):
    """A recursive filter: pure steps from state to state."""

    def predict(self, state: State, control: ArrayLike | None = None, dt: float | None = None) -> State:
        """Return the state one time step later."""
        ...

    def update(self, state: State, z: ArrayLike) -> tuple[State, Any]:
        """Return the state given the measurement z, and what the update says about itself."""
        ...
