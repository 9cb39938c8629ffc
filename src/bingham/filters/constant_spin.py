"""The constant spin that suits a sequence of orientations best (the ŝ of Glover & Kaelbling 2013, §6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.errors import InvalidArgumentError
from bingham.rotations import compose, conjugate, from_rotation_vector, to_rotation_vector
from bingham.sampling.power import right_jacobian
from bingham.validation import as_numbers, unit_or_missing

__all__ = ["ConstantSpin", "fit_constant_spin"]

FloatArray = NDArray[np.float64]

# Rows of the first fit; it doubles from there on, so that an early error never grows to half a rotation.
FIRST_ROWS = 8
# Pairs of neighbours that propose a spin.
PROPOSALS = 40
# Revolutions more or fewer between neighbours that a proposal may hide.
ALIASES = (-1, 0, 1)
STEPS = 50


@dataclass(frozen=True, eq=False)
class ConstantSpin:
    """Least-squares fit of x(t) = exp(ω (t − t₀)) ⊗ x₀.

    Parameters
    ----------
    rate : ndarray, shape (3,)
        ω in rad/s, world frame; in the body frame it is R(x₀)ᵀ ω, the same all the time.
    start : ndarray, shape (4,)
        x₀, the orientation at the first time.
    start_time : float
        t₀, s.
    covariance : ndarray, shape (3, 3)
        Of ω, rad²/s², world frame, from the residuals; NaN with two orientations.
    residual : float
        Root mean square of the angles left over, for each axis, rad.
    """

    rate: FloatArray
    start: FloatArray
    start_time: float
    covariance: FloatArray
    residual: float

    @property
    def axis(self) -> FloatArray:
        """Unit vector (3,) of ω, world frame; NaN without rotation."""
        size = float(np.linalg.norm(self.rate))
        return self.rate / size if size > 0.0 else np.full(3, np.nan)

    @property
    def revolutions_per_second(self) -> float:
        """|ω|/2π."""
        return float(np.linalg.norm(self.rate)) / (2.0 * np.pi)

    def orientation(self, times: ArrayLike) -> FloatArray:
        """Return x(t) (..., 4) at times (...), s."""
        t = np.asarray(times, dtype=np.float64) - self.start_time
        return compose(from_rotation_vector(t[..., None] * self.rate), self.start)


def fit_constant_spin(orientations: ArrayLike | Rotation, times: ArrayLike) -> ConstantSpin:
    """Return the constant angular rate that minimises the squared angles between x(t) and the orientations.

    Neighbouring orientations propose rates, with a revolution more or less between them; the rate whose x₀ explains
    the first rows best is refined (Gauss–Newton) on twice as many rows each time, up to all. With equal time steps
    rates alias by whole revolutions a step: the slowest is returned.

    Parameters
    ----------
    orientations : (T, 4) array_like or Rotation
        Signs do not matter; rows of NaN are left out.
    times : (T,) array_like
        Strictly increasing, s.

    Raises
    ------
    InvalidArgumentError
        If fewer than two orientations are there, or shapes or times do not fit.

    Examples
    --------
    >>> t = np.array([0.0, 0.02, 0.05, 0.06, 0.1])
    >>> q = from_rotation_vector(t[:, None] * [0.0, 0.0, 6.0 * np.pi])
    >>> fit = fit_constant_spin(q, t)
    >>> round(fit.revolutions_per_second, 6), fit.axis.round(6) + 0.0
    (3.0, array([0., 0., 1.]))
    """
    x = np.atleast_2d(unit_or_missing(orientations, 4, "orientations"))
    t = as_numbers(times, "times")
    if x.ndim != 2 or t.shape != x.shape[:1]:
        raise InvalidArgumentError("times", f"one for each of the orientations {x.shape}, shape ({len(x)},)", t.shape)
    if not (np.all(np.isfinite(t)) and np.all(np.diff(t) > 0.0)):
        raise InvalidArgumentError("times", "finite and strictly increasing, s", t)
    seen = ~np.isnan(x[:, 0])
    x, t = x[seen], t[seen]
    if len(x) < 2:
        raise InvalidArgumentError("orientations", "at least two that are not missing", len(x))
    count = min(FIRST_ROWS, len(x))
    rate = min(_proposals(x[: PROPOSALS + 1], t[: PROPOSALS + 1]), key=lambda r: _cost(x[:count], t[:count], r))
    while True:
        rate, start, residuals, normal = _refined(x[:count], t[:count], rate)
        if count == len(x):
            break
        count = min(2 * count, len(x))
    freedom = residuals.size - 6
    variance = float(np.sum(residuals**2)) / freedom if freedom > 0 else np.nan
    covariance = np.asarray(variance * np.linalg.pinv(normal)[3:, 3:], dtype=np.float64)
    return ConstantSpin(rate, start, float(t[0]), covariance, float(np.sqrt(np.mean(residuals**2))))


def _proposals(x: FloatArray, t: FloatArray) -> list[FloatArray]:
    r = to_rotation_vector(compose(x[1:], conjugate(x[:-1])))
    size = np.linalg.norm(r, axis=1)
    axis = r / np.where(size > 0.0, size, 1.0)[:, None]
    # The slowest first: among equals `min` keeps it.
    found = [(axis * ((size + 2.0 * np.pi * k) / np.diff(t))[:, None]) for k in ALIASES]
    return sorted(np.concatenate(found), key=lambda rate: float(np.linalg.norm(rate).round(9)))


def _start(x: FloatArray, t: FloatArray, rate: FloatArray) -> tuple[FloatArray, float]:
    """Return the mean axis x₀ of exp(−ω (t − t₀)) ⊗ x and the mean of its squared projections."""
    back = compose(from_rotation_vector((t[0] - t)[:, None] * rate), x)
    values, vectors = np.linalg.eigh(back.T @ back / len(x))
    return vectors[:, -1], float(values[-1])


def _cost(x: FloatArray, t: FloatArray, rate: FloatArray) -> float:
    return round(1.0 - _start(x, t, rate)[1], 9)


def _refined(x: FloatArray, t: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return rate, x₀, residuals (n, 3) and the normal matrix (6, 6) of Gauss–Newton's method from `rate`.

    Residuals are seen from x₀: r = log(exp(−ω τ) ⊗ x ⊗ x₀*), which a change (e, a) of (x₀, ω) lowers by
    e + J(−ω τ) τ a; the Jacobian J is the integral of the rotations that lie between.
    """
    start = _start(x, t, rate)[0]
    tau = t - t[0]
    normal = np.eye(6)
    residuals = np.zeros((len(x), 3))
    for _ in range(STEPS):
        back = compose(from_rotation_vector(-tau[:, None] * rate), x)
        residuals = to_rotation_vector(compose(back, conjugate(start)))
        by_rate = tau[:, None, None] * right_jacobian(tau[:, None] * rate)
        jacobian = np.concatenate([np.tile(np.eye(3), (len(x), 1, 1)), by_rate], axis=2)
        normal = np.einsum("nij,nik->jk", jacobian, jacobian)
        step = np.linalg.pinv(normal) @ np.einsum("nij,ni->j", jacobian, residuals)
        start = compose(from_rotation_vector(step[:3]), start)
        rate = rate + step[3:]
        if np.abs(step[:3]).max() < 1e-12 and np.abs(step[3:]).max() * tau[-1] < 1e-12:
            break
    return rate, start / np.linalg.norm(start), residuals, normal
