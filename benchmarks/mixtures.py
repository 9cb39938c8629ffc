"""Expectation-maximisation on a million surface normals: a distribution of six components and a background."""

from __future__ import annotations

from time import perf_counter

import numba
import numpy as np
from bingham import Bingham, BinghamMixture
from bingham.distributions.em import expectation_maximization

from timing import Row

TOPIC = "EM, 1 000 000 normals, 6 components and a background"


def measure() -> list[Row]:
    """Return the rows of this topic: time on the wall between iterations."""
    rng = np.random.default_rng(1)
    frames = np.linalg.qr(rng.normal(size=(6, 3, 3)))[0]
    x = np.concatenate([Bingham([-80.0, -60.0, 0.0], m).rvs(170_000, rng=rng) for m in frames])
    x = np.ascontiguousarray(rng.permutation(x)[:1_000_000])
    start = BinghamMixture(
        np.full(6, 0.15), Bingham.from_spectrum(np.tile([-30.0, -20.0, 0.0], (6, 1)), frames.copy()), 0.1
    )
    rows = []
    for threads, ours, limit in ((min(2, numba.config.NUMBA_NUM_THREADS), True, 0.4), (1, False, None)):
        numba.set_num_threads(threads)
        times: list[float] = []

        def tick(_iteration: int, _log_likelihood: float, times: list[float] = times) -> None:
            times.append(perf_counter())

        expectation_maximization(x, start, tolerance=0.0, max_iterations=10, progress=tick)
        name = f"bingham, {threads} thread{'s' if threads > 1 else ''}"
        rows.append(Row(TOPIC, name, float(np.diff(times).min()), "iteration", ours, limit))
    return rows
