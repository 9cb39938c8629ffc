"""The one loop over a sequence: checks, time steps, predict, update, track.

`RecursiveFilter` gives it to every filter as the method `run`; a filter with a compiled loop answers ``_compiled``.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.errors import BinghamError, InvalidArgumentError, RecordingWarning
from bingham.filters.protocol import Filter, Info, State
from bingham.filters.track import ACCEPTED, MISSING, REJECTED, BinghamTrack, Track
from bingham.recording import as_seconds
from bingham.validation import as_numbers, check_number, missing_rows

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["Keep", "RecursiveFilter", "Rows", "each_step", "run", "time_steps", "warn_of_rejections"]

FloatArray = NDArray[np.float64]
Keep = Literal["all", "modes", "last"]
TrackT = TypeVar("TrackT", bound=Track[Any])

# More than this share of the measurements rejected says that a noise, the prior or the model is wrong.
MOST = 0.5
# Fewer measurements than this say nothing.
FEW = 3


@dataclass(frozen=True, eq=False)
class Rows:
    """A sequence ready to be filtered: everything that `run` is given but the prior, checked.

    Attributes
    ----------
    measurements : (T, ...) or (..., T, n) ndarray
        NaN where missing.
    missing : (T,) or (..., T) ndarray of bool
        Rows in which nothing was measured.
    controls : ndarray or None
        Rows on the same axis.
    time, steps : (T,) ndarray or None
        Seconds of each row, and before it.
    batched : bool
        Whether the rows are on the last axis but one rather than on the first.
    keep : {"all", "modes", "last"}
        What the track keeps.
    """

    measurements: FloatArray
    missing: NDArray[np.bool_]
    controls: FloatArray | None
    time: FloatArray | None
    steps: FloatArray | None
    batched: bool
    keep: Keep

    @property
    def length(self) -> int:
        """Number of rows T."""
        return self.missing.shape[-1]

    @property
    def kept(self) -> slice:
        """The rows that the track keeps."""
        return slice(-1, None) if self.keep == "last" else slice(None)

    def at(self, t: int) -> tuple[FloatArray | None, float | None, FloatArray]:
        """Return control, seconds and measurement of row t."""
        row = (..., t, slice(None)) if self.batched else (t,)
        control = None if self.controls is None else self.controls[row]
        return control, None if self.steps is None else float(self.steps[t]), self.measurements[row]


class RecursiveFilter(ABC, Generic[State, TrackT]):
    """Base of the filters: write `predict` and `update` and there is `run`.

    The properties say what `run` may ask of the filter; they are all False unless overridden.
    """

    @property
    def batched(self) -> bool:
        """Whether `predict` and `update` take leading batch axes, so that `run` takes measurements (..., T, n)."""
        return False

    @property
    def several(self) -> bool:
        """Whether a measurement may be (k, n): k interpretations of an ambiguous one."""
        return False

    @property
    def needs_times(self) -> bool:
        """Whether prediction has to know the seconds that pass."""
        return False

    @property
    def noise_per_step(self) -> bool:
        """Whether the process noise is that of one step, whatever its duration: irregular times do not suit it."""
        return False

    @abstractmethod
    def predict(self, state: State, control: Any = None, dt: float | None = None) -> State:
        """Return the state one time step later, of ``dt`` seconds."""

    @abstractmethod
    def update(self, state: State, z: Any) -> tuple[State, Info]:
        """Return the state given the measurement z, NaN throughout if missing, and what the update says about it."""

    def run(
        self,
        prior: State,
        measurements: ArrayLike | Rotation | tuple[ArrayLike, ...],
        *,
        controls: ArrayLike | Rotation | None = None,
        times: ArrayLike | None = None,
        start_time: float | None = None,
        keep: Keep = "all",
    ) -> TrackT:
        """Filter a whole recording: predict, then update, for every row.

        Parameters
        ----------
        prior : state
            Before the first prediction.
        measurements : (T, n) or (..., T, n) array_like, Rotation, or tuple of arrays
            One row for each `update`; a row of NaN is a missing measurement, which is predicted only. A tuple holds
            one array (T, nₛ) for each of several sensors; an array holds their columns side by side.
        controls : (T, m) or (..., T, m) array_like or Rotation, optional
            One row for each `predict`: it acts from times[k − 1] (start_time for k = 0) to times[k].
        times : (T,) array_like, optional
            Seconds of the measurements, strictly increasing, regular or not.
        start_time : float, optional
            Time of the prior, s; the time of the first measurement unless given, so that no time passes before it.
        keep : {"all", "modes", "last"}
            Every row with its state, every row without, or the last row only.

        Returns
        -------
        Track
            Continue from ``track.final`` (and ``start_time=times[-1]``) to get the identical track of an unbroken run.

        Raises
        ------
        InvalidArgumentError
            Naming the argument, and in its notes the row; where times are irregular but the noise is that of a step.

        Warns
        -----
        RecordingWarning
            If a gate rejects more than half of the measurements.
        """
        track = run(self, prior, measurements, controls=controls, times=times, start_time=start_time, keep=keep)
        return cast(TrackT, track)

    def _check_prior(self, prior: State) -> None:
        """Raise if the prior is no state of this filter."""

    def _measurements(self, measurements: Any) -> tuple[FloatArray, NDArray[np.bool_] | None]:
        """Return the rows as float64, and which are missing, or None where NaN throughout says it."""
        if isinstance(measurements, tuple):
            raise InvalidArgumentError(
                "measurements", "one array with the rows", f"a tuple of {len(measurements)}",
                "tuples are for filters with several sensors",
            )  # fmt: skip
        return as_numbers(measurements, "measurements"), None

    def _compiled(self, prior: State, rows: Rows) -> Track[State] | None:
        """Return the track of a compiled loop, or None where there is none for these models."""
        return None


def time_steps(times: ArrayLike, start_time: float | None, count: int) -> FloatArray:
    """Return the seconds (T,) before each of ``count`` times, the first counted from start_time."""
    if start_time is not None:
        check_number(start_time, "start_time", "a finite time, s")
    t = as_seconds(times, "times")
    if t.shape != (count,):
        raise InvalidArgumentError("times", f"shape ({count},), one for each measurement", t.shape)
    steps = np.diff(t, prepend=t[:1] if start_time is None else start_time)
    wrong = np.flatnonzero(~np.isfinite(t) | ~(steps > 0.0))
    wrong = wrong[(wrong > 0) | ~(steps[wrong] == 0.0)]
    if wrong.size:
        i = int(wrong[0])
        raise InvalidArgumentError(
            "times",
            "strictly increasing seconds, from start_time on",
            f"{float(t[i])!r} at row {i}",
            "sort the rows and drop repeated ones",
        )
    return steps


def run(
    recursive_filter: Filter[State, Info],
    prior: State,
    measurements: ArrayLike | Rotation | tuple[ArrayLike, ...],
    *,
    controls: ArrayLike | Rotation | None = None,
    times: ArrayLike | None = None,
    start_time: float | None = None,
    keep: Keep = "all",
) -> Track[State]:
    """Filter a recording with anything that has `predict` and `update`; see `RecursiveFilter.run`."""
    rows = _checked(recursive_filter, prior, measurements, controls, times, start_time, keep)
    track: Track[State] | None = None
    if isinstance(recursive_filter, RecursiveFilter):
        track = recursive_filter._compiled(prior, rows)
    if track is None:
        track = _run_rows(recursive_filter, prior, rows)
    warn_of_rejections(track)
    return track


def each_step(
    recursive_filter: Filter[State, Any],
    prior: State,
    measurements: ArrayLike | Rotation | tuple[ArrayLike, ...],
    *,
    controls: ArrayLike | Rotation | None = None,
    times: ArrayLike | None = None,
    start_time: float | None = None,
) -> Iterator[tuple[State, Any]]:
    """Predict, then update, for every row; yield the states after the updates and what these say.

    Parameters are those of `RecursiveFilter.run`, of which this is the loop.

    Examples
    --------
    >>> from bingham.baselines import AngleState, ScalarKalmanFilter
    >>> prior = AngleState(np.array(0.0), np.array(1.0))
    >>> axes = [[0.6, 0.8], [np.nan, np.nan], [0.6, 0.8]]
    >>> for state, info in each_step(ScalarKalmanFilter(0.1, 0.5), prior, axes):
    ...     print(state.angle.round(3), info.reason or "seen")
    0.638 seen
    0.638 missing
    0.788 seen
    """
    yield from _each(
        recursive_filter, prior, _checked(recursive_filter, prior, measurements, controls, times, start_time, "last")
    )


def _each(recursive_filter: Filter[State, Any], prior: State, rows: Rows) -> Iterator[tuple[State, Any]]:
    state = prior
    for t in range(rows.length):
        control, dt, z = rows.at(t)
        try:
            state = recursive_filter.predict(state, control, dt)
            state, info = recursive_filter.update(state, z)
        except BinghamError as error:
            error.add_note(f"in row {t} of the sequence")
            raise
        yield state, info


def _checked(
    recursive_filter: Any, prior: Any, measurements: Any, controls: Any, times: Any, start_time: Any, keep: Any
) -> Rows:
    if keep not in ("all", "modes", "last"):
        raise InvalidArgumentError("keep", "'all', 'modes' or 'last'", repr(keep))
    known = isinstance(recursive_filter, RecursiveFilter)
    if known:
        recursive_filter._check_prior(prior)
        z, missing = recursive_filter._measurements(measurements)
    else:
        z, missing = as_numbers(measurements, "measurements"), None
    batched, several = (getattr(recursive_filter, name, False) for name in ("batched", "several"))
    shape = "(..., T, n)" if batched else "(T, n) or (T, k, n)" if several else "(T, n)"
    if z.ndim < 2 or (z.ndim > (3 if several else 2) and not batched):
        hint = "run the recordings of a batch one by one" if z.ndim > 2 else ""
        raise InvalidArgumentError("measurements", f"shape {shape}, one row for each step", z.shape, hint)
    length = z.shape[-2 if batched else 0]
    if not length:
        raise InvalidArgumentError("measurements", f"shape {shape} with T >= 1", "no rows")
    if missing is None:
        missing = missing_rows(z, "measurements")
        if z.ndim == 3 and not batched:
            missing = np.asarray(missing.all(axis=1))
    u = None if controls is None else as_numbers(controls, "controls")
    if u is not None and (u.ndim < 1 + batched or u.shape[-2 if batched else 0] != length):
        raise InvalidArgumentError("controls", f"{length} rows, one for each measurement", f"shape {u.shape}")
    steps = _steps(recursive_filter, times, start_time, length)
    time = None if times is None else np.array(times, dtype=np.float64)
    return Rows(z, missing, u, time, steps, batched, keep)


def _steps(recursive_filter: Any, times: Any, start_time: Any, length: int) -> FloatArray | None:
    if times is None:
        if getattr(recursive_filter, "needs_times", False):
            raise InvalidArgumentError("times", "seconds of each measurement, for motion in continuous time", None)
        if start_time is not None:
            raise InvalidArgumentError("start_time", "None where no times are given", start_time)
        return None
    steps = time_steps(times, start_time, length)
    irregular = length > 2 and np.ptp(steps[1:]) > 1e-3 * steps[-1]
    if irregular and getattr(recursive_filter, "noise_per_step", False):
        raise InvalidArgumentError(
            "times",
            "regular times for a noise given once per step",
            f"steps of {steps[1:].min():.3g} to {steps[1:].max():.3g} s",
            "use models.motion.Diffusion or Gyroscope, or per_second=True of a Kalman filter: they scale with time",
        )
    return steps


def _run_rows(recursive_filter: Filter[State, Any], prior: State, rows: Rows) -> Track[State]:
    states: list[State] = []
    modes: list[Any] = []
    infos: list[Any] = []
    state = prior
    for state, info in _each(recursive_filter, prior, rows):
        if rows.keep == "last":
            states, modes, infos = [], [], []
        if rows.keep != "modes":
            states.append(state)
        modes.append(state.mode)
        infos.append(info)
    axis = np.ndim(modes[0]) - 1

    def column(name: str, default: Any = np.nan) -> FloatArray:
        values = [np.asarray(getattr(info, name, default), dtype=np.float64) for info in infos]
        return np.stack(np.broadcast_arrays(*values), axis=axis)

    decision = column("decisions", ()).astype(np.int8)
    if not decision.size:
        missing = rows.missing[..., rows.kept]
        decision = np.where(missing, MISSING, np.where(column("accepted") > 0.0, ACCEPTED, REJECTED)).astype(np.int8)
    limits = [getattr(info, "threshold", np.inf) for info in infos if info.reason != "missing"]
    track = BinghamTrack if isinstance(state, Bingham) else Track
    return track(
        time=None if rows.time is None else rows.time[rows.kept],
        modes=np.stack(modes, axis=axis),
        log_evidence=column("log_evidence"),
        nis=column("nis"),
        decision=decision,
        final=state,  # pyright: ignore[reportArgumentType]
        states=_gathered(states, axis) if states else None,
        threshold=np.min(limits, axis=0) if limits else np.inf,
    )


def _gathered(states: list[Any], axis: int) -> Any:
    """Return one state with the rows as the batch axis after the others, or the list for states of another kind."""
    kind = type(states[0])
    if kind is Bingham:
        return Bingham.from_spectrum(np.stack([s.z for s in states]), np.stack([s.M for s in states]))
    return kind.stacked(states, axis) if hasattr(kind, "stacked") else states


def warn_of_rejections(track: Track[Any]) -> None:
    """Say so where a gate rejects most of what a sensor measured: it is the models that are wrong then."""
    decision = track.decision.reshape(-1, 1) if track.decision.ndim == track.log_evidence.ndim else track.decision
    decision = decision.reshape(-1, decision.shape[-1])
    for s in range(decision.shape[1]):
        measured = int(np.sum(decision[:, s] != MISSING))
        rejected = int(np.sum(decision[:, s] == REJECTED))
        if measured >= FEW and rejected > MOST * measured:
            sensor = f" of {track.sensor(s)}" if decision.shape[1] > 1 else ""
            warnings.warn(
                f"the gate rejected {rejected} of {measured} measurements{sensor}, the first in row "
                f"{int(np.argmax(decision[:, s] == REJECTED))}: is a noise too small, the prior too narrow, a unit or "
                "an axis another one, a gyroscope biased (ImuFilter takes orientations and estimates its bias)?",
                RecordingWarning,
                stacklevel=4,
            )
