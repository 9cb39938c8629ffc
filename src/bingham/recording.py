"""What filters consume: recordings of an inertial sensor or of measured orientations, validated once.

Times are float seconds, strictly increasing, and may be irregular. Everything else is given at those times:
nothing is resampled or interpolated, and a row of NaN says that there is no sample at that time. Quaternions
are Hamilton, scalar first, and turn body vectors into world vectors.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError, RecordingWarning
from bingham.validation import as_array, as_numbers, described

__all__ = [
    "Doubt",
    "ImuRecording",
    "OrientationRecording",
    "RowError",
    "amended",
    "as_seconds",
    "doubts",
    "with_covariance",
]

# Rows further from unit length than float32 rounding explains are not orientations.
UNIT_TOLERANCE = 1e-6

# Times that cannot be seconds. Seconds since any epoch in use stay far below the first, in 5138 they reach 1e11 since
# 1970; milliseconds since 1970 are above it since 2001.
NEVER_SECONDS = 1e12
# Whole numbers that usually lie more than a day apart are nanoseconds (rates up to 10 kHz), unless given as floats.
LONG_STEP = 1e5
# A gyroscope that is read so seldom tells nothing of the motion between.
LONG_GYROSCOPE_STEP = 100.0
# s between samples of a gyroscope: few are read so seldom, and milliseconds look so at up to 1 kHz.
SELDOM = 1.0
# m/s²; a resting accelerometer that reads in g shows 1.
IN_G = (0.5, 1.5)
# m/s²; what an accelerometer usually shows on Earth lies between, also one on a runner.
USUAL_FORCE = (5.0, 20.0)
# rad/s; a rate that is usually that of gravity in m/s² may be an accelerometer's.
LIKE_GRAVITY = (9.4, 10.2)
# rad/s; usual sensors for bodies end at 2000 degrees/s, which is 35, and few go further.
TOO_FAST = 40.0
# Rows of which medians and quantiles tell what is usual in a recording of any length.
ENOUGH_ROWS = 20_000
SWAPPED = "Check the order: time, gyroscope, accelerometer, magnetometer"


class RowError(InvalidArgumentError):
    """A row of a recording breaks the contract; a reader turns `index` into a place of its file."""

    def __init__(self, argument: str, index: int, expected: str, got: str, hint: str | Doubt = "") -> None:
        self.index, self.problem = index, f"expected {expected}, got {got}"
        self.doubt = hint if isinstance(hint, Doubt) else None
        hint = f"{hint.question} {hint.hint}" if isinstance(hint, Doubt) else hint
        super().__init__(argument, expected, f"{got} at index {index}", hint)


def as_seconds(values: ArrayLike, name: str = "time", longest_step: float | None = None) -> NDArray[np.float64]:
    """Return times as an own array of floats.

    Parameters
    ----------
    values : array_like, shape (N,)
        Seconds.
    name : str
        What to call them in messages.
    longest_step : float, optional
        Median step that refutes seconds, whatever the type of the numbers.

    Raises
    ------
    RowError
        If they are dates or cannot be seconds: above 1e12, or integers usually more than 1e5 apart.
    """
    raw = np.asarray(values)
    if raw.dtype.kind in "mM":
        hint = "divide by np.timedelta64(1, 's'), dates after subtracting the first"
        raise RowError(name, 0, "float seconds", f"{raw.dtype}", hint)
    time = _floats(name, values)
    if time.ndim != 1 or not len(time):
        return time
    largest = 0
    if not -NEVER_SECONDS < time.min() <= time.max() < NEVER_SECONDS:
        largest = int(np.argmax(np.where(np.isfinite(time), np.abs(time), 0.0)))
    if abs(time[largest]) >= NEVER_SECONDS and np.isfinite(time[largest]):
        units = {"ns": ("nano", "1e-9", 1e17), "us": ("micro", "1e-6", 1e14), "ms": ("milli", "1e-3", 0.0)}
        unit, (prefix, factor, _) = next(item for item in units.items() if abs(time[largest]) >= item[1][2])
        doubt = Doubt("time", f"are these {prefix}seconds?", (unit,), f"Multiply by {factor}")
        raise RowError(name, largest, "seconds", f"{time[largest]:.6g}", doubt)
    step = float(np.median(_some(np.diff(time)))) if len(time) > 1 else 0.0
    if longest_step is not None and step >= longest_step:
        doubt = Doubt("time", "are these nano- or microseconds?", ("ns", "us"), "Multiply by 1e-9 or 1e-6")
        raise RowError(name, 1, "seconds of a gyroscope", f"steps of {step:.6g}", doubt)
    if raw.dtype.kind in "iu" and step >= LONG_STEP:
        hint = "Multiply by 1e-9; seconds so far apart are taken as floats"
        doubt = Doubt("time", "are these nanoseconds?", ("ns",), hint)
        raise RowError(name, 1, "seconds", f"integers in steps of {step:.6g}", doubt)
    return time


@dataclass(frozen=True, slots=True, eq=False)
class OrientationRecording:
    """Orientations over time, each measured, estimated or true.

    Parameters
    ----------
    name : str
        What to call the recording in reports.
    time : array_like, shape (N,)
        Seconds, strictly increasing, not necessarily regular.
    orientation : array_like, shape (N, d)
        Unit vectors: d = 4, quaternions (w, x, y, z), body to world; d = 2, axes or headings in the plane.
    position : array_like, shape (N, 3), optional
        Metres, world frame; a row of NaN where unknown.
    truth : array_like, shape (N, d), optional
        True orientation at the same times; a row of NaN where unknown.
    score : array_like of bool, shape (N,), optional
        Samples that count in an error; without it all that have a truth do.
    covariance : array_like, shape (N, 3, 3), optional
        Of each orientation (d = 4) as a measurement: of a small rotation about the axes of the world, rad², its
        variances positive; NaN where unknown.
    mounting_covariance : array_like, shape (3, 3), optional
        Of an error that all orientations have in common: of a small constant rotation about the axes of the body, rad².

    Raises
    ------
    InvalidArgumentError
        If a shape, a time, a norm (beyond 1e-6) or a value does not fit.

    Examples
    --------
    >>> r = OrientationRecording("turn", [0.0, 0.5, 0.7], [[1, 0, 0, 0], [0.6, 0, 0, 0.8], [0, 0, 0, 1]])
    >>> r.size, r.dim, r.duration_s
    (3, 4, 0.7)
    """

    name: str
    time: NDArray[np.float64]
    orientation: NDArray[np.float64]
    position: NDArray[np.float64] | None = None
    truth: NDArray[np.float64] | None = None
    score: NDArray[np.bool_] | None = None
    covariance: NDArray[np.float64] | None = None
    mounting_covariance: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        time = _times(self.time)
        orientation = _rows("orientation", self.orientation, len(time), None, missing=False)
        dim = orientation.shape[1]
        if dim not in (2, 4):
            raise InvalidArgumentError("orientation", "shape (N, 2) or (N, 4)", f"shape {orientation.shape}")
        _unit("orientation", orientation)
        _store(self, time=time, orientation=orientation, score=_mask(self.score, len(time)))
        if self.position is not None:
            _store(self, position=_rows("position", self.position, len(time), 3))
        if self.truth is not None:
            truth = _rows("truth", self.truth, len(time), dim)
            _unit("truth", truth)
            _store(self, truth=truth)
        if self.covariance is not None:
            flat = np.reshape(np.asarray(self.covariance, dtype=np.float64), (len(time), -1))
            covariance = _rows("covariance", flat, len(time), 9).reshape(-1, 3, 3)
            variances = np.einsum("nii->ni", covariance)
            if (wrong := (variances <= 0.0).any(axis=1)).any():
                raise RowError("covariance", int(np.argmax(wrong)), "positive variances", "zero or less")
            known = np.where(np.isfinite(flat[:, :1, None]), covariance, np.eye(3))
            lopsided = np.abs(known - np.swapaxes(known, 1, 2)).max(axis=(1, 2)) > 1e-6 * np.einsum("nii->n", known)
            if lopsided.any():
                raise RowError("covariance", int(np.argmax(lopsided)), "symmetric matrices", "one that is not")
            if (wrong := np.linalg.eigvalsh(known)[:, 0] <= 0.0).any():
                raise RowError("covariance", int(np.argmax(wrong)), "positive definite matrices", "one that is not")
            _store(self, covariance=covariance)
        if self.mounting_covariance is not None:
            mounting = _rows("mounting_covariance", self.mounting_covariance, 3, 3, missing=False)
            if np.abs(mounting - mounting.T).max() > 1e-6 * np.trace(mounting) or np.linalg.eigvalsh(mounting)[0] < 0.0:
                expected = "a symmetric matrix without negative eigenvalues"
                raise InvalidArgumentError("mounting_covariance", expected, mounting.tolist())
            _store(self, mounting_covariance=mounting)

    @property
    def size(self) -> int:
        """Number of samples N."""
        return len(self.time)

    @property
    def dim(self) -> int:
        """Ambient dimension d of the orientations, 2 or 4."""
        return self.orientation.shape[1]

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self.time[-1] - self.time[0])

    @property
    def scored(self) -> NDArray[np.bool_]:
        """Samples to compare with `truth`, shape (N,): known truth, and `score` where given."""
        return _scored(self.truth, self.score, self.size)


@dataclass(frozen=True, slots=True, eq=False)
class ImuRecording:
    """Gyroscope samples and what was measured beside them, on the gyroscope's clock.

    A sensor with a clock or rate of its own has a row of NaN at gyroscope times that brought no new sample of it;
    a filter updates only with rows that are there.

    Parameters
    ----------
    name : str
        What to call the recording in reports.
    time : array_like, shape (N,)
        Seconds, strictly increasing, not necessarily regular.
    gyroscope : array_like, shape (N, 3)
        Angular velocity of the body about its own axes, rad/s; no NaN.
    accelerometer : array_like, shape (N, 3), optional
        Specific force in the body frame, m/s²: at rest 9.81 upwards.
    magnetometer : array_like, shape (N, 3), optional
        Magnetic field in the body frame, in any one unit.
    reference : array_like, shape (N, 4), optional
        True orientation (w, x, y, z), body to earth, at the same times.
    score : array_like of bool, shape (N,), optional
        Samples that count in an error; without it all that have a reference do.
    truth : OrientationRecording, optional
        Ground truth that has its own clock (same zero of time).
    orientations : OrientationRecording or tuple, optional
        Orientations measured beside the gyroscope at times of their own (same zero of time), by a camera, motion
        capture or a star tracker; a tuple is ``(time, quaternions)`` or ``(time, quaternions, covariance, frame)`` with
        covariances (3, 3) or (M, 3, 3), rad², about the axes of ``frame``, "body" or "world".
    earth_frame : str
        World axes of the reference: "ENU" (east, north, up), "NED" or "NWU".

    Raises
    ------
    InvalidArgumentError
        If a shape, a time, a norm (beyond 1e-6) or a value does not fit, or if the body usually turns by more than
        half a rotation in the second or more between samples.

    Warns
    -----
    RecordingWarning
        If the numbers look like milliseconds, multiples of g, degrees/s or another sensor's; they are taken as is.

    Examples
    --------
    >>> r = ImuRecording("rest", [0.0, 0.01], [[0, 0, 0], [0, 0, 0]], accelerometer=[[0, 0, 9.81], [np.nan] * 3])
    >>> r.size, r.magnetometer is None, r.accelerometer.dtype
    (2, True, dtype('float64'))
    """

    name: str
    time: NDArray[np.float64]
    gyroscope: NDArray[np.float64]
    accelerometer: NDArray[np.float64] | None = None
    magnetometer: NDArray[np.float64] | None = None
    reference: NDArray[np.float64] | None = None
    score: NDArray[np.bool_] | None = None
    truth: OrientationRecording | None = None
    earth_frame: str = "ENU"
    orientations: OrientationRecording | None = None

    def __post_init__(self) -> None:
        time = _times(self.time, LONG_GYROSCOPE_STEP)
        size = len(time)
        _store(
            self,
            time=time,
            gyroscope=_rows("gyroscope", self.gyroscope, size, 3, missing=False),
            score=_mask(self.score, size),
        )
        for name in ("accelerometer", "magnetometer"):
            if getattr(self, name) is not None:
                _store(self, **{name: _rows(name, getattr(self, name), size, 3)})
        if self.reference is not None:
            reference = _rows("reference", self.reference, size, 4)
            _unit("reference", reference)
            _store(self, reference=reference)
        if self.orientations is not None:
            _store(self, orientations=_beside(self.orientations, time))
        if self.earth_frame not in ("ENU", "NED", "NWU"):
            raise InvalidArgumentError("earth_frame", "'ENU', 'NED' or 'NWU'", repr(self.earth_frame))
        step = _usual_step(self)
        turn = step * float(np.median(np.linalg.norm(_some(self.gyroscope), axis=1)))
        if step >= SELDOM and turn > np.pi:
            got = f"steps of {step:.4g} s with {turn:.3g} rad in each"
            doubt = Doubt("time", "milliseconds?", ("ms",), "Multiply by 1e-3")
            raise RowError("time", 1, "less than half a rotation between samples", got, doubt)
        for doubt in doubts(self):
            message = f"{self.name}: {doubt.quantity}: {doubt.question} {doubt.hint}"
            warnings.warn(message, RecordingWarning, stacklevel=3)

    @property
    def size(self) -> int:
        """Number of gyroscope samples N."""
        return len(self.time)

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self.time[-1] - self.time[0])

    @property
    def scored(self) -> NDArray[np.bool_]:
        """Samples to compare with `reference`, shape (N,): known reference, and `score` where given."""
        return _scored(self.reference, self.score, self.size)


Recording = TypeVar("Recording", bound=ImuRecording | OrientationRecording)


def amended(recording: Recording, **fields: Any) -> Recording:
    """Return a recording with other values of some fields; doubts about its units are not repeated."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordingWarning)
        return replace(recording, **fields)


