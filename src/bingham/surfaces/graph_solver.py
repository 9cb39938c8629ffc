"""Levenberg–Marquardt on poses and planes with SciPy's sparse solver: the default backend of planar SLAM."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation

from bingham.rotations import compose, from_rotation_vector
from bingham.sampling.power import right_jacobian

__all__ = ["Graph", "minimize_graph"]

FloatArray = NDArray[np.float64]

# Relative fall of the cost at which it ends.
FLAT = 1e-10


class Graph(NamedTuple):
    """Odometry (T−1 turns (3, 3) and steps (3,), with their deviations), and plane residuals.

    ``seen`` holds (pose, plane, residual) for every observation; a residual is called as `BinghamResidual`.
    """

    turns: FloatArray
    steps: FloatArray
    odometry_sigma: tuple[float, float]
    anchor: float
    seen: list[tuple[int, int, Any]]


class _Blocks:
    """Collects blocks of the Jacobian and the residual vector."""

    def __init__(self) -> None:
        self.rows: list[Any] = []
        self.columns: list[Any] = []
        self.values: list[FloatArray] = []
        self.errors: list[FloatArray] = []
        self.count = 0

    def add(self, error: FloatArray, *parts: tuple[int, FloatArray]) -> None:
        """Append a residual (k,) with its derivatives (k, m) from each column on."""
        for column, block in parts:
            i, j = np.indices(block.shape)
            self.rows.append((self.count + i).ravel())
            self.columns.append((column + j).ravel())
            self.values.append(block.ravel())
        self.errors.append(error)
        self.count += len(error)


def _cross(v: FloatArray) -> FloatArray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def _log(rotation: FloatArray) -> FloatArray:
    return Rotation.from_matrix(rotation).as_rotvec()


def _linearised(graph: Graph, r: FloatArray, t: FloatArray, q: FloatArray) -> tuple[FloatArray, Any]:
    """Return all residuals, whitened, and their sparse Jacobian; columns (ω, v) of each pose, then η of each plane."""
    blocks = _Blocks()
    planes = 6 * len(r)
    blocks.add(np.append(_log(r[0]), t[0]) / graph.anchor, (0, np.eye(6) / graph.anchor))
    weight = np.repeat(1.0 / np.array(graph.odometry_sigma), 3)[:, None]
    for i, (turn, step) in enumerate(zip(graph.turns, graph.steps, strict=True)):
        between, way = r[i].T @ r[i + 1], r[i].T @ (t[i + 1] - t[i])
        angle = _log(turn.T @ between)
        inverse = np.linalg.inv(right_jacobian(angle))
        first, second = np.zeros((6, 6)), np.zeros((6, 6))
        first[:3, :3], second[:3, :3] = -inverse @ between.T, inverse
        first[3:, :3], first[3:, 3:], second[3:, 3:] = turn.T @ _cross(way), -turn.T, turn.T @ between
        error = np.append(angle, turn.T @ (way - step)) * weight[:, 0]
        blocks.add(error, (6 * i, weight * first), (6 * i + 6, weight * second))
    for pose, plane, residual in graph.seen:
        at = residual(r[pose], t[pose], q[plane])
        blocks.add(at.error, (6 * pose, at.pose_jacobian), (planes + 3 * plane, at.plane_jacobian))
    place = np.concatenate(blocks.rows), np.concatenate(blocks.columns)
    matrix = coo_array((np.concatenate(blocks.values), place), shape=(blocks.count, planes + 3 * len(q)))
    return np.concatenate(blocks.errors), matrix.tocsc()


def _moved(r: FloatArray, t: FloatArray, q: FloatArray, step: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    poses, planes = step[: 6 * len(r)].reshape(-1, 6), step[6 * len(r) :].reshape(-1, 3)
    turned = r @ Rotation.from_rotvec(poses[:, :3]).as_matrix()
    shifted = t + np.einsum("nij,nj->ni", r, poses[:, 3:])
    rotated = compose(q, from_rotation_vector(planes))
    return turned, shifted, rotated / np.linalg.norm(rotated, axis=1)[:, None]


def minimize_graph(
    graph: Graph, rotations: FloatArray, positions: FloatArray, quaternions: FloatArray, max_iterations: int
) -> tuple[FloatArray, FloatArray, FloatArray, int, float, float]:
    """Return poses, planes, iterations, and half the sum of squares at the start and at the end.

    Poses move on the right, R ← R Exp(ω), t ← t + R v, planes as q ← q ⊗ exp(η/2); damping after Marquardt.
    """
    r, t, q = np.array(rotations), np.array(positions), np.array(quaternions)
    errors, jacobian = _linearised(graph, r, t, q)
    cost = start = 0.5 * float(errors @ errors)
    damping = 1e-5
    for iteration in range(1, max_iterations + 1):
        normal = (jacobian.T @ jacobian).tocsc()
        gradient = jacobian.T @ errors
        diagonal = np.maximum(normal.diagonal(), 1e-12)
        for _ in range(12):
            step = splu((normal + diags_array(damping * diagonal)).tocsc()).solve(-gradient)
            trial = _moved(r, t, q, step)
            new_errors, new_jacobian = _linearised(graph, *trial)
            new_cost = 0.5 * float(new_errors @ new_errors)
            if new_cost <= cost:
                break
            damping *= 10.0
        else:
            return r, t, q, iteration, start, cost
        fall = cost - new_cost
        (r, t, q), errors, jacobian, cost = trial, new_errors, new_jacobian, new_cost
        damping = max(damping * 0.1, 1e-12)
        if fall <= FLAT * max(cost, 1.0):
            return r, t, q, iteration, start, cost
    return r, t, q, max_iterations, start, cost
