"""What all recursive filters of the package share, so that one study or one loop runs any of them.

Missing measurements: a z that is NaN throughout was not measured. `Filter.update` returns the state as it is, with
log_evidence 0, accepted False and reason "missing"; a z that is NaN in part is rejected. In a batch (or among several
interpretations) that holds for every row.

Time: ``dt`` is the length of the step in seconds. Motion in continuous time (`Diffusion`, `Gyroscope`, users'
functions) scales with it and may ask for it; noise that is given once per step stays what it is, whatever ``dt`` says.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = ["MISSING", "Filter", "HasMode", "Info", "UpdateInfo"]


class Info(Protocol):
    """What the info of every filter's update tells; arrays (...) where a batch was updated."""

    @property
    def log_evidence(self) -> float | NDArray[np.float64]:
        """Log f(z | past), a density with respect to the measurement's own surface measure; 0 where z is missing."""
        ...

    @property
    def nis(self) -> float | NDArray[np.float64]:
        """Normalised innovation squared; NaN where z is missing or the filter has none."""
        ...

    @property
    def accepted(self) -> bool | NDArray[np.bool_]:
        """Whether the state was updated."""
        ...

    @property
    def reason(self) -> str:
        """Why not: "missing" or what the gate found; empty otherwise."""
        ...


class UpdateInfo(NamedTuple):
    """What an update says about itself; of a filter with S sensors ``nis`` and ``threshold`` are (S,).

    Attributes
    ----------
    log_evidence : float
        log f(z | past), a density with respect to the measurement's own surface measure.
    nis : float or (S,) ndarray
        Normalised innovation squared: −2 log of the best joint density of prior and likelihood relative to their
        maxima; χ² with as many degrees of freedom as the likelihood has rank when the distribution is narrow; NaN
        where z is missing.
    threshold : float or (S,) ndarray
        What the gate allows; infinite without a gate.
    accepted : bool
        Whether the state was updated, and nothing of z rejected.
    reason : str
        Why not; empty otherwise.
    decisions : tuple of int
        For each of several sensors 1, accepted; 0, rejected; −1, missing.
    """

    log_evidence: float
    nis: float | NDArray[np.float64]
    threshold: float | NDArray[np.float64]
    accepted: bool
    reason: str
    decisions: tuple[int, ...] = ()


MISSING = UpdateInfo(0.0, np.nan, np.inf, False, "missing")


class HasMode(Protocol):
    """A filter's state: whatever it is, it names its most probable value."""

    @property
    def mode(self) -> NDArray[np.float64]:
        """Unit vector (d,)."""
        ...


State = TypeVar("State", bound=HasMode)
Info_co = TypeVar("Info_co", bound=Info, covariant=True)


class Filter(Protocol[State, Info_co]):
    """A recursive filter: pure steps from state to state, and what an update says about itself.

    Each filter says what arrays it takes as control and measurement z; for quaternions also SciPy's `Rotation`.
    """

    def predict(self, state: State, control: Any = None, dt: float | None = None) -> State:
        """Return the state one time step later, of ``dt`` seconds."""
        ...

    def update(self, state: State, z: Any) -> tuple[State, Info_co]:
        """Return the state given the measurement z, NaN throughout if missing, and what the update says about it."""
        ...
