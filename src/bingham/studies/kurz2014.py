"""Kurz, Gilitschenski, Julier & Hanebeck 2014, §7: axes and rotations, Bingham and Gaussian noise, against Kalman."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.baselines.axial_kalman import AxialKalmanFilter
from bingham.baselines.gaussian import GaussianState
from bingham.distributions.bingham import Bingham
from bingham.distributions.relations import from_gaussian, to_gaussian
from bingham.filters.first_order import BinghamFilter
from bingham.metrics import (
    angle_probability,
    chi_square_probability,
    geodesic_error,
    nees,
    root_mean_square,
)
from bingham.rotations import compose
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

__all__ = ["SCENARIOS", "STUDY", "Scenario"]

FloatArray = NDArray[np.float64]
STEPS = 100
CHUNK = 50
# Calibration is judged on every THIN-th step.
THIN = 5


@dataclass(frozen=True)
class Scenario:
    """One of the paper's settings: prior, process and measurement noise, and the true start."""

    label: str
    prior: Bingham
    process: Bingham
    measurement: Bingham
    start: tuple[float, ...]
    published_milliseconds: float

    @property
    def dim(self) -> int:
        """Ambient dimension."""
        return self.prior.dim

    @cached_property
    def gaussians(self) -> list[tuple[FloatArray, FloatArray]]:
        """Mean and covariance of prior, process and measurement noise by eq. (57)."""
        return [to_gaussian(distribution) for distribution in (self.prior, self.process, self.measurement)]

    @cached_property
    def refitted(self) -> list[Bingham]:
        """The Gaussian noises as Binghams again: process and measurement, by the moments of their projections."""
        return [from_gaussian(*g) for g in self.gaussians[1:]]

    def noises(self, kind: str) -> tuple[Bingham, Bingham]:
        """Return the noise distributions that the Bingham filter is given for 'bingham' or 'gaussian' noise."""
        process, measurement = (self.process, self.measurement) if kind == "bingham" else self.refitted
        return process, measurement

    def sample(self, kind: str, which: int, rng: np.random.Generator) -> FloatArray:
        """Return noise (STEPS, d); which = 0 for the process, 1 for the measurement."""
        if kind == "bingham":
            return (self.process, self.measurement)[which].rvs(STEPS, rng=rng)
        mean, covariance = self.gaussians[1 + which]
        values, axes = np.linalg.eigh(covariance)
        x = mean + (rng.standard_normal((STEPS, self.dim)) * np.sqrt(np.maximum(values, 0.0))) @ axes.T
        return x / np.linalg.norm(x, axis=1, keepdims=True)


SCENARIOS = (
    Scenario(
        "2-D",
        Bingham([-1.0, 0.0], np.eye(2)),
        Bingham([-200.0, 0.0], np.eye(2)[::-1]),
        Bingham([-2.0, 0.0], np.eye(2)[::-1]),
        (1.0, 0.0),
        8.0,
    ),
    Scenario(
        "4-D",
        Bingham([-1.0, -1.0, -1.0, 0.0], np.eye(4)),
        Bingham([-200.0, -200.0, -2.0, 0.0], np.eye(4)[::-1]),
        Bingham([-500.0, -500.0, -500.0, 0.0], np.eye(4)[::-1]),
        (0.0, 1.0, 0.0, 0.0),
        13.0,
    ),
)
KINDS = ("bingham", "gaussian")
# Diagonals of eqs. (58)–(60), the 2-D Gaussians.
PUBLISHED_COVARIANCES = ((3.8e-1, 1.5e-1), (4.7e-6, 2.5e-3), (8.8e-2, 2.8e-1))


def simulate(scenario: int, kind: str, seed: int, first: int, last: int) -> Arrays:
    """Return truth and measurements (R, T, d): x' = x ⊕ w, z = x ⊕ v."""
    s = SCENARIOS[scenario]
    noise = np.empty((2, last - first, STEPS, s.dim))
    for i, run in enumerate(range(first, last)):
        rng = generator(seed, scenario, KINDS.index(kind), run)
        for which in (0, 1):
            noise[which, i] = s.sample(kind, which, rng)
    truth = np.empty((last - first, STEPS, s.dim))
    x = np.broadcast_to(s.start, (last - first, s.dim))
    for t in range(STEPS):
        x = compose(x, noise[0, :, t])
        x /= np.linalg.norm(x, axis=-1, keepdims=True)
        truth[:, t] = x
    return {"truth": truth, "measured": compose(truth, noise[1])}


