"""The inertial filter fed sample by sample, each sensor at its own times."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.uncertainty import frame_required
from bingham.errors import InvalidArgumentError
from bingham.filters.imu import KEPT_APART, ImuFilter, check_start
from bingham.filters.imu_state import ImuState
from bingham.filters.imu_track import MAGNETOMETER_CODES, UNIFORM_INCLINATION, UNIFORM_VARIANCE, bounded
from bingham.filters.orientation_log import ORIENTATION_CODES
from bingham.filters.tangent import distribution_of_covariance
from bingham.kernels.imu_live import read, take_field, take_force, take_orientation, take_rate
from bingham.kernels.imu_loop import MAXIMAL_FORCE
from bingham.kernels.imu_model import BIAS, FORCE_BIAS, WORK
from bingham.recording import OrientationRecording, with_covariance
from bingham.rotations import rotate as rotate_vectors
from bingham.validation import unit_row

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["ImuStream"]

FloatArray = NDArray[np.float64]

GYROSCOPE, ACCELEROMETER, MAGNETOMETER, ORIENTATION = range(4)


class Reading(np.ndarray[Any, np.dtype[np.float64]]):
    """The estimated quaternion, an array; called, it takes a measured one: `ImuStream.orientation`."""

    measured: Callable[..., None]

    def __call__(self, *arguments: Any, **keywords: Any) -> None:
        """Take an orientation measured beside the gyroscope."""
        self.measured(*arguments, **keywords)

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        """Return what is computed from it as a plain array."""
        return array[()] if return_scalar else np.asarray(array)

    def __repr__(self) -> str:
        return repr(np.asarray(self))


class ImuStream:
    """Live orientation: call the method of the sensor whose sample has come, read the estimate at any time.

    Samples of one sensor come in the order of their times; sensors may have any rates of their own, miss samples and be
    late by a fraction of ``update_interval`` against each other. Those of equal time are given in the order gyroscope,
    accelerometer, magnetometer, orientation; then the estimates equal those of `ImuFilter.run` bit for bit.

    Parameters
    ----------
    filter : ImuFilter, optional
        Parameters; the defaults unless given.
    prior : Bingham, optional
        Distribution of the orientation before the first accelerometer sample; uniform unless given.
    state : ImuState, optional
        Continue from here (`state` of another stream, `ImuTrack.final`).

    Examples
    --------
    >>> stream = ImuStream()
    >>> for k in range(200):
    ...     stream.gyroscope(0.01 * k, [0.0, 0.0, 0.0])
    ...     stream.accelerometer(0.01 * k, [0.0, 9.81, 0.0])
    >>> stream.started, bool(stream.inclination_std < 0.02), bool(stream.heading_std > 1.0)
    (True, True, True)
    """

    def __init__(
        self, filter: ImuFilter | None = None, *, prior: Bingham | None = None, state: ImuState | None = None
    ) -> None:
        if prior is not None and state is not None:
            raise InvalidArgumentError("prior", "None when a state is given", "both")
        check_start(prior, state)
        self._filter = ImuFilter() if filter is None else filter
        self._parameters = np.atleast_1d(self._filter.parameters)
        self._prior = prior
        self._state = self._filter.blank() if state is None else state.copy()
        self._record = self._state.record
        self._work = np.zeros(1, dtype=WORK)
        self._times = self._state.newest.tolist()  # also of samples that are rejected
        self._log_evidence = 0.0

    def gyroscope(self, time: float, rate: Sequence[float] | FloatArray) -> None:
        """Take the angular velocity (3,), rad/s, of the body about its own axes at `time`, s.

        Raises
        ------
        InvalidArgumentError
            If the sample is not finite or not later than the one before; the estimate is as before.
        """
        x, y, z = _finite("rate", rate)
        self._step(GYROSCOPE, time)
        self._log_evidence += take_rate(self._state.values, self._parameters, self._work, time, x, y, z)

    def accelerometer(self, time: float, force: Sequence[float] | FloatArray) -> None:
        """Take the specific force (3,), m/s², in body axes at `time`, s; see `gyroscope` for errors."""
        x, y, z = _finite("force", force)
        self._step(ACCELEROMETER, time)
        if self._record["phase"] == 0 and 0.0 < math.hypot(x, y, z) <= MAXIMAL_FORCE:
            self._state.begin(self._filter.start([x, y, z], self._prior))
        take_force(self._state.values, self._parameters, self._work, time, x, y, z)

    def magnetometer(self, time: float, field: Sequence[float] | FloatArray) -> None:
        """Take the magnetic field (3,), any one unit, in body axes at `time`, s; see `gyroscope` for errors."""
        x, y, z = _finite("field", field)
        self._step(MAGNETOMETER, time)
        take_field(self._state.values, time, x, y, z)

    @property
    def orientation(self) -> Reading:
        """Most probable orientation (w, x, y, z) now, body to world; NaN before the start.

        Called like the other sensors, ``stream.orientation(time, q, covariance, frame="body")`` takes an orientation
        measured beside the gyroscope: a unit quaternion or `Rotation`, body to world, and the covariance (3, 3), rad²,
        of a small rotation about the axes of `frame`, "body" or "world". It is used as soon as the gyroscope
        has reached its time, and may be late as the other sensors may; without accelerometer the first one is the
        start. One that the estimate contradicts is rejected, see `orientation_decision`.
        """
        reading = self._reported()[0].view(Reading)
        reading.measured = self._orientation
        return reading

    def _orientation(
        self, time: float, q: ArrayLike | Rotation, covariance: ArrayLike | None = None, *, frame: str | None = None
    ) -> None:
        orientation = unit_row(q, 4, "q")
        if covariance is None:
            world = self._filter.orientation_error**2 * np.eye(3)
        else:
            given = with_covariance(OrientationRecording("q", np.zeros(1), orientation[None]), covariance, frame or "")
            assert given.covariance is not None
            world = given.covariance[0]
        self._step(ORIENTATION, time)
        if self._record["phase"] == 0 and math.isfinite(self._record["last"][0]):
            self._state.begin(self._filter.start_seen(orientation, world, self._prior))
        state, parameters, work = self._state.values, self._parameters, self._work
        self._log_evidence += take_orientation(state, parameters, work, time, orientation, world)

    @property
    def orientation_decision(self) -> tuple[int, float, str]:
        """Code, NIS and reason of the last orientation that was looked at; see `OrientationLog`."""
        code = int(self._record["seen_code"])
        return code, float(self._record["seen_nis"]) if code else math.nan, ORIENTATION_CODES[code]

    @property
    def started(self) -> bool:
        """Whether there is an estimate, which takes an accelerometer sample or an orientation."""
        return self._state.started

    @property
    def distribution(self) -> Bingham:
        """Bingham distribution of the orientation now; the prior before the first accelerometer sample."""
        if not self.started:
            return Bingham.uniform(4) if self._prior is None else self._prior
        return distribution_of_covariance(*self._reported())

    @frame_required
    def covariance(self, *, frame: Literal["body", "world"]) -> FloatArray:
        """Return the covariance (3, 3) of the rotation error, rad²; an unknown angle has the variance π²/3."""
        if frame not in ("body", "world"):
            raise InvalidArgumentError("frame", "'body' or 'world'", repr(frame), "name the axes of the small rotation")
        q, c = self._reported()
        c = bounded(c)
        if frame == "world":
            return c
        to_world = np.stack([rotate_vectors(q, axis) for axis in np.eye(3)], axis=-1)
        return to_world.T @ c @ to_world

    @property
    def bias(self) -> FloatArray:
        """Gyroscope bias (3,), rad/s."""
        return self._record["bias"].copy()

    @property
    def bias_std(self) -> FloatArray:
        """Standard deviations (3,) of the bias, rad/s."""
        return np.sqrt(np.diagonal(self._record["covariance"])[BIAS:FORCE_BIAS])

    @property
    def heading_std(self) -> float:
        """Standard deviation of the heading, rad; π/√3 at most, which is an unknown heading."""
        return float(np.sqrt(np.minimum(self._reported()[1][2, 2], UNIFORM_VARIANCE)))

    @property
    def relative_heading_std(self) -> float:
        """Standard deviation, rad, of the heading's drift since the start; NaN once something has shown the heading."""
        apart = float(self._record["unknown_heading"])
        return math.sqrt(max(self._reported()[1][2, 2] - apart, 0.0)) if apart > KEPT_APART else math.nan

    @property
    def inclination_std(self) -> float:
        """Root mean square of the inclination error, rad."""
        c = self._reported()[1]
        return float(np.sqrt(np.minimum(c[0, 0] + c[1, 1], UNIFORM_INCLINATION)))

    @property
    def at_rest(self) -> bool:
        """Whether the body is found at rest."""
        return bool(self._record["resting"] > 0)

    @property
    def log_evidence(self) -> float:
        """Log-density of all samples used by this stream so far."""
        return self._log_evidence

    @property
    def magnetometer_decision(self) -> tuple[int, float, str]:
        """Code, statistic and reason of the magnetometer's share in the last update; see `ImuTrack`."""
        code = int(self._record["code"])
        return code, float(self._record["statistic"]) if code else math.nan, MAGNETOMETER_CODES[code]

    @property
    def state(self) -> ImuState:
        """A copy of everything the filter knows; a stream made from it goes on identically."""
        return self._state.copy()

    def _reported(self) -> tuple[FloatArray, FloatArray]:
        """Return orientation (4,) and covariance (3, 3), world axes, as they are now."""
        q, c = np.full(4, np.nan), np.full((3, 3), np.nan)
        if self.started:
            read(self._state.values, self._parameters, q, c)
        return q, c

    def _step(self, sensor: int, time: float) -> None:
        last = self._times[sensor]
        if not (math.isfinite(time) and not time <= last):
            raise InvalidArgumentError(
                "time",
                f"finite seconds after {last} s, the sensor's last sample",
                time,
                "drop samples that come late or twice",
            )
        self._times[sensor] = time


def _finite(name: str, vector: Sequence[float] | FloatArray) -> tuple[float, float, float]:
    try:
        x, y, z = map(float, vector.tolist() if isinstance(vector, np.ndarray) else vector)
    except (TypeError, ValueError):
        raise InvalidArgumentError(name, "three numbers", vector) from None
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        raise InvalidArgumentError(name, "finite numbers", vector, "leave out samples that are missing")
    return x, y, z
