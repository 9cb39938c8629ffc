"""First-order Bingham filter (Kurz et al. 2013, 2014; Glover & Kaelbling 2013 §4), d = 2 and 4."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution, check_measurement_noise, check_process_noise
from bingham.errors import InvalidArgumentError
from bingham.filters.gate import Gate
from bingham.filters.protocol import MISSING, UpdateInfo
from bingham.filters.sequence import run_conjugate
from bingham.filters.stepwise import run_rows
from bingham.filters.track import Track
from bingham.models.motion import Diffusion, Gyroscope, MotionModel, RandomWalk
from bingham.models.sensors import OrientationSensor, Sensor, condition
from bingham.validation import as_array, check_noise_side, described, is_missing

__all__ = ["BinghamFilter"]


@dataclass(frozen=True)
class BinghamFilter:
    """Recursive estimation of an axis (d = 2) or a rotation (d = 4) with Bingham distributions.

    Parameters
    ----------
    process_noise : Bingham or MotionModel
        A Bingham distribution w stands for x' = x ⊕ w once per step; `models.motion` has controls, gyroscopes,
        irregular time.
    measurement_noise : Bingham or Sensor
        A Bingham distribution v stands for z = x ⊕ v; `models.sensors` has vectors and headings.
    noise_side : {"right", "left"}
        Side on which noises given as Bingham distributions act: "right" in the body frame (Kurz), "left" in the world
        frame (Glover).
    gate : Gate, optional
        Rejects measurements that prediction and noise cannot explain; without one every measurement is used.

    Examples
    --------
    >>> import numpy as np
    >>> identity_last = np.eye(4)[:, ::-1]
    >>> noise = Bingham([-500, -500, -500, 0], identity_last)
    >>> f = BinghamFilter(Bingham([-200, -200, -200, 0], identity_last), noise)
    >>> state, info = f.update(f.predict(Bingham.uniform(4)), [0.0, 1.0, 0.0, 0.0])
    >>> np.abs(state.mode).round(6) + 0.0
    array([0., 1., 0., 0.])
    """

    process_noise: Bingham | MotionModel
    measurement_noise: Bingham | Sensor
    noise_side: Literal["right", "left"] = "right"
    gate: Gate | None = None

    def __post_init__(self) -> None:
        check_noise_side(self.noise_side)
        left = self.noise_side == "left"
        w, v = self.process_noise, self.measurement_noise
        check_process_noise(w)
        check_measurement_noise(v)
        if self.gate is not None and not isinstance(self.gate, Gate):
            number = isinstance(self.gate, float)
            raise InvalidArgumentError(
                "gate", "a Gate", described(self.gate), f"write gate=Gate({self.gate})" if number else "Gate(0.999)"
            )
        put = object.__setattr__
        put(self, "_motion", RandomWalk(w, left) if isinstance(w, Bingham) else w)
        put(self, "_sensor", OrientationSensor(v, left) if isinstance(v, Bingham) else v)
        if isinstance(self.sensor, OrientationSensor) and self.sensor.noise.dim != self.motion.dim:
            raise InvalidArgumentError(
                "measurement_noise", f"dimension {self.motion.dim}, as the process noise", self.sensor.noise.dim
            )

    @property
    def motion(self) -> MotionModel:
        """The motion model."""
        return self._motion  # type: ignore[attr-defined,no-any-return]

    @property
    def sensor(self) -> Sensor:
        """The sensor model."""
        return self._sensor  # type: ignore[attr-defined,no-any-return]

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

    def update(self, state: Bingham, z: ArrayLike | Rotation) -> tuple[Bingham, UpdateInfo]:
        """Posterior ∝ f(z | x) f(x): the sensor's likelihood matrix is added (Kurz et al. 2014, eq. 53).

        Parameters
        ----------
        state : Bingham
            The prediction, a single distribution.
        z : array_like or Rotation
            The measurement, as the sensor takes it; for Bingham noise a unit vector (d,). NaN throughout if missing.

        Returns
        -------
        Bingham
            The posterior, or `state` itself if the gate rejects or nothing was measured.
        UpdateInfo
            log_evidence = log F(A + L) − log F(A) − log F(noise), the gate's NIS, threshold, decision and reason.
        """
        check_distribution(state, "state")
        z = as_array(z)
        if is_missing(z):
            return state, MISSING
        posterior, top, log_noise, rank = condition(state, self.sensor, z)
        log_evidence = float(posterior.log_normalizer + top - state.log_normalizer - log_noise)
        threshold = math.inf if self.gate is None else self.gate.threshold(rank)
        nis = -2.0 * top
        if nis > threshold:
            reason = f"NIS {nis:.4g} above {threshold:.4g}"
            return state, UpdateInfo(log_evidence, nis, threshold, False, reason)
        return posterior, UpdateInfo(log_evidence, nis, threshold, True, "")

    def run(
        self,
        prior: Bingham,
        measurements: ArrayLike | Rotation,
        *,
        controls: ArrayLike | Rotation | None = None,
        times: ArrayLike | None = None,
        start_time: float | None = None,
        keep: Literal["all", "last"] = "all",
    ) -> Track:
        """Filter a whole recording, or a batch of them: predict, then update, for every row.

        One compiled loop for orientations and the motion models of this package; other sensors go row by row through
        `predict` and `update`, one recording at a time and about a hundred times slower.

        Parameters
        ----------
        prior : Bingham
            The distribution before the first prediction; a batch (B,) for a batch of recordings, or one distribution
            for all.
        measurements : (T, d) or (B, T, d) array_like, or Rotation
            Unit vectors, or (T, n) for a sensor that measures something else; a row of NaN is a missing measurement:
            the state is predicted only, its evidence is 0.
        controls : (T, d) or (T, 3), or with a leading B, optional
            Known rotation, or angular rate in rad/s: controls[k] acts from times[k − 1]
            (start_time for k = 0) to times[k].
        times : (T,) array_like, optional
            Strictly increasing seconds, for motion in continuous time; gaps widen the distribution.
        start_time : float, optional
            Time of the prior, s; the time of the first measurement unless given, so that nothing is predicted for it.
        keep : {"all", "last"}
            Keep every distribution or only the last one.

        Returns
        -------
        Track
            Continue from ``track.final`` (and ``start_time=times[-1]``) to get the identical track of an unbroken run.
        """
        if keep not in ("all", "last"):
            raise InvalidArgumentError("keep", "'all' or 'last'", repr(keep))
        check_distribution(prior, "prior", "the prior comes before the rows")
        if isinstance(self.sensor, OrientationSensor) and isinstance(self.motion, (RandomWalk, Diffusion, Gyroscope)):
            return run_conjugate(
                self.motion, self.sensor, self.gate, prior, measurements, controls, times, start_time, keep
            )
        return run_rows(self, prior, measurements, controls, times, start_time, keep)