def _beside(given: Any, time: NDArray[np.float64]) -> OrientationRecording:
    """Return orientations measured beside a gyroscope of these times as a recording."""
    name = "orientations"
    if isinstance(given, (tuple, list)):
        given = _of_parts(*given)
    if not isinstance(given, OrientationRecording):
        hint = "a tuple (time, quaternions, covariance, frame), or OrientationRecording(name, time, orientation, ...)"
        raise InvalidArgumentError(name, "an OrientationRecording", described(given), hint)
    if given.dim != 4:
        raise InvalidArgumentError(name, "quaternions, shape (M, 4)", f"shape {given.orientation.shape}")
    if given.time[-1] < time[0] or given.time[0] > time[-1]:
        got = f"{given.time[0]:.6g} to {given.time[-1]:.6g} s"
        hint = "both clocks need the same zero and unit"
        raise InvalidArgumentError(
            name, f"times between {time[0]:.6g} and {time[-1]:.6g} s, the gyroscope's", got, hint
        )
    return given


def _of_parts(*parts: Any) -> OrientationRecording:
    """Make a recording of (time, quaternions[, covariance, frame])."""
    if len(parts) not in (2, 4):
        hint = "covariances need the axes they are about: 'body' or 'world'" if len(parts) == 3 else ""
        got = f"{len(parts)} parts"
        raise InvalidArgumentError(
            "orientations", "(time, quaternions) or (time, quaternions, covariance, frame)", got, hint
        )
    time, orientation = parts[:2]
    recording = OrientationRecording("orientations", time, as_array(orientation))  # type: ignore[arg-type]
    if len(parts) == 2:
        return recording
    return with_covariance(recording, parts[2], parts[3], "orientations")


