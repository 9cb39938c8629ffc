"""Filters run side by side; the one that explains the measurements best speaks (Glover & Kaelbling 2013, §6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.errors import InvalidArgumentError
from bingham.filters.protocol import Filter, Info
from bingham.filters.run import RecursiveFilter
from bingham.filters.track import Track
from bingham.validation import check_kind

__all__ = ["BankInfo", "BankState", "FilterBank"]

FloatArray = NDArray[np.float64]

START = "start from BankState([state, ...])"


@dataclass(frozen=True, eq=False, repr=False)
class BankState:
    """States of all members and the total log-evidence (k,) of each.

    Parameters
    ----------
    states : sequence
        One state for each filter; different priors are different hypotheses.
    log_evidence : (k,) array_like, optional
        What each has gathered so far; log prior probabilities of the hypotheses at the start, equal unless given.
        −∞ rules a hypothesis out.
    """

    states: Sequence[Any]
    log_evidence: ArrayLike | None = None

    def __post_init__(self) -> None:
        if not len(self.states):
            raise InvalidArgumentError("states", "at least one", "none")
        count = len(self.states)
        totals = np.zeros(count) if self.log_evidence is None else np.array(self.log_evidence, dtype=np.float64)
        if totals.shape != (count,):
            raise InvalidArgumentError("log_evidence", f"shape ({count},), one for each state", f"shape {totals.shape}")
        if np.isnan(totals).any() or not -np.inf < totals.max() < np.inf:
            raise InvalidArgumentError("log_evidence", "numbers below +∞, not all of them −∞", totals)
        object.__setattr__(self, "log_evidence", totals)

    def __repr__(self) -> str:
        shares = np.array2string(self.probabilities, precision=3, threshold=8)
        return f"<BankState of {len(self.states)} hypotheses with probabilities {shares}; best: {self.best}>"

    @property
    def totals(self) -> FloatArray:
        """Log-evidence (k,)."""
        return self.log_evidence  # type: ignore[return-value]

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


class BankInfo(NamedTuple):
    """What an update of a bank says about itself.

    ``log_evidence``: that of the bank as a mixture of its hypotheses. ``nis``: that of the best member. ``accepted``:
    whether any member was updated. ``reason``: why none was, in the words of the best one; empty otherwise.
    ``members``: what each says.
    """

    log_evidence: float
    nis: float
    accepted: bool
    reason: str
    members: tuple[Info, ...]


@dataclass(frozen=True)
class FilterBank(RecursiveFilter[BankState, Track[BankState]]):
    """Several filters, or one filter for several priors, fed the same measurements.

    Parameters
    ----------
    members : sequence of filters
        Any of the package, or what has their `protocol.Filter` shape; a single one serves all states.

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

    members: Sequence[Filter[Any, Info]]

    def __post_init__(self) -> None:
        if not len(self.members):
            raise InvalidArgumentError("members", "at least one filter", "none")

    def _pairs(self, state: BankState) -> list[tuple[Any, Any]]:
        check_kind(state, BankState, "state", START)
        members = list(self.members) * (len(state.states) if len(self.members) == 1 else 1)
        if len(members) != len(state.states):
            raise InvalidArgumentError("state", f"{len(members)} states, one for each filter", len(state.states))
        return list(zip(members, state.states, strict=True))

    @property
    def needs_times(self) -> bool:
        """Whether one of the members does."""
        return any(getattr(member, "needs_times", False) for member in self.members)

    @property
    def noise_per_step(self) -> bool:
        """Whether the process noise of one of the members is that of one step."""
        return any(getattr(member, "noise_per_step", False) for member in self.members)

    def _check_prior(self, prior: BankState) -> None:
        check_kind(prior, BankState, "prior", START)

    def predict(
        self, state: BankState, control: ArrayLike | Rotation | None = None, dt: float | None = None
    ) -> BankState:
        """Return the members' predictions."""
        return BankState([f.predict(s, control, dt) for f, s in self._pairs(state)], state.totals)

    def update(self, state: BankState, z: ArrayLike | Rotation, **options: Any) -> tuple[BankState, BankInfo]:
        """Return the members' posteriors; further options go to all members' ``update``."""
        results: list[tuple[Any, Info]] = [f.update(s, z, **options) for f, s in self._pairs(state)]
        infos = tuple(info for _, info in results)
        gained = np.array([info.log_evidence for info in infos])
        if gained.shape != state.totals.shape:
            raise InvalidArgumentError("state", "single states", f"evidence {gained.shape}", "one bank a recording")
        new = BankState([s for s, _ in results], state.totals + gained)
        log_evidence = float(np.logaddexp.reduce(new.totals) - np.logaddexp.reduce(state.totals))
        accepted = any(bool(info.accepted) for info in infos)
        best = infos[new.best]
        return new, BankInfo(log_evidence, float(best.nis), accepted, "" if accepted else best.reason, infos)
