"""Orientation and angular rate of a turning body with their joint covariance, at irregular times.

`SecondOrderBinghamFilter` keeps orientation and spin as independent (Glover & Kaelbling 2013, §4), which lets it start
from nothing and survive half-turn ambiguities; but an orientation that was predicted by the spin is not independent of
it, so its spin is neither as accurate as it could be nor as its distribution says. Where both are known narrowly, this
filter keeps the covariance between them, in the tangent space, and reports the marginals as Bingham distributions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.filters.constant_spin import fit_constant_spin
from bingham.validation import as_numbers, check_noise_side, check_number, unit_or_missing

__all__ = ["SpinFilter", "SpinTrack", "SpinningBody", "spin_prior", "tuned_spin_filter"]

FloatArray = NDArray[np.float64]

# Rows that make the prior, and how much wider it is than their fit: they are filtered again.
PRIOR_ROWS = 12
WIDER = 30.0
# Rows that the noises are learned from.
TUNED_ROWS = 5000
# Learned random walks below this share of the spin a second make no difference.
SLOWEST_WALK = 1e-5


@dataclass(frozen=True, eq=False)
class SpinningBody:
    """Orientation (4,), angular rate (3,) in rad/s, world frame, and the covariance (6, 6) of their errors.

    The error of the orientation is a rotation vector in the world frame, the other that of the rate.
    """

    orientation: FloatArray
    rate: FloatArray
    covariance: FloatArray

    @property
    def mode(self) -> FloatArray:
        """The orientation (4,)."""
        return self.orientation


@dataclass(frozen=True, eq=False)
class SpinTrack:
    """Filtered orientations and rates: time (T,), modes (T, 4), rates (T, 3), covariances (T, 6, 6).

    ``log_evidence`` (T,) and ``nis`` (T,) are those of the measurements, 0 and NaN where one is missing.
    """

    time: FloatArray
    modes: FloatArray
    rates: FloatArray
    covariances: FloatArray
    log_evidence: FloatArray
    nis: FloatArray

    def __len__(self) -> int:
        return len(self.modes)

    @property
    def final(self) -> SpinningBody:
        """The last state."""
        return SpinningBody(self.modes[-1].copy(), self.rates[-1].copy(), self.covariances[-1].copy())

    @property
    def accepted(self) -> NDArray[np.bool_]:
        """Which rows were measured (T,)."""
        return np.isfinite(self.nis)

    @property
    def distributions(self) -> Bingham:
        """Marginal distributions of the orientation, a batch (T,)."""
        return Bingham.from_covariance(self.modes, self.covariances[:, :3, :3], frame="world")


@dataclass(frozen=True)
class SpinFilter:
    """Tracks x and ω with x' = exp(ω dt) ⊗ x, a random walk of ω, and measured orientations.

    Parameters
    ----------
    measurement_noise : float or (3, 3) array_like
        Standard deviation, rad, of a measurement about each axis; or its covariance, rad².
    spin_walk : float
        Random walk of the rate, rad/s/√s: raising it lets the spin change faster.
    noise_side : {"right", "left"}
        Frame of a covariance: "right" is the body's, "left" the world's.
    """

    measurement_noise: float | ArrayLike
    spin_walk: float
    noise_side: Literal["right", "left"] = "right"

    def __post_init__(self) -> None:
        check_noise_side(self.noise_side)
        check_number(self.spin_walk, "spin_walk", "a finite number ≥ 0, rad/s/√s", minimum=0.0)
        noise = as_numbers(self.measurement_noise, "measurement_noise")
        covariance = noise**2 * np.eye(3) if noise.ndim == 0 else noise
        if covariance.shape != (3, 3) or not np.all(np.linalg.eigvalsh(covariance) > 0.0):
            raise InvalidArgumentError(
                "measurement_noise", "a number > 0, rad, or a positive definite (3, 3), rad²", noise
            )
        object.__setattr__(self, "_noise", np.ascontiguousarray(covariance))

    def predict(self, state: SpinningBody, control: None = None, dt: float | None = None) -> SpinningBody:
        """Return the state after dt seconds."""
        if dt is None:
            raise InvalidArgumentError("dt", "a time step in s", None, "the rate is in rad/s")
        return self._run(state, np.full((1, 4), np.nan), np.array([float(dt)]), 0.0).final

    def run(
        self, prior: SpinningBody, measurements: ArrayLike | Rotation, times: ArrayLike, start_time: float | None = None
    ) -> SpinTrack:
        """Filter measured orientations (T, 4) at strictly increasing times (T,), s; rows of NaN are missing.

        The prior is at ``start_time``, that of the first measurement unless given.
        """
        z = np.ascontiguousarray(unit_or_missing(measurements, 4, "measurements"))
        t = np.ascontiguousarray(as_numbers(times, "times"))
        if z.ndim != 2 or t.shape != z.shape[:1] or not len(t):
            raise InvalidArgumentError("times", f"shape ({len(z)},), one for each measurement", t.shape)
        if not (np.all(np.isfinite(t)) and np.all(np.diff(t) > 0.0)):
            raise InvalidArgumentError("times", "finite and strictly increasing, s", t)
        return self._run(prior, z, t, float(t[0]) if start_time is None else float(start_time))

    def _run(self, prior: SpinningBody, z: FloatArray, t: FloatArray, start: float) -> SpinTrack:
        from bingham.kernels.spin import run_spin

        count = len(t)
        q, rate, covariance = (np.array(a, dtype=np.float64) for a in (prior.orientation, prior.rate, prior.covariance))
        out = np.empty((count, 4)), np.empty((count, 3)), np.empty((count, 6, 6)), np.empty(count), np.empty(count)
        noise: FloatArray = self._noise  # type: ignore[attr-defined]
        body = self.noise_side == "right"
        run_spin(t, z, start, q, rate, covariance, float(self.spin_walk), noise, body, *out)
        return SpinTrack(t, *out)


def spin_prior(measurements: ArrayLike | Rotation, times: ArrayLike) -> SpinningBody:
    """Return a prior for the first row: the constant spin of the first rows, with a covariance much wider than its own.

    Raises
    ------
    InvalidArgumentError
        If fewer than four orientations are there.
    """
    z = np.atleast_2d(unit_or_missing(measurements, 4, "measurements"))
    seen = np.flatnonzero(~np.isnan(z[:, 0]))[:PRIOR_ROWS]
    if len(seen) < 4:
        raise InvalidArgumentError("measurements", "at least four orientations, to know a spin", len(seen))
    fit = fit_constant_spin(z[seen], np.asarray(times, dtype=np.float64)[seen])
    # A fit that leaves nothing over (rounded or simulated data) still does not know better than a millionth.
    spread = np.maximum(WIDER**2 * np.diag(fit.covariance).max(), 1e-6 * max(1.0, float(fit.rate @ fit.rate)))
    start = max((WIDER * fit.residual) ** 2, 1e-8)
    covariance = np.diag(np.repeat([min(start, 1.0), spread], 3))
    return SpinningBody(fit.orientation(np.asarray(times, dtype=np.float64)[0]), fit.rate, covariance)


def tuned_spin_filter(
    measurements: ArrayLike | Rotation,
    times: ArrayLike,
    *,
    measurement_noise: float | None = None,
    spin_walk: float | None = None,
) -> SpinFilter:
    """Return the filter whose noises make the measurements most probable, those given left as they are.

    Maximum of the evidence of the first 5000 rows over the measurement noise (isotropic) and the random walk of the
    rate. Evidence cannot tell walks apart that are too slow to matter: a constant spin gets one of 1e-5 of the rate.
    """
    from scipy.optimize import minimize

    z = np.ascontiguousarray(np.atleast_2d(unit_or_missing(measurements, 4, "measurements")))[:TUNED_ROWS]
    t = np.ascontiguousarray(as_numbers(times, "times"))[:TUNED_ROWS]
    prior = spin_prior(z, t)
    seen = np.flatnonzero(~np.isnan(z[:, 0]))[:PRIOR_ROWS]
    residual = max(fit_constant_spin(z[seen], t[seen]).residual, 1e-6)
    slowest = SLOWEST_WALK * max(1.0, float(np.linalg.norm(prior.rate)))
    known = [measurement_noise, spin_walk]
    free = [k for k in range(2) if known[k] is None]
    base = np.log([measurement_noise or residual, max(spin_walk or 0.0, slowest)])

    def made(logs: FloatArray) -> SpinFilter:
        noise, walk = np.exp(logs)
        return SpinFilter(measurement_noise or float(noise), float(walk) if spin_walk is None else spin_walk)

    def loss(values: FloatArray) -> float:
        logs = base.copy()
        logs[free] = values
        if logs[1] < np.log(slowest):
            return np.inf
        value = -float(made(logs).run(prior, z, t).log_evidence.sum())
        return value if np.isfinite(value) else np.inf

    if not free:
        return made(base)
    best = None
    for walk in (slowest * 3.0, 1.0, 30.0) if 1 in free else (1.0,):
        start = base.copy()
        if 1 in free:
            start[1] = np.log(max(walk, 2.0 * slowest))
        found = minimize(loss, start[free], method="Nelder-Mead", options={"xatol": 1e-3, "fatol": 1e-3, "maxfev": 120})
        if best is None or found.fun < best.fun:
            best = found
    assert best is not None
    logs = base.copy()
    logs[free] = best.x
    return made(logs)
