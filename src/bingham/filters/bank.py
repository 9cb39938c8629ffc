"""Filters run side by side; the one that explains the measurements best speaks (Glover & Kaelbling 2013, §6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError
from bingham.filters.protocol import UpdateInfo

__all__ = ["BankState", "FilterBank"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BankState:
    """States of all members and the total log-evidence (k,) of each.

    Parameters
    ----------
    states : sequence
        One state for each filter; different priors are different hypotheses.
    log_evidence : (k,) array_like, optional
        What each has gathered so far; log prior probabilities of the hypotheses at the start, equal unless given.
    """

    states: Sequence[Any]
    log_evidence: FloatArray | None = None

    @property
    def totals(self) -> FloatArray:
        """Log-evidence (k,)."""
        return np.zeros(len(self.states)) if self.log_evidence is None else self.log_evidence

    @property
    def best(self) -> int:
        """Index of the member with the highest total log-evidence."""
        return int(np.argmax(self.totals))

    @property
    def selected(self) -> Any:
        """State of the best member."""
        return self.states[self.best]

    @property
    def probabilities(self) -> FloatArray:
        """Posterior probabilities (k,) of the hypotheses."""
        return np.exp(self.totals - np.logaddexp.reduce(self.totals))

    @property
    def mode(self) -> FloatArray:
        """Mode of the best member."""
        return self.selected.mode


@dataclass(frozen=True)
class FilterBank:
    """Several filters, or one filter for several priors, fed the same measurements.

    Parameters
    ----------
    members : sequence of filters
        Any with ``predict`` and ``update`` whose info carries ``log_evidence``; a single one serves all states.

    Examples
    --------
    >>> from bingham import Bingham, BinghamFilter
    >>> near = np.eye(2)[:, ::-1]
    >>> f = BinghamFilter(Bingham([-500, 0], near), Bingham([-50, 0], near))
    >>> bank = FilterBank([f])
    >>> state = BankState([Bingham([-20, 0], near), Bingham([-20, 0], np.eye(2))])
    >>> state, info = bank.update(bank.predict(state), [0.1, 0.99498744])
    >>> state.best
    1
    """

    members: Sequence[Any]

    def __post_init__(self) -> None:
        if not len(self.members):
            raise InvalidArgumentError("members", "at least one filter", "none")

    def _pairs(self, state: BankState) -> list[tuple[Any, Any]]:
        members = list(self.members) * (len(state.states) if len(self.members) == 1 else 1)
        if len(members) != len(state.states):
            raise InvalidArgumentError("state", f"{len(members)} states, one for each filter", len(state.states))
        return list(zip(members, state.states, strict=True))

    def predict(self, state: BankState, control: ArrayLike | None = None, dt: float | None = None) -> BankState:
        """Return the members' predictions."""
        return BankState([f.predict(s, control, dt) for f, s in self._pairs(state)], state.totals)

    def update(self, state: BankState, z: ArrayLike, **options: Any) -> tuple[BankState, UpdateInfo]:
        """Return the members' posteriors; ``log_evidence`` is that of the bank as a mixture of its hypotheses."""
        results = [f.update(s, z, **options) for f, s in self._pairs(state)]
        totals = state.totals + np.array([info.log_evidence for _, info in results])
        log_evidence = float(np.logaddexp.reduce(totals) - np.logaddexp.reduce(state.totals))
        new = BankState([s for s, _ in results], totals)
        best = results[new.best][1]
        return new, UpdateInfo(log_evidence, best.statistic, np.inf, True, "")
