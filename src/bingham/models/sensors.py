"""Conjugate sensors: measurements whose likelihood is exp(xᵀ L x), so that updating is adding L.

Each returns a `Likelihood`; the evidence of a measurement is log F(A + L) − log F(A) − log_normalizer.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution
from bingham.errors import InvalidArgumentError
from bingham.kernels.single import added_4, updated_2, updated_4
from bingham.rotations import compose, conjugate, from_rotation_vector, rotate
from bingham.validation import UNIT_TOLERANCE, as_numbers, check_number, described, unit_row, unit_rows

__all__ = [
    "Conditioned",
    "HeadingSensor",
    "Likelihood",
    "OrientationSensor",
    "Sensor",
    "VectorSensor",
    "condition",
    "davenport_matrix",
]

FloatArray = NDArray[np.float64]


class Likelihood(NamedTuple):
    """f(z | x) = exp(xᵀ matrix x − log_normalizer): largest eigenvalue of matrix (d, d) 0; rank: degrees of freedom."""

    matrix: FloatArray
    log_normalizer: float
    rank: int


class Conditioned(NamedTuple):
    """A posterior, the largest eigenvalue ``top`` ≤ 0 of A + L, and the likelihood's log_normalizer and rank."""

    distribution: Bingham
    top: float
    log_normalizer: float
    rank: int


class Sensor(Protocol):
    """What a filter asks of a conjugate sensor; in a list of sensors also ``size``, the numbers in a measurement."""

    def likelihood(self, z: ArrayLike, predicted: Bingham) -> Likelihood:
        """Return the likelihood of the measurement z; some sensors linearise about the predicted mode."""
        ...


def condition(state: Bingham, sensor: Sensor, z: ArrayLike) -> Conditioned:
    """Return the distribution ∝ f(x) f(z | x), x ~ `state`, a single distribution: its matrix is A + L."""
    if isinstance(sensor, OrientationSensor):
        return sensor.condition(state, z)
    likelihood = sensor.likelihood(z, state)
    if type(sensor) not in (VectorSensor, HeadingSensor):
        _check_likelihood(likelihood, type(sensor).__name__, state.dim)
    if likelihood.matrix.shape != (state.dim, state.dim) or state.shape:
        expected = f"a single distribution of dimension {likelihood.matrix.shape[-1]}"
        raise InvalidArgumentError("state", expected, repr(state))
    if state.dim == 4:
        frame_z, frame, log_f, top = added_4(state.z, state.M, likelihood.matrix)
        distribution = Bingham.from_spectrum(frame_z, frame, log_f)
    else:
        values, frame = np.linalg.eigh(state.matrix + likelihood.matrix)
        top = float(values[-1])
        distribution = Bingham.from_spectrum(values - top, np.ascontiguousarray(frame))
    return Conditioned(distribution, top, likelihood.log_normalizer, likelihood.rank)


def _check_likelihood(likelihood: Any, sensor: str, d: int) -> None:
    """Reject what somebody's sensor returns if it is no likelihood of an orientation of dimension d."""
    expected = f"a Likelihood from {sensor}, its matrix finite and symmetric ({d}, {d})"
    if not isinstance(likelihood, Likelihood):
        raise InvalidArgumentError("likelihood", expected, described(likelihood))
    matrix = np.asarray(likelihood.matrix)
    if matrix.shape != (d, d):
        raise InvalidArgumentError("likelihood", expected, f"shape {matrix.shape}")
    if not (np.isfinite(matrix).all() and np.isfinite(likelihood.log_normalizer)):
        hint = "what measures nothing is NaN throughout in the measurement, not in its likelihood"
        raise InvalidArgumentError("likelihood", expected, "NaN or infinity", hint)
    scale = max(1.0, float(np.abs(matrix).max()))
    if np.abs(matrix - matrix.T).max() > UNIT_TOLERANCE * scale:
        raise InvalidArgumentError("likelihood", expected, "one that is not symmetric")
    top = float(np.linalg.eigvalsh(matrix)[-1])
    if abs(top) > UNIT_TOLERANCE * scale:
        hint = "subtract it from the diagonal and from log_normalizer: the density stays the same"
        raise InvalidArgumentError("likelihood", f"{expected}, 0 its largest eigenvalue", f"{top:.6g}", hint)


