"""Li, Frisch, Noack & Hanebeck 2019: Riemannian spherical sampling, and filters that sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.filters.exact_vector import exact_vector_posterior
from bingham.filters.first_order import BinghamFilter
from bingham.filters.sampled import SampledFilter
from bingham.kernels.refit import refit
from bingham.metrics import root_mean_square
from bingham.models.motion import ControlledRotation
from bingham.models.sensors import Likelihood, davenport_matrix
from bingham.rotations import compose, from_rotation_vector
from bingham.sampling.protocol import Sampler
from bingham.sampling.random import RandomSampling
from bingham.sampling.riemannian import RiemannianSampling
from bingham.sampling.unscented import Unscented
from bingham.studies.li2019_sampling import correction_rows, correction_sets, sampling_rows, sampling_sets
from bingham.studies.study import Arrays, Chunk, Row, Study, StudyResult, generator, joined, mean_row, range_chunks

__all__ = ["FILTERS", "NOISE_LEVELS", "STUDY"]

FloatArray = NDArray[np.float64]

STEPS = 50
CHUNK = 5
NOISE_LEVELS = (1e-1, 1e-2, 1e-4)
# Process noise −diag(1, 10, 10, 10) of Fig. 7, mode at the identity; the paper names no initial distribution: the same.
PROCESS = Bingham([-10.0, -10.0, -10.0, -1.0], np.eye(4)[:, ::-1])
# The paper names neither the input u nor the rotated vector n₀.
INPUT = from_rotation_vector([0.0, 0.2, 0.0])
VECTOR = np.array([0.0, 0.0, 1.0])
# How often single updates are scored against the exact posterior.
SCORED = 10


@dataclass(frozen=True)
class Choice:
    """A filter of the study: its sampler, made anew for each run; None: exact or conjugate."""

    sampler: Any = None
    progressive: bool = False


FILTERS = {
    "unscented_7": Choice(lambda rng: Unscented()),
    "unscented_progressive_7": Choice(lambda rng: Unscented(), progressive=True),
    "rss_20": Choice(lambda rng: RiemannianSampling(20)),
    "rss_50": Choice(lambda rng: RiemannianSampling(50)),
    "rss_100": Choice(lambda rng: RiemannianSampling(100)),
    "rss_gnomonic_100": Choice(lambda rng: RiemannianSampling(100, map="gnomonic")),
    "rss_progressive_100": Choice(lambda rng: RiemannianSampling(100), progressive=True),
    "random_100": Choice(lambda rng: RandomSampling(100, rng=rng)),
    "particle_2000": Choice(lambda rng: RandomSampling(2000, rng=rng)),
    "particle_20000": Choice(lambda rng: RandomSampling(20_000, rng=rng)),
    "conjugate": Choice(),
    "quadrature": Choice(),
}


def rotated(q: FloatArray) -> FloatArray:
    """Return q ⊗ n₀ ⊗ q* (..., 3) of unit quaternions (..., 4), n₀ = (0, 0, 1)."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return np.stack([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z], axis=-1)


def variances(level: float) -> FloatArray:
    """Return the diagonal (3,) of the measurement noise's covariance."""
    return level * np.array([1.0, 10.0, 10.0])


def simulate(seed: int, level: int, run: int) -> tuple[FloatArray, FloatArray]:
    """Return orientations (T, 4) and measured vectors (T, 3) of one run (eqs. 14, 15)."""
    rng = generator(seed, level, run)
    noise = PROCESS.rvs(STEPS, rng=rng)
    q = np.array([1.0, 0.0, 0.0, 0.0])
    truth = np.empty((STEPS, 4))
    for t in range(STEPS):
        q = compose(compose(q, INPUT), noise[t])
        truth[t] = q
    deviation = np.sqrt(variances(NOISE_LEVELS[level]))
    return truth, rotated(truth) + deviation * rng.standard_normal((STEPS, 3))


@dataclass(frozen=True)
class IsotropicVector:
    """The measurement as if its noise were isotropic with the same total variance: exactly conjugate."""

    variance: float

    def likelihood(self, z: Any, predicted: Bingham) -> Likelihood:
        """Return L = K(z, n₀)/σ², less its largest eigenvalue |z|/σ²."""
        y = np.asarray(z, dtype=np.float64)
        length = float(np.linalg.norm(y))
        matrix = (davenport_matrix(y, VECTOR) - length * np.eye(4)) / self.variance
        log_normalizer = 1.5 * np.log(2.0 * np.pi * self.variance) + 0.5 * (length - 1.0) ** 2 / self.variance
        return Likelihood(matrix, float(log_normalizer), 2)


@dataclass(frozen=True)
class QuadratureFilter:
    """Assumed-density filter with the exact posterior moment: what all sampled ones approximate."""

    precision: FloatArray

    def predict(self, state: Bingham, control: Any = None, dt: float | None = None) -> Bingham:
        """Return the distribution of x ⊕ u ⊕ w."""
        return ControlledRotation(PROCESS).propagate(state, INPUT, None)

    def update(self, state: Bingham, z: FloatArray) -> tuple[Bingham, float]:
        """Return the moment-matched posterior and its log-evidence."""
        exact = exact_vector_posterior(state, VECTOR, lambda r: -0.5 * (z - r) ** 2 @ self.precision, z, tolerance=1e-5)
        z, frame, log_f, w, _ = refit(exact.moment, np.array(state.M), 1e-12)
        return Bingham.from_spectrum(z, frame, log_f, w), exact.log_evidence


