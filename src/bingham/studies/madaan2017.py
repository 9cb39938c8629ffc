"""Madaan, Suresh & Kalra 2017, §IV: a precessing body under Bingham noise, and the same filter on a recorded motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.filters.first_order import BinghamFilter
from bingham.filters.second_order import SecondOrderBinghamFilter, SpinState
from bingham.metrics import angle_probability, coverage, geodesic_error, root_mean_square
from bingham.models.motion import Diffusion
from bingham.rotations import compose, conjugate
from bingham.simulate import simulate_precession
from bingham.studies.study import Arrays, Chunk, Row, Study, StudyResult, generator, joined, mean_row

__all__ = ["NOISE", "STUDY"]

FloatArray = NDArray[np.float64]
# The report's laws: prior and "system noise", modes at the identity.
PRIOR = Bingham([-1.0, -1.0, -1.0, 0.0], np.eye(4)[::-1])
NOISE = Bingham([-5e4, -5e4, -5e4, 0.0], np.eye(4)[::-1])
# Not in the report: its figures show some turns of a body that spins ten times faster than it precesses.
RATE_HZ, DURATION_S, SPIN, PRECESSION, TILT = 50.0, 20.0, 3.0, 0.3, 0.6
# Spread of the spin's change in each step that the second-order filter assumes.
SPIN_NOISE = Bingham([-4e5, -4e5, -4e5, 0.0], np.eye(4)[::-1])
THIN = 10
# Candidates for the random walk of a recorded motion, rad/√s; the evidence of the measurements chooses.
RANDOM_WALKS = np.geomspace(0.01, 3.0, 13)


def run_precession(seed: int, run: int) -> Arrays:
    """Filter one disturbed, noisily measured precession: x' = x ⊗ u ⊗ w, z = x ⊗ v, with and without the controls."""
    rng = generator(seed, 0, run)
    nominal = simulate_precession(DURATION_S, RATE_HZ, spin=SPIN, precession=PRECESSION, tilt_rad=TILT).orientation
    controls = compose(conjugate(nominal[:-1]), nominal[1:])
    steps = len(controls)
    disturbed = compose(controls, NOISE.rvs(steps, rng=rng))
    truth = np.empty_like(controls)
    x = nominal[0]
    for t in range(steps):
        x = compose(x, disturbed[t])
        x /= np.linalg.norm(x)
        truth[t] = x
    measured = compose(truth, NOISE.rvs(steps, rng=rng))
    track = BinghamFilter(NOISE, NOISE).run(PRIOR, measured, controls=controls)
    out = _scores(track.modes, track.laws, truth, measured)

    second = SecondOrderBinghamFilter(SPIN_NOISE, NOISE, noise_side="right")
    state = SpinState(PRIOR, Bingham([-3.0, -3.0, -3.0, 0.0], np.eye(4)[::-1]))
    modes = np.empty_like(truth)
    for t in range(steps):
        state, _ = second.update(second.predict(state), measured[t])
        modes[t] = state.mode
    out["rmse/bingham_second_order"] = root_mean_square(2.0 * geodesic_error(modes, truth))
    if run == 0:
        out |= {"truth": truth, "measured": measured, "bingham": track.modes}
    return out


def run_recorded(seed: int, run: int, time: FloatArray, orientation: FloatArray) -> Arrays:
    """Filter a recorded motion with the report's noise added: prediction by a random walk chosen by the evidence."""
    measured = compose(orientation, NOISE.rvs(len(time), rng=generator(seed, 1, run)))
    tracks = [BinghamFilter(Diffusion(float(s)), NOISE).run(PRIOR, measured, times=time) for s in RANDOM_WALKS]
    best = int(np.argmax([track.total_log_evidence for track in tracks]))
    out = _scores(tracks[best].modes, tracks[best].laws, orientation, measured)
    return out | {"random_walk": np.array(RANDOM_WALKS[best])}


def _scores(modes: FloatArray, laws: Bingham, truth: FloatArray, measured: FloatArray) -> Arrays:
    kept = Bingham.from_spectrum(laws.z[::THIN].copy(), laws.M[::THIN].copy())
    return {
        "rmse/bingham": root_mean_square(2.0 * geodesic_error(modes, truth)),
        "rmse/measured": root_mean_square(2.0 * geodesic_error(measured, truth)),
        "coverage/bingham": coverage(angle_probability(kept, truth[::THIN])),
    }


def _single(function: Any, **arguments: Any) -> Arrays:
    """Run one run and give its scalars an axis, so that runs can be joined."""
    return {name: np.asarray(a)[None] for name, a in function(**arguments).items()}


def _chunks(runs: int, seed: int, options: Mapping[str, Any]) -> list[Chunk]:
    chunks = [
        Chunk(f"precession-{run:07d}", _single, {"function": run_precession, "seed": seed, "run": run})
        for run in range(runs)
    ]
    if "orientation" in options:
        d = np.shape(options["orientation"])[-1]
        if d != 4:
            raise InvalidArgumentError("recording", "quaternions", f"vectors of length {d}")
        more = {"time": options["time"], "orientation": options["orientation"]}
        chunks += [
            Chunk(f"recorded-{run:07d}", _single, {"function": run_recorded, "seed": seed, "run": run} | more)
            for run in range(runs)
        ]
    return chunks


def _summarize(runs: int, seed: int, results: Mapping[str, Arrays]) -> StudyResult:
    table: list[Row] = []
    for prefix, case in (("precession", "precession"), ("recorded", "recorded motion")):
        if not any(key.startswith(prefix) for key in results):
            continue
        for name in ("measured", "bingham", "bingham_second_order"):
            if f"rmse/{name}" in results[f"{prefix}-{0:07d}"]:
                table.append(mean_row(case, name, "rmse_rad", joined(results, prefix, f"rmse/{name}")))
        table.append(mean_row(case, "bingham", "coverage_95", joined(results, prefix, "coverage/bingham")))
        if prefix == "recorded":
            table.append(
                mean_row(case, "bingham", "random_walk_rad_per_root_s", joined(results, prefix, "random_walk"))
            )
    first = results[f"precession-{0:07d}"]
    return StudyResult(
        "madaan2017", runs, seed, table, {name: first[name][0] for name in ("truth", "measured", "bingham")}
    )


STUDY = Study(
    name="madaan2017",
    title="Madaan, Suresh & Kalra 2017: precessing body, noisy and filtered; a recorded motion with --recording",
    default_runs=20,
    chunks=_chunks,
    summarize=_summarize,
)
