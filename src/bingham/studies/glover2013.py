"""Glover & Kaelbling 2013, §6, synthetic data: error of the composition, and Table 1 against quaternion EKFs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.baselines.gaussian import GaussianState
from bingham.baselines.quaternion_ekf import QuaternionEkf
from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.filters.first_order import BinghamFilter
from bingham.metrics import angle_probability, chi_square_probability, geodesic_error, nees
from bingham.studies.calibration import calibration_arrays, calibration_rows, moment_error
from bingham.studies.glover2013_composition import COMPOSED, run_composition
from bingham.studies.glover2013_runs import run_curves
from bingham.studies.glover2013_signals import (
    isotropic_distribution,
    noise_covariance,
    nominal_motion,
    projected_draws,
    simulate,
)
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

__all__ = ["STUDY", "TABLE"]

FloatArray = NDArray[np.float64]
STEPS = 1000
CHUNK = 10
# Calibration is judged on every THIN-th step: neighbours say nearly the same.
THIN = 20

# Table 1: (process, observation) → published mean improvement over the EKF in % and the figure after its "±".
NARROW, WIDE, GIRDLE = (-400.0, -400.0, -400.0), (-50.0, -50.0, -50.0), (-400.0, -400.0, -10.0)
TABLE = {
    (-50.0, GIRDLE): (37.3, 5.1),
    (-200.0, GIRDLE): (45.6, 5.0),
    (-400.0, GIRDLE): (54.3, 6.4),
    (-50.0, NARROW): (19.9, 1.8),
    (-200.0, NARROW): (3.33, 0.53),
    (-400.0, NARROW): (1.52, 0.44),
    (-50.0, WIDE): (3.42, 0.88),
    (-200.0, WIDE): (0.72, 0.40),
    (-400.0, WIDE): (0.47, 0.27),
}
PUBLISHED_WINS = 268.0
# Mean change of orientation between steps, in degrees, that the paper states for each process noise.
PUBLISHED_STEP = {-50.0: 18.0, -200.0: 9.0, -400.0: 7.0}
# Mean and largest error of the composition.
PUBLISHED_KL = (0.0012, 0.0197)
FILTERS = ("bingham", "ekf_fixed", "ekf_padded", "ekf_fair")


def run_cell(process: float, observation: tuple[float, ...], seed: int, cell: int, first: int, last: int) -> Arrays:
    """Filter projected-Gaussian signals first … last − 1 of one cell of Table 1; errors are angles of rotations."""
    noises = (process,) * 3, observation
    process_distribution, observation_distribution = (isotropic_distribution(z) for z in noises)
    w, v = (noise_covariance(z) for z in noises)
    padded_w, padded_v = (noise_covariance(z, padded=True) for z in noises)
    count = last - first
    starts, controls = np.empty((count, 4)), np.empty((count, STEPS, 4))
    truth, measured = np.empty_like(controls), np.empty_like(controls)
    for i, run in enumerate(range(first, last)):
        rng = generator(seed, cell, run)
        starts[i], controls[i] = nominal_motion(rng, STEPS)
        data = simulate(starts[i], controls[i], projected_draws(w, STEPS, rng), projected_draws(v, STEPS, rng))
        truth[i], measured[i] = data["truth"], data["measured"]

    # All filters start from the observation noise about the true start.
    frames = np.stack([observation_distribution.rotate(right=q).M for q in starts])
    prior = Bingham.from_spectrum(np.tile(observation_distribution.z, (count, 1)), frames)
    track = BinghamFilter(process_distribution, observation_distribution, noise_side="left").run(
        prior, measured, controls=controls
    )
    start = GaussianState(starts, np.tile(np.trace(v) * np.eye(4), (count, 1, 1)))
    kalman = {
        "ekf_fixed": QuaternionEkf(w, v),
        "ekf_padded": QuaternionEkf(padded_w, padded_v),
        "ekf_fair": QuaternionEkf(w, v, rotate_noise=True),
    }
    tracks = {name: f.run(start, measured, controls=controls) for name, f in kalman.items()}
    kept = truth[:, ::THIN]
    distributions = Bingham.from_spectrum(track.concentrations[:, ::THIN].copy(), track.frames[:, ::THIN].copy())
    out: Arrays = {"error/bingham": 2.0 * geodesic_error(track.modes, truth).mean(axis=1)}
    out |= calibration_arrays("bingham", angle_probability(distributions, kept), moment_error(distributions, kept))
    for name, found in tracks.items():
        out[f"error/{name}"] = 2.0 * geodesic_error(found.modes, truth).mean(axis=1)
        statistic = nees(found.modes[:, ::THIN], found.states.covariance[:, ::THIN], kept)
        out |= calibration_arrays(name, chi_square_probability(statistic, 3), statistic / 3.0)
    out["step"] = np.degrees(2.0 * geodesic_error(truth[:, 1:], truth[:, :-1]).mean(axis=1))
    return out


def _name(z: tuple[float, ...]) -> str:
    return f"{z[0]:g}" if len(set(z)) == 1 else "/".join(f"{x:g}" for x in z)


def _chunks(runs: int, seed: int, options: Mapping[str, Any]) -> list[Chunk]:
    if runs < len(TABLE):
        raise InvalidArgumentError("runs", f"at least {len(TABLE)}, one signal for each cell of Table 1", runs)
    chunks: list[Chunk] = []
    for cell, (process, observation) in enumerate(TABLE):
        count = runs // len(TABLE) + (cell < runs % len(TABLE))
        arguments = {"process": process, "observation": observation, "seed": seed, "cell": cell}
        chunks += range_chunks(f"cell{cell}-", run_cell, count, CHUNK, **arguments)
    pairs = [(p, o) for p in COMPOSED for o in COMPOSED]
    for cell, (process, observation) in enumerate(pairs):
        arguments = {"process": process, "observation": observation, "seed": seed, "cell": cell}
        chunks.append(Chunk(f"composition{cell}", run_composition, arguments))
    return chunks


def _summarize(runs: int, seed: int, results: Mapping[str, Arrays]) -> StudyResult:
    table: list[Row] = []
    errors: dict[str, list[FloatArray]] = {name: [] for name in FILTERS}
    for cell, ((process, observation), (published, _)) in enumerate(TABLE.items()):
        case, prefix = f"process {process:g}, observation {_name(observation)}", f"cell{cell}-"
        error = {name: joined(results, prefix, f"error/{name}") for name in FILTERS}
        for name in FILTERS:
            errors[name].append(error[name])
            table.append(mean_row(case, name, "mean_error_rad", error[name]))
            table += calibration_rows(case, name, results, prefix, name)
        for name in FILTERS[1:]:
            gain, paper = 100.0 * (1.0 - error["bingham"] / error[name]), published if name == "ekf_fixed" else None
            table.append(mean_row(f"{case}, against {name}", "bingham", "improvement_percent", gain, paper))
        table.append(mean_row(case, "truth", "step_deg", joined(results, prefix, "step"), PUBLISHED_STEP[process]))
    joint = {name: np.concatenate(values) for name, values in errors.items()}
    for name in FILTERS[1:]:
        won, paper = joint["bingham"] < joint[name], PUBLISHED_WINS if name == "ekf_fixed" else None
        table.append(wins_row(f"all signals, against {name}", "bingham", won, paper))
    pairs = [(p, o) for p in COMPOSED for o in COMPOSED]
    divergence = np.stack([results[f"composition{cell}"]["kl"] for cell in range(len(pairs))])
    for (p, o), values in zip(pairs, divergence, strict=True):
        table.append(mean_row(f"composition, process {_name(p)}, observation {_name(o)}", "bingham", "kl", values))
    table.append(Row("composition, mean of all", "bingham", "kl", float(divergence.mean()), None, PUBLISHED_KL[0]))
    table.append(Row("composition, largest", "bingham", "kl", float(divergence.max()), None, PUBLISHED_KL[1]))
    curves = (
        {f"error/{name}": values for name, values in joint.items()} | {"composition/kl": divergence} | run_curves(seed)
    )
    return StudyResult("glover2013", runs, seed, table, curves)


STUDY = Study(
    name="glover2013",
    title="Glover & Kaelbling 2013: error of the composition; Table 1 against first-order quaternion EKFs",
    default_runs=270,
    chunks=_chunks,
    summarize=_summarize,
    version=2,
)
