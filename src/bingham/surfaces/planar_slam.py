"""Poses and planes from odometry and plane measurements: a factor graph solved by Levenberg–Marquardt."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError, MissingExtraError
from bingham.surfaces.plane_factors import BinghamResidual, GaussianResidual, plane_factor
from bingham.surfaces.planes import as_group, from_group, to_world

__all__ = ["PlanarMeasurements", "PlanarSolution", "dead_reckoning", "solve_planar_slam"]

FloatArray = NDArray[np.float64]

MAX_ITERATIONS = 1000
# Standard deviations with which the first pose is held: it fixes the frame of the map.
ANCHOR = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class PlanarMeasurements:
    """What a robot brings home.

    Parameters
    ----------
    turns, steps : ndarray, shape (T−1, 3, 3) and (T−1, 3)
        Measured odometry, the next pose in the frame of the last one.
    odometry_sigma : tuple of float
        Standard deviations of a rotation (rad) and of a step (m), for each axis.
    pose_index, plane_index : ndarray of int, shape (m,)
        Which pose saw which plane.
    seen : ndarray, shape (m, 4)
        Measured planes in the frame of the pose.
    """

    turns: FloatArray
    steps: FloatArray
    odometry_sigma: tuple[float, float]
    pose_index: NDArray[np.int64]
    plane_index: NDArray[np.int64]
    seen: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class PlanarSolution:
    """Estimated rotations (T, 3, 3), positions (T, 3) m and planes (P, 4), and how the solver got there.

    `cost_start` and `cost` are half the sum of squared residuals; `converged` says that it stopped before the limit of
    iterations with a finite cost no larger than at the start.
    """

    rotations: FloatArray
    positions: FloatArray
    planes: FloatArray
    iterations: int
    cost_start: float
    cost: float
    converged: bool


def dead_reckoning(turns: FloatArray, steps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rotations (T, 3, 3) and positions (T, 3) that odometry alone gives, from the identity."""
    rotations, positions = [np.eye(3)], [np.zeros(3)]
    for turn, step in zip(turns, steps, strict=True):
        positions.append(positions[-1] + rotations[-1] @ step)
        rotations.append(rotations[-1] @ turn)
    return np.array(rotations), np.array(positions)


def solve_planar_slam(
    measurements: PlanarMeasurements,
    noise: Bingham,
    model: Literal["bingham", "gaussian"] = "bingham",
    *,
    start: PlanarSolution | None = None,
    solver: Literal["scipy", "gtsam"] = "scipy",
) -> PlanarSolution:
    """Return the maximum-likelihood poses and planes, the first pose at the identity.

    Parameters
    ----------
    measurements : PlanarMeasurements
        Odometry and plane observations with known association; every plane is seen at least once.
    noise : Bingham
        Distribution of the plane measurements, quaternions with mode at the identity.
    model : {"bingham", "gaussian"}
        The Bingham likelihood, or the tangent-space Gaussian of the same covariance.
    start : PlanarSolution, optional
        Where to start; from dead reckoning and the first sight of each plane otherwise.

    solver : {"scipy", "gtsam"}
        This package's Levenberg–Marquardt on SciPy's sparse matrices, or GTSAM's.

    Raises
    ------
    MissingExtraError
        For solver="gtsam" without GTSAM.
    """
    if model not in ("bingham", "gaussian"):
        raise InvalidArgumentError("model", "'bingham' or 'gaussian'", repr(model))
    if solver not in ("scipy", "gtsam"):
        raise InvalidArgumentError("solver", "'scipy' or 'gtsam'", repr(solver))
    if start is None:
        rotations, positions = dead_reckoning(measurements.turns, measurements.steps)
    else:
        rotations, positions = start.rotations, start.positions
    names, first = np.unique(measurements.plane_index, return_index=True)
    if start is None:
        pose = measurements.pose_index[first]
        planes = to_world(rotations[pose], positions[pose], measurements.seen[first])
    else:
        planes = start.planes
    residual = BinghamResidual if model == "bingham" else GaussianResidual
    solve = _with_gtsam if solver == "gtsam" else _with_scipy
    return solve(measurements, [residual(z, noise) for z in measurements.seen], names, rotations, positions, planes)


def _with_scipy(
    measurements: PlanarMeasurements, residuals: list[Any], names: NDArray[np.int64], rotations: FloatArray,
    positions: FloatArray, planes: FloatArray,
) -> PlanarSolution:  # fmt: skip
    from bingham.surfaces.graph_solver import Graph, minimize_graph

    columns = np.searchsorted(names, measurements.plane_index)
    seen = [(int(t), int(k), f) for t, k, f in zip(measurements.pose_index, columns, residuals, strict=True)]
    graph = Graph(measurements.turns, measurements.steps, measurements.odometry_sigma, ANCHOR, seen)
    r, t, q, iterations, cost_start, cost = minimize_graph(
        graph, rotations, positions, as_group(planes), MAX_ITERATIONS
    )
    converged = bool(np.isfinite(cost) and cost <= cost_start and iterations < MAX_ITERATIONS)
    return PlanarSolution(r, t, from_group(q), iterations, cost_start, cost, converged)


def _with_gtsam(
    measurements: PlanarMeasurements, residuals: list[Any], names: NDArray[np.int64], rotations: FloatArray,
    positions: FloatArray, planes: FloatArray,
) -> PlanarSolution:  # fmt: skip
    try:
        import gtsam as _gtsam
    except ImportError as error:
        raise MissingExtraError("gtsam", "slam", "planar SLAM with solver='gtsam'") from error
    gtsam = cast(Any, _gtsam)
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    x, l = gtsam.symbol_shorthand.X, gtsam.symbol_shorthand.L
    for t, (rotation, position) in enumerate(zip(rotations, positions, strict=True)):
        values.insert(x(t), gtsam.Pose3(gtsam.Rot3(rotation), position))
    graph.add(gtsam.PriorFactorPose3(x(0), gtsam.Pose3(), gtsam.noiseModel.Isotropic.Sigma(6, ANCHOR)))
    turn_sigma, step_sigma = measurements.odometry_sigma
    odometry = gtsam.noiseModel.Diagonal.Sigmas(np.repeat([turn_sigma, step_sigma], 3))
    for t, (turn, step) in enumerate(zip(measurements.turns, measurements.steps, strict=True)):
        graph.add(gtsam.BetweenFactorPose3(x(t), x(t + 1), gtsam.Pose3(gtsam.Rot3(turn), step), odometry))
    for k, plane in zip(names, planes, strict=True):
        values.insert(l(int(k)), gtsam.Rot3(*as_group(plane)))
    for t, k, factor in zip(measurements.pose_index, measurements.plane_index, residuals, strict=True):
        graph.add(plane_factor(x(int(t)), l(int(k)), factor))
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setMaxIterations(MAX_ITERATIONS)
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, values, parameters)
    cost_start = float(graph.error(values))
    result = optimizer.optimize()
    cost = float(graph.error(result))
    poses = [result.atPose3(x(t)) for t in range(len(rotations))]
    quaternions = [result.atRot3(l(int(k))).toQuaternion() for k in names]
    iterations = int(optimizer.iterations())
    return PlanarSolution(
        np.array([pose.rotation().matrix() for pose in poses]),
        np.array([np.asarray(pose.translation()) for pose in poses]),
        from_group(np.array([[q.w(), q.x(), q.y(), q.z()] for q in quaternions])),
        iterations,
        cost_start,
        cost,
        bool(np.isfinite(cost) and cost <= cost_start and iterations < MAX_ITERATIONS),
    )
