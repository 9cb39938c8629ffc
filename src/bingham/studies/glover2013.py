"""Glover & Kaelbling 2013, §6, synthetic data: error of the composition, and Table 1 against quaternion EKFs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from bingham.distributions.bingham import Bingham
from bingham.distributions.relations import from_gaussian, to_gaussian
from bingham.errors import InvalidArgumentError
from bingham.filters.first_order import BinghamFilter
from bingham.filters.gaussian import GaussianState
from bingham.filters.quaternion_ekf import QuaternionEkf
from bingham.metrics import angle_probability, chi_square_probability, coverage, geodesic_error, normalized_error
from bingham.rotations import compose, conjugate
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

__all__ = ["STUDY", "composition_error", "isotropic_law", "simulate"]

FloatArray = NDArray[np.float64]
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
STEPS = 1000
CHUNK = 10
# Coverage is counted on every THIN-th step: neighbours say nearly the same.
THIN = 20
# Euler angles of the nominal motion: amplitude, rad, and periods, steps.
AMPLITUDE = 0.5 * np.pi
PERIODS = np.array([200.0, 250.0, 300.0])

# Table 1: (process, observation) → published mean improvement over the EKF in % and its standard error.
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

# Noises of the composition study, all nine pairs of them.
COMPOSED = ((-50.0, -50.0, -50.0), (-200.0, -200.0, -200.0), (-10.0, -10.0, -1.0))
COMPOSED_STEPS = 200
COMPOSED_SAMPLES = 400
PUBLISHED_KL = (0.0012, 0.0197)
FILTERS = ("bingham", "ekf", "ekf_padded", "ekf_fair")


def isotropic_law(z: tuple[float, ...]) -> Bingham:
    """Return the law with its mode at the identity and concentrations (3,) along x, y and z."""
    return Bingham([*z, 0.0], np.eye(4)[:, [1, 2, 3, 0]])


def _nominal(rng: np.random.Generator, steps: int) -> tuple[FloatArray, FloatArray]:
    """Return the start (4,) and the controls (steps, 4) of a sine wave on each Euler angle, with random phases."""
    time = np.arange(steps + 1)[:, None]
    angles = AMPLITUDE * np.sin(2.0 * np.pi * (time / PERIODS + rng.random(3)))
    q: Any = Rotation.from_euler("xyz", angles).as_quat(scalar_first=True)
    return q[0], compose(q[1:], conjugate(q[:-1]))


def _projected(covariance: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """Return unit quaternions (count, 4) near the identity: projected draws from N(identity, covariance)."""
    values, axes = np.linalg.eigh(covariance)
    x = IDENTITY + (rng.standard_normal((count, 4)) * np.sqrt(np.maximum(values, 0.0))) @ axes.T
    return x / np.linalg.norm(x, axis=1, keepdims=True)


def simulate(start: FloatArray, controls: FloatArray, process: FloatArray, observation: FloatArray) -> Arrays:
    """Return truth and measurements (T, 4): x' = w ⊗ u ⊗ x, y = v ⊗ x, from noises w and v (T, 4)."""
    truth = np.empty_like(controls)
    x = start
    for t, (w, u) in enumerate(zip(process, controls, strict=True)):
        x = compose(w, compose(u, x))
        x /= np.linalg.norm(x)
        truth[t] = x
    return {"truth": truth, "measured": compose(observation, truth)}


def run_cell(process: float, observation: tuple[float, ...], seed: int, cell: int, first: int, last: int) -> Arrays:
    """Filter projected-Gaussian signals first … last − 1 of one cell of Table 1; errors are angles of rotations."""
    laws = isotropic_law((process,) * 3), isotropic_law(observation)
    w, v = (to_gaussian(law).covariance for law in laws)
    count = last - first
    starts, controls = np.empty((count, 4)), np.empty((count, STEPS, 4))
    truth, measured = np.empty_like(controls), np.empty_like(controls)
    for i, run in enumerate(range(first, last)):
        rng = generator(seed, cell, run)
        starts[i], controls[i] = _nominal(rng, STEPS)
        data = simulate(starts[i], controls[i], _projected(w, STEPS, rng), _projected(v, STEPS, rng))
        truth[i], measured[i] = data["truth"], data["measured"]

    # All filters start from the observation noise about the true start.
    noise = from_gaussian(IDENTITY, v)
    prior = Bingham.from_spectrum(np.tile(noise.z, (count, 1)), np.stack([noise.rotate(right=q).M for q in starts]))
    track = BinghamFilter(from_gaussian(IDENTITY, w), noise, noise_side="left").run(prior, measured, controls=controls)
    start = GaussianState(starts, np.tile(np.trace(v) * np.eye(4), (count, 1, 1)))
    kalman = {
        "ekf": QuaternionEkf(w, v),
        "ekf_padded": QuaternionEkf(_padded(w), _padded(v)),
        "ekf_fair": QuaternionEkf(w, v, rotate_noise=True),
    }
    tracks = {name: f.run(start, measured, controls) for name, f in kalman.items()}
    out: Arrays = {"error/bingham": 2.0 * geodesic_error(track.modes, truth).mean(axis=1)}
    laws_kept = Bingham.from_spectrum(track.concentrations[:, ::THIN].copy(), track.frames[:, ::THIN].copy())
    out["coverage/bingham"] = coverage(angle_probability(laws_kept, truth[:, ::THIN]), axis=1)
    for name, kept in tracks.items():
        out[f"error/{name}"] = 2.0 * geodesic_error(kept.modes, truth).mean(axis=1)
        statistic = normalized_error(kept.modes[:, ::THIN], kept.states.covariance[:, ::THIN], truth[:, ::THIN])
        out[f"coverage/{name}"] = coverage(chi_square_probability(statistic, 3), axis=1)
    out["step"] = np.degrees(2.0 * geodesic_error(truth[:, 1:], truth[:, :-1]).mean(axis=1))
    return out


