"""Which filter a recording gets, and what the command line lets users choose about it."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bingham.errors import InvalidArgumentError, RecordingWarning

if TYPE_CHECKING:
    from bingham.cli.result import Result
    from bingham.distributions.bingham import Bingham
    from bingham.recording import ImuRecording, OrientationRecording

__all__ = ["FilterOptions", "Prepared", "begun", "note", "prepare"]

WARM_UP_SAMPLES = 3


def note(message: str) -> None:
    """Warn the user about a recording."""
    warnings.warn(message, RecordingWarning, stacklevel=3)


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


class Prepared(NamedTuple):
    """A filter that is ready to run over one recording, and how to read what it returns."""

    name: str
    run: Callable[[], Any]
    result: Callable[[Any], Result]


def prepare(recording: ImuRecording | OrientationRecording, options: FilterOptions) -> Prepared:
    """Return the filter for a recording, its compiled code loaded, so that timing it times the filter alone."""
    from bingham.recording import ImuRecording

    if not isinstance(recording, ImuRecording):
        return _orientations(recording, options)
    if options.plain:
        if options.smooth:
            raise InvalidArgumentError("--smooth", "the filter with bias", "--plain", "leave one of the two out")
        if recording.accelerometer is None:
            note(f"{recording.name}: no accelerometer: turns are followed from a start that nothing shows")
        return _plain_inertial(recording)
    if recording.accelerometer is None or not np.isfinite(recording.accelerometer).any():
        got = f"{recording.name} without one"
        hint = "gravity shows where up is; is it called by another name? --plain follows the gyroscope alone"
        raise InvalidArgumentError("RECORDING", "at least one accelerometer sample", got, hint)
    return _inertial(recording, options.smooth)


def begun(recording: ImuRecording | OrientationRecording, options: FilterOptions) -> Any:
    """Return the recording from the sample on that the filter can start with: the accelerometer's first."""
    from bingham.recording import ImuRecording

    if options.plain or not isinstance(recording, ImuRecording) or recording.accelerometer is None:
        return recording
    first = int(np.argmax(np.isfinite(recording.accelerometer[:, 0])))
    if not first:
        return recording
    left = f"{first} samples, {recording.time[first] - recording.time[0]:.3g} s, left out"
    note(f"{recording.name}: no orientation before the first accelerometer sample: {left}")
    return _rows(recording, slice(first, None), truth=recording.truth)


def _inertial(recording: ImuRecording, smooth: bool) -> Prepared:
    from bingham.cli.result import of_imu_track
    from bingham.filters.imu import ImuFilter

    filter_ = ImuFilter()
    run = filter_.smooth if smooth else filter_.run
    run(_start(recording))
    return Prepared("imu, smoothed" if smooth else "imu", lambda: run(recording), of_imu_track)


def _plain_inertial(recording: ImuRecording) -> Prepared:
    from bingham.cli.result import of_track
    from bingham.filters.inertial import InertialFilter

    filter_ = InertialFilter()
    filter_.run(_start(recording))
    return Prepared("inertial, plain", lambda: filter_.run(recording), of_track)


def _start(recording: ImuRecording) -> ImuRecording:
    """Return the first samples of a recording, up to one with the accelerometer."""
    known = np.zeros(1) if recording.accelerometer is None else np.isfinite(recording.accelerometer[:, 0])
    return _rows(recording, slice(0, max(WARM_UP_SAMPLES, int(np.argmax(known)) + 1)), truth=None)


def _rows(recording: ImuRecording, count: slice, truth: OrientationRecording | None) -> ImuRecording:
    from bingham.recording import amended

    fields = ("time", "gyroscope", "accelerometer", "magnetometer", "reference", "score")
    values = {name: getattr(recording, name) for name in fields}
    return amended(recording, truth=truth, **{k: None if v is None else v[count] for k, v in values.items()})


def _orientations(recording: OrientationRecording, options: FilterOptions) -> Prepared:
    from bingham.cli.result import of_track
    from bingham.distributions.bingham import Bingham
    from bingham.filters.first_order import BinghamFilter
    from bingham.filters.gate import Gate
    from bingham.filters.smoother import smooth_fixed_interval
    from bingham.models.diffusion import Diffusion
    from bingham.models.sensors import OrientationSensor

    filter_ = BinghamFilter(
        Diffusion(options.process_noise, recording.dim),
        OrientationSensor(orientation_noise("--measurement-noise", options.measurement_noise, recording.dim)),
        gate=Gate(options.gate) if options.gate < 1 else None,
    )
    prior = Bingham.uniform(recording.dim)

    def run(count: int | None = None) -> Any:
        filter_or_smooth = partial(smooth_fixed_interval, filter_) if options.smooth else filter_.run
        return filter_or_smooth(prior, recording.orientation[:count], times=recording.time[:count])

    run(WARM_UP_SAMPLES)
    return Prepared("first-order, smoothed" if options.smooth else "first-order", run, of_track)


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
