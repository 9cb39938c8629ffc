"""Bouncing balls, the future work of Glover & Kaelbling (2013, footnote 2): a bounce is a control of the spin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.baselines.gaussian import GaussianState
from bingham.baselines.second_order_ekf import SecondOrderQuaternionEkf, SpinningGaussian
from bingham.distributions.bingham import Bingham
from bingham.filters.second_order import SecondOrderBinghamFilter, SpinState
from bingham.rotations import from_rotation_vector
from bingham.studies.ball_flights import BOUNCE, FRAMES, SPIN_TYPES, simulate_flight
from bingham.studies.ball_gaussian import covariance_of
from bingham.studies.ball_noises import BACK, DARK, IDENTITY, LOGO, PROCESS, SPIN_PRIOR
from bingham.studies.study import Arrays, Row, generator, joined, mean_row

__all__ = ["bounce_chunk", "bounce_rows"]

FloatArray = NDArray[np.float64]
# What the table does to the spin, in rad a frame: friction adds topspin to a ball that flies along x.
PUSH = from_rotation_vector([0.0, 0.5, 0.0])
# Random stream apart from those of the levels.
STREAM = 100
FILTERS = ("bingham_second_order", "ekf_second_order")


def bounce_chunk(noise: tuple[float, ...], seed: int, first: int, last: int) -> Arrays:
    """Return the spin errors (runs, 40), rad, of both second-order filters that know of the bounce, and do not."""
    rows: dict[str, list[FloatArray]] = {}
    for run in range(first, last):
        flight, _ = simulate_flight(run % len(SPIN_TYPES), noise, generator(seed, STREAM, run), PUSH)
        for name in FILTERS:
            for told in (True, False):
                error = _errors(name, flight, told)
                rows.setdefault(f"bounce/{name}/{'told' if told else 'untold'}", []).append(error)
    return {name: np.array(values) for name, values in rows.items()}


def _errors(name: str, flight: Arrays, told: bool) -> FloatArray:
    """Return the angle, rad, between the estimated spin after each frame and the spin after the bounce."""
    if name == "bingham_second_order":
        tracker: Any = SecondOrderBinghamFilter(PROCESS, LOGO, noise_side="right")
        state: Any = SpinState(Bingham.uniform(4), SPIN_PRIOR)
        dark: dict[str, Any] = {"noise": DARK}
    else:
        tracker = SecondOrderQuaternionEkf(covariance_of(PROCESS), covariance_of(LOGO), noise_side="right")
        unknown = GaussianState(IDENTITY, 0.25 * np.eye(4))
        state = SpinningGaussian.independent(unknown, GaussianState(IDENTITY, covariance_of(SPIN_PRIOR)))
        dark = {"covariance": covariance_of(DARK)}
    modes = np.empty((FRAMES, 4))
    for n, z in enumerate(flight["seen"]):
        # The spin that moves the ball to frame BOUNCE is that after the step before.
        state = tracker.predict(state, PUSH if told and n == BOUNCE - 1 else None)
        if np.isnan(z).any():
            state, _ = tracker.update(state, BACK, **dark)
        else:
            state, _ = max((tracker.update(state, row) for row in z), key=lambda r: float(r[1].log_evidence))
        modes[n] = state.spin.mode
    return 2.0 * np.arccos(np.minimum(1.0, np.abs(modes @ flight["spin"])))


def bounce_rows(results: Mapping[str, Arrays]) -> list[Row]:
    """Return the spin errors some frames after the bounce."""
    rows: list[Row] = []
    for name in FILTERS:
        for told in ("told", "untold"):
            errors = joined(results, "bounce-", f"bounce/{name}/{told}")
            for after in (1, 10, 20):
                case = f"bounce, {after} frames after"
                rows.append(mean_row(case, f"{name}_{told}", "spin_error_rad", errors[:, BOUNCE - 1 + after]))
    return rows