def with_covariance(
    recording: OrientationRecording, covariance: ArrayLike, frame: str, argument: str = "covariance"
) -> OrientationRecording:
    """Return a recording of rotations with covariances (3, 3) or (N, 3, 3), rad², about the axes of `frame`."""
    if frame not in ("body", "world"):
        raise InvalidArgumentError("frame", "'body' or 'world'", repr(frame), "name the axes of the small rotation")
    size = recording.size
    c = as_numbers(covariance, argument)
    if c.shape not in ((3, 3), (size, 3, 3)):
        hint = "for the same deviation σ about all axes: σ**2 * np.eye(3)" if c.ndim < 2 else ""
        raise InvalidArgumentError(argument, f"covariances (3, 3) or ({size}, 3, 3), rad²", f"shape {c.shape}", hint)
    c = np.broadcast_to(c, (size, 3, 3))
    if frame == "body":
        from scipy.spatial.transform import Rotation  # loads slowly

        r = Rotation.from_quat(recording.orientation, scalar_first=True).as_matrix()
        c = r @ c @ np.swapaxes(r, -1, -2)
    return replace(recording, covariance=c)


class Doubt(NamedTuple):
    """A quantity whose numbers look as if they were in another unit, or another sensor's (no `units` then)."""

    quantity: str
    question: str
    units: tuple[str, ...]
    hint: str


