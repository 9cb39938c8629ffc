"""Noises of the mixture filter of the spinning-ball study, by log-evidence on flights of their own."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.studies.ball_bingham import mixture_evidence
from bingham.studies.ball_flights import SPIN_TYPES, simulate_flight
from bingham.studies.ball_noises import DARK, LOGO, PROCESS, PUBLISHED_LOGO, about_identity
from bingham.studies.study import generator

__all__ = ["FLIGHTS", "PUBLISHED", "Noises", "adapted_noises"]

# Random stream apart from those of the flights that are scored; one flight of each type.
STREAM = 200
FLIGHTS = len(SPIN_TYPES)
# Concentrations are multiplied by these until none gains a nat over all flights.
FACTORS = (16.0, 4.0, 2.0)
# Spins steadier than this are as good as constant within a flight; evidence cannot tell them apart.
STEADIEST = -4e5


class Noises(NamedTuple):
    """Noises of spin, of a logo in sight and of one out of sight."""

    process: Bingham
    logo: Bingham
    dark: Bingham


PUBLISHED = Noises(PROCESS, LOGO, DARK)


@cache
def adapted_noises(level: int, noise: tuple[float, ...], seed: int, flights: int = FLIGHTS) -> Noises:
    """Return the noises of largest log-evidence on ``flights`` flights of a stream apart from those of the study.

    A search of the coordinates from the published values: process noise, logo noise about its two kinds of axes, and
    noise out of sight are scaled in turn. Neither true spins nor true orientations are looked at.
    """
    seen = [
        simulate_flight(run % len(SPIN_TYPES), noise, generator(seed, STREAM + level, run))[0]["seen"]
        for run in range(flights)
    ]

    def evidence(scale: NDArray[np.float64]) -> float:
        noises = _scaled(scale)
        return sum(mixture_evidence(flight, *noises) for flight in seen)

    scale = np.ones(4)
    best = evidence(scale)
    for factor in FACTORS:
        for k in (0, 1, 2, 3):
            for step in (factor, 1.0 / factor):
                moved = scale.copy()
                while True:
                    moved[k] *= step
                    if moved[0] * PROCESS.z[0] < STEADIEST or not (found := evidence(moved)) > best + 1.0:
                        break
                    scale, best = moved.copy(), found
    return _scaled(scale)


def _scaled(scale: NDArray[np.float64]) -> Noises:
    process, tilt, about, dark = scale
    logo = about_identity(*np.multiply(PUBLISHED_LOGO, [tilt, tilt, about]))
    return Noises(Bingham(process * PROCESS.z, PROCESS.M), logo, Bingham(dark * DARK.z, DARK.M))
