"""The result of filtering a sequence: `Track`, the base of every filter's, and `BinghamTrack`."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, Self, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.uncertainty import frame_required
from bingham.errors import InvalidArgumentError, MissingExtraError
from bingham.notebook import AXIS_COLOURS, curves, framed, words
from bingham.rotations import align_signs, to_rotation

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["ACCEPTED", "MISSING", "REJECTED", "BinghamTrack", "Track", "TrackMethods"]

FloatArray = NDArray[np.float64]
State = TypeVar("State")

ACCEPTED, REJECTED, MISSING = 1, 0, -1
COORDINATES = {2: ("ux", "uy"), 4: ("qw", "qx", "qy", "qz")}


class TrackMethods:
    """What every track can do with its `time`, `modes`, `log_evidence`, `nis` and `decision`; see `Track`.

    Subclasses are frozen dataclasses, without a repr of their own; they name their fields with a row for each sample.
    """

    # Fields with the rows on the axis after the batch; subclasses add theirs.
    PER_ROW: ClassVar[tuple[str, ...]] = ("time", "modes", "log_evidence", "nis", "decision", "states")
    # Fields that belong to the last row: None in a slice that leaves it out.
    AT_END: ClassVar[tuple[str, ...]] = ("final",)
    # What to call the sensors, where there are several.
    SENSORS: ClassVar[tuple[str, ...]] = ()

    time: Any
    modes: Any
    log_evidence: Any
    nis: Any
    decision: Any
    threshold: Any = np.inf

    def __len__(self) -> int:
        return self.modes.shape[-2]

    def __repr__(self) -> str:
        batch = "" if self.modes.ndim == 2 else f"{'×'.join(map(str, self.modes.shape[:-2]))} × "
        span = f", {self.time[0]:.6g} to {self.time[-1]:.6g} s" if self.time is not None and len(self.time) else ""
        evidence = np.array2string(np.asarray(self.total_log_evidence), precision=6, threshold=4)
        return (
            f"<{type(self).__name__} of {batch}{len(self)} rows, d = {self.modes.shape[-1]}{span}: {self._decided()}; "
            f"log-evidence {evidence}>"
        )

    def _decided(self) -> str:
        """Return how many measurements were accepted, rejected and missing, in words."""
        counts = [(int(x.sum()), name) for x, name in
                  ((self.accepted, "accepted"), (self.rejected, "rejected"), (self.missing, "missing"))]  # fmt: skip
        return ", ".join(f"{count} {name}" for count, name in counts if count) or "nothing"

    def _repr_html_(self) -> str:
        d = self.modes.shape[-1]
        picture = ""
        if self.modes.ndim == 2 and d == 4:
            angles = self.as_euler(degrees=True)
            picture = curves(list(angles.T), AXIS_COLOURS[::-1], half=180.0)
        elif self.modes.ndim == 2 and d == 2:
            angle = np.degrees(np.arctan2(self.modes[:, 1], self.modes[:, 0]))
            picture = curves([angle - 180.0 * np.floor((angle + 90.0) / 180.0)], AXIS_COLOURS[2:], half=90.0)
        drawn = "yaw, pitch, roll, ±180°" if d == 4 else "angle of the axis, ±90°"
        return framed(picture, words(repr(self) + (f"\ndrawn: {drawn}" if picture else "")))

    def __getitem__(self, rows: slice | int | ArrayLike) -> Self:
        """Return the track of some rows: a slice, a mask (T,) or indices."""
        chosen = np.arange(len(self))[rows if isinstance(rows, slice) else np.atleast_1d(np.asarray(rows))]  # type: ignore[index]
        batch = self.modes.ndim - 2
        values = {f.name: getattr(self, f.name) for f in fields(cast(Any, self))}
        for name in self.PER_ROW:
            if values.get(name) is not None:
                values[name] = _rows(values[name], 0 if name == "time" else batch, rows, chosen)
        if not len(chosen) or chosen[-1] != len(self) - 1:
            states = getattr(self, "states", None)
            values |= dict.fromkeys(self.AT_END)
            values["final"] = _state(states, batch, int(chosen[-1])) if states is not None and len(chosen) else None
        return type(self)(**values)

    def between(self, start: float, end: float) -> Self:
        """Return the track of the rows with start ≤ time < end, s."""
        if self.time is None:
            raise InvalidArgumentError("track", "one with times", "none", "give times= to run, or slice by rows")
        for name, value in (("start", start), ("end", end)):
            if not value == value:
                raise InvalidArgumentError(name, "a time, s", value)
        return self[slice(*np.searchsorted(self.time, [start, end]).tolist())]

    @property
    def accepted(self) -> NDArray[np.bool_]:
        """Rows (..., T) something of which was used and nothing rejected."""
        return _over_sensors(np.any, self.decision == ACCEPTED, self.log_evidence) & ~self.rejected

    @property
    def rejected(self) -> NDArray[np.bool_]:
        """Rows (..., T) of which the gate rejected something."""
        return _over_sensors(np.any, self.decision == REJECTED, self.log_evidence)

    @property
    def missing(self) -> NDArray[np.bool_]:
        """Rows (..., T) in which nothing was measured."""
        return _over_sensors(np.all, self.decision == MISSING, self.log_evidence)

    @property
    def total_log_evidence(self) -> Any:
        """Log-probability density of all measurements (...): the sum of `log_evidence`."""
        return self.log_evidence.sum(axis=-1)

    @property
    def aligned_modes(self) -> FloatArray:
        """Modes (T, d) with signs chosen so that neighbours agree."""
        return align_signs(self.modes)

    @property
    def rotations(self) -> Rotation:
        """Modes as a SciPy `Rotation`, d = 4; rows without an estimate are not allowed: slice them away."""
        self._check_rotations()
        if np.isnan(self.modes).any():
            raise InvalidArgumentError(
                "track", "an estimate in every row", f"{int(np.isnan(self.modes[..., 0]).sum())} without one",
                "track[np.isfinite(track.modes[:, 0])].rotations",
            )  # fmt: skip
        return to_rotation(self.modes)

    def as_euler(self, sequence: str = "ZYX", *, degrees: bool = False) -> FloatArray:
        """Return angles (..., T, 3), rad or degrees, as `Rotation.as_euler`; NaN where there is no estimate.

        Parameters
        ----------
        sequence : str
            Capitals for rotations about the body's axes, one after the other: "ZYX" is yaw, pitch, roll; lower case
            for the world's.
        degrees : bool
            True for degrees.
        """
        self._check_rotations()
        q = self.modes.reshape(-1, 4)
        known = np.isfinite(q[:, 0])
        angles = np.full((len(q), 3), np.nan)
        if known.any():
            angles[known] = to_rotation(q[known]).as_euler(sequence, degrees=degrees)
        return angles.reshape(*self.modes.shape[:-1], 3)

    def reasons(self) -> list[str]:
        """Why something of each row was not used; empty where all was (single sequences)."""
        if self.modes.ndim != 2:
            raise InvalidArgumentError("track", "a single sequence", f"{self.modes.shape[:-2]} sequences")
        decision, nis = self.decision.reshape(len(self), -1), self.nis.reshape(len(self), -1)
        limits = np.broadcast_to(self.threshold, decision.shape[1:])
        words = np.where(self.missing, "missing", "").tolist()
        for t, s in zip(*np.nonzero(decision == REJECTED), strict=True):
            what = f"NIS {nis[t, s]:.4g} above {limits[s]:.4g}" if np.isfinite(nis[t, s]) else "rejected"
            words[t] += ("; " if words[t] else "") + (f"{self.sensor(s)}: {what}" if decision.shape[1] > 1 else what)
        return words

    def sensor(self, index: int) -> str:
        """Return what messages call a sensor."""
        return self.SENSORS[index] if self.SENSORS else f"sensor {index + 1}"

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return what `to_dataframe` shows: column name → values (..., T); subclasses add theirs."""
        d = self.modes.shape[-1]
        out: dict[str, NDArray[Any]] = {}
        if self.time is not None:
            out["time_s"] = np.broadcast_to(self.time, self.log_evidence.shape)
        names = COORDINATES.get(d, tuple(f"x{i + 1}" for i in range(d)))
        out |= {name: self.modes[..., i] for i, name in enumerate(names)}
        out["log_evidence"] = self.log_evidence
        if self.nis.ndim == self.log_evidence.ndim:
            out["nis"] = self.nis
        else:
            out |= {f"nis_{s + 1}": self.nis[..., s] for s in range(self.nis.shape[-1])}
        return out | {"accepted": self.accepted, "missing": self.missing}

    def to_dataframe(self) -> Any:
        """Return a `pandas.DataFrame` with a row for each step; with a column ``sequence`` where there are several.

        Raises
        ------
        MissingExtraError
            If pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError:
            raise MissingExtraError("pandas", "io", "to_dataframe") from None
        columns = {name: np.ravel(values) for name, values in self.columns().items()}
        if self.modes.ndim > 2:
            batch = self.modes.shape[:-2]
            columns = {"sequence": np.repeat(np.arange(int(np.prod(batch))), len(self))} | columns
        return pd.DataFrame(columns)

    def plot(self, ax: Any = None) -> Any:
        """Draw yaw, pitch and roll, or the angle of an axis in the plane, degrees, over time; return the axes.

        ``bingham.plot.plot_track`` draws the whole figure.
        """
        from importlib import import_module

        # Drawing stands above filters in the layers: loaded by name, and only by those who ask for it.
        return import_module("bingham.plot.angles").plot_angles(self, ax)

    def report(self, path: Any = None, **more: Any) -> Any:
        """Return a page to look at, `bingham.report.Report`, written to `path` if one is given; notebooks show it.

        Keywords as for `bingham.report.report_track`: ``title``, ``truth``, ``summary``, ….
        """
        from importlib import import_module

        self._check_rotations()
        return import_module("bingham.report").report_track(self, path, **more)

    def _check_rotations(self) -> None:
        if self.modes.shape[-1] != 4:
            raise InvalidArgumentError("track", "rotations, d = 4", f"d = {self.modes.shape[-1]}")


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Track(TrackMethods, Generic[State]):
    """Estimates over time; leading batch axes (...) where several sequences were filtered at once.

    ``track[100:200]`` and ``track[mask]`` are tracks of those rows, ``track.between(2.0, 3.0)`` one of those seconds.

    Attributes
    ----------
    time : (T,) ndarray or None
        Seconds, where times were given.
    modes : (..., T, d) ndarray
        Most probable values, signs as the filter left them; see `aligned_modes`.
    log_evidence : (..., T) ndarray
        log f(zₜ | z₁ … zₜ₋₁); 0 where the measurement is missing.
    nis : (..., T) or (..., T, S) ndarray
        Normalised innovation squared of each measurement, of each of S sensors; NaN where it is missing.
    decision : int8 ndarray, shape as `nis`
        1 accepted, 0 rejected by the gate, −1 missing.
    final : state
        The last state: running on from it continues the track bit for bit. None in a slice that ends elsewhere and has
        no states.
    states : batch or list of states, optional
        One state for each row; None with ``keep="modes"``.
    threshold : float or (S,) ndarray
        The largest NIS that the gate accepts; infinite without one.
    """

    time: FloatArray | None
    modes: FloatArray
    log_evidence: FloatArray
    nis: FloatArray
    decision: NDArray[np.int8]
    final: State
    states: Any = None
    threshold: float | FloatArray = np.inf


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class BinghamTrack(Track[Bingham]):
    """Filtered Bingham distributions over time; `states`, or `distributions`, is one batch (..., T)."""

    @property
    def distributions(self) -> Bingham:
        """All distributions as one batch (..., T)."""
        if self.states is None:
            raise InvalidArgumentError("keep", "'all' for distributions of every row", "'modes'")
        return self.states

    @property
    def concentrations(self) -> FloatArray:
        """Concentrations z of each distribution (..., T, d), ascending."""
        return self.distributions.z

    @property
    def frames(self) -> FloatArray:
        """M of each distribution (..., T, d, d); column i is the axis of zᵢ."""
        return self.distributions.M

    @property
    def matrices(self) -> FloatArray:
        """A = M diag(z) Mᵀ (..., T, d, d)."""
        return self.distributions.matrix

    @frame_required
    def covariance(self, *, frame: Literal["body", "world"], undefined: Literal["raise", "nan"] = "nan") -> FloatArray:
        """Return 3×3 covariances (..., T, 3, 3), rad²; see `Bingham.covariance`.

        Where a distribution has no clear mode its covariance is NaN, unlike that of a single distribution: the first
        ones of a track often have none. ``undefined="raise"`` rejects such tracks.
        """
        return self.distributions.covariance(frame=frame, undefined=undefined)

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return `Track.columns` and the concentrations z1 … zd."""
        out = super().columns()
        if self.states is not None:
            z = self.concentrations
            out |= {f"z{i + 1}": z[..., i] for i in range(z.shape[-1])}
        return out


def _over_sensors(reduce: Any, found: NDArray[np.bool_], rows: FloatArray) -> NDArray[np.bool_]:
    return reduce(found, axis=-1) if found.ndim > rows.ndim else found


def _rows(values: Any, axis: int, rows: Any, chosen: NDArray[np.int64]) -> Any:
    """Return the chosen rows of an array or a batch of states, with the rows on the given axis; or of a list."""
    if isinstance(values, list):
        return [values[i] for i in chosen]
    index = rows if isinstance(rows, slice) else chosen
    return values[(slice(None),) * axis + (index,)]


def _state(states: Any, axis: int, row: int) -> Any:
    return states[row] if isinstance(states, list) else states[(slice(None),) * axis + (row,)]
