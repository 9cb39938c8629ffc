"""Kurz, Gilitschenski, Julier & Hanebeck 2013, §VI: axis of a joint in the plane, against the scalar Kalman filter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from bingham.baselines.scalar_kalman import AngleState, ScalarKalmanFilter
from bingham.baselines.wrapped_normal import DoubledAngleState, WrappedNormalFilter
from bingham.distributions.bingham import Bingham
from bingham.distributions.relations import angular_variance
from bingham.filters.first_order import BinghamFilter
from bingham.metrics import angle_probability, geodesic_error, normal_probability, root_mean_square
from bingham.studies.calibration import calibration_arrays, calibration_rows, moment_error
from bingham.studies.study import (
    Arrays,
    Chunk,
    Row,
    Study,
    StudyResult,
    generator,
    joined,
    mean_row,
    range_chunks,
    wins_row,
)
from bingham.studies.timing import microseconds_per_call, microseconds_per_step

__all__ = ["STUDY", "bingham_gaussian_divergence"]

STEPS = 100
CHUNK = 100
# Probabilities are kept of every THIN-th step.
THIN = 5
PRIOR = Bingham([-1.0, 0.0], np.eye(2))
PROCESS = Bingham([-200.0, 0.0], [[0.0, 1.0], [1.0, 0.0]])
MEASUREMENT = Bingham([-3.0, 0.0], [[0.0, 1.0], [1.0, 0.0]])
# The paper's variances, found there by sampling: prior, process and measurement.
PUBLISHED_VARIANCES = (0.5956, 0.0027, 0.2836)
PUBLISHED_MILLISECONDS = 60.0
CASE = "2-D bingham"
SAMPLED_CASE = "2-D bingham, published variances"


def simulate(seed: int, first: int, last: int) -> Arrays:
    """Return axes (R, T, 2): x' = x ⊕ w from (1, 0), z = x ⊕ v, for runs first … last − 1."""
    angles = np.empty((2, last - first, STEPS))
    for i, run in enumerate(range(first, last)):
        rng = generator(seed, run)
        for row, noise in zip(angles, (PROCESS, MEASUREMENT), strict=True):
            sample = noise.rvs(STEPS, rng=rng)
            row[i] = np.arctan2(sample[:, 1], sample[:, 0])
    truth = np.cumsum(angles[0], axis=1)
    measured = truth + angles[1]
    return {name: np.stack([np.cos(a), np.sin(a)], axis=-1) for name, a in (("truth", truth), ("measured", measured))}


def run_chunk(seed: int, first: int, last: int) -> Arrays:
    """Filter runs first … last − 1: RMSE and calibration of each run, and the course of the very first one."""
    data = simulate(seed, first, last)
    truth, measured = data["truth"], data["measured"]
    variances = tuple(angular_variance(distribution) for distribution in (PRIOR, PROCESS, MEASUREMENT))

    track = BinghamFilter(PROCESS, MEASUREMENT).run(PRIOR, measured)
    modes = {"bingham": track.modes}
    probability = {"bingham": angle_probability(track.distributions, truth)}
    error = {"bingham": moment_error(track.distributions, truth)}
    deviations: dict[str, NDArray[np.float64]] = {}
    for name, (prior, process, measurement) in (
        ("scalar_kalman", variances),
        ("scalar_kalman_published", PUBLISHED_VARIANCES),
    ):
        start = AngleState(np.full(last - first, 0.5 * np.pi), np.full(last - first, prior))
        kalman = ScalarKalmanFilter(process, measurement).run(start, measured)
        modes[name] = kalman.modes
        deviations[name] = np.sqrt(kalman.states.variance)
        angle = geodesic_error(kalman.modes, truth)
        probability[name] = normal_probability(angle, kalman.states.variance)
        error[name] = angle**2 / kalman.states.variance
    start = DoubledAngleState(np.full(last - first, np.pi), np.full(last - first, -0.5 * PRIOR.z[0]))
    wrapped = WrappedNormalFilter(variances[1], variances[2]).run(start, measured)
    modes["wrapped_normal"] = wrapped.modes
    equivalent = np.stack([-2.0 * wrapped.states.kappa, np.zeros_like(wrapped.states.kappa)], axis=-1)
    frames = np.stack([np.stack([-wrapped.modes[..., 1], wrapped.modes[..., 0]], axis=-1), wrapped.modes], axis=-1)
    distribution = Bingham.from_spectrum(equivalent, frames)
    probability["wrapped_normal"], error["wrapped_normal"] = (
        angle_probability(distribution, truth),
        moment_error(distribution, truth),
    )

    out: Arrays = {}
    for name, estimate in modes.items():
        out[f"rmse/{name}"] = root_mean_square(geodesic_error(estimate, truth))
        out |= calibration_arrays(name, probability[name], error[name], THIN)
    if first == 0:
        out |= {"example/truth": truth[0], "example/measured": measured[0], "example/bingham": track.modes[0],
                "example/bingham_band": track.distributions[0].credible_angle(0.95),
                "example/scalar_kalman": modes["scalar_kalman"][0],
                "example/scalar_kalman_band": norm.ppf(0.975) * deviations["scalar_kalman"][0]}  # fmt: skip
    return out


