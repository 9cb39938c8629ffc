"""The filters of the spinning-ball study, on one flight (Glover & Kaelbling 2013, §6)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.baselines.gaussian import GaussianState
from bingham.baselines.quaternion_ekf import QuaternionEkf
from bingham.baselines.second_order_ekf import SecondOrderQuaternionEkf, SpinningGaussian
from bingham.distributions.bingham import Bingham
from bingham.distributions.relations import to_gaussian
from bingham.filters.bank import BankState, FilterBank
from bingham.filters.first_order import BinghamFilter
from bingham.filters.second_order import SecondOrderBinghamFilter, SpinState, classify_spin
from bingham.rotations import compose, conjugate
from bingham.studies.ball_scores import Found, score
from bingham.studies.study import Arrays

__all__ = ["FILTERS", "run_filters"]

FloatArray = NDArray[np.float64]
FRAME = np.eye(4)[:, [1, 2, 3, 0]]


def _distribution(*z: float) -> Bingham:
    return Bingham([*z, 0.0], FRAME)


# The published parameters.
PROCESS = _distribution(-400.0, -400.0, -400.0)
LOGO = _distribution(-40.0, -40.0, -10.0)
# Logo out of sight: as if seen at the centre of the back, at any angle about its own axis. It is the distribution
# fitted to all orientations with the logo on the far half, whose second moment about that centre is diag(1, 1, 3, 3)/8.
DARK = _distribution(-3.6, -3.6, 0.0)
BACK = np.array([0.0, 1.0, 0.0, 0.0])
SPIN_PRIOR = _distribution(-3.0, -3.0, -3.0)
INFORMED = _distribution(-10.0, -10.0, -10.0)
FILTERS = (
    "bingham_second_order",
    "bingham_oracle",
    "bingham_bank",
    "bingham_first_order",
    "bingham_first_order_fair",
    "ekf_first_order",
    "ekf_first_order_fair",
    "ekf_second_order",
    "ekf_second_order_fair",
)


def _turn_noise(one: Bingham, other: Bingham) -> Bingham:
    """Return the distribution of e* ⊗ e' on the axes both have, the identity last: a mode of a girdle."""
    z = np.einsum("ij,ij->j", FRAME, one.inverse().compose(other).matrix @ FRAME)
    return _distribution(*np.minimum(z[:3] - z[3], 0.0))


# Noise of the rotation between two observations, by how many of them are out of sight.
TURN_NOISE = (_turn_noise(LOGO, LOGO), _turn_noise(LOGO, DARK), _turn_noise(DARK, DARK))


def run_filters(flight: Arrays, kind: int, types: FloatArray, names: Sequence[str]) -> Arrays:
    """Return the `score` of each filter on one flight, as ``quantity/filter``."""
    out: Arrays = {}
    for name in names:
        scores = score(RUNNERS[name](flight["seen"], kind, types), flight, kind)
        out |= {f"{quantity}/{name}": values for quantity, values in scores.items()}
    return out


def _second_order(seen: FloatArray, priors: Sequence[Bingham], types: FloatArray) -> Found:
    """Run a bank of second-order filters, one for each prior of the spin."""
    bank = FilterBank([SecondOrderBinghamFilter(PROCESS, LOGO, noise_side="right")])
    state = BankState([SpinState(Bingham.uniform(4), prior) for prior in priors])
    kept: list[SpinState] = []
    for z in seen:
        state = bank.predict(state)
        dark = bool(np.isnan(z).any())
        state, _ = bank.update(state, BACK if dark else z, noise=DARK if dark else None)
        kept.append(state.selected)
    return Found([s.orientation for s in kept], [s.spin for s in kept], [classify_spin(s.spin, types)[0] for s in kept])


def _around(types: FloatArray) -> list[Bingham]:
    return [INFORMED.rotate(left=s) for s in types]


def _turns(seen: FloatArray, turning: bool) -> Iterator[tuple[FloatArray, Bingham] | None]:
    """Yield, frame by frame, the rotations (k, 4) between neighbouring observations and their noise; None first.

    Every frame is an observation, out of sight that of the back. With y = x ⊗ e and y' = v ⊗ x ⊗ e',
    y' ⊗ y* = v ⊗ n, n = y ⊗ (e* ⊗ e') ⊗ y*: if ``turning``, n has this distribution, else a fixed one, as published.
    """
    yield None
    for before, now in pairwise(seen):
        dark, dark_now = (bool(np.isnan(z).any()) for z in (before, now))
        y = BACK if dark else before[0]
        noise = TURN_NOISE[dark + dark_now]
        turns = compose(np.atleast_2d(BACK) if dark_now else now, conjugate(y))
        yield turns, noise.rotate(left=y, right=conjugate(y)) if turning else noise


