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

from bingham.distributions.bingham import Bingham
from bingham.rotations import compose, from_rotation_vector, rotate
from bingham.studies.ball_filters import FILTERS, run_filters
from bingham.studies.ball_scores import AFTER, HALF_TURN
from bingham.studies.study import Arrays, Chunk, Row, Study, StudyResult, generator, joined, mean_row, range_chunks

__all__ = ["ASSUMED", "DEFAULT", "LOGO_NOISES", "SPIN_TYPES", "STUDY", "simulate_flight"]

FloatArray = NDArray[np.float64]
FRAMES = 40
CHUNK = 8
FRAME_RATE = 200.0
# World: z up, towards the cameras; the ball flies along x. Axes of topspin, underspin, left and right sidespin.
AXES = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
DIRECTIONS = ("topspin", "underspin", "left sidespin", "right sidespin")
REVOLUTIONS = (25.0, 37.5, 50.0)
SPIN_TYPES = from_rotation_vector(
    np.repeat(AXES, 3, axis=0) * np.tile(REVOLUTIONS, 4)[:, None] * 2.0 * np.pi / FRAME_RATE
)
# The gun's repeatability: relative spread of the speed and spread of the axis, rad; perturbation in each frame, rad.
SPEED_SPREAD, AXIS_SPREAD, WOBBLE = 0.03, 0.03, 0.01
# The logo is on the body's z axis and is found on the upper half of the ball: the published distribution of the
# orientation out of sight is the fit to exactly half of the sphere.
VISIBLE = 0.0
LEAST_VISIBLE = 12
# True noise of a detected logo: tilts about the body's x and y, rotation about the logo's own axis. The third is the
# published filter's assumption, the first the study's default.
LOGO_NOISES = ((-200.0, -200.0, -100.0), (-800.0, -800.0, -400.0), (-100.0, -100.0, -50.0), (-40.0, -40.0, -10.0))
DEFAULT, ASSUMED = 0, 3
COVERAGES = {"orientation_covered": "coverage_95", "spin_covered": "spin_coverage_95"}
PUBLISHED = {"classification_rate": 0.91, "spin_error_rad": 0.17}


def simulate_flight(kind: int, noise: tuple[float, ...], rng: np.random.Generator) -> tuple[Arrays, int]:
    """Return one flight of spin type ``kind`` with the logo in at least 12 frames, and how many were discarded for it.

    Arrays: orientation (40, 4), spin (4,), and the two interpretations of each detected logo (40, 2, 4), NaN
    where the logo is out of sight.
    """
    distribution = Bingham([*noise, 0.0], np.eye(4)[:, [1, 2, 3, 0]])
    discarded = 0
    while True:
        speed = 1.0 + SPEED_SPREAD * rng.standard_normal()
        tilt = from_rotation_vector(AXIS_SPREAD * rng.standard_normal(3))
        turn = 2.0 * np.arctan2(np.linalg.norm(SPIN_TYPES[kind, 1:]), SPIN_TYPES[kind, 0])
        axis = rotate(tilt, SPIN_TYPES[kind, 1:] / np.linalg.norm(SPIN_TYPES[kind, 1:]))
        spin = from_rotation_vector(speed * turn * axis)
        x = rng.standard_normal(4)
        x /= np.linalg.norm(x)
        orientation = np.empty((FRAMES, 4))
        for n in range(FRAMES):
            x = compose(from_rotation_vector(WOBBLE * rng.standard_normal(3)), compose(spin, x))
            orientation[n] = x
        visible = rotate(orientation, [0.0, 0.0, 1.0])[:, 2] > VISIBLE
        seen = compose(orientation, distribution.rvs(FRAMES, rng=rng))
        if visible.sum() >= LEAST_VISIBLE:
            both = np.stack([seen, compose(seen, HALF_TURN)], axis=1)
            both[~visible] = np.nan
            return {"orientation": orientation, "spin": spin, "seen": both}, discarded
        discarded += 1


def run_chunk(level: int, seed: int, first: int, last: int) -> Arrays:
    """Filter flights first … last − 1 at one level of logo noise: orientation and spin errors, and classifications."""
    parts: list[Arrays] = []
    for run in range(first, last):
        rng = generator(seed, level, run)
        kind = run % len(SPIN_TYPES)
        flight, discarded = simulate_flight(kind, LOGO_NOISES[level], rng)
        found = run_filters(flight, kind, SPIN_TYPES, FILTERS)
        guess = int(rng.integers(len(SPIN_TYPES)))
        found["spin_error/random_guess"] = np.full(FRAMES, _angle(SPIN_TYPES[guess], flight["spin"]))
        found["correct/random_guess"] = np.full(FRAMES, float(guess == kind))
        parts.append(found | {"kind": np.array(kind), "discarded": np.array(discarded)})
    return {name: np.stack([part[name] for part in parts]) for name in parts[0]}


def _angle(p: FloatArray, q: FloatArray) -> float:
    return float(2.0 * np.arccos(min(1.0, abs(p @ q))))


def _chunks(runs: int, seed: int, options: Mapping[str, Any]) -> list[Chunk]:
    return [
        chunk
        for level in range(len(LOGO_NOISES))
        for chunk in range_chunks(f"level{level}-", run_chunk, runs, CHUNK, level=level, seed=seed)
    ]


def _case(level: int) -> str:
    return "logo noise " + "/".join(f"{z:g}" for z in LOGO_NOISES[level])


def _summarize(runs: int, seed: int, results: Mapping[str, Arrays]) -> StudyResult:
    table: list[Row] = []
    curves: Arrays = {"kind": joined(results, f"level{DEFAULT}-", "kind")}
    for level in range(len(LOGO_NOISES)):
        found = {
            name: joined(results, f"level{level}-", name) for name in results[min(results)] if name.count("/") == 1
        }
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
                for metric, inside in covered.items():
                    if inside is not None:
                        table.append(mean_row(case, name, metric, inside[:, k]))
            case = f"{_case(level)}, mean of frames 1-{AFTER[-1]}"
            table.append(mean_row(case, name, "classification_rate", correct[:, : AFTER[-1]].mean(axis=1)))
            table.append(mean_row(case, name, "spin_error_rad", spin[:, : AFTER[-1]].mean(axis=1)))
        if level in (DEFAULT, ASSUMED):
            curves |= {f"{level}/{name}": curve for name, curve in found.items()}
        discarded = joined(results, f"level{level}-", "discarded").sum()
        share = float(discarded / (discarded + runs))
        table.append(Row(_case(level), "truth", "discarded_share", share, None, 34 / 107))
    return StudyResult("glover2013-ball", runs, seed, table, curves)


STUDY = Study(
    name="glover2013-ball",
    title="Glover & Kaelbling 2013: spinning balls, second-order filters, spin classification (simulated flights)",
    # Four times the paper's number: of 73 flights, a single one that settles half a turn off decides the order.
    default_runs=292,
    chunks=_chunks,
    summarize=_summarize,
    version=4,
)