def bingham_gaussian_divergence(z1: float) -> float:
    """Return KL(f ‖ N) over one half circle in nats (2014, eq. 70; 2013, Fig. 3), by quadrature.

    f is the distribution of the angle from the mode of a d = 2 Bingham distribution with concentration z₁, normalised
    on [−π/2, π/2]; N the normal density of the same mean and variance: KL = −h(f) + ½ log(2πe σ²).
    """
    distribution = Bingham([z1, 0.0], np.eye(2))
    # The entropy on the whole circle exceeds that on a half by log 2.
    return float(
        0.5 * np.log(2.0 * np.pi * np.e * angular_variance(distribution)) - (distribution.entropy() - np.log(2.0))
    )


def _chunks(runs: int, seed: int, options: Mapping[str, Any]) -> list[Chunk]:
    return range_chunks("runs-", run_chunk, runs, CHUNK, seed=seed)


def _summarize(runs: int, seed: int, results: Mapping[str, Arrays]) -> StudyResult:
    rmse = {name: joined(results, "runs", f"rmse/{name}") for name in
            ("bingham", "scalar_kalman", "scalar_kalman_published", "wrapped_normal")}  # fmt: skip
    table: list[Row] = []
    for name, values in rmse.items():
        case, label = (SAMPLED_CASE, "scalar_kalman") if name.endswith("published") else (CASE, name)
        table.append(mean_row(case, label, "rmse_rad", values))
        table += calibration_rows(case, label, results, "runs", name)
    for case, other in (
        (CASE, "scalar_kalman"),
        (SAMPLED_CASE, "scalar_kalman_published"),
        (f"{CASE}, against wrapped normal", "wrapped_normal"),
    ):
        table.append(wins_row(case, "bingham", rmse["bingham"] < rmse[other]))
    for distribution, part, published in zip(
        (PRIOR, PROCESS, MEASUREMENT), ("prior", "process", "measurement"), PUBLISHED_VARIANCES, strict=True
    ):
        table.append(
            Row(
                f"{CASE}, {part}",
                "scalar_kalman",
                "angular_variance_rad2",
                angular_variance(distribution),
                None,
                published,
            )
        )
    for z1 in (-1.0, -3.0, -15.0, -200.0):
        table.append(Row(f"2-D z1 = {z1:g}", "scalar_kalman", "kl", bingham_gaussian_divergence(z1)))
    timed = BinghamFilter(PROCESS, MEASUREMENT), PRIOR, simulate(seed, 0, 1)["measured"][0]
    for case, measure in ((CASE, microseconds_per_step), (f"{CASE}, call by call", microseconds_per_call)):
        table.append(Row(case, "bingham", "us_per_step", measure(*timed), None, 1e3 * PUBLISHED_MILLISECONDS))

    z1 = -np.geomspace(0.1, 100.0, 121)
    curves: Arrays = {"rmse/bingham": rmse["bingham"], "rmse/scalar_kalman": rmse["scalar_kalman"],
                      "rmse/wrapped_normal": rmse["wrapped_normal"], "divergence/z1": z1,
                      "divergence/kl": np.array([bingham_gaussian_divergence(float(z)) for z in z1])}  # fmt: skip
    curves |= {key: value for key, value in results[min(results)].items() if key.startswith("example/")}
    return StudyResult("kurz2013", runs, seed, table, curves)


STUDY = Study(
    name="kurz2013",
    title="Kurz et al. 2013: axis in the plane, Bingham filter against the scalar Kalman filter",
    default_runs=1000,
    chunks=_chunks,
    summarize=_summarize,
    version=2,
)
