"""Which filter a recording gets, and what the command line lets users choose about it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from functools import partial
from time import thread_time
from typing import TYPE_CHECKING, Any

import numpy as np

from bingham.errors import InvalidArgumentError, RecordingWarning
from bingham.io.checks import note

if TYPE_CHECKING:
    from bingham.distributions.bingham import Bingham
    from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["FilterOptions", "Filtering", "fitted", "orientation_noise", "pieces_of", "renamed", "rows_of"]

WARM_UP_SAMPLES = 3
USUAL_NOISE = 0.04  # rad, the default of --measurement-noise: what a recording tells of itself takes its place
VARIED = 1.05  # ratio of variances below which one is as good as each
WIDEST_NOISE = 0.8  # rad, beyond which a covariance says nothing of an orientation
# Samples that are filtered at once: what a filter says of them, some 400 bytes each, is better kept in memory that was
# used before. Of a magnetometer the last few of a piece stay "waiting for the next update".
PIECE = 50_000


@dataclass(frozen=True)
class FilterOptions:
    """What `bingham track` passes on; noises and gate only concern recordings of orientations.

    Parameters
    ----------
    process_noise : float
        How fast the body turns away from its last orientation, rad/√s.
    measurement_noise : float
        Standard deviation of a measured orientation about each axis, rad.
    gate : float
        Share of regular measurements to let through; 1 switches the gate off.
    plain : bool
        For inertial recordings: the filter without bias estimation.
    smooth : bool
        Estimate every orientation from the whole recording.

    Raises
    ------
    InvalidArgumentError
        If a value is out of its range, named as the option that sets it.
    """

    process_noise: float
    measurement_noise: float
    gate: float
    plain: bool
    smooth: bool

    def __post_init__(self) -> None:
        for option, value in (("--process-noise", self.process_noise), ("--measurement-noise", self.measurement_noise)):
            if not 0 < value < np.inf:
                raise InvalidArgumentError(option, "a number > 0", value)
        if not 0 < self.gate <= 1:
            raise InvalidArgumentError("--gate", "a probability in (0, 1]", self.gate, "1 switches the gate off")


class Filtering:
    """Filters the pieces of one recording, one after the other, each from where the one before ended.

    Parameters
    ----------
    options : FilterOptions
        What the user chose.

    Attributes
    ----------
    name : str
        Of the filter.
    seconds : float
        Processor time that it took.
    """

    def __init__(self, options: FilterOptions) -> None:
        self.options = options
        self.name = ""
        self.seconds = 0.0
        self._run: Callable[[Any], Any] | None = None
        self._waited: tuple[int, float] | None = None
        self._awaited = "accelerometer sample"
        self._faults: dict[str, int] = {}

    def run(self, piece: ImuRecording | OrientationRecording) -> tuple[Any, Any]:
        """Return the part of a piece that has an estimate, and its track; (None, None) if there is no such part."""
        if self._run is None:
            started = self._started(piece)
            if started is None:
                return None, None
            piece = started
            self._run = self._prepared(piece)
        before = thread_time()
        track = self._run(piece)
        self.seconds += thread_time() - before
        if getattr(piece, "orientations", None) is not None and np.isnan(track.modes[0, 0]):
            return self._from_estimate(piece, track)
        return piece, track

    def _from_estimate(self, piece: Any, track: Any) -> tuple[Any, Any]:
        """Leave out what comes before the first orientation, where nothing else shows one."""
        first = int(np.argmax(np.isfinite(track.modes[:, 0])))
        if np.isnan(track.modes[first, 0]):
            return None, None
        self._waited = (first, float(piece.time[first] - piece.time[0]))
        return rows_of(piece, slice(first, None)), track[first:]

    def finish(self, name: str) -> None:
        """Raise an error if there was nothing to start with; say what was left out at the beginning."""
        if self._run is None:
            got = f"{name} without one"
            hint = "gravity shows where up is; is it called by another name? --plain follows the gyroscope alone"
            raise InvalidArgumentError("RECORDING", "at least one accelerometer sample", got, hint)
        if self._faults:
            from bingham.filters.imu import warn_of_faults

            warn_of_faults(name, self._faults)
        if self._waited is not None:
            left = f"{self._waited[0]} samples, {self._waited[1]:.3g} s, left out"
            note(name, f"no orientation before the first {self._awaited}: {left}")

    def _started(self, piece: Any) -> Any:
        """Return a piece from the sample on that the filter can start with: the accelerometer's first."""
        from bingham.recording import ImuRecording

        if not isinstance(piece, ImuRecording) or self.options.plain:
            if self.options.plain and self.options.smooth:
                raise InvalidArgumentError("--smooth", "the filter with bias", "--plain", "leave one of the two out")
            if isinstance(piece, ImuRecording) and piece.accelerometer is None:
                what = "rotations are followed from a start that nothing shows; is it called by another name?"
                note(piece.name, f"no accelerometer: {what}")
            return piece
        force = piece.accelerometer
        if piece.orientations is not None and (force is None or not np.isfinite(force[:, 0]).any()):
            self._awaited = "one that was measured"
            return piece
        known = np.zeros(0, dtype=np.int64) if force is None else np.flatnonzero(np.isfinite(force[:, 0]))
        first = int(known[0]) if len(known) else piece.size
        if first:
            count, seconds = self._waited or (0, 0.0)
            end = piece.time[min(first, piece.size - 1)]
            self._waited = (count + first, seconds + float(end - piece.time[0]))
        return rows_of(piece, slice(first, None)) if first < piece.size else None

    def _prepared(self, first: Any) -> Callable[[Any], Any]:
        """Return the filter for this kind of recording, its compiled code loaded so that timing it times it alone."""
        from bingham.recording import ImuRecording

        if not isinstance(first, ImuRecording):
            return self._orientations(first)
        return self._plain_inertial(first) if self.options.plain else self._inertial(first)

    def _inertial(self, first: ImuRecording) -> Callable[[Any], Any]:
        from bingham.filters.imu import ImuFilter

        filter_ = ImuFilter()
        smooth = self.options.smooth
        self.name = "imu, smoothed" if smooth else "imu"
        if first.accelerometer is not None:
            (filter_.smooth if smooth else filter_.run)(rows_of(first, slice(0, WARM_UP_SAMPLES)))
        state: Any = None

        def run(piece: ImuRecording) -> Any:
            nonlocal state
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RecordingWarning)  # of faults, which are said of the whole at the end
                track = filter_.smooth(piece) if smooth else filter_.run(piece, state=state)
            state = track.final
            self._faults = state.faults
            return track

        return run

    def _plain_inertial(self, first: ImuRecording) -> Callable[[Any], Any]:
        from bingham.filters.inertial import InertialFilter

        filter_ = InertialFilter()
        self.name = "inertial, plain"
        filter_.run(rows_of(first, slice(0, WARM_UP_SAMPLES)))
        state: Any = None

        def run(piece: ImuRecording) -> Any:
            nonlocal state
            track = filter_.run(piece, prior=state)
            state = track.state
            return track

        return run

    def _orientations(self, recording: OrientationRecording) -> Callable[[Any], Any]:
        from bingham.distributions.bingham import Bingham
        from bingham.filters.first_order import BinghamFilter
        from bingham.filters.gate import Gate
        from bingham.filters.smoother import smooth_fixed_interval
        from bingham.models.diffusion import Diffusion
        from bingham.models.sensors import OrientationSensor

        options = self.options
        self.name = "first-order, smoothed" if options.smooth else "first-order"
        gate = Gate(options.gate) if options.gate < 1 else None
        if (own := _own_distributions(recording, options)) is not None:
            from bingham.models.distribution_sensor import DistributionSensor

            rows = DistributionSensor.rows(own)
            each = BinghamFilter(Diffusion(options.process_noise, 4), DistributionSensor(4), gate=gate)
            return lambda whole: each.run(Bingham.uniform(4), rows, times=whole.time)
        noise = orientation_noise("--measurement-noise", _measured_noise(recording, options), recording.dim)
        filter_ = BinghamFilter(
            Diffusion(options.process_noise, recording.dim),
            OrientationSensor(noise),
            gate=gate,
        )
        prior = Bingham.uniform(recording.dim)
        run = partial(smooth_fixed_interval, filter_) if options.smooth else filter_.run
        start = slice(0, WARM_UP_SAMPLES)
        run(prior, recording.orientation[start], times=recording.time[start])
        return lambda whole: run(prior, whole.orientation, times=whole.time)