def run_chunk(scenario: int, kind: str, seed: int, first: int, last: int) -> Arrays:
    """Filter runs first … last − 1 with both filters: errors (R, T), RMSE and calibration (R,)."""
    s = SCENARIOS[scenario]
    data = simulate(scenario, kind, seed, first, last)
    truth, measured = data["truth"], data["measured"]
    track = BinghamFilter(*s.noises(kind)).run(s.prior, measured)
    (mean, covariance), (_, process), (_, measurement) = s.gaussians
    start = GaussianState(np.tile(mean, (last - first, 1)), np.tile(covariance, (last - first, 1, 1)))
    kalman = AxialKalmanFilter(process, measurement).run(start, measured)
    error = {"bingham": geodesic_error(track.modes, truth), "axial_kalman": geodesic_error(kalman.modes, truth)}
    kept = slice(None, None, THIN)
    distributions = Bingham.from_spectrum(track.concentrations[:, kept].copy(), track.frames[:, kept].copy())
    statistic = nees(kalman.modes[:, kept], kalman.states.covariance[:, kept], truth[:, kept])
    degrees = s.dim - 1
    out = calibration_arrays(
        "bingham", angle_probability(distributions, truth[:, kept]), moment_error(distributions, truth[:, kept])
    )
    out |= calibration_arrays("axial_kalman", chi_square_probability(statistic, degrees), statistic / degrees)
    for name in error:
        out[f"error/{name}"] = error[name]
        out[f"rmse/{name}"] = root_mean_square(error[name])
    return out


def _chunks(runs: int, seed: int, options: Mapping[str, Any]) -> list[Chunk]:
    return [
        chunk
        for i, s in enumerate(SCENARIOS)
        for kind in KINDS
        for chunk in range_chunks(f"{s.label}-{kind}-", run_chunk, runs, CHUNK, scenario=i, kind=kind, seed=seed)
    ]


def _summarize(runs: int, seed: int, results: Mapping[str, Arrays]) -> StudyResult:
    table: list[Row] = []
    curves: Arrays = {}
    for i, s in enumerate(SCENARIOS):
        for kind in KINDS:
            case, prefix = f"{s.label} {kind}", f"{s.label}-{kind}-"
            rmse = {name: joined(results, prefix, f"rmse/{name}") for name in ("bingham", "axial_kalman")}
            for name, values in rmse.items():
                table.append(mean_row(case, name, "rmse_rad", values))
                table += calibration_rows(case, name, results, prefix, name)
                curves[f"{case}/pit/{name}"] = joined(results, prefix, f"pit/{name}")
                curves[f"{case}/rmse/{name}"] = values
                curves[f"{case}/error/{name}"] = joined(results, prefix, f"error/{name}").mean(axis=0)
            table.append(wins_row(case, "bingham", rmse["bingham"] < rmse["axial_kalman"]))
        timed = BinghamFilter(s.process, s.measurement), s.prior, simulate(i, "bingham", seed, 0, 1)["measured"][0]
        for way, measure in (("", microseconds_per_step), (", call by call", microseconds_per_call)):
            case, paper = f"{s.label} bingham{way}", 1e3 * s.published_milliseconds
            table.append(Row(case, "bingham", "us_per_step", measure(*timed), None, paper))
    for part, (_, covariance), published in zip(
        ("prior", "process", "measurement"), SCENARIOS[0].gaussians, PUBLISHED_COVARIANCES, strict=True
    ):
        for j in (0, 1):
            table.append(
                Row(
                    f"2-D {part}, C{j + 1}{j + 1}",
                    "axial_kalman",
                    "covariance",
                    float(covariance[j, j]),
                    None,
                    published[j],
                )
            )
    return StudyResult("kurz2014", runs, seed, table, curves)


STUDY = Study(
    name="kurz2014",
    title="Kurz et al. 2014: axes and rotations, Bingham and Gaussian noise, against the axial Kalman filter",
    # Ten times the paper's 100: shares of runs won are known to ±3 % from 100 runs only.
    default_runs=1000,
    chunks=_chunks,
    summarize=_summarize,
    version=2,
)
