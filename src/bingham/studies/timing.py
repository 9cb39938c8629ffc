"""Time a filter step, as the studies print it beside the published milliseconds."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.filters.first_order import BinghamFilter

__all__ = ["microseconds_per_call", "microseconds_per_step"]

FloatArray = NDArray[np.float64]


def microseconds_per_step(
    bingham_filter: BinghamFilter, prior: Bingham, measurements: FloatArray, repetitions: int = 5
) -> float:
    """Return µs of one predict and update inside `run`, the best of some repetitions over measurements (T, d)."""
    rows = np.tile(measurements, (max(1, 2000 // len(measurements)), 1))
    return 1e6 * _best_seconds(lambda: bingham_filter.run(prior, rows), repetitions) / len(rows)


def microseconds_per_call(
    bingham_filter: BinghamFilter, prior: Bingham, measurements: FloatArray, repetitions: int = 5
) -> float:
    """Return µs of `predict` and `update` called from Python, one measurement of (T, d) after the other."""

    def step_by_step() -> None:
        state = prior
        for z in measurements:
            state, _ = bingham_filter.update(bingham_filter.predict(state), z)

    return 1e6 * _best_seconds(step_by_step, repetitions) / len(measurements)


def _best_seconds(function: Callable[[], object], repetitions: int) -> float:
    """Return the shortest of some durations of a call, after a first one that may compile."""
    function()
    best = np.inf
    for _ in range(repetitions):
        start = perf_counter()
        function()
        best = min(best, perf_counter() - start)
    return float(best)
