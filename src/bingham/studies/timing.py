"""Time a filter step, as the studies print it beside the published milliseconds."""

from __future__ import annotations

from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.filters.first_order import BinghamFilter

__all__ = ["microseconds_per_step"]


def microseconds_per_step(
    bingham_filter: BinghamFilter, prior: Bingham, measurements: NDArray[np.float64], repetitions: int = 5
) -> float:
    """Return µs of one predict and update inside `run`, the best of some repetitions over measurements (T, d)."""
    rows = np.tile(measurements, (max(1, 2000 // len(measurements)), 1))
    bingham_filter.run(prior, rows)
    best = np.inf
    for _ in range(repetitions):
        start = perf_counter()
        bingham_filter.run(prior, rows)
        best = min(best, perf_counter() - start)
    return 1e6 * best / len(rows)
