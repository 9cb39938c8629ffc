"""Glover & Kaelbling 2013, §6, spinning ping-pong balls: spins found from a logo seen in high-speed video, simulated.

The videos were never published. Flights are made from the description: a ball gun with 12 settings, 200 frames a
second, 25–50 revolutions a second, an elliptic logo on one side that cameras above the table see on the upper part of
the ball only, and whose orientation has two interpretations.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.studies.ball_adapted import FLIGHTS, adapted_noises
from bingham.studies.ball_bounce import bounce_chunk, bounce_rows
from bingham.studies.ball_filters import FILTERS, run_filters
from bingham.studies.ball_flights import FRAMES, SPIN_TYPES, simulate_flight
from bingham.studies.ball_scores import AFTER
from bingham.studies.study import Arrays, Chunk, Row, Study, StudyResult, generator, joined, mean_row, range_chunks

__all__ = ["ASSUMED", "DEFAULT", "LOGO_NOISES", "STUDY"]

FloatArray = NDArray[np.float64]
CHUNK = 8
# True noise of a detected logo: tilts about the body's x and y, rotation about the logo's own axis. The third is the
# published filter's assumption, the first the study's default.
LOGO_NOISES = ((-200.0, -200.0, -100.0), (-800.0, -800.0, -400.0), (-100.0, -100.0, -50.0), (-40.0, -40.0, -10.0))
DEFAULT, ASSUMED = 0, 3
LOGO_ERRORS = {"logo_axis": 6.1, "logo_angle": 6.8}
COVERAGES = {"orientation_covered": "coverage_95", "spin_covered": "spin_coverage_95"}
PUBLISHED = {"classification_rate": 0.91, "spin_error_rad": 0.17}


def run_chunk(level: int, seed: int, first: int, last: int, adapted_on: int = FLIGHTS) -> Arrays:
    """Filter flights first … last − 1 at one level of logo noise: orientation and spin errors, and classifications.

    The mixture's noises are those of largest evidence on ``adapted_on`` other flights.
    """
    parts: list[Arrays] = []
    adapted = adapted_noises(level, LOGO_NOISES[level], seed, adapted_on)
    concentrations = {f"adapted/{name}": noise.z[:3] for name, noise in adapted._asdict().items()}
    for run in range(first, last):
        rng = generator(seed, level, run)
        kind = run % len(SPIN_TYPES)
        flight, discarded = simulate_flight(kind, LOGO_NOISES[level], rng)
        found = run_filters(flight, kind, SPIN_TYPES, FILTERS, adapted)
        guess = int(rng.integers(len(SPIN_TYPES)))
        found["spin_error/random_guess"] = np.full(FRAMES, _angle(SPIN_TYPES[guess], flight["spin"]))
        found["correct/random_guess"] = np.full(FRAMES, float(guess == kind))
        parts.append(found | concentrations | {"kind": np.array(kind), "discarded": np.array(discarded)})
    return {name: np.stack([part[name] for part in parts]) for name in parts[0]}


def _angle(p: FloatArray, q: FloatArray) -> float:
    return float(2.0 * np.arccos(min(1.0, abs(p @ q))))


def _chunks(runs: int, seed: int, options: Mapping[str, Any]) -> list[Chunk]:
    levels = [
        chunk
        for level in range(len(LOGO_NOISES))
        for chunk in range_chunks(
            f"level{level}-", run_chunk, runs, CHUNK, level=level, seed=seed, adapted_on=min(runs, FLIGHTS)
        )
    ]
    return levels + range_chunks("bounce-", bounce_chunk, runs, CHUNK, noise=LOGO_NOISES[DEFAULT], seed=seed)


def _case(level: int) -> str:
    return "logo noise " + "/".join(f"{z:g}" for z in LOGO_NOISES[level])


def _summarize(runs: int, seed: int, results: Mapping[str, Arrays]) -> StudyResult:
    table: list[Row] = []
    curves: Arrays = {"kind": joined(results, f"level{DEFAULT}-", "kind")}
    for level in range(len(LOGO_NOISES)):
        first = results[min(key for key in results if key.startswith(f"level{level}-"))]
        found = {name: joined(results, f"level{level}-", name) for name in first if name.count("/") == 1}
        for name in (*FILTERS, "random_guess"):
            correct, spin = found[f"correct/{name}"], found[f"spin_error/{name}"]
            orientation = found.get(f"orientation_error/{name}")
            covered = {metric: found.get(f"{key}/{name}") for key, metric in COVERAGES.items()}
            for k, frame in enumerate(AFTER):
                case = f"{_case(level)}, frame {frame}"
                ours = name == "bingham_second_order" and level == DEFAULT and frame == AFTER[-1]
                paper = PUBLISHED if ours else {}
                rate = paper.get("classification_rate")
                table.append(mean_row(case, name, "classification_rate", correct[:, frame - 1], rate))
                table.append(mean_row(case, name, "spin_error_rad", spin[:, frame - 1], paper.get("spin_error_rad")))
                if orientation is not None:
                    table.append(mean_row(case, name, "orientation_error_rad", orientation[:, frame - 1]))
                    for part, published in LOGO_ERRORS.items():
                        error = np.degrees(found[f"{part}_error/{name}"][:, frame - 1])
                        table.append(mean_row(case, name, f"{part}_error_deg", error, published if ours else None))
                if name != "bingham_second_order" and frame == AFTER[-1]:
                    difference = spin[:, frame - 1] - found["spin_error/bingham_second_order"][:, frame - 1]
                    table.append(mean_row(case, name, "spin_error_rad_above_second_order", difference))
                for metric, inside in covered.items():
                    if inside is not None:
                        table.append(mean_row(case, name, metric, inside[:, k]))
            case = f"{_case(level)}, mean of frames 1-{AFTER[-1]}"
            table.append(mean_row(case, name, "classification_rate", correct[:, : AFTER[-1]].mean(axis=1)))
            table.append(mean_row(case, name, "spin_error_rad", spin[:, : AFTER[-1]].mean(axis=1)))
        for noise in ("process", "logo", "dark"):
            z = found.pop(f"adapted/{noise}")[0]
            table += [
                Row(_case(level), "bingham_mixture", f"{noise}_z{k + 1}", float(value)) for k, value in enumerate(z)
            ]
        if level == DEFAULT:
            table += _by_direction(found, curves["kind"])
        if level in (DEFAULT, ASSUMED):
            curves |= {f"{level}/{name}": curve for name, curve in found.items()}
        discarded = joined(results, f"level{level}-", "discarded").sum()
        share = float(discarded / (discarded + runs))
        table.append(Row(_case(level), "truth", "discarded_share", share, None, 34 / 107))
    table += bounce_rows(results)
    return StudyResult("glover2013-ball", runs, seed, table, curves)


def _by_direction(found: Arrays, kind: FloatArray) -> list[Row]:
    """Return the rows of topspin and underspin, and of sidespin, which the cameras see from its axis."""
    rows: list[Row] = []
    n = AFTER[-1] - 1
    for name in ("bingham_second_order", "bingham_mixture", "ekf_first_order", "ekf_second_order"):
        for group, chosen in (("topspin and underspin", kind // 3 < 2), ("sidespin", kind // 3 >= 2)):
            if chosen.any():
                case = f"{_case(DEFAULT)}, {group}, frame {n + 1}"
                rows.append(mean_row(case, name, "classification_rate", found[f"correct/{name}"][chosen, n]))
                rows.append(mean_row(case, name, "spin_error_rad", found[f"spin_error/{name}"][chosen, n]))
    return rows


STUDY = Study(
    name="glover2013-ball",
    title="Glover & Kaelbling 2013: spinning balls, second-order filters, spin classification (simulated flights)",
    # Four times the paper's number: of 73 flights, a single one that settles half a turn off decides the order.
    default_runs=292,
    chunks=_chunks,
    summarize=_summarize,
    version=7,
)