def _first_order(seen: FloatArray, types: FloatArray, fair: bool) -> Found:
    """Track the spin alone by the first-order filter of §4: with the fair noise, F(C(v)) of raw observations."""
    state = SPIN_PRIOR
    spins: list[Bingham] = []
    for observed in _turns(seen, fair):
        state = BinghamFilter(PROCESS, LOGO).predict(state)
        if observed is not None:
            turns, noise = observed
            spin_filter = BinghamFilter(PROCESS, noise, noise_side="right" if fair else "left")
            updates = (spin_filter.update(state, z) for z in turns)
            state, _ = max(updates, key=lambda r: r[1].log_evidence)
        spins.append(state)
    return Found(None, spins, [classify_spin(spin, types)[0] for spin in spins])


def _classify_gaussian(state: GaussianState, types: FloatArray) -> int:
    """Return the most probable type under a Gaussian, signs of quaternions chosen to suit."""
    nearest = np.where((types @ state.mean < 0.0)[:, None], -types, types)
    e = nearest - state.mean
    return int(np.argmin(np.einsum("ki,ki->k", e, np.linalg.solve(state.covariance, e.T).T)))


def _ekf_first_order(seen: FloatArray, types: FloatArray, fair: bool) -> Found:
    process, logo = (to_gaussian(distribution).covariance for distribution in (PROCESS, LOGO))
    kalman = QuaternionEkf(process, logo, noise_side="right" if fair else "left", rotate_noise=fair)
    state = GaussianState(*to_gaussian(SPIN_PRIOR))
    spins: list[GaussianState] = []
    for observed in _turns(seen, fair):
        state = kalman.predict(state)
        if observed is not None:
            turns, noise = observed
            covariance = to_gaussian(noise).covariance
            updates = (kalman.update(state, z, covariance) for z in turns)
            state, _ = max(updates, key=lambda r: float(r[1].log_evidence))
        spins.append(state)
    return Found(None, spins, [_classify_gaussian(spin, types) for spin in spins])


def _ekf_second_order(seen: FloatArray, types: FloatArray, fair: bool) -> Found:
    process, logo, dark = (to_gaussian(distribution).covariance for distribution in (PROCESS, LOGO, DARK))
    kalman = SecondOrderQuaternionEkf(process, logo, noise_side="right", rotate_noise=fair)
    unknown = GaussianState(np.array([1.0, 0.0, 0.0, 0.0]), 0.25 * np.eye(4))
    state = SpinningGaussian.independent(unknown, GaussianState(*to_gaussian(SPIN_PRIOR)))
    kept: list[SpinningGaussian] = []
    for z in seen:
        state = kalman.predict(state)
        if np.isnan(z).any():
            state, _ = kalman.update(state, BACK, dark)
        else:
            state, _ = max((kalman.update(state, row) for row in z), key=lambda r: float(r[1].log_evidence))
        kept.append(state)
    chosen = [_classify_gaussian(s.spin, types) for s in kept]
    return Found([s.orientation for s in kept], [s.spin for s in kept], chosen)


RUNNERS: dict[str, Any] = {
    "bingham_second_order": lambda seen, kind, types: _second_order(seen, [SPIN_PRIOR], types),
    "bingham_oracle": lambda seen, kind, types: _second_order(seen, [_around(types)[kind]], types),
    "bingham_bank": lambda seen, kind, types: _second_order(seen, _around(types), types),
    "bingham_first_order": lambda seen, kind, types: _first_order(seen, types, False),
    "bingham_first_order_fair": lambda seen, kind, types: _first_order(seen, types, True),
    "ekf_first_order": lambda seen, kind, types: _ekf_first_order(seen, types, False),
    "ekf_first_order_fair": lambda seen, kind, types: _ekf_first_order(seen, types, True),
    "ekf_second_order": lambda seen, kind, types: _ekf_second_order(seen, types, False),
    "ekf_second_order_fair": lambda seen, kind, types: _ekf_second_order(seen, types, True),
}
