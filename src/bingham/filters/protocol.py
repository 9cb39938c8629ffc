"""What all recursive filters of the package share, so that one study or one loop runs any of them.

Missing measurements: a z that is NaN throughout was not measured. `Filter.update` returns the state as it is, with
log_evidence 0, accepted False and reason "missing"; a z that is NaN in part is rejected. In a batch (or among several
interpretations) that holds for every row.

Time: ``dt`` is the length of the step in seconds. Motion in continuous time (`Diffusion`, `Gyroscope`, users'
functions) scales with it and may ask for it; noise that is given once per step stays what it is, whatever ``dt`` says.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.errors import InvalidArgumentError
from bingham.validation import as_array

__all__ = ["MISSING", "Filter", "HasMode", "Info", "UpdateInfo", "each_step"]


class Info(Protocol):
    """What the info of every filter's update tells; arrays (...) where a batch was updated."""

    @property
    def log_evidence(self) -> float | NDArray[np.float64]:
        """Log f(z | past), a density with respect to the measurement's own surface measure; 0 where z is missing."""
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
    """What an update says about itself.

    ``log_evidence``: log f(z | past), a density with respect to the measurement's own surface measure.
    ``nis``: −2 log of the best joint density of prior and likelihood relative to their maxima; χ² with as many
    degrees of freedom as the likelihood has rank when the distribution is narrow; NaN where z is missing.
    ``threshold``: what the gate allows (infinite without a gate). ``accepted``: whether the state was updated.
    ``reason``: why not, in words; empty otherwise.
    """

    log_evidence: float
    nis: float
    threshold: float
    accepted: bool
    reason: str


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


def each_step(
    recursive_filter: Filter[State, Info_co],
    prior: State,
    measurements: ArrayLike | Rotation,
    controls: ArrayLike | Rotation | None = None,
    steps: ArrayLike | None = None,
) -> Iterator[tuple[State, Info_co]]:
    """Predict, then update, for every row; yield the states after the updates and what these say.

    Parameters
    ----------
    recursive_filter : Filter
        Any filter of the package.
    prior : state
        Before the first prediction.
    measurements : (..., T, n) array_like or Rotation
        Rows of NaN are missing measurements.
    controls : (..., T, m) array_like or Rotation, optional
        controls[..., t, :] acts in the prediction before measurements[..., t, :].
    steps : (T,) array_like, optional
        Seconds of each prediction.

    Examples
    --------
    >>> from bingham import ScalarKalmanFilter
    >>> from bingham.filters.scalar_kalman import AngleState
    >>> prior = AngleState(np.array(0.0), np.array(1.0))
    >>> axes = [[0.6, 0.8], [np.nan, np.nan], [0.6, 0.8]]
    >>> for state, info in each_step(ScalarKalmanFilter(0.1, 0.5), prior, axes):
    ...     print(state.angle.round(3), info.reason or "seen")
    0.638 seen
    0.638 missing
    0.788 seen
    """
    z = np.asarray(as_array(measurements), dtype=np.float64)
    if z.ndim < 2:
        raise InvalidArgumentError("measurements", "shape (..., T, n), one row for each step", z.shape)
    length = z.shape[-2]
    u = None if controls is None else np.asarray(as_array(controls), dtype=np.float64)
    if u is not None and (u.ndim < 2 or u.shape[-2] != length):
        raise InvalidArgumentError("controls", f"{length} rows, one for each measurement", f"shape {u.shape}")
    dt = None if steps is None else np.asarray(steps, dtype=np.float64)
    if dt is not None and dt.shape != (length,):
        raise InvalidArgumentError("steps", f"shape ({length},), one for each measurement", dt.shape)
    state = prior
    for t in range(length):
        try:
            state = recursive_filter.predict(
                state, None if u is None else u[..., t, :], None if dt is None else float(dt[t])
            )
            state, info = recursive_filter.update(state, z[..., t, :])
        except InvalidArgumentError as error:
            error.add_note(f"in row {t} of the sequence")
            raise
        yield state, info
