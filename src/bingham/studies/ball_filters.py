"""The filters of the spinning-ball study, on one flight (Glover & Kaelbling 2013, §6)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.relations import to_gaussian
from bingham.filters.bank import BankState, FilterBank
from bingham.filters.first_order import BinghamFilter
from bingham.filters.gaussian import GaussianState
from bingham.filters.quaternion_ekf import QuaternionEkf
from bingham.filters.second_order import SecondOrderBinghamFilter, SpinState, classify_spin
from bingham.filters.second_order_ekf import SecondOrderQuaternionEkf, SpinningGaussian
from bingham.metrics import geodesic_error
from bingham.rotations import compose, conjugate
from bingham.studies.study import Arrays

__all__ = ["FILTERS", "run_filters"]

FloatArray = NDArray[np.float64]
FRAME = np.eye(4)[:, [1, 2, 3, 0]]
HALF_TURN = np.array([0.0, 0.0, 0.0, 1.0])


def _law(*z: float) -> Bingham:
    return Bingham([*z, 0.0], FRAME)


# The published parameters.
PROCESS = _law(-400.0, -400.0, -400.0)
LOGO = _law(-40.0, -40.0, -10.0)
# Logo out of sight: as if seen at the centre of the back, at any angle about its own axis. It is the law fitted to all
# orientations with the logo on the far half, whose second moment about that centre is diag(1, 1, 3, 3)/8.
DARK = _law(-3.6, -3.6, 0.0)
BACK = np.array([0.0, 1.0, 0.0, 0.0])
SPIN_PRIOR = _law(-3.0, -3.0, -3.0)
INFORMED = _law(-10.0, -10.0, -10.0)
FILTERS = (
    "bingham_second_order",
    "bingham_oracle",
    "bingham_bank",
    "bingham_first_order",
    "ekf_first_order",
    "ekf_second_order",
    "ekf_second_order_fair",
)


def run_filters(flight: Arrays, kind: int, types: FloatArray, names: Sequence[str]) -> Arrays:
    """Return, frame by frame, errors and correctness (T,) of each filter on one flight."""
    out: Arrays = {}
    for name in names:
        orientation, spin, chosen = RUNNERS[name](flight["seen"], kind, types)
        if orientation is not None:
            twin = compose(flight["orientation"], HALF_TURN)
            error = np.minimum(geodesic_error(orientation, flight["orientation"]), geodesic_error(orientation, twin))
            out[f"orientation_error/{name}"] = 2.0 * error
        out[f"spin_error/{name}"] = 2.0 * geodesic_error(spin, flight["spin"])
        out[f"correct/{name}"] = np.array(chosen == kind, dtype=np.float64)
    return out


Found = tuple[FloatArray | None, FloatArray, NDArray[np.intp]]


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
    chosen = np.array([classify_spin(s.spin, types)[0] for s in kept])
    return np.array([s.mode for s in kept]), np.array([s.spin.mode for s in kept]), chosen


def _around(types: FloatArray) -> list[Bingham]:
    return [INFORMED.rotate(left=s) for s in types]


def _neighbours(seen: FloatArray) -> list[tuple[FloatArray, FloatArray] | None]:
    """Return, frame by frame, one interpretation (4,) of the frame before and both (2, 4) of this one, where seen."""
    out: list[tuple[FloatArray, FloatArray] | None] = [None]
    for before, now in pairwise(seen):
        missing = np.isnan(before).any() or np.isnan(now).any()
        out.append(None if missing else (before[0], now))
    return out


def _first_order(seen: FloatArray, kind: int, types: FloatArray) -> Found:
    """Track the spin alone: the likelihood of §4 with the raw observation before in place of the filtered orientation.

    y = x ⊗ e and y' = v ⊗ x ⊗ e' make y' ⊗ y* = v ⊗ y ⊗ (e* ⊗ e') ⊗ y*: the noise turns with the logo.
    """
    noise = LOGO.inverse().compose(LOGO)
    state = SPIN_PRIOR
    spins, chosen = np.empty((len(seen), 4)), np.empty(len(seen), dtype=np.intp)
    for n, pair in enumerate(_neighbours(seen)):
        if pair is None:
            state = BinghamFilter(PROCESS, noise, noise_side="right").predict(state)
        else:
            y, now = pair
            turned = noise.rotate(left=y, right=conjugate(y))
            spin_filter = BinghamFilter(PROCESS, turned, noise_side="right")
            state = spin_filter.predict(state)
            updates = (spin_filter.update(state, z) for z in compose(now, conjugate(y)))
            state, _ = max(updates, key=lambda r: r[1].log_evidence)
        spins[n], chosen[n] = state.mode, classify_spin(state, types)[0]
    return None, spins, chosen


def _classify_gaussian(state: GaussianState, types: FloatArray) -> int:
    """Return the most probable type under a Gaussian, signs of quaternions chosen to suit."""
    nearest = np.where((types @ state.mean < 0.0)[:, None], -types, types)
    e = nearest - state.mean
    return int(np.argmin(np.einsum("ki,ki->k", e, np.linalg.solve(state.covariance, e.T).T)))


def _ekf_first_order(seen: FloatArray, kind: int, types: FloatArray) -> Found:
    process, noise = (to_gaussian(law).covariance for law in (PROCESS, LOGO.compose(LOGO.inverse())))
    kalman = QuaternionEkf(process, noise)
    state = GaussianState(*to_gaussian(SPIN_PRIOR))
    spins, chosen = np.empty((len(seen), 4)), np.empty(len(seen), dtype=np.intp)
    for n, pair in enumerate(_neighbours(seen)):
        state = kalman.predict(state)
        if pair is not None:
            turns = compose(pair[1], conjugate(pair[0]))
            state, _ = max((kalman.update(state, z) for z in turns), key=lambda r: float(r[1].log_evidence))
        spins[n], chosen[n] = state.mode, _classify_gaussian(state, types)
    return None, spins, chosen


def _ekf_second_order(seen: FloatArray, types: FloatArray, fair: bool) -> Found:
    process, logo, dark = (to_gaussian(law).covariance for law in (PROCESS, LOGO, DARK))
    kalman = SecondOrderQuaternionEkf(process, logo, noise_side="right", rotate_noise=fair)
    unknown = GaussianState(np.array([1.0, 0.0, 0.0, 0.0]), 0.25 * np.eye(4))
    state = SpinningGaussian.independent(unknown, GaussianState(*to_gaussian(SPIN_PRIOR)))
    orientations, spins = np.empty((len(seen), 4)), np.empty((len(seen), 4))
    chosen = np.empty(len(seen), dtype=np.intp)
    for n, z in enumerate(seen):
        state = kalman.predict(state)
        if np.isnan(z).any():
            state, _ = kalman.update(state, BACK, dark)
        else:
            state, _ = max((kalman.update(state, row) for row in z), key=lambda r: float(r[1].log_evidence))
        orientations[n], spins[n] = state.mode, state.spin.mode
        chosen[n] = _classify_gaussian(state.spin, types)
    return orientations, spins, chosen


RUNNERS: dict[str, Any] = {
    "bingham_second_order": lambda seen, kind, types: _second_order(seen, [SPIN_PRIOR], types),
    "bingham_oracle": lambda seen, kind, types: _second_order(seen, [_around(types)[kind]], types),
    "bingham_bank": lambda seen, kind, types: _second_order(seen, _around(types), types),
    "bingham_first_order": _first_order,
    "ekf_first_order": _ekf_first_order,
    "ekf_second_order": lambda seen, kind, types: _ekf_second_order(seen, types, False),
    "ekf_second_order_fair": lambda seen, kind, types: _ekf_second_order(seen, types, True),
}