def _own_distributions(recording: OrientationRecording, options: FilterOptions) -> Bingham | None:
    """Return the distribution of every measurement by its own covariance; None where they have none, or all the same.

    Covariances that are unknown are taken for the median, variances of angles beyond `WIDEST_NOISE` for that.
    """
    from bingham.distributions.bingham import Bingham

    c = recording.covariance
    if c is None or options.smooth or options.measurement_noise != USUAL_NOISE or recording.dim != 4:
        return None
    known = np.isfinite(c).all(axis=(1, 2))
    variances, axes = np.linalg.eigh(c[known])
    if not known.any() or (variances <= 0.0).any() or variances.max(axis=0).max() < VARIED * variances[:, 0].min():
        return None
    usual = float(np.sqrt(np.median(variances.mean(axis=1))))
    if usual > WIDEST_NOISE:
        return None
    variances = np.minimum(variances, WIDEST_NOISE**2)
    every = np.tile(usual**2 * np.eye(3), (len(c), 1, 1))
    every[known] = (axes * variances[:, None, :]) @ np.swapaxes(axes, 1, 2)
    missing = f"; of {np.count_nonzero(~known)} it is unknown, taken as usual" if not known.all() else ""
    note(recording.name, f"measurement noise by each one's covariance, usually {usual:.3g} rad{missing}")
    return Bingham.from_covariance(recording.orientation, every, frame="world")


