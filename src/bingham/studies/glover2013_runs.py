"""Two runs of the first-order filter with its bounds, as in Figure 2 of Glover & Kaelbling (2013)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.filters.first_order import BinghamFilter
from bingham.metrics import geodesic_error
from bingham.studies.glover2013_signals import isotropic_distribution, nominal_motion, simulate
from bingham.studies.study import Arrays, generator

__all__ = ["OBSERVED", "run_curves"]

FloatArray = NDArray[np.float64]
# The figure's noises: of the process, and of the observations of its two runs.
PROCESS, OBSERVED = (-400.0, -400.0, -400.0), ((-50.0, -50.0, -50.0), (-10.0, -10.0, -1.0))
STEPS, SAMPLES = 200, 400
# Random stream apart from those of the cells and compositions.
STREAM = 30


def run_curves(seed: int) -> Arrays:
    """Return truth, measurements and estimates (200, 4) of both runs, signs continuous, and 90 % bounds.

    ``low`` and ``high`` (200, 4) bound each component of the filter's distribution, by samples; ``error`` (200,) is the
    angle from estimate to truth, rad, and ``bound`` its 90 % credible angle.
    """
    out: Arrays = {}
    for k, observation in enumerate(OBSERVED):
        rng = generator(seed, STREAM + k)
        w, v = isotropic_distribution(PROCESS), isotropic_distribution(observation)
        start, controls = nominal_motion(rng, STEPS)
        data = simulate(start, controls, w.rvs(STEPS, rng=rng), v.rvs(STEPS, rng=rng))
        prior = v.rotate(right=start)
        track = BinghamFilter(w, v, noise_side="left").run(prior, data["measured"], controls=controls)
        truth = _continuous(data["truth"])
        found = {name: _aligned(x, truth) for name, x in (("measured", data["measured"]), ("modes", track.modes))}
        bounds = [_bounds(track.distributions[t], found["modes"][t], rng) for t in range(STEPS)]
        found |= {"truth": truth, "low": np.stack([b[0] for b in bounds]), "high": np.stack([b[1] for b in bounds])}
        found["error"] = 2.0 * geodesic_error(track.modes, truth)
        found["bound"] = 2.0 * np.asarray(track.distributions.credible_angle(0.9))
        out |= {f"run/{k}/{name}": values for name, values in found.items()}
    return out


def _continuous(q: FloatArray) -> FloatArray:
    """Return the same rotations (T, 4) with signs such that neighbours are near."""
    turned = np.sum(q[1:] * q[:-1], axis=1) < 0.0
    return q * np.append(1.0, np.where(np.cumsum(turned) % 2, -1.0, 1.0))[:, None]


def _aligned(q: FloatArray, to: FloatArray) -> FloatArray:
    """Return the same rotations (T, 4) on the side of others."""
    return np.where(np.sum(q * to, axis=1, keepdims=True) < 0.0, -q, q)


def _bounds(distribution: Bingham, mode: FloatArray, rng: np.random.Generator) -> FloatArray:
    x = distribution.rvs(SAMPLES, rng=rng)
    return np.quantile(np.where((x @ mode)[:, None] < 0.0, -x, x), [0.05, 0.95], axis=0)
