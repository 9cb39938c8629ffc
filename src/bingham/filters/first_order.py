"""First-order Bingham filter (Kurz et al. 2013, 2014; Glover & Kaelbling 2013 §4), d = 2 and 4."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution, check_measurement_noise, check_process_noise
from bingham.errors import InvalidArgumentError
from bingham.filters.gate import Gate, check_gate
from bingham.filters.protocol import MISSING, UpdateInfo
from bingham.filters.run import RecursiveFilter, Rows
from bingham.filters.sensor_list import columns, rows_of, update_all
from bingham.filters.sequence import has_loop, run_compiled
from bingham.filters.track import BinghamTrack
from bingham.models.motion import MotionModel, RandomWalk, on_side
from bingham.models.sensors import OrientationSensor, Sensor, condition
from bingham.validation import as_array, check_noise_side, is_missing

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["BinghamFilter"]


@dataclass(frozen=True)
class BinghamFilter(RecursiveFilter[Bingham, BinghamTrack]):
    """Recursive estimation of an axis (d = 2) or a rotation (d = 4) with Bingham distributions.

    `run` is one compiled loop, a microsecond or two a row, for the motions and sensors of `bingham.models`, batches of
    recordings included; other motions and sensors go row by row through `predict` and `update`.

    Parameters
    ----------
    process_noise : Bingham or MotionModel
        A Bingham distribution w stands for x' = x ⊕ w once per step; `bingham.models` has controls, gyroscopes,
        irregular time.
    measurement_noise : Bingham or Sensor, or a sequence of them
        A Bingham distribution v stands for z = x ⊕ v; `bingham.models` has vectors and headings. With a sequence, a
        measurement is the numbers of all sensors in one row, or a tuple with one array for each; what a sensor did not
        measure is NaN, or None in the tuple. They are used in their order.
    noise_side : {"right", "left"}
        Side of noises and controls: "right" in the body frame, x' = x ⊕ u ⊕ w (Kurz); "left" in the world frame,
        x' = w ⊕ u ⊕ x (Glover). Models that name a side of their own keep it; a `Gyroscope` is fixed to the body.
    gate : Gate, optional
        Rejects measurements that prediction and noise cannot explain; without one every measurement is used.

    Examples
    --------
    >>> identity_last = np.eye(4)[:, ::-1]
    >>> noise = Bingham([-500, -500, -500, 0], identity_last)
    >>> f = BinghamFilter(Bingham([-200, -200, -200, 0], identity_last), noise)
    >>> state, info = f.update(f.predict(Bingham.uniform(4)), [0.0, 1.0, 0.0, 0.0])
    >>> np.abs(state.mode).round(6) + 0.0
    array([0., 1., 0., 0.])

    A gyroscope, and gravity and the field as the body sees them, 0.01 s apart:

    >>> from bingham import Gyroscope, HeadingSensor, VectorSensor
    >>> f = BinghamFilter(Gyroscope(0.01), [VectorSensor([0.0, 0.0, 1.0], 1e3), HeadingSensor(100.0)])
    >>> up, field = np.tile([0.0, 0.0, 1.0], (50, 1)), np.tile([0.0, 0.4, -0.9], (50, 1))
    >>> track = f.run(Bingham.uniform(4), (up, field), controls=np.zeros((50, 3)), times=np.arange(50) / 100)
    >>> np.abs(track.modes[-1]).round(6) + 0.0
    array([1., 0., 0., 0.])
    """

    process_noise: Bingham | MotionModel
    measurement_noise: Bingham | Sensor | Sequence[Bingham | Sensor]
    noise_side: Literal["right", "left"] = "right"
    gate: Gate | None = None

    def __post_init__(self) -> None:
        check_noise_side(self.noise_side)
        check_process_noise(self.process_noise)
        if isinstance(self.measurement_noise, list):
            object.__setattr__(self, "measurement_noise", tuple(self.measurement_noise))
        if not self._noises:
            raise InvalidArgumentError("measurement_noise", "at least one sensor", "an empty sequence")
        for v in self._noises:
            check_measurement_noise(v)
        check_gate(self.gate)
        for sensor in self.sensors:
            if isinstance(sensor, OrientationSensor) and sensor.noise.dim != self.motion.dim:
                raise InvalidArgumentError(
                    "measurement_noise", f"dimension {self.motion.dim}, as the process noise", sensor.noise.dim
                )
        if self.in_list:
            columns(self.sensors)

    @property
    def in_list(self) -> bool:
        """Whether there is a sequence of sensors."""
        return isinstance(self.measurement_noise, tuple)

    @property
    def _noises(self) -> Sequence[Any]:
        v = self.measurement_noise
        return v if isinstance(v, tuple) else (v,)

    @cached_property
    def motion(self) -> MotionModel:
        """The motion model, on its side."""
        w, left = self.process_noise, self.noise_side == "left"
        return RandomWalk(w, left) if isinstance(w, Bingham) else on_side(w, left)

    @cached_property
    def sensors(self) -> tuple[Sensor, ...]:
        """The sensor models, on their side."""
        left = self.noise_side == "left"
        return tuple(OrientationSensor(v, left) if isinstance(v, Bingham) else on_side(v, left) for v in self._noises)

    @property
    def needs_times(self) -> bool:
        """Whether the motion model is one in continuous time."""
        return getattr(self.motion, "continuous_time", None) is True

    @property
    def noise_per_step(self) -> bool:
        """Whether the process noise is that of one step."""
        return getattr(self.motion, "continuous_time", None) is False

    @property
    def batched(self) -> bool:
        """Whether `run` takes batches of recordings: where it is compiled."""
        return has_loop(self.motion, self.sensors)

    def predict(self, state: Bingham, control: ArrayLike | Rotation | None = None, dt: float | None = None) -> Bingham:
        """Distribution of x ⊕ u ⊕ w for x ~ `state`, w ~ the process noise (Kurz et al. 2014, eq. 47).

        Parameters
        ----------
        state : Bingham
            A single distribution.
        control : (d,) or (3,) array_like or Rotation, optional
            Known rotation u, or the angular rate in rad/s for a `Gyroscope`.
        dt : float, optional
            Seconds, for motion models in continuous time; noise given once per step does not depend on it.
        """
        check_distribution(state, "state")
        return self.motion.propagate(state, None if control is None else as_array(control), dt)

    def update(self, state: Bingham, z: ArrayLike | Rotation | tuple[Any, ...]) -> tuple[Bingham, UpdateInfo]:
        """Posterior ∝ f(z | x) f(x): the sensor's likelihood matrix is added (Kurz et al. 2014, eq. 53).

        Parameters
        ----------
        state : Bingham
            The prediction, a single distribution.
        z : array_like or Rotation, or a tuple of them
            The measurement, as the sensor takes it; for Bingham noise a unit vector (d,). NaN throughout if missing.

        Returns
        -------
        Bingham
            The posterior, or `state` itself if the gate rejects or nothing was measured.
        UpdateInfo
            log_evidence = log F(A + L) − log F(A) − log F(noise), NIS, the gate's threshold, decision and reason.
        """
        check_distribution(state, "state")
        if self.in_list:
            return update_all(state, self.sensors, self.gate, z)
        if not isinstance(z, np.ndarray):
            z = as_array(z)  # type: ignore[arg-type]
        if is_missing(z):
            return state, MISSING
        posterior, top, log_noise, rank = condition(state, self.sensors[0], z)
        log_evidence = float(posterior.log_normalizer + top - state.log_normalizer - log_noise)
        threshold = math.inf if self.gate is None else self.gate.threshold(rank)
        nis = -2.0 * top
        if nis > threshold:
            reason = f"NIS {nis:.4g} above {threshold:.4g}"
            return state, UpdateInfo(log_evidence, nis, threshold, False, reason)
        return posterior, UpdateInfo(log_evidence, nis, threshold, True, "")

    def _check_prior(self, prior: Bingham) -> None:
        check_distribution(prior, "prior", "the prior comes before the rows")
        if prior.shape and not self.batched:
            models = ", ".join(type(model).__name__ for model in (self.motion, *self.sensors))
            raise InvalidArgumentError("prior", f"a single distribution, for {models}", f"a batch {prior.shape}")

    def _measurements(self, measurements: Any) -> tuple[NDArray[np.float64], NDArray[np.bool_] | None]:
        return rows_of(self.sensors, measurements) if self.in_list else super()._measurements(measurements)

    def _compiled(self, prior: Bingham, rows: Rows) -> BinghamTrack | None:
        if not has_loop(self.motion, self.sensors):
            return None
        return run_compiled(self.motion, self.sensors, self.gate, prior, rows, in_list=self.in_list)
