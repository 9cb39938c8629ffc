"""Orientation from an inertial sensor: gyroscope, accelerometer and, if there, magnetometer."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.algebra import spectral
from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError, RecordingWarning
from bingham.filters.imu_state import TOLD, ImuState
from bingham.filters.imu_track import ImuTrack
from bingham.filters.orientation_log import OrientationLog
from bingham.filters.tangent import covariance_of_distribution, distribution_of_covariance
from bingham.kernels.imu_loop import MAXIMAL_FORCE, SEEN, UPDATE, Estimates
from bingham.kernels.imu_loop import run as run_kernel
from bingham.kernels.imu_loop import smooth as smooth_kernel
from bingham.kernels.imu_model import BIAS, FIRST_SWING, FIRST_TILT, FORCE_BIAS, SIZE, SWING_PERIOD, VELOCITY, WORK
from bingham.models.sensors import davenport_matrix
from bingham.recording import ImuRecording
from bingham.rotations import rotate

__all__ = ["ImuFilter"]

FloatArray = NDArray[np.float64]

# Their places among the errors of the state.
SPEEDS, BIASES, FORCE_BIASES = range(VELOCITY, BIAS), range(BIAS, FORCE_BIAS), range(FORCE_BIAS, SIZE)
KEPT_APART = 0.1  # rad²: variance of the heading at the start above which only the drift since then is of use
BLOCK = 1000  # samples at a time in search of the first that is one
FREE_FALL = "zeros are free fall, which shows no up: leave it out, as NaN in a recording, if it is no sample"


@dataclass(frozen=True)
class ImuFilter:
    """Bingham orientation with Gaussian gyroscope bias, their correlation kept.

    Errors of orientation, velocity, gyroscope bias and accelerometer bias form one error state (``kernels.imu_model``);
    the orientation's distribution is read out as a Bingham distribution at any spread (`filters.tangent`). Gravity is
    found by integrating the accelerometer and holding that a body's velocity stays bounded: as seen over seconds what
    remains is gravity. A magnetometer corrects the heading only. At rest the gyroscope shows its bias. World axes are
    east, north, up; a resting accelerometer reads +g upwards. One set of defaults serves all sensors tried. Samples
    that no sensor measures are rejected, clipped and frozen rates widen the distribution, and where corrections
    contradict what the filter expects, it widens too.

    Parameters
    ----------
    gyroscope_noise : float
        Density of white noise, rad/s/√Hz: var θ grows by gyroscope_noise² per second. More: quicker towards gravity.
    gyroscope_scale_error : float
        Relative error s of scale and axes: turning on and on at ω adds a rate error s ω that lasts about 1 s.
    gyroscope_bias : float
        Standard deviation of the bias at the start, rad/s. More: learnt sooner in motion, with more error in heading.
    gyroscope_wide_bias : float
        The same for a sensor that proves to be uncalibrated (rest or motion contradict `gyroscope_bias`), rad/s.
    gyroscope_bias_walk : float
        Density of the bias's random walk, rad/s/√s.
    accelerometer_noise : float
        Density of noise and vibration, m/s²/√Hz.
    accelerometer_scale_error : float
        Relative error of |a| beyond g; counts in violent motion.
    accelerometer_bias : float
        Standard deviation of a constant error, m/s².
    slow_velocity : float
        Typical velocity, m/s, that cannot be seen in the swinging of the accelerometer. More: slower towards gravity.
    motion_window : float
        Seconds over which the intensity of motion is judged.
    rest_rate, rest_acceleration : float
        Largest deviation from its mean, rad/s and m/s², that a sensor at rest shows.
    rest_time : float
        Seconds below both until the body counts as resting.
    rest_rate_error : float
        Rate, rad/s, a body "at rest" may still have.
    magnetometer_error : float
        Typical error of the heading in an undisturbed place, rad.
    magnetometer_time : float
        Seconds over which that error persists. More: slower towards north, less rotated by disturbances.
    field_memory : float
        Seconds over which the expected field (strength and dip) adapts while it is believed.
    field_limit : float
        Heading error, rad, to be feared from the visible disturbance beyond which a sample is rejected.
    new_field_time : float
        Seconds of motion in a steady field after which it becomes the expected one.
    gravity : float
        Local g, m/s².
    declination : float
        Heading of the field's horizontal part, rad, clockwise from true north (east positive); 0: magnetic north.
    update_interval : float
        Seconds between updates; every sample moves the orientation.
    gyroscope_delay : float
        Seconds by which samples, taken as means over the interval before them, lag behind the motion: the sensor's
        low-pass filter; a third of it is taken to be unknown. 0 for simulated sensors.
    alignment_error : float
        Error of the sensor's axes against the body's under 1 g, rad; it grows with the force. It changes what is
        reported, not the estimate. 0 for simulated sensors.
    gyroscope_range : float
        Largest rate that the gyroscope measures, rad/s; 0: found where its samples have flat tops.
    orientation_error : float
        Standard deviation about each axis, rad, of orientations beside the gyroscope that bring no covariance.

    Examples
    --------
    >>> import numpy as np
    >>> from bingham import ImuFilter, ImuRecording
    >>> t = np.arange(300) / 100
    >>> up = np.tile([0.0, 0.0, 9.81], (300, 1))
    >>> still = np.tile([0.002, 0.0, 0.0], (300, 1))
    >>> field = np.tile([0.0, 20.0, -40.0], (300, 1))
    >>> track = ImuFilter().run(ImuRecording("still", t, still, up, field))
    >>> np.abs(track.modes[-1]).round(2)
    array([1., 0., 0., 0.])
    >>> bool(abs(track.bias[-1, 0] - 0.002) < 3e-4)
    True
    """

    gyroscope_noise: float = 1.75e-4
    gyroscope_scale_error: float = 3e-3
    gyroscope_bias: float = math.radians(0.15)
    gyroscope_wide_bias: float = math.radians(3.0)
    gyroscope_bias_walk: float = math.radians(0.002)
    accelerometer_noise: float = 0.03
    accelerometer_scale_error: float = 0.02
    accelerometer_bias: float = 0.025
    slow_velocity: float = 0.12
    motion_window: float = 5.0
    rest_rate: float = math.radians(2.0)
    rest_acceleration: float = 0.5
    rest_time: float = 1.5
    rest_rate_error: float = math.radians(0.1)
    magnetometer_error: float = math.radians(3.0)
    magnetometer_time: float = 0.8
    field_memory: float = 20.0
    field_limit: float = math.radians(30.0)
    new_field_time: float = 20.0
    gravity: float = 9.81
    declination: float = 0.0
    update_interval: float = 0.08
    gyroscope_delay: float = 0.002
    alignment_error: float = math.radians(0.12)
    gyroscope_range: float = 0.0
    orientation_error: float = math.radians(2.0)

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, (int, float, np.floating)):
                hint = "give recordings to run: ImuFilter().run(recording)" * isinstance(value, ImuRecording)
                raise InvalidArgumentError(field.name, "a finite number", type(value).__name__, hint)
            if not math.isfinite(value):
                raise InvalidArgumentError(field.name, "a finite number", value)
            if field.name == "declination":
                if abs(value) > math.pi:
                    hint = f"degrees? declination=np.radians({value:g})"
                    raise InvalidArgumentError("declination", "an angle in rad, from -π to π", value, hint)
                continue
            if value < 0.0 or (value == 0.0 and field.name not in MAY_BE_ZERO):
                raise InvalidArgumentError(field.name, "a positive number", value)

    @property
    def parameters(self) -> np.void:
        """All parameters as the record that the kernel takes, a field each."""
        names = [field.name for field in fields(self)]
        record = np.zeros(1, dtype=[(name, np.float64) for name in names])
        for name in names:
            record[name] = getattr(self, name)
        return record[0]

    def start(self, accelerometer: ArrayLike, prior: Bingham | None = None) -> ImuState:
        """Return the state after the first accelerometer sample: the prior times the sample's likelihood.

        Parameters
        ----------
        accelerometer : (3,) array_like
            Specific force, m/s²; its direction is up within about 6°, and further off the more its size differs from g.
        prior : Bingham, optional
            Distribution of the orientation before; uniform unless given. A girdle about the vertical says "tilt known,
            heading not".
        """
        check_start(prior, None)
        distribution = Bingham.uniform(4) if prior is None else prior
        if distribution.dim != 4 or distribution.shape:
            raise InvalidArgumentError(
                "prior", "a single distribution of rotations, d = 4", f"d = {distribution.dim}, {distribution.shape}"
            )
        force = np.asarray(accelerometer, dtype=np.float64)
        norm = float(np.linalg.norm(force))
        if force.shape != (3,) or not (math.isfinite(norm) and norm > 0.0):
            hint = FREE_FALL if norm == 0.0 else ""
            raise InvalidArgumentError("accelerometer", "a finite non-zero vector (3,)", accelerometer, hint)
        # A linear acceleration that changes the size by a share of g rotates the direction by about as much, rad.
        excess = norm - self.gravity
        tilt2 = FIRST_TILT**2 + (excess / self.gravity) ** 2
        swing2 = FIRST_SWING**2 + (SWING_PERIOD * excess) ** 2
        posterior = distribution.matrix + davenport_matrix([0.0, 0.0, 1.0], force / norm) / tilt2
        # Nothing is compiled for one matrix.
        z, frame = spectral(posterior, "prior", compiled=False)
        seen = _least_turn(Bingham.from_spectrum(z - z[-1], frame))
        state = self.blank()
        record = state.record
        record["phase"], record["orientation"] = -1, seen.mode
        record["swing_power"] = record["speed_power"] = swing2
        p = record["covariance"]
        p[:3, :3] = covariance_of_distribution(seen)
        p[SPEEDS, SPEEDS] = 2.0 * swing2
        # What is not known of the heading whatever the tilt: nothing but a sensor of the heading will change it.
        apart = p[2, 2] - p[2, :2] @ np.linalg.solve(p[:2, :2], p[:2, 2])
        record["unknown_heading"] = apart
        p[2, 2] -= apart
        return state

    def start_seen(self, orientation: ArrayLike, covariance: ArrayLike, prior: Bingham | None = None) -> ImuState:
        """Return the state after a first orientation where there is no accelerometer: the prior times its likelihood.

        Parameters
        ----------
        orientation : (4,) array_like
            Unit quaternion (w, x, y, z), body to world.
        covariance : (3, 3) array_like
            Of a small rotation about the axes of the world, rad².
        prior : Bingham, optional
            Distribution of the orientation before; uniform unless given.
        """
        check_start(prior, None)
        state = self.blank()
        record = state.record
        record["phase"], record["orientation"] = -2, orientation
        record["covariance"][:3, :3] = covariance
        if prior is not None:
            seen = prior.multiply(distribution_of_covariance(record["orientation"], record["covariance"][:3, :3]))
            record["orientation"], record["covariance"][:3, :3] = seen.mode, covariance_of_distribution(seen)
        record["covariance"][SPEEDS, SPEEDS] = 1.0
        record["covariance"][BIASES, BIASES] = self.gyroscope_wide_bias**2
        record["bias_scale"] = self.gyroscope_wide_bias
        return state

    def blank(self) -> ImuState:
        """Return the state before any sample."""
        state = ImuState.zeros()
        record = state.record
        record["last"] = np.nan
        record["noise"] = record["seen_noise"] = record["level"] = record["coarse"] = 1.0
        record["range"] = 0.99 * self.gyroscope_range
        record["bias_scale"] = self.gyroscope_bias
        p = record["covariance"]
        p[BIASES, BIASES] = self.gyroscope_bias**2
        p[FORCE_BIASES, FORCE_BIASES] = self.accelerometer_bias**2
        return state

    def run(self, recording: ImuRecording, *, prior: Bingham | None = None, state: ImuState | None = None) -> ImuTrack:
        """Filter a recording in one compiled loop.

        Parameters
        ----------
        recording : ImuRecording
            With accelerometer or ``orientations``; without magnetometer and orientations the heading is relative to the
            prior and its variance grows.
        prior : Bingham, optional
            Distribution of the orientation before the first accelerometer sample; uniform unless given.
        state : ImuState, optional
            Continue from here (``track.final`` of the recording before).

        Returns
        -------
        ImuTrack
            An estimate for every gyroscope sample; NaN before the first accelerometer sample.

        Raises
        ------
        InvalidArgumentError
            If there is no accelerometer sample and no orientation to start with, the first one is zero (free fall shows
            no up; later zeros are taken as they are), or both `prior` and `state` are given.

        Warns
        -----
        RecordingWarning
            If samples are none, and if most orientations are rejected.
        """
        return self._run(recording, prior, state, smooth=False)

    def smooth(self, recording: ImuRecording, *, prior: Bingham | None = None) -> ImuTrack:
        """Estimate every orientation from the whole recording: `run`, then backwards.

        Rauch, Tung & Striebel's recursion on the error state, at the filter's updates and interpolated between. Keeps
        about 3 kB for each update (12.5 a second). As in `run`, orientations before the first accelerometer sample are
        NaN. Where the recording contradicts `gyroscope_bias`, it is filtered once more from the start, with the
        deviation that was found, at most `gyroscope_wide_bias`.
        """
        return self._run(recording, prior, None, smooth=True)

    def _run(self, recording: ImuRecording, prior: Bingham | None, state: ImuState | None, *, smooth: bool) -> ImuTrack:
        if not isinstance(recording, ImuRecording):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InvalidArgumentError("recording", "an ImuRecording", type(recording).__name__)
        check_start(prior, state)
        force, field = recording.accelerometer, recording.magnetometer
        if state is not None:
            if prior is not None:
                raise InvalidArgumentError("prior", "None when a state is given", "both")
            last = state.record["last"][0]
            if recording.time[0] <= last:
                raise InvalidArgumentError(
                    "recording", f"times after the state's last sample at {last} s", recording.time[0]
                )
            state = state.copy()
        else:
            state = self.blank()
        seen = self._orientations(recording, state)
        if state.record["phase"] == 0:
            state.begin(self._start(recording, seen, prior))
            if smooth and (field is not None or len(seen)):  # the smoother hands the heading back to the start
                state.record["covariance"][2, 2] += state.record["unknown_heading"]
                state.record["unknown_heading"] = 0.0
        before = state.faults
        n = recording.size
        updates = min(n, 1 + math.ceil(recording.duration_s / self.update_interval)) + 2 * len(seen)
        kept, out = np.zeros(updates + 1 if smooth else 0, dtype=UPDATE), Estimates.blank(n, smooth=smooth)
        work = np.zeros(1, dtype=WORK)[0]
        count = run_kernel(
            state.record,
            self.parameters,
            work,
            _read_only(recording.time),
            _read_only(recording.gyroscope),
            _read_only(np.empty((0, 3)) if force is None else force),
            _read_only(np.empty((0, 3)) if field is None else field),
            seen if len(seen) or state.record["seen"] else None,
            out,
            kept,
        )
        if smooth and (wider := self._wider_bias(kept[:count])) > self.gyroscope_bias:
            # What came before could not learn from what came after: start with what was found to be true.
            return replace(self, gyroscope_bias=wider)._run(recording, prior, None, smooth=True)
        if smooth and count:
            smooth_kernel(state.record, self.parameters, work, kept[: count + 1], out)
        given = recording.orientations
        if given is not None and given.mounting_covariance is not None:
            turn = np.stack([rotate(out.mode, axis) for axis in np.eye(3)], axis=-1)
            out.covariance[:] += turn @ given.mounting_covariance @ np.swapaxes(turn, 1, 2)
        warn_of_faults(recording.name, {name: n - before[name] for name, n in state.faults.items()})
        log = None if recording.orientations is None else OrientationLog.of(seen)
        if log is not None:
            log.warn(recording.name)
        relative, apart = np.full(n, np.nan), out.unknown_heading > KEPT_APART
        if apart.any():
            drift = out.covariance[apart, 2, 2] - out.unknown_heading[apart]
            relative[apart] = np.sqrt(np.maximum(drift, 0.0))
        return ImuTrack(
            time=recording.time,
            modes=out.mode,
            rotation_covariance=out.covariance,
            bias=out.bias,
            bias_std=out.bias_std,
            rest=out.rest,
            log_evidence=out.evidence,
            magnetometer_code=out.code,
            magnetometer_statistic=out.statistic,
            final=state,
            smoothed=smooth,
            prior=prior,
            relative_heading_std=relative,
            orientations=log,
        )

    def _orientations(self, recording: ImuRecording, state: ImuState) -> NDArray[Any]:
        """Return the orientations that are for this recording: after those that the state has taken, before its end."""
        given = recording.orientations
        if given is None:
            return np.zeros(0, dtype=SEEN)
        last = state.record["last"][3]
        taken = given.time <= recording.time[-1]
        if np.isfinite(last):
            taken &= given.time > last
        seen = np.zeros(int(taken.sum()), dtype=SEEN)
        seen["time"], seen["orientation"] = given.time[taken], given.orientation[taken]
        seen["covariance"] = self.orientation_error**2 * np.eye(3)
        if given.covariance is not None:
            own = given.covariance[taken]
            known = np.isfinite(own[:, 0, 0])
            seen["covariance"][known] = own[known]
        seen["nis"] = seen["evidence"] = np.nan
        return seen

    def _wider_bias(self, kept: NDArray[Any]) -> float:
        """Return the deviation of the bias with all that was added where rest, motion or biases contradicted it."""
        steps = kept["predicted"][1:, BIAS, BIAS] - kept["filtered"][:-1, BIAS, BIAS]
        added = steps[steps > 0.5 * self.gyroscope_bias**2].sum()
        widest = max(self.gyroscope_bias, self.gyroscope_wide_bias)
        return min(math.sqrt(self.gyroscope_bias**2 + added), widest) if added else self.gyroscope_bias

    def _start(self, recording: ImuRecording, seen: NDArray[Any], prior: Bingham | None) -> ImuState:
        """Return the state that the first accelerometer sample, or without any the first orientation, makes."""
        force = recording.accelerometer
        later = seen[seen["time"] >= recording.time[0]]
        if len(later) and (force is None or not np.isfinite(force[:, 0]).any()):
            return self.start_seen(later["orientation"][0], later["covariance"][0], prior)
        return self.start(_first(force), prior)


MAY_BE_ZERO = {
    "gyroscope_noise", "gyroscope_scale_error", "gyroscope_bias_walk", "accelerometer_noise",
    "accelerometer_scale_error", "gyroscope_delay", "alignment_error", "gyroscope_range",
}  # fmt: skip


def check_start(prior: object, state: object) -> None:
    """Reject a prior that is no distribution and a state that is none."""
    if prior is not None and not isinstance(prior, Bingham):
        hint = "about an orientation q: Bingham.from_covariance(q, covariance, frame=...)"
        raise InvalidArgumentError("prior", "a Bingham distribution of the orientation", type(prior).__name__, hint)
    if state is not None and not isinstance(state, ImuState):
        hint = "ImuState.from_json(text)" if isinstance(state, str) else "track.final, or stream.state"
        raise InvalidArgumentError("state", "an ImuState", type(state).__name__, hint)


def warn_of_faults(name: str, faults: dict[str, int]) -> None:
    """Say once how many samples were no samples or came from a sensor beyond its range."""
    told = [f"{count} {what}" for what, count in faults.items() if count and what in TOLD]
    if told:
        warnings.warn(f"{name}: {'; '.join(told)}", RecordingWarning, stacklevel=4)


def _read_only(array: FloatArray) -> FloatArray:
    """Return a view (a copy, if it is not contiguous) that the kernel is compiled for, whosever array it is."""
    view = np.ascontiguousarray(array, dtype=float).view()
    view.flags.writeable = False
    return view


def _first(force: FloatArray | None) -> FloatArray:
    """Return the first accelerometer sample (3,) that is one."""
    given = np.empty((0, 3)) if force is None else force
    for first in range(0, len(given), BLOCK):
        size2 = np.sum(given[first : first + BLOCK] ** 2, axis=1)
        believed = (size2 > 0.0) & (size2 <= MAXIMAL_FORCE**2)
        if believed.any():
            return given[first + int(np.argmax(believed))]
    got = "none" if force is None else "none but zeros"
    raise InvalidArgumentError("recording", "at least one accelerometer sample", got, "gravity shows where up is")


def _least_turn(distribution: Bingham) -> Bingham:
    """Give a girdle (heading unknown) the orientation nearest to the identity as its mode; keep other distributions."""
    span = distribution.M[:, 2:]
    turn = span @ span[0]
    norm = float(np.linalg.norm(turn))
    if distribution.z[2] < -1e-6 or norm < 1e-3:
        return distribution
    mode = turn / norm
    other = span @ np.array([-span[0, 1], span[0, 0]]) / norm
    return Bingham.from_spectrum(np.array(distribution.z), np.column_stack([distribution.M[:, :2], other, mode]))
