"""Error of the moment-matched composition along quaternion signals (Glover & Kaelbling 2013, §6 and A.9.3)."""

from __future__ import annotations

import numpy as np

from bingham.distributions.bingham import Bingham
from bingham.filters.first_order import BinghamFilter
from bingham.studies.glover2013_signals import isotropic_distribution, nominal_motion, simulate
from bingham.studies.study import Arrays, generator

__all__ = ["COMPOSED", "composition_error", "run_composition"]

# Noises of the composition study, all nine pairs of them.
COMPOSED = ((-50.0, -50.0, -50.0), (-200.0, -200.0, -200.0), (-10.0, -10.0, -1.0))
COMPOSED_STEPS = 200
COMPOSED_SAMPLES = 400
# Random streams 0 … 8 are those of Table 1's cells.
STREAM = 9


def composition_error(p: Bingham, q: Bingham, samples: int, rng: np.random.Generator) -> float:
    """Return KL(f_B ‖ f_true) of the moment-matched f_B of x ⊗ y, x ~ p, y ~ q (Glover & Kaelbling, A.9.3).

    With r = f_true/f_B the estimator E_B[r − 1 − log r] is unbiased like E_B[−log r], since E_B[r] = 1, never negative,
    and its variance is of the order of its square.
    """
    matched = p.compose(q)
    x = matched.rvs(samples, rng=rng)
    log_ratio = p.composed_logpdf(q, x) - matched.logpdf(x)
    return float(np.mean(np.expm1(log_ratio) - log_ratio))


def run_composition(process: tuple[float, ...], observation: tuple[float, ...], seed: int, cell: int) -> Arrays:
    """Return the composition errors along one Bingham signal, at every fourth prediction of the filter."""
    rng = generator(seed, STREAM + cell)
    w, v = isotropic_distribution(process), isotropic_distribution(observation)
    start, controls = nominal_motion(rng, COMPOSED_STEPS)
    data = simulate(start, controls, w.rvs(COMPOSED_STEPS, rng=rng), v.rvs(COMPOSED_STEPS, rng=rng))
    track = BinghamFilter(w, v, noise_side="left").run(Bingham.uniform(4), data["measured"], controls=controls)
    distributions = track.distributions
    errors = [composition_error(w, distributions[t], COMPOSED_SAMPLES, rng) for t in range(0, COMPOSED_STEPS, 4)]
    return {"kl": np.array(errors)}
