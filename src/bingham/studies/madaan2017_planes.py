"""Madaan, Suresh & Kalra 2017, §V and §VI: planar directions of a room by Bingham mixtures, and planes for SLAM.

The report's data are not published; a rendered room and a simulated loop through four rooms take their place. Its two
findings are run again beside what fixes them: axial distributions merge opposite walls, and lifting normals to pure
quaternions changes nothing; signs put back after the fit part them. Whether the floor is found, which the report
misses, is noted for expectation-maximisation and for sample consensus.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from bingham.distributions.mixture import BinghamMixture
from bingham.simulate.rooms import four_rooms
from bingham.simulate.scene import corridor, render
from bingham.studies.study import Arrays, Chunk, Row, Study, StudyResult, generator, joined, mean_row, range_chunks
from bingham.surfaces.normals import back_project, organised_normals
from bingham.surfaces.planar_slam import PlanarSolution, dead_reckoning, solve_planar_slam
from bingham.surfaces.planes import gaussian_to_noise, plane_angle
from bingham.surfaces.segmentation import fit_directions, lift

__all__ = ["STUDY"]

# A direction is right within this angle of the true one.
RIGHT = np.deg2rad(10.0)
# Standard deviations of the plane measurements' rotation vector, rad: two axes and the third.
NOISES = {"small": (0.05, 0.035), "large": (0.4, 0.3)}
# The normals that the lifted and the sample-consensus fits see.
FEW = 4000
ROOM = "rendered room"
MODELS: tuple[Literal["bingham", "gaussian"], ...] = ("bingham", "gaussian")


def _reached(found: Any, wanted: Any) -> Any:
    """Return for each wanted axis (m, 3) whether one of the axes found (P, 3) is right, signs ignored."""
    return np.abs(wanted @ np.atleast_2d(found).T).max(axis=1) > np.cos(RIGHT)


def room_chunk(seed: int, first: int, last: int) -> Arrays:
    """Segment one rendering of the room a run, with all methods."""
    scene, camera = corridor()
    rows: dict[str, list[float]] = {}

    def put(name: str, value: float) -> None:
        rows.setdefault(name, []).append(float(value))

    out: Arrays = {}
    axes_of_room = camera.rotation.T @ np.eye(3)
    for run in range(first, last):
        rng = generator(seed, 0, run)
        view = render(scene, camera, rng=rng)
        normals = organised_normals(back_project(view.depth, *camera.intrinsics)).normals
        seen = view.depth > 0.0
        truth = view.normals[view.label]
        for name, signed in (("signed", True), ("axial", False)):
            found = fit_directions(normals, range(5, 9), signed=signed, restarts=3, rng=rng)
            label = found.predict(normals)
            chosen = np.append(found.directions, [[np.nan] * 3], axis=0)[label]
            right = np.sum(chosen * truth, axis=-1) > np.cos(RIGHT)
            put(f"right/{name}", right[seen].mean())
            put(f"directions/{name}", len(found.directions))
            put(f"floor/{name}", _reached(found.directions, axes_of_room[:, 2][None])[0])
            if run == 0 and signed:
                out |= {"example/depth": view.depth, "example/label": label, "example/wrong": ~right & seen,
                        "example/directions": found.directions, "example/weights": found.weights,
                        "example/z": found.mixture.components.z, "example/M": found.mixture.components.M,
                        "example/shares": np.append(found.mixture.weights, found.mixture.background),
                        "example/owner": found.owner}  # fmt: skip
        usable = normals[np.isfinite(normals[..., 0])]
        few = usable[rng.choice(len(usable), FEW, replace=False)]
        if run == 0:
            out["example/normals"] = few
        peeled = BinghamMixture.fit(few, 8, method="sac", rng=rng)
        put("floor/sample_consensus", _reached(peeled.components.mode, axes_of_room[:, 2][None])[0])
        put("axes/sample_consensus", _reached(peeled.components.mode, axes_of_room.T).sum())
        # Opposite walls: normals along ± the room's y axis, in one component or apart?
        along = few @ axes_of_room[:, 1]
        lifted = BinghamMixture.fit(lift(few), 6, restarts=2, max_concentration=900.0, tolerance=1e-6, rng=rng)
        label = lifted.predict(lift(few))
        one, other = (np.bincount(label[side] + 1, minlength=8).argmax() for side in (along > 0.95, along < -0.95))
        put("merged/lifted", one == other)
    return out | {name: np.array(values) for name, values in rows.items()}


def slam_chunk(seed: int, first: int, last: int, noise: str) -> Arrays:
    """Solve one loop a run with both noise models."""
    wide, narrow = NOISES[noise]
    distribution = gaussian_to_noise(np.diag([wide, wide, narrow]) ** 2)
    rows: dict[str, list[float]] = {}
    out: Arrays = {}
    for run in range(first, last):
        # The same loop and odometry for every noise.
        loop = four_rooms(distribution, rng=generator(seed, 1, run))
        truth = PlanarSolution(loop.rotations, loop.positions, loop.planes, 0, 0.0, 0.0, True)
        drift = dead_reckoning(loop.measurements.turns, loop.measurements.steps)[1]
        rows.setdefault("trajectory/odometry", []).append(_rms(drift - loop.positions))
        for model in MODELS:
            solution = solve_planar_slam(loop.measurements, distribution, model)
            rows.setdefault(f"trajectory/{model}", []).append(_rms(solution.positions - loop.positions))
            error = float(np.degrees(np.mean(plane_angle(solution.planes, loop.planes))))
            rows.setdefault(f"planes/{model}", []).append(error)
            rows.setdefault(f"converged/{model}", []).append(float(solution.converged))
            # From the truth both models reach their best optimum; from odometry they may stop in a worse one.
            best = solve_planar_slam(loop.measurements, distribution, model, start=truth)
            rows.setdefault(f"best/{model}", []).append(_rms(best.positions - loop.positions))
            error = float(np.degrees(np.mean(plane_angle(best.planes, loop.planes))))
            rows.setdefault(f"best_planes/{model}", []).append(error)
            if run == 0:
                out[f"{noise}/{model}"] = solution.positions
        if run == 0:
            out |= {f"{noise}/truth": loop.positions, f"{noise}/odometry": drift}
    return out | {name: np.array(values) for name, values in rows.items()}


def _rms(error: Any) -> float:
    return float(np.sqrt(np.mean(np.sum(error**2, axis=1))))


def _chunks(runs: int, seed: int, options: Mapping[str, Any]) -> list[Chunk]:
    loops = [range_chunks(f"slam-{name}-", slam_chunk, runs, 2, seed=seed, noise=name) for name in NOISES]
    return sum(loops, range_chunks("room-", room_chunk, runs, 2, seed=seed))


def _summarize(runs: int, seed: int, results: Mapping[str, Arrays]) -> StudyResult:
    table: list[Row] = []
    for label, metric, name in (
        ("em signed", "pixels_right", "right/signed"),
        ("em axial", "pixels_right", "right/axial"),
        ("em signed", "directions", "directions/signed"),
        ("em axial", "directions", "directions/axial"),
        ("em signed", "floor_found", "floor/signed"),
        ("em axial", "floor_found", "floor/axial"),
        ("sac", "floor_found", "floor/sample_consensus"),
        ("sac", "room_axes_found_of_3", "axes/sample_consensus"),
        ("em lifted", "opposite_walls_merged", "merged/lifted"),
    ):
        table.append(mean_row(ROOM, label, metric, joined(results, "room", name)))
    curves: Arrays = {}
    for noise in NOISES:
        case = f"loop, {noise} noise"
        prefix = f"slam-{noise}-"
        table.append(mean_row(case, "odometry", "trajectory_rmse_m", joined(results, prefix, "trajectory/odometry")))
        for model in MODELS:
            for metric, name in (
                ("trajectory_rmse_m", "trajectory"),
                ("plane_error_deg", "planes"),
                ("trajectory_rmse_m_from_truth", "best"),
                ("plane_error_deg_from_truth", "best_planes"),
                ("converged", "converged"),
            ):
                table.append(mean_row(case, model, metric, joined(results, prefix, f"{name}/{model}")))
        first = results[min(key for key in results if key.startswith(prefix))]
        curves |= {key: value for key, value in first.items() if key.startswith(f"{noise}/")}
    first = results[min(key for key in results if key.startswith("room-"))]
    curves |= {key: value for key, value in first.items() if key.startswith("example/")}
    return StudyResult("madaan2017-planes", runs, seed, table, curves)


STUDY = Study(
    "madaan2017-planes",
    "Madaan, Suresh & Kalra 2017: plane directions by Bingham mixtures, planes for SLAM",
    10,
    _chunks,
    _summarize,
)
