"""Moments to concentrations, and the fit to samples."""

from __future__ import annotations

import bingham
import numba
import numpy as np

from normalizer import spectra
from timing import Row, best_of, best_once

TOPIC = "moments to concentrations (d = 4)"


def measure() -> list[Row]:
    """Return the rows of this topic."""
    from peers import BinghamDistribution

    n = 100_000
    w = bingham.moments(spectra(n))
    numba.set_num_threads(1)
    one = np.array([0.1, 0.15, 0.25, 0.5])
    scatter = np.diag(one)
    # PyRecEst remembers every distribution it has seen; a filter never asks for the same one twice.
    fresh = (np.diag(row) for row in bingham.moments(spectra(8, 4) / 50.0))
    x = bingham.Bingham([-900.0, -500.0, -3.0, 0.0], np.eye(4)).rvs(10_000, rng=1)
    return [
        Row(TOPIC, "bingham, batch", best_of(lambda: bingham.concentrations(w), per=n), "distribution", True),
        Row(
            TOPIC, "bingham, one distribution from Python", best_of(lambda: bingham.concentrations(one)), "distribution"
        ),
        Row(
            TOPIC,
            "bingham, `Bingham.from_moment`",
            best_of(lambda: bingham.Bingham.from_moment(scatter)),
            "distribution",
        ),
        Row(
            TOPIC,
            "PyRecEst 2.4.2, `fit_to_moment`",
            best_once(lambda: BinghamDistribution.fit_to_moment(next(fresh))),
            "distribution",
        ),
        Row(
            "fit to 10 000 quaternions", "bingham, `Bingham.fit`", best_of(lambda: bingham.Bingham.fit(x)), "fit", True
        ),
        Row(
            "fit to 10 000 quaternions",
            "PyRecEst 2.4.2, `fit_to_moment(xᵀx/n)`",
            best_once(lambda: BinghamDistribution.fit_to_moment(x.T @ x / len(x)), repeats=1),
            "fit",
        ),
    ]