def _measured_noise(recording: OrientationRecording, options: FilterOptions) -> float:
    """Return the deviation of a measurement, rad: what the user says, or else the recording's own covariances."""
    covariance = recording.covariance
    if covariance is None or options.measurement_noise != USUAL_NOISE:
        return options.measurement_noise
    variances = np.trace(covariance, axis1=1, axis2=2) / 3
    deviation = float(np.sqrt(np.median(variances[np.isfinite(variances)])))
    if deviation > WIDEST_NOISE:
        return options.measurement_noise
    note(recording.name, f"measurement noise {deviation:.3g} rad, the median of its covariances")
    return deviation


def fitted(options: FilterOptions, recording: Any) -> FilterOptions:
    """Return the options with the plain filter where there is no accelerometer, which the other one starts with."""
    alone = getattr(recording, "accelerometer", recording) is None and recording.orientations is None
    return replace(options, plain=True) if alone and not options.smooth else options


def pieces_of(recording: Any, options: FilterOptions) -> Iterator[Any]:
    """Yield a recording in pieces, so that what a filter says of it need not be in memory at once."""
    from bingham.recording import ImuRecording

    whole = options.smooth or options.plain or not isinstance(recording, ImuRecording)
    whole = whole or recording.orientations is not None
    size = recording.size if whole else PIECE
    for first in range(0, recording.size, size):
        yield recording if size >= recording.size else rows_of(recording, slice(first, first + size))


def renamed(recording: Any, name: str) -> Any:
    """Return a recording under another name; it needs no checks, it has passed them."""
    part = object.__new__(type(recording))
    for field in fields(recording):
        object.__setattr__(part, field.name, name if field.name == "name" else getattr(recording, field.name))
    return part


def rows_of(value: Any, rows: slice) -> Any:
    """Return some rows of a recording or track; they need no checks, the whole has passed them."""
    if hasattr(value, "__getitem__"):
        return value[rows]
    part = object.__new__(type(value))
    for field in fields(value):
        content = getattr(value, field.name)
        by_row = isinstance(content, np.ndarray) and content.ndim and len(content) == len(value.time)
        object.__setattr__(part, field.name, content[rows] if by_row else content)
    return part


def orientation_noise(option: str, deviation_rad: float, dim: int) -> Bingham:
    """Return the isotropic distribution about the identity whose angle has the given standard deviation per axis.

    Raises
    ------
    InvalidArgumentError
        Naming the option, if no distribution with a mode has that deviation.
    """
    from bingham.distributions.bingham import Bingham

    if not 0 < deviation_rad * deviation_rad < np.inf:
        raise InvalidArgumentError(option, "a number > 0, rad", deviation_rad)
    if dim == 4:
        try:
            return Bingham.from_covariance([1.0, 0.0, 0.0, 0.0], deviation_rad**2 * np.eye(3), frame="body")
        except InvalidArgumentError:
            expected = "rad, at most about 0.9: with more no orientation is the most probable"
            raise InvalidArgumentError(option, expected, deviation_rad, "degrees? Multiply by π/180") from None
    # E sin² of a normal angle.
    across = -np.expm1(-2 * deviation_rad**2) / 2
    return Bingham.from_moment(np.diag([1 - across, across]))