def doubts(recording: ImuRecording) -> list[Doubt]:
    """Return which numbers look like milliseconds, multiples of g, degrees per second and other sensors'."""
    found: list[Doubt] = []
    if (step := _usual_step(recording)) >= SELDOM:
        question = f"usually {step:.4g} s between samples of a gyroscope: is it in milliseconds?"
        found.append(Doubt("time", question, ("ms",), "Multiply by 1e-3"))
    force = _some(recording.accelerometer)
    if force is not None and (there := np.isfinite(force[:, 0])).any():
        usual = float(np.median(np.linalg.norm(force[there], axis=1)))
        if IN_G[0] < usual < IN_G[1]:
            question = f"usually {usual:.3g} m/s², where gravity alone is 9.81: is it in g?"
            found.append(Doubt("accelerometer", question, ("g",), "Multiply by 9.80665"))
        elif not USUAL_FORCE[0] < usual < USUAL_FORCE[1]:
            question = f"usually {usual:.3g} m/s², where gravity alone is 9.81: another unit, or another sensor's?"
            found.append(Doubt("accelerometer", question, (), SWAPPED))
    rate = np.linalg.norm(_some(recording.gyroscope), axis=1)
    usual, fastest = float(np.median(rate)), float(np.quantile(rate, 0.99))
    if LIKE_GRAVITY[0] < usual < LIKE_GRAVITY[1]:
        question = f"usually {usual:.3g} rad/s, the number of gravity in m/s²: the accelerometer's?"
        found.append(Doubt("gyroscope", question, (), SWAPPED))
    if fastest > TOO_FAST:
        question = f"up to {fastest:.3g} rad/s, {fastest / 2 / np.pi:.0f} revolutions a second: degrees/s?"
        found.append(Doubt("gyroscope", question, ("deg_s",), "Multiply by π/180"))
    return found