def build(name: str, level: float, rng: np.random.Generator) -> Any:
    """Return the filter of that name at a noise level."""
    choice, variance = FILTERS[name], variances(level)
    if name == "quadrature":
        return QuadratureFilter(1.0 / variance)
    if name == "conjugate":
        return BinghamFilter(ControlledRotation(PROCESS), IsotropicVector(float(variance.mean())))
    constant = -0.5 * float(np.sum(np.log(2.0 * np.pi * variance)))
    precision = 1.0 / variance

    def log_likelihood(z: FloatArray, q: FloatArray) -> FloatArray:
        return constant - 0.5 * (z - rotated(q)) ** 2 @ precision

    # As in the paper, the linear prediction x ⊗ u ⊗ w is composed exactly; samples serve the update.
    sampler: Sampler = choice.sampler(rng)
    return SampledFilter(process_noise=PROCESS, log_likelihood=log_likelihood, sampler=sampler,
                         progressive=choice.progressive)  # fmt: skip


def track(bingham_filter: Any, measured: FloatArray) -> tuple[list[Bingham], list[Bingham]]:
    """Return predicted and updated distributions of each step, from the initial distribution."""
    state, predicted, updated = PROCESS, [], []
    for z in measured:
        state = bingham_filter.predict(state, INPUT)
        predicted.append(state)
        state, _ = bingham_filter.update(state, z)
        updated.append(state)
    return predicted, updated


def run_chunk(seed: int, level: int, first: int, last: int) -> Arrays:
    """Track runs first … last − 1 at one noise level: RMS errors of each run and moment errors of single updates."""
    value = NOISE_LEVELS[level]
    metrics = ("rmse", "orientation", "moment")
    out = {f"{metric}/{name}": np.empty(last - first) for name in FILTERS for metric in metrics}
    for i, run in enumerate(range(first, last)):
        truth, measured = simulate(seed, level, run)
        predicted, updated = track(build("quadrature", value, np.random.default_rng(0)), measured)
        scored = range(SCORED - 1, STEPS, SCORED)
        for k, name in enumerate(FILTERS):
            one = build(name, value, generator(seed, level, run, k))
            distributions = updated if name == "quadrature" else track(one, measured)[1]
            modes = np.array([distribution.mode for distribution in distributions])
            cosine = np.sum(rotated(modes) * rotated(truth), axis=1)
            out[f"rmse/{name}"][i] = root_mean_square(np.arccos(np.clip(cosine, -1.0, 1.0)))
            overlap = np.abs(np.sum(modes * truth, axis=1))
            out[f"orientation/{name}"][i] = root_mean_square(2.0 * np.arccos(np.minimum(overlap, 1.0)))
            # One update each from the exact filter's prediction, so that errors do not add up over time.
            errors = [one.update(predicted[t], measured[t])[0].moment() - updated[t].moment() for t in scored]
            out[f"moment/{name}"][i] = np.mean([np.linalg.norm(e) for e in errors])
    return out


def milliseconds_per_step(name: str, level: float, measured: FloatArray, repetitions: int = 3) -> float:
    """Return the median processor time of a prediction and an update, ms, each the best of some repetitions."""
    one = build(name, level, np.random.default_rng(0))
    track(one, measured[:3])
    best = np.full(len(measured), np.inf)
    for _ in range(repetitions):
        state = PROCESS
        for t, z in enumerate(measured):
            start = process_time()
            state, _ = one.update(one.predict(state, INPUT), z)
            best[t] = min(best[t], process_time() - start)
    return 1e3 * float(np.median(best))


def _chunks(runs: int, seed: int, options: Mapping[str, Any]) -> list[Chunk]:
    chunks = [Chunk("sampling", sampling_sets, {}), Chunk("correction", correction_sets, {})]
    for level in range(len(NOISE_LEVELS)):
        chunks += range_chunks(f"track-{level}-", run_chunk, runs, CHUNK, seed=seed, level=level)
    return chunks


def _summarize(runs: int, seed: int, results: Mapping[str, Arrays]) -> StudyResult:
    table: list[Row] = [*sampling_rows(results["sampling"]), *correction_rows(results["correction"])]
    curves: Arrays = {**results["sampling"], **results["correction"]}
    for level, value in enumerate(NOISE_LEVELS):
        case = f"tracking a={value:g}"
        _, measured = simulate(seed, level, 0)
        for name in FILTERS:
            rmse = joined(results, f"track-{level}-", f"rmse/{name}")
            table.append(mean_row(case, name, "rmse_rad", rmse))
            orientation = joined(results, f"track-{level}-", f"orientation/{name}")
            table.append(mean_row(case, name, "orientation_rmse_rad", orientation))
            table.append(mean_row(case, name, "moment_error", joined(results, f"track-{level}-", f"moment/{name}")))
            time = milliseconds_per_step(name, value, measured)
            table.append(Row(case, name, "ms_per_step", time))
            curves[f"rmse/{level}/{name}"] = rmse
            curves[f"ms/{level}/{name}"] = np.array([time])
    curves.update(_example(seed))
    return StudyResult("li2019", runs, seed, table, curves, headline=("rmse_rad", "ms_per_step"))


def _example(seed: int) -> Arrays:
    """Return where the rotated vector points in the first run of the lowest noise: truth, and every filter's mode."""
    level = len(NOISE_LEVELS) - 1
    truth, measured = simulate(seed, level, 0)
    curves = {"track/truth": rotated(truth)}
    for k, name in enumerate(FILTERS):
        updated = track(build(name, NOISE_LEVELS[level], generator(seed, level, 0, k)), measured)[1]
        curves[f"track/{name}"] = rotated(np.array([distribution.mode for distribution in updated]))
    return curves


STUDY = Study(
    name="li2019",
    title="Li et al. 2019: Riemannian spherical sampling against unscented and particle filters",
    default_runs=100,
    chunks=_chunks,
    summarize=_summarize,
)
