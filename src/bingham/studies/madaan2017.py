"""Madaan, Suresh & Kalra 2017, §IV: a precessing body under Bingham noise, and the same filter on a recorded motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.relations import to_gaussian
from bingham.errors import InvalidArgumentError
from bingham.filters.first_order import BinghamFilter
from bingham.models.diffusion import Diffusion
from bingham.rotations import compose
from bingham.studies.madaan2017_bodies import (
    NOISE,
    PRIOR,
    SPIN_CHANGE,
    disturbed_orientation,
    disturbed_spin,
    isotropic,
)
from bingham.studies.madaan2017_filters import joint, kalman, scores, second_order
from bingham.studies.study import Arrays, Chunk, Row, Study, StudyResult, generator, joined, mean_row

__all__ = ["STUDY"]

FloatArray = NDArray[np.float64]
# Disturbances of the spin under which the second-order filter's own model is true.
SPIN_NOISES = (-2.5e4, -4e5, -1e7)
# Candidates for the random walk of a recorded motion, rad/√s; the evidence of the measurements chooses.
RANDOM_WALKS = np.geomspace(0.01, 3.0, 13)
FILTERS = ("measured", "bingham", "axial_kalman", "axial_kalman_padded", "bingham_second_order", "joint")
METRICS = {
    "rmse": "rmse_rad",
    "coverage": "coverage_95",
    "spin_rmse": "spin_rmse_rad",
    "spin_coverage": "spin_coverage_95",
    "variance": "actual_over_reported_variance",
    "spin_variance": "spin_actual_over_reported_variance",
}


def run_precession(seed: int, run: int) -> Arrays:
    """Filter one disturbed, noisily measured precession, with the controls and, at second order, without."""
    body = disturbed_orientation(generator(seed, 0, run))
    truth, measured, controls = body["truth"], body["measured"], body["controls"]
    track = BinghamFilter(NOISE, NOISE).run(PRIOR, measured, controls=controls)
    out = scores("measured", truth, measured) | scores("bingham", truth, track.modes, track.distributions)

    out |= kalman("axial_kalman", to_gaussian(NOISE).covariance, body)
    out |= kalman("axial_kalman_padded", NOISE.axis_moments[0] * np.eye(4), body)
    unknown = body | {"controls": np.tile([1.0, 0.0, 0.0, 0.0], (len(truth), 1))}
    out |= second_order(SPIN_CHANGE, unknown) | joint(SPIN_CHANGE, unknown)
    return out | (_curves(truth, measured, track.modes) if run == 0 else {})


def run_spin(seed: int, run: int, level: int) -> Arrays:
    """Filter one precession disturbed in its spin by filters of second order, whose model is true."""
    distribution = isotropic(SPIN_NOISES[level])
    body = disturbed_spin(distribution, generator(seed, 2, level, run))
    found = second_order(distribution, body) | joint(distribution, body)
    return scores("measured", body["truth"], body["measured"]) | found


def run_recorded(seed: int, run: int, time: FloatArray, orientation: FloatArray) -> Arrays:
    """Filter a recorded motion with the report's noise added: prediction by a random walk chosen by the evidence."""
    measured = compose(orientation, NOISE.rvs(len(time), rng=generator(seed, 1, run)))
    tracks = [BinghamFilter(Diffusion(float(s)), NOISE).run(PRIOR, measured, times=time) for s in RANDOM_WALKS]
    best = int(np.argmax([track.total_log_evidence for track in tracks]))
    modes, distributions = tracks[best].modes, tracks[best].distributions
    out = scores("measured", orientation, measured) | scores("bingham", orientation, modes, distributions)
    out["random_walk"] = np.array(RANDOM_WALKS[best])
    return out | (_curves(orientation, measured, modes) | {"time": time - time[0]} if run == 0 else {})


def _curves(truth: FloatArray, measured: FloatArray, bingham: FloatArray) -> Arrays:
    return {"truth": truth, "measured": measured, "bingham": bingham}


def _single(function: Any, **arguments: Any) -> Arrays:
    """Run one run and give its scalars an axis, so that runs can be joined."""
    return {name: np.asarray(a)[None] for name, a in function(**arguments).items()}


def _chunks(runs: int, seed: int, options: Mapping[str, Any]) -> list[Chunk]:
    parts: dict[str, dict[str, Any]] = {"precession": {"function": run_precession}}
    parts |= {f"spin{level}": {"function": run_spin, "level": level} for level in range(len(SPIN_NOISES))}
    if "orientation" in options:
        d = np.shape(options["orientation"])[-1]
        if d != 4:
            raise InvalidArgumentError("recording", "quaternions", f"vectors of length {d}")
        more = {"time": options["time"], "orientation": options["orientation"]}
        parts["recorded"] = {"function": run_recorded} | more
    return [
        Chunk(f"{prefix}-{run:07d}", _single, {"seed": seed, "run": run} | arguments)
        for prefix, arguments in parts.items()
        for run in range(runs)
    ]


def _summarize(runs: int, seed: int, results: Mapping[str, Arrays]) -> StudyResult:
    table: list[Row] = []
    curves: Arrays = {}
    cases = {"precession": "precession"}
    cases |= {f"spin{level}": f"precession, spin noise {z:.0f}" for level, z in enumerate(SPIN_NOISES)}
    cases["recorded"] = "recorded motion"
    for prefix, case in cases.items():
        first = results.get(f"{prefix}-{0:07d}")
        if first is None:
            continue
        for name in FILTERS:
            for key, metric in METRICS.items():
                if f"{key}/{name}" in first:
                    table.append(mean_row(case, name, metric, joined(results, f"{prefix}-", f"{key}/{name}")))
        if prefix == "recorded":
            walks = joined(results, f"{prefix}-", "random_walk")
            table.append(mean_row(case, "bingham", "random_walk_rad_per_root_s", walks))
        curves |= {
            f"{prefix}/{name}": first[name][0] for name in ("time", "truth", "measured", "bingham") if name in first
        }
    return StudyResult("madaan2017", runs, seed, table, curves)


STUDY = Study(
    name="madaan2017",
    options=("name", "time", "orientation"),
    title="Madaan, Suresh & Kalra 2017: precessing body, noisy and filtered; a recorded motion with --recording",
    # The report shows one run and names no number of them.
    default_runs=20,
    chunks=_chunks,
    summarize=_summarize,
    version=3,
)