def _usual_step(recording: ImuRecording) -> float:
    return float(np.median(_some(np.diff(recording.time)))) if recording.size > 1 else 0.0


def _some(rows: Any) -> Any:
    """Return as many rows, evenly spread, as what is usual needs; None of None."""
    return rows if rows is None or len(rows) < 2 * ENOUGH_ROWS else rows[:: len(rows) // ENOUGH_ROWS]


def _store(recording: object, **fields: Any) -> None:
    """Set fields of a frozen dataclass, arrays read-only."""
    for name, value in fields.items():
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
        object.__setattr__(recording, name, value)


def _floats(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Return an own C-contiguous float64 copy; of an array that nobody can write to, itself."""
    if isinstance(values, np.ndarray) and values.dtype == np.float64 and values.flags.c_contiguous:
        own = values.base is None and not values.flags.writeable
        if own:
            return values
    try:
        return np.array(values, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise InvalidArgumentError(name, "an array of numbers", type(values).__name__) from None


def _times(values: ArrayLike, longest_step: float | None = None) -> NDArray[np.float64]:
    time = as_seconds(values, "time", longest_step)
    if time.ndim != 1 or not len(time):
        raise InvalidArgumentError("time", "shape (N,) with N ≥ 1", f"shape {time.shape}")
    finite = np.isfinite(time)
    if not finite.all():
        k = int(np.argmin(finite))
        raise RowError("time", k, "finite seconds", f"{time[k]}", "remove the row")
    steps = np.diff(time)
    if not (steps > 0).all():
        k = int(np.argmax(steps <= 0)) + 1
        hint = "drop duplicates" if steps[k - 1] == 0 else "sort by time"
        raise RowError("time", k, "strictly increasing seconds", f"{time[k]} after {time[k - 1]}", hint)
    return time


def _rows(name: str, values: ArrayLike, size: int, width: int | None, *, missing: bool = True) -> NDArray[np.float64]:
    """Check `size` rows of `width` numbers, each finite or, if `missing` is legal, NaN as a whole."""
    rows = _floats(name, values)
    if rows.ndim != 2 or rows.shape[0] != size or (width is not None and rows.shape[1] != width):
        expected = f"shape ({size}, {'d' if width is None else width}), a row for each time"
        raise InvalidArgumentError(name, expected, f"shape {rows.shape}")
    if np.isfinite(rows).all():
        return rows
    legal = np.isfinite(rows).all(axis=1)
    if missing:
        legal |= np.isnan(rows).all(axis=1)
    if not legal.all():
        k = int(np.argmin(legal))
        expected = "finite numbers, or NaN in the whole row" if missing else "finite numbers"
        raise RowError(name, k, expected, f"{rows[k].tolist()}", "remove the row or complete it")
    return rows


def _unit(name: str, rows: NDArray[np.float64]) -> None:
    norm = np.linalg.norm(rows, axis=1)
    off = np.abs(norm - 1) > UNIT_TOLERANCE  # False for NaN: no sample
    if off.any():
        k = int(np.argmax(off))
        raise RowError(name, k, "unit norm", f"norm {norm[k]:.9g}", "normalise the rows")


def _mask(values: ArrayLike | None, size: int) -> NDArray[np.bool_] | None:
    if values is None:
        return None
    mask = np.array(values)
    if mask.dtype != np.bool_ or mask.shape != (size,):
        raise InvalidArgumentError("score", f"booleans of shape ({size},)", f"{mask.dtype} of shape {mask.shape}")
    return mask


def _scored(known: NDArray[np.float64] | None, score: NDArray[np.bool_] | None, size: int) -> NDArray[np.bool_]:
    if known is None:
        return np.zeros(size, dtype=np.bool_)
    valid = np.isfinite(known[:, 0])
    return valid if score is None else valid & score