@dataclass(frozen=True)
class OrientationSensor:
    """z = x ⊕ v (or v ⊕ x, ``left``), v ~ `noise`: L = N diag(z_v) Nᵀ, N = ẑ ⊕ (D M_v) (Kurz et al. 2014, eq. 52).

    Parameters
    ----------
    noise : Bingham
        d = 2 or 4; its mode may be a constant offset (bias).
    left : bool, optional
        True when the noise acts in the world frame. Unless given, as ``noise_side`` of the filter says; False without
        one.

    Notes
    -----
    Algorithm 2 of the paper prints M^p where the noise's M^v is meant.
    """

    noise: Bingham
    left: bool | None = None

    def __post_init__(self) -> None:
        check_distribution(self.noise, "noise")
        if self.noise.dim not in (2, 4) or self.noise.shape:
            raise InvalidArgumentError("noise", "a single distribution of dimension 2 or 4", repr(self.noise))

    @property
    def size(self) -> int:
        """Numbers in a measurement: d."""
        return self.noise.dim

    @cached_property
    def frame(self) -> FloatArray:
        """Conjugated noise axes by rows (d, d): D M_v."""
        return np.ascontiguousarray(conjugate(self.noise.M.T))

    @cached_property
    def mode(self) -> FloatArray:
        """Mode of the noise (d,), contiguous."""
        return np.array(self.noise.mode)

    def likelihood(self, z: ArrayLike, predicted: Bingham | None = None) -> Likelihood:
        """Return the likelihood matrix of the measured orientation z (d,)."""
        y = unit_rows(z, self.noise.dim, "z")
        axes = compose(self.frame, y) if self.left else compose(y, self.frame)
        return Likelihood((axes.T * self.noise.z) @ axes, float(self.noise.log_normalizer), self.noise.dim - 1)

    def condition(self, state: Bingham, z: ArrayLike) -> Conditioned:
        """Return the posterior without forming L, which keeps the digits of very different concentrations."""
        noise = self.noise
        d = noise.dim
        if state.z.shape != (d,):
            raise InvalidArgumentError("state", f"a single distribution of dimension {d}", repr(state))
        y = unit_row(z, d, "z")
        if d == 4:
            new_z, frame, log_f, top = updated_4(state.z, state.M, y, noise.z, self.frame, bool(self.left))
        else:
            new_z, frame = np.empty(2), np.empty((2, 2))
            log_f, top = updated_2(state.z, state.M, y, noise.z, self.mode, new_z, frame)
        return Conditioned(Bingham.from_spectrum(new_z, frame, log_f), top, noise.log_normalizer, d - 1)


def davenport_matrix(r: ArrayLike, b: ArrayLike) -> FloatArray:
    """Return the symmetric K (..., 4, 4) with rᵀ R(q) b = qᵀ K q for world vectors r and body vectors b (..., 3).

    R(q) b = vec(q ⊗ b ⊗ q*), hence K = [[r·b, (b × r)ᵀ], [b × r, r bᵀ + b rᵀ − (r·b) I]] (Davenport's q-method).
    """
    r, b = np.broadcast_arrays(np.asarray(r, dtype=np.float64), np.asarray(b, dtype=np.float64))
    dot = np.sum(r * b, axis=-1)
    k = np.empty((*r.shape[:-1], 4, 4))
    k[..., 0, 0] = dot
    k[..., 0, 1:] = k[..., 1:, 0] = np.cross(b, r)
    outer = r[..., :, None] * b[..., None, :]
    k[..., 1:, 1:] = outer + np.swapaxes(outer, -1, -2) - dot[..., None, None] * np.eye(3)
    return k


