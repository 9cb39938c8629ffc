"""Second-order quaternion Bingham filter: orientation and spin (Glover & Kaelbling 2013, §4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution
from bingham.distributions.repeated import repeated
from bingham.errors import InvalidArgumentError
from bingham.filters.protocol import MISSING, UpdateInfo
from bingham.filters.run import RecursiveFilter
from bingham.filters.track import Track
from bingham.models.motion import RandomWalk
from bingham.models.sensors import OrientationSensor
from bingham.sampling.power import power, power_jacobian
from bingham.validation import check_kind, check_noise_side, check_number, unit_or_missing, unit_row

__all__ = ["Prediction", "SecondOrderBinghamFilter", "SpinState", "classify_spin"]

FloatArray = NDArray[np.float64]
# Linearisations of v^s in an update, at most: each leaves between a hundredth and a quarter of the last one's change.
RELINEARISATIONS = 30
# Change of the mode, rad, below which the next linearisation changes it by rounding only.
SETTLED = 1e-13


def _check_distribution(distribution: Bingham, name: str) -> None:
    check_distribution(distribution, name)
    if distribution.dim != 4 or distribution.shape:
        raise InvalidArgumentError(name, "a single distribution of dimension 4", repr(distribution))


class Prediction(NamedTuple):
    """What the update of the spin needs of the step before: x and v there, what turned v, and the exponent of v."""

    orientation: Bingham
    spin: Bingham
    control: FloatArray | None
    exponent: float


@dataclass(frozen=True, eq=False)
class SpinState:
    """Independent distributions of the orientation x and of the rotation v that leads to the next one.

    Parameters
    ----------
    orientation, spin : Bingham
        Single distributions on the quaternions; spin is a rotation per step, in the world frame: x' = v ⊗ x.
    before : Prediction, optional
        The state that a prediction started from; the next update uses it.
    """

    orientation: Bingham
    spin: Bingham
    before: Prediction | None = None

    def __post_init__(self) -> None:
        for name in ("orientation", "spin"):
            _check_distribution(getattr(self, name), name)

    @property
    def mode(self) -> FloatArray:
        """Most probable orientation (4,)."""
        return self.orientation.mode


@dataclass(frozen=True)
class SecondOrderBinghamFilter(RecursiveFilter[SpinState, Track[SpinState]]):
    """Tracks x and v with x' = v ⊗ x, v' = w ⊗ u ⊗ v, and measurements of x only (Glover & Kaelbling 2013, §3).

    The joint distribution is kept as the product of its marginals (§4): x' from B_v ∘ B_x, and v' from
    w ∘ u ∘ (B_v · (f_{y|x} ∘ B_x⁻¹)), B_x and B_v of the step before. f_{y|x} ∘ B_x⁻¹ stands for F(C(v)), the exact
    likelihood of v given y; every composition is matched by moments.

    Over a time dt the orientation moves by v^s, s = dt/interval, and the noise is that of s steps.

    Parameters
    ----------
    process_noise : Bingham
        Distribution of w, once per interval; raising its spread lets the spin change faster.
    measurement_noise : Bingham
        Distribution of the measurement noise.
    noise_side : {"left", "right"}
        Side on which the measurement noise acts: "left" in the world frame (Glover), "right" in the body frame.
    interval : float
        Time, s, in which v rotates the body once. The rotation in it must stay below half a revolution.

    Examples
    --------
    >>> from bingham.rotations import compose, from_rotation_vector
    >>> near = np.eye(4)[:, ::-1]
    >>> f = SecondOrderBinghamFilter(Bingham([-1e4] * 3 + [0], near), Bingham([-400] * 3 + [0], near))
    >>> state = SpinState(Bingham.uniform(4), Bingham([-3] * 3 + [0], near))
    >>> spin, x = from_rotation_vector([0.0, 0.0, 0.8]), np.array([1.0, 0.0, 0.0, 0.0])
    >>> for _ in range(20):
    ...     x = compose(spin, x)
    ...     state, info = f.update(f.predict(state), x)
    >>> np.abs(state.spin.mode @ spin).round(3)
    np.float64(1.0)
    """

    process_noise: Bingham
    measurement_noise: Bingham
    noise_side: Literal["left", "right"] = "left"
    interval: float = 1.0

    def __post_init__(self) -> None:
        check_noise_side(self.noise_side)
        for name in ("process_noise", "measurement_noise"):
            _check_distribution(getattr(self, name), name)
        check_number(self.interval, "interval", "a time > 0, s", above=0.0)
        sensor = OrientationSensor(self.measurement_noise, left=self.noise_side == "left")
        object.__setattr__(self, "_sensor", sensor)
        object.__setattr__(self, "_motion", RandomWalk(self.process_noise, left=True))

    @property
    def several(self) -> bool:
        """Whether a measurement may have several interpretations: it may."""
        return True

    def predict(
        self, state: SpinState, control: ArrayLike | Rotation | None = None, dt: float | None = None
    ) -> SpinState:
        """Return the state one step, or ``dt`` seconds, later; ``control`` u (4,) changes the spin: an acceleration.

        The orientation moves by the spin that it had before (x' = v ⊗ x), which u and w change for the next step.
        """
        from bingham.kernels.single import composed_spin

        check_kind(state, SpinState, "state", "start from SpinState(orientation, spin)")
        u = None if control is None else unit_row(control, 4, "control")
        exponent = 1.0
        if dt is not None:
            check_number(dt, "dt", "a time ≥ 0, s", minimum=0.0)
            exponent = float(dt) / self.interval
        if exponent == 0.0:
            return SpinState(state.orientation, state.spin if u is None else state.spin.rotate(left=u))
        x, v = state.orientation, state.spin
        turn = power(v, exponent)
        moved = Bingham.from_spectrum(*composed_spin(x.z, x.M, turn.z, turn.M))
        return SpinState(moved, self._changed(v, u, exponent), Prediction(x, v, u, exponent))

    def _changed(self, spin: Bingham, control: FloatArray | None, exponent: float) -> Bingham:
        """Return the distribution of w ⊗ u ⊗ v."""
        motion: RandomWalk = self._motion  # type: ignore[attr-defined]
        if exponent != 1.0:
            motion = RandomWalk(repeated(self.process_noise, exponent), left=True)
        return motion.propagate(spin, control)

    def update(
        self, state: SpinState, z: ArrayLike | Rotation, *, noise: Bingham | None = None
    ) -> tuple[SpinState, UpdateInfo]:
        """Return the posterior given a measured orientation.

        Parameters
        ----------
        state : SpinState
            The prediction; a state that was never predicted has its spin left alone.
        z : (4,) or (k, 4) array_like or Rotation
            One orientation; or k interpretations of an ambiguous one, of which the most probable is used; rows of NaN
            are left out, and nothing but NaN means that nothing was measured.
        noise : Bingham, optional
            Replaces the measurement noise for this update, a girdle for instance.

        Returns
        -------
        SpinState
            The posterior.
        UpdateInfo
            ``log_evidence`` of the interpretation used.
        """
        check_kind(state, SpinState, "state", "start from SpinState(orientation, spin)")
        rows = self._rows(z)
        if not len(rows):
            return state, MISSING
        sensor: OrientationSensor = self._sensor  # type: ignore[attr-defined]
        sensor = sensor if noise is None else OrientationSensor(noise, left=sensor.left)
        best, info, orientation = self._best(state.orientation, rows, sensor)
        spin, before = state.spin, state.before
        if before is not None:
            found = _conditioned(before, rows[best], sensor)
            spin = self._changed(found, before.control, before.exponent)
        return SpinState(orientation, spin), info

    def _rows(self, z: ArrayLike | Rotation) -> FloatArray:
        """Return the interpretations (k, 4) that are not missing."""
        rows = np.atleast_2d(unit_or_missing(z, 4, "z"))
        if rows.ndim != 2:
            raise InvalidArgumentError("z", "shape (4,), or (k, 4) for k interpretations", rows.shape)
        return rows[~np.isnan(rows[:, 0])]

    def _best(self, predicted: Bingham, rows: FloatArray, sensor: OrientationSensor) -> tuple[int, UpdateInfo, Bingham]:
        """Return the most probable of the interpretations (k, 4), what its update says and its posterior."""
        candidates = [sensor.condition(predicted, row) for row in rows]
        best = max(range(len(rows)), key=lambda i: candidates[i].distribution.log_normalizer + candidates[i].top)
        orientation, top, log_noise, _ = candidates[best]
        log_evidence = float(orientation.log_normalizer + top - predicted.log_normalizer - log_noise)
        return best, UpdateInfo(log_evidence, -2.0 * top, np.inf, True, ""), orientation


def _conditioned(before: Prediction, y: FloatArray, sensor: OrientationSensor) -> Bingham:
    """Return B_v · (f_{y|x} ∘ B_x⁻¹)(v^s), the distribution of the spin that led to the measurement y.

    For s ≠ 1 v^s is linear in v around the mode of the result, which is found by repetition (Gauss and Newton's way):
    then the likelihood of v^s, a quadratic form, is one of v.
    """
    from bingham.kernels.single import conditioned_spin

    x, v = before.orientation, before.spin
    if before.exponent == 1.0:
        parts = conditioned_spin(v.z, v.M, x.z, x.M, y, sensor.noise.z, sensor.frame, sensor.left)
        return Bingham.from_spectrum(*parts)
    flat, frame = np.zeros(4), np.eye(4)
    likelihood = Bingham.from_spectrum(
        *conditioned_spin(flat, frame, x.z, x.M, y, sensor.noise.z, sensor.frame, sensor.left)
    ).matrix
    found = v
    for _ in range(RELINEARISATIONS):
        near = found.mode
        _, jacobian = power_jacobian(near, before.exponent)
        found = Bingham.from_matrix(v.matrix + jacobian.T @ likelihood @ jacobian)
        # The distance of ±near, not 1 − |cos|: that loses half of the digits.
        if min(np.linalg.norm(near - found.mode), np.linalg.norm(near + found.mode)) < SETTLED:
            break
    return found


def classify_spin(spin: Bingham, types: ArrayLike) -> tuple[int, FloatArray]:
    """Return the most probable of known spins (k, 4) under the spin's distribution, and their log-densities (k,)."""
    check_distribution(spin, "spin")
    log_density = np.atleast_1d(spin.logpdf(types))
    return int(np.argmax(log_density)), log_density
