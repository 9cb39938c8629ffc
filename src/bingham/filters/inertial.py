"""Plain inertial filter: gyroscope, gravity and heading, without bias estimation."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution
from bingham.errors import InvalidArgumentError
from bingham.filters.gate import Gate
from bingham.filters.run import warn_of_rejections
from bingham.filters.sequence import bingham_track, run_sequences, sensor_table
from bingham.filters.track import MISSING, BinghamTrack
from bingham.kernels.gap import PACE_STATE, bridge_gaps
from bingham.kernels.lowpass import LOWPASS_STATE, average_specific_force
from bingham.models.sensors import HeadingSensor, VectorSensor
from bingham.recording import ImuRecording
from bingham.rotations import from_rotation_vector

__all__ = ["InertialFilter", "InertialState", "InertialTrack"]

FloatArray = NDArray[np.float64]

# Seconds of white noise that one sample averages at most (below 20 Hz it counts as one sample), and the first one.
LONGEST_SHARE = 0.05
FIRST_SHARE = 0.01


@dataclass(frozen=True, eq=False, repr=False)
class InertialState:
    """All an inertial filter carries from sample to sample; saving it and going on gives the identical track.

    ``distribution``: of the orientation, body → world. ``time``: of the last sample, s. ``average``: state of the
    averaged specific force. ``magnetometer`` (3,): the last row, by which repeated rows are known. ``pace`` (4,): the
    usual step, s, and the last rate, rad/s, by which gaps are known.
    """

    distribution: Bingham
    time: float
    average: FloatArray
    magnetometer: FloatArray
    pace: FloatArray

    def __repr__(self) -> str:
        return f"<InertialState at {self.time:.6g} s: {self.distribution!r}>"

    @property
    def mode(self) -> FloatArray:
        """Most probable orientation (4,)."""
        return self.distribution.mode


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class InertialTrack(BinghamTrack):
    """A `BinghamTrack` of gravity and heading; ``state`` continues it, None in a slice that ends elsewhere."""

    AT_END: ClassVar[tuple[str, ...]] = ("final", "state")
    SENSORS: ClassVar[tuple[str, ...]] = ("gravity", "heading")

    state: InertialState


@dataclass(frozen=True)
class InertialFilter:
    """Orientation from a gyroscope, an accelerometer and, where present, a magnetometer.

    ``BinghamFilter(Gyroscope(...), [VectorSensor(...), HeadingSensor(...)])`` for recordings: before its loop runs,
    gaps are bridged, the specific force is averaged and repeated rows of the magnetometer are left out.

    The gyroscope rotates the distribution and diffuses it; the specific force, averaged in a frame the gyroscope holds
    still, adds Davenport's matrix of the vertical; the field adds its heading and leaves the inclination alone. Each
    step is exact within the Bingham family. The gyroscope's bias is not estimated: see `ImuFilter` for that.

    Parameters
    ----------
    gyroscope_noise_density : float
        σ, rad/s/√Hz: variance of the attitude grows by σ² dt per axis. Raising it follows gravity and field faster. The
        default covers uncorrected biases of a few tenths of a degree per second.
    gravity_noise_density : float
        rad/√Hz: white noise of the averaged vertical's direction; with σ it sets the time constant
        gravity_noise_density/σ with which the distribution follows it.
    heading_noise_density : float
        rad/√Hz: white noise of the magnetic heading; likewise.
    averaging_time : float
        s: time constant of each of the two stages that average the specific force. Raising it suppresses linear
        acceleration better and lets the gyroscope's bias in.
    declination : float
        rad: angle from geographic to magnetic north, positive to the east.
    gate : Gate or None
        Rejects single measurements that prediction and noise cannot explain.

    Examples
    --------
    >>> import numpy as np
    >>> from bingham import ImuRecording
    >>> t = np.arange(500) / 100.0
    >>> up, north = np.tile([0.0, 0.0, 9.81], (500, 1)), np.tile([0.0, 20.0, -40.0], (500, 1))
    >>> still = ImuRecording("still", t, np.zeros((500, 3)), up, north)
    >>> np.abs(InertialFilter().run(still).modes[-1]).round(6) + 0.0
    array([1., 0., 0., 0.])
    """

    gyroscope_noise_density: float = 0.01
    gravity_noise_density: float = 0.003
    heading_noise_density: float = 0.09
    averaging_time: float = 1.0
    declination: float = 0.0
    gate: Gate | None = field(default_factory=lambda: Gate(0.9999))

    def __post_init__(self) -> None:
        for name in ("gyroscope_noise_density", "gravity_noise_density", "heading_noise_density", "averaging_time"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise InvalidArgumentError(name, "a finite number > 0", value)
        if not math.isfinite(self.declination):
            raise InvalidArgumentError("declination", "a finite angle, rad", self.declination)

    def run(self, recording: ImuRecording, prior: Bingham | InertialState | None = None) -> InertialTrack:
        """Filter a whole recording in one compiled loop.

        Parameters
        ----------
        recording : ImuRecording
            Irregular times are used as they are. Over a gap (of five usual steps, or of 0.25 s) the distribution
            widens by what the rate may have been.
        prior : Bingham or InertialState, optional
            Distribution of the first orientation (uniform unless given), or the ``state`` of a track to go on from.

        Returns
        -------
        InertialTrack
        """
        state = prior if isinstance(prior, InertialState) else None
        distribution = (
            prior.distribution if isinstance(prior, InertialState) else Bingham.uniform(4) if prior is None else prior
        )
        check_distribution(distribution, "prior")
        if distribution.dim != 4 or distribution.shape:
            raise InvalidArgumentError("prior", "a single distribution of rotations", repr(distribution))
        time = np.array(recording.time)
        steps = np.diff(time, prepend=time[:1] if state is None else state.time)
        if state is not None and not steps[0] > 0.0:
            raise InvalidArgumentError("recording", f"times after {state.time!r} s, where the state stopped", time[0])
        count = time.size
        gyroscope, gaps = np.array(recording.gyroscope), np.empty(count)
        pace = np.zeros(PACE_STATE) if state is None else state.pace.copy()
        bridge_gaps(steps, gyroscope, pace, gaps)
        average = np.zeros(LOWPASS_STATE) if state is None else state.average.copy()
        gravity = np.full((count, 3), np.nan)
        if recording.accelerometer is not None:
            average_specific_force(
                steps, gyroscope, gaps, np.array(recording.accelerometer), self.averaging_time, average, gravity
            )
        field_rows, last_row = np.full((count, 3), np.nan), np.full(3, np.nan)
        if recording.magnetometer is not None:
            field_rows = np.array(recording.magnetometer)
            before = last_row if state is None else state.magnetometer
            repeated = np.all(field_rows == np.concatenate([before[None], field_rows[:-1]]), axis=1)
            last_row = field_rows[-1].copy()
            field_rows[repeated] = np.nan
        limits = np.array([math.inf if self.gate is None else self.gate.threshold(rank) for rank in (2, 1)])
        y = np.concatenate([gravity, field_rows], axis=1)[None]
        variances = self.gyroscope_noise_density**2 * steps + gaps
        # A sample speaks for the time since the last one, but not for a gap.
        shares = np.where(steps > 0.0, np.minimum(steps, LONGEST_SHARE), FIRST_SHARE)
        results = run_sequences(
            motion=None,
            variances=variances,
            left=False,
            sensors=sensor_table(self._sensors, limits.tolist()),
            z=np.array(distribution.z)[None],
            frames=np.array(distribution.M.T, order="C")[None],
            controls=from_rotation_vector(gyroscope * steps[:, None])[None],
            y=y,
            shares=shares,
            kept=count,
        )
        decision = results[4]
        # A zero force or a vertical field says nothing of the orientation.
        decision[decision < MISSING] = MISSING
        end = Bingham.from_spectrum(results[0][0, -1].copy(), results[1][0, -1].copy())
        track = bingham_track(
            results, time, limits, batched=False, in_list=True, kind=InertialTrack,
            state=InertialState(end, float(time[-1]), average, last_row, pace),
        )  # fmt: skip
        warn_of_rejections(track)
        return track

    @property
    def _sensors(self) -> tuple[VectorSensor, HeadingSensor]:
        """Gravity and heading, their concentrations those of a second."""
        north = (math.sin(self.declination), math.cos(self.declination))
        gravity = VectorSensor((0.0, 0.0, 1.0), self.gravity_noise_density**-2)
        return gravity, HeadingSensor(self.heading_noise_density**-2, north)