@dataclass(frozen=True)
class VectorSensor:
    """A known world direction seen in the body frame, with von Mises–Fisher noise: L = κ (K(r, b) − I), exact.

    Parameters
    ----------
    reference : (3,) array_like
        The direction r in the world; its length does not matter.
    concentration : float
        κ > 0; at high values the direction's variance is 1/κ rad² per axis.
    """

    size: ClassVar[int] = 3

    reference: ArrayLike
    concentration: float

    def __post_init__(self) -> None:
        r = as_numbers(self.reference, "reference")
        if r.shape != (3,) or not (np.all(np.isfinite(r)) and np.linalg.norm(r) > 0.0):
            raise InvalidArgumentError("reference", "a finite non-zero vector (3,)", self.reference)
        check_number(self.concentration, "concentration", "a finite number > 0", above=0.0)
        object.__setattr__(self, "reference", tuple((r / np.linalg.norm(r)).tolist()))

    def likelihood(self, z: ArrayLike, predicted: Bingham | None = None) -> Likelihood:
        """Return the likelihood of the measured body vector z (3,); only its direction counts."""
        b = np.asarray(z, dtype=np.float64)
        norm = float(np.linalg.norm(b))
        if b.shape != (3,) or not (np.isfinite(norm) and norm > 0.0):
            raise InvalidArgumentError("z", "a finite non-zero vector (3,)", z)
        k = self.concentration
        # ∫ exp(κ rᵀu − κ) du over S² = 2π (1 − e^{−2κ})/κ.
        log_f = float(np.log(-2.0 * np.pi * np.expm1(-2.0 * k) / k))
        return Likelihood(k * (davenport_matrix(self.reference, b / norm) - np.eye(4)), log_f, 2)


@dataclass(frozen=True)
class HeadingSensor:
    """The heading of a body vector (a magnetometer's share); inclination stays untouched: L = −2κ v vᵀ.

    v = k ⊗ q_h with k the vertical and q_h the predicted mode rotated about it until the measured vector's horizontal
    part points along `reference`. Along turns about the vertical this is the von Mises distribution exp(κ cos ψ) of
    the heading error ψ.

    Parameters
    ----------
    concentration : float
        κ > 0; at high values the heading's variance is 1/κ rad².
    reference : (2,) array_like
        Where the vector points in the horizontal plane (east, north); the default is (magnetic) north.
    """

    size: ClassVar[int] = 3

    concentration: float
    reference: ArrayLike = (0.0, 1.0)

    def __post_init__(self) -> None:
        check_number(self.concentration, "concentration", "a finite number > 0", above=0.0)
        r = as_numbers(self.reference, "reference")
        if r.shape != (2,) or not (np.all(np.isfinite(r)) and np.linalg.norm(r) > 0.0):
            raise InvalidArgumentError(
                "reference", "a finite non-zero vector (2,) in the horizontal plane", self.reference
            )
        object.__setattr__(self, "reference", tuple(r.tolist()))

    def likelihood(self, z: ArrayLike, predicted: Bingham) -> Likelihood:
        """Return the likelihood of the measured body vector z (3,) about the predicted mode."""
        from scipy.special import i0e

        b = np.asarray(z, dtype=np.float64)
        if b.shape != (3,) or not np.all(np.isfinite(b)):
            raise InvalidArgumentError("z", "a finite vector (3,)", z)
        east, north = rotate(predicted.mode, b)[:2]
        if np.hypot(east, north) == 0.0:
            raise InvalidArgumentError(
                "z", "a vector with a horizontal part", z, "a vertical field has no heading: skip it"
            )
        r = np.asarray(self.reference, dtype=np.float64)
        turn = np.arctan2(r[1], r[0]) - np.arctan2(north, east)
        q = compose(from_rotation_vector([0.0, 0.0, turn]), predicted.mode)
        v = compose([0.0, 0.0, 0.0, 1.0], q)
        k = self.concentration
        return Likelihood(-2.0 * k * np.outer(v, v), float(np.log(2.0 * np.pi * i0e(k))), 1)