def _padded(covariance: FloatArray) -> FloatArray:
    """Return the covariance with its scalar entry raised to the mean of the others, less tied to the identity."""
    c = covariance.copy()
    c[0, 0] = np.trace(c[1:, 1:]) / 3.0
    return c


def composition_error(p: Bingham, q: Bingham, samples: int, rng: np.random.Generator) -> float:
    """Return KL(f_B ‖ f_true) of the moment-matched law f_B of x ⊗ y, x ~ p, y ~ q (Glover & Kaelbling, A.9.3).

    With r = f_true/f_B the estimator E_B[r − 1 − log r] is unbiased like E_B[−log r], since E_B[r] = 1, never negative,
    and its variance is of the order of its square.
    """
    matched = p.compose(q)
    x = matched.rvs(samples, rng=rng)
    log_ratio = p.composed_logpdf(q, x) - matched.logpdf(x)
    return float(np.mean(np.expm1(log_ratio) - log_ratio))


def run_composition(process: tuple[float, ...], observation: tuple[float, ...], seed: int, cell: int) -> Arrays:
    """Return the composition errors along one Bingham signal, at every fourth prediction of the filter."""
    rng = generator(seed, len(TABLE) + cell)
    w, v = isotropic_law(process), isotropic_law(observation)
    start, controls = _nominal(rng, COMPOSED_STEPS)
    data = simulate(start, controls, w.rvs(COMPOSED_STEPS, rng=rng), v.rvs(COMPOSED_STEPS, rng=rng))
    track = BinghamFilter(w, v, noise_side="left").run(Bingham.uniform(4), data["measured"], controls=controls)
    laws = track.laws
    errors = [composition_error(w, laws[t], COMPOSED_SAMPLES, rng) for t in range(0, COMPOSED_STEPS, 4)]
    return {"kl": np.array(errors)}


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
    curves: Arrays = {}
    for cell, ((process, observation), (published, _)) in enumerate(TABLE.items()):
        case, prefix = f"process {process:g}, observation {_name(observation)}", f"cell{cell}-"
        error = {name: joined(results, prefix, f"error/{name}") for name in FILTERS}
        for name in FILTERS:
            errors[name].append(error[name])
            table.append(mean_row(case, name, "mean_error_rad", error[name]))
            table.append(mean_row(case, name, "coverage_95", joined(results, prefix, f"coverage/{name}")))
        for name in FILTERS[1:]:
            gain = 100.0 * (1.0 - error["bingham"] / error[name])
            table.append(
                mean_row(
                    f"{case}, against {name}",
                    "bingham",
                    "improvement_percent",
                    gain,
                    published if name == "ekf" else None,
                )
            )
        curves[f"improvement/{cell}"] = 100.0 * (1.0 - error["bingham"] / error["ekf"])
        table.append(mean_row(case, "truth", "step_deg", joined(results, prefix, "step"), PUBLISHED_STEP[process]))
    joint = {name: np.concatenate(values) for name, values in errors.items()}
    for name in FILTERS[1:]:
        row = wins_row(
            f"all signals, against {name}",
            "bingham",
            joint["bingham"] < joint[name],
            PUBLISHED_WINS if name == "ekf" else None,
        )
        table.append(row)
    pairs = [(p, o) for p in COMPOSED for o in COMPOSED]
    divergence = np.stack([results[f"composition{cell}"]["kl"] for cell in range(len(pairs))])
    for (p, o), values in zip(pairs, divergence, strict=True):
        table.append(mean_row(f"composition, process {_name(p)}, observation {_name(o)}", "bingham", "kl", values))
    table.append(Row("composition, mean of all", "bingham", "kl", float(divergence.mean()), None, PUBLISHED_KL[0]))
    table.append(Row("composition, largest", "bingham", "kl", float(divergence.max()), None, PUBLISHED_KL[1]))
    curves |= {f"error/{name}": values for name, values in joint.items()} | {"composition/kl": divergence}
    return StudyResult("glover2013", runs, seed, table, curves)


STUDY = Study(
    name="glover2013",
    title="Glover & Kaelbling 2013: error of the composition; Table 1 against first-order quaternion EKFs",
    default_runs=270,
    chunks=_chunks,
    summarize=_summarize,
)
