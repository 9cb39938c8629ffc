"""The filters of the precession study and their scores: error, an angle of rotation, and coverage of 95 % regions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bingham.baselines.axial_kalman import AxialKalmanFilter
from bingham.baselines.gaussian import GaussianState
from bingham.distributions.bingham import Bingham
from bingham.distributions.relations import to_gaussian
from bingham.filters.second_order import SecondOrderBinghamFilter, SpinState
from bingham.filters.spin import SpinFilter, SpinningBody
from bingham.metrics import (
    angle_probability,
    chi_square_probability,
    coverage,
    geodesic_error,
    nees,
    root_mean_square,
)
from bingham.rotations import compose, from_rotation_vector, to_rotation_vector
from bingham.studies.madaan2017_bodies import NOISE, PRIOR, RATE_HZ, isotropic
from bingham.studies.study import Arrays

__all__ = ["joint", "kalman", "scores", "second_order"]

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
    """Run the second-order filter and score its distributions of the orientation and of the spin that comes next."""
    tracker = SecondOrderBinghamFilter(distribution, NOISE, noise_side="right")
    state = SpinState(PRIOR, SPIN_PRIOR)
    states: list[SpinState] = []
    for z, u in zip(body["measured"], body["controls"], strict=True):
        state, _ = tracker.update(tracker.predict(state, u), z)
        states.append(state)
    return _both(
        "bingham_second_order", body, _batch([s.orientation for s in states]), _batch([s.spin for s in states])
    )


def joint(distribution: Bingham, body: Arrays) -> Arrays:
    """Run the filter that keeps orientation and spin with their joint covariance, on the same process and noises."""
    tracker = SpinFilter(NOISE.covariance(frame="body"), 0.0)
    change = np.zeros((6, 6))
    change[3:, 3:] = distribution.covariance(frame="world") * RATE_HZ**2
    state = SpinningBody(body["measured"][0], np.zeros(3), np.diag(np.repeat([0.1, 0.1 * RATE_HZ**2], 3)))
    orientations: list[tuple[FloatArray, FloatArray]] = []
    spins: list[tuple[FloatArray, FloatArray]] = []
    for n, (z, u) in enumerate(zip(body["measured"], body["controls"], strict=True)):
        # The first orientation is measured where the prior stands; from then on one step each.
        state = tracker.run(state, z[None], [n / RATE_HZ], start_time=max(n - 1, 0) / RATE_HZ).final
        spin = compose(u, from_rotation_vector(state.rate / RATE_HZ))
        state = SpinningBody(state.orientation, to_rotation_vector(spin) * RATE_HZ, state.covariance + change)
        orientations.append((state.orientation, state.covariance[:3, :3]))
        spins.append((spin, state.covariance[3:, 3:] / RATE_HZ**2))
    parts = [
        Bingham.from_covariance(*(np.stack(x) for x in zip(*pairs, strict=True)), frame="world")
        for pairs in (orientations, spins)
    ]
    return _both("joint", body, *parts)


def _both(name: str, body: Arrays, orientation: Bingham, spin: Bingham) -> Arrays:
    """Score distributions (T,) of the orientation, and those of the spin once it has settled."""
    spin = spin[SETTLED:]
    found = scores(name, body["truth"], orientation.mode, orientation)
    found_spin = scores(name, body["spin"][SETTLED:], spin.mode, spin)
    return found | {f"spin_{key}": value for key, value in found_spin.items()}


def _batch(distributions: list[Bingham]) -> Bingham:
    return Bingham.from_spectrum(
        np.stack([distribution.z for distribution in distributions]),
        np.stack([distribution.M for distribution in distributions]),
    )


def scores(name: str, truth: FloatArray, modes: FloatArray, distributions: Bingham | None = None) -> Arrays:
    """Return the error of modes (T, 4), an angle of rotation, and what of it their distributions (T,) say.

    That is the coverage of their 95 % regions, and the mean square of the error over the mean of the reported variance:
    1 if it is right, more if they are too narrow, less if they are too wide.
    """
    error = 2.0 * geodesic_error(modes, truth)
    out: Arrays = {f"rmse/{name}": root_mean_square(error)}
    if distributions is not None:
        kept = Bingham.from_spectrum(distributions.z[::THIN].copy(), distributions.M[::THIN].copy())
        out[f"coverage/{name}"] = coverage(angle_probability(kept, truth[::THIN]))
        reported = np.trace(kept.covariance(frame="body"), axis1=-2, axis2=-1)
        # The first second, in which nothing is known yet, would outweigh all others.
        out[f"variance/{name}"] = np.array(np.mean(error[SETTLED:] ** 2) / np.mean(reported[SETTLED // THIN :]))
    return out
