"""The filters of the precession study and their scores: error, an angle of rotation, and coverage of 95 % regions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bingham.baselines.axial_kalman import AxialKalmanFilter
from bingham.baselines.gaussian import GaussianState
from bingham.distributions.bingham import Bingham
from bingham.distributions.relations import to_gaussian
from bingham.filters.second_order import SecondOrderBinghamFilter, SpinState
from bingham.metrics import (
    angle_probability,
    chi_square_probability,
    coverage,
    geodesic_error,
    nees,
    root_mean_square,
)
from bingham.studies.madaan2017_bodies import NOISE, PRIOR, isotropic
from bingham.studies.study import Arrays

__all__ = ["kalman", "scores", "second_order"]

FloatArray = NDArray[np.float64]
# Prior of the spin, as in Glover & Kaelbling's study of balls.
SPIN_PRIOR = isotropic(-3.0)
# Coverage is counted on every THIN-th step: neighbours say nearly the same.
THIN = 10
# The spin, unknown at first, is scored from this step on.
SETTLED = 50


def kalman(name: str, noise: FloatArray, body: Arrays) -> Arrays:
    """Run the axial Kalman filter with one covariance (4, 4) for both noises."""
    prior = GaussianState(*to_gaussian(PRIOR))
    track = AxialKalmanFilter(noise, noise).run(prior, body["measured"], controls=body["controls"])
    truth, kept = body["truth"], slice(None, None, THIN)
    statistic = nees(track.modes[kept], track.states.covariance[kept], truth[kept])
    covered = coverage(chi_square_probability(statistic, 3))
    return scores(name, truth, track.modes) | {f"coverage/{name}": covered}


def second_order(distribution: Bingham, body: Arrays) -> Arrays:
    """Run the second-order filter and score its distributions of the orientation and of the spin."""
    tracker = SecondOrderBinghamFilter(distribution, NOISE, noise_side="right")
    state = SpinState(PRIOR, SPIN_PRIOR)
    states: list[SpinState] = []
    for z, u in zip(body["measured"], body["controls"], strict=True):
        state, _ = tracker.update(tracker.predict(state, u), z)
        states.append(state)
    orientation, spin = _joint([s.orientation for s in states]), _joint([s.spin for s in states[SETTLED:]])
    name = "bingham_second_order"
    found = scores(name, body["truth"], orientation.mode, orientation)
    found_spin = scores(name, body["spin"][SETTLED:], spin.mode, spin)
    return found | {f"spin_{key}": value for key, value in found_spin.items()}


def _joint(distributions: list[Bingham]) -> Bingham:
    return Bingham.from_spectrum(
        np.stack([distribution.z for distribution in distributions]),
        np.stack([distribution.M for distribution in distributions]),
    )


def scores(name: str, truth: FloatArray, modes: FloatArray, distributions: Bingham | None = None) -> Arrays:
    """Return the error of modes (T, 4), an angle of rotation, and the coverage of their distributions (T,)."""
    out: Arrays = {f"rmse/{name}": root_mean_square(2.0 * geodesic_error(modes, truth))}
    if distributions is not None:
        kept = Bingham.from_spectrum(distributions.z[::THIN].copy(), distributions.M[::THIN].copy())
        out[f"coverage/{name}"] = coverage(angle_probability(kept, truth[::THIN]))
    return out
