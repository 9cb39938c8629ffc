"""Second-order quaternion Bingham filter: orientation and spin (Glover & Kaelbling 2013, §4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution
from bingham.errors import InvalidArgumentError
from bingham.filters.protocol import MISSING, UpdateInfo
from bingham.filters.run import RecursiveFilter
from bingham.filters.track import Track
from bingham.models.motion import RandomWalk
from bingham.models.sensors import OrientationSensor
from bingham.validation import as_array, check_kind, check_noise_side, unit_or_missing

__all__ = ["SecondOrderBinghamFilter", "SpinState", "classify_spin"]

FloatArray = NDArray[np.float64]
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def _check_distribution(distribution: Bingham, name: str) -> None:
    check_distribution(distribution, name)
    if distribution.dim != 4 or distribution.shape:
        raise InvalidArgumentError(name, "a single distribution of dimension 4", repr(distribution))


@dataclass(frozen=True, eq=False)
class SpinState:
    """Independent distributions of the orientation x and of the rotation v that led to it in the last step.

    Parameters
    ----------
    orientation, spin : Bingham
        Single distributions on the quaternions; spin is a rotation per step, in the world frame: x' = v ⊗ x.
    previous : Bingham, optional
        Distribution of the orientation one step before, as prediction leaves it for the update of the spin.
    """

    orientation: Bingham
    spin: Bingham
    previous: Bingham | None = None

    def __post_init__(self) -> None:
        for name in ("orientation", "spin"):
            _check_distribution(getattr(self, name), name)

    @property
    def mode(self) -> FloatArray:
        """Most probable orientation (4,)."""
        return self.orientation.mode


@dataclass(frozen=True)
class SecondOrderBinghamFilter(RecursiveFilter[SpinState, Track[SpinState]]):
    """Tracks x and v with v' = w ⊗ u ⊗ v, x' = v' ⊗ x, and measurements of x only.

    The joint distribution is kept as the product of its marginals. Given y, the spin's likelihood is F(C(v)) up to a
    factor: the distribution of x' ⊗ x*, x' with the likelihood of y as its density, x from one step before (§4). It is
    matched by moments.

    Parameters
    ----------
    process_noise : Bingham
        Distribution of w, once per step; raising its spread lets the spin change faster.
    measurement_noise : Bingham
        Distribution of the measurement noise.
    noise_side : {"left", "right"}
        Side on which the measurement noise acts: "left" in the world frame (Glover), "right" in the body frame.

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

    def __post_init__(self) -> None:
        check_noise_side(self.noise_side)
        for name in ("process_noise", "measurement_noise"):
            _check_distribution(getattr(self, name), name)
        object.__setattr__(self, "_motion", RandomWalk(self.process_noise, left=True))
        sensor = OrientationSensor(self.measurement_noise, left=self.noise_side == "left")
        object.__setattr__(self, "_sensor", sensor)

    @property
    def several(self) -> bool:
        """Whether a measurement may have several interpretations: it may."""
        return True

    @property
    def noise_per_step(self) -> bool:
        """Whether spin and noise are those of one step: they are."""
        return True

    def predict(
        self, state: SpinState, control: ArrayLike | Rotation | None = None, dt: float | None = None
    ) -> SpinState:
        """Return the state one step later; ``control`` u (4,) rotates the spin: an acceleration.

        Spin and noise are per step, whatever ``dt``.
        """
        from bingham.kernels.second_order import composed_spin

        check_kind(state, SpinState, "state", "start from SpinState(orientation, spin)")
        u = None if control is None else as_array(control)
        spin: Bingham = self._motion.propagate(state.spin, u)  # type: ignore[attr-defined]
        x = state.orientation
        return SpinState(Bingham.from_spectrum(*composed_spin(x.z, x.M, spin.z, spin.M)), spin, x)

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
        rows = np.atleast_2d(unit_or_missing(z, 4, "z"))
        if rows.ndim != 2:
            raise InvalidArgumentError("z", "shape (4,), or (k, 4) for k interpretations", rows.shape)
        rows = rows[~np.isnan(rows[:, 0])]
        if not len(rows):
            return state, MISSING
        sensor = self._sensor if noise is None else OrientationSensor(noise, left=self._sensor.left)  # type: ignore[attr-defined]
        candidates = [sensor.condition(state.orientation, row) for row in rows]
        best = max(range(len(rows)), key=lambda i: candidates[i].distribution.log_normalizer + candidates[i].top)
        orientation, top, log_noise, _ = candidates[best]
        log_evidence = float(orientation.log_normalizer + top - state.orientation.log_normalizer - log_noise)
        spin, before = state.spin, state.previous
        if before is not None:
            from bingham.kernels.second_order import conditioned_spin

            arrays = conditioned_spin(
                spin.z, spin.M, before.z, before.M, rows[best], sensor.noise.z, sensor.frame, sensor.left
            )
            spin = Bingham.from_spectrum(*arrays)
        return SpinState(orientation, spin, before), UpdateInfo(log_evidence, -2.0 * top, np.inf, True, "")


def classify_spin(spin: Bingham, types: ArrayLike) -> tuple[int, FloatArray]:
    """Return the most probable of known spins (k, 4) under the spin's distribution, and their log-densities (k,)."""
    check_distribution(spin, "spin")
    log_density = np.atleast_1d(spin.logpdf(types))
    return int(np.argmax(log_density)), log_density
