"""Planes as axes: incidence, frames, the measurement distribution, Jacobians, SLAM with both noise models."""

import importlib.util

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham.rotations import compose, from_rotation_vector
from bingham.simulate.rooms import four_rooms
from bingham.surfaces.planar_slam import dead_reckoning, solve_planar_slam
from bingham.surfaces.plane_factors import BinghamResidual, GaussianResidual, plane_factor
from bingham.surfaces.planes import (
    from_group,
    gaussian_to_noise,
    make_plane,
    noise_to_gaussian,
    observation,
    plane_angle,
    plane_likelihood,
    split_plane,
    to_body,
    to_world,
)

needs_gtsam = pytest.mark.skipif(importlib.util.find_spec("gtsam") is None, reason="gtsam is not installed")


def random_pose(rng):
    return Rotation.random(rng=rng), 3.0 * rng.standard_normal(3)


def random_covariance(rng, size):
    a = rng.standard_normal((3, 3))
    return size * a @ a.T / np.trace(a @ a.T)


def test_points_of_a_plane_stay_on_it_in_every_frame():
    rng = np.random.default_rng(0)
    turn, position = random_pose(rng)
    normal, distance = rng.standard_normal(3), 1.7
    plane = make_plane(normal, distance)
    unit = normal / np.linalg.norm(normal)
    point = distance * unit + np.cross(unit, rng.standard_normal(3))
    assert np.append(point, 1.0) @ plane == pytest.approx(0.0, abs=1e-12)
    body = to_body(turn.as_matrix(), position, plane)
    assert np.append(turn.inv().apply(point - position), 1.0) @ body == pytest.approx(0.0, abs=1e-12)
    assert plane_angle(to_world(turn.as_matrix(), position, body), plane) < 1e-12
    np.testing.assert_allclose(split_plane(-plane)[0], unit, atol=1e-12)
    assert split_plane(plane)[1] == pytest.approx(distance, rel=1e-12)


def test_gaussian_conversion_is_its_own_inverse_and_right_when_small():
    rng = np.random.default_rng(1)
    for size in (1e-4, 0.3):
        c = random_covariance(rng, size)
        np.testing.assert_allclose(noise_to_gaussian(gaussian_to_noise(c)), c, rtol=1e-9, atol=1e-14)
    noise = gaussian_to_noise(np.diag([1e-4, 2e-4, 3e-4]))
    # exp(−½ ωᵀ Σ⁻¹ ω) with the vector part ω/2: λ = −2/σ² to first order.
    np.testing.assert_allclose(noise.z[:3], -2.0 / np.array([1e-4, 2e-4, 3e-4]), rtol=1e-3)


def test_likelihood_is_the_noise_distribution_of_the_deviation():
    rng = np.random.default_rng(2)
    noise = gaussian_to_noise(random_covariance(rng, 0.5))
    q, z = rng.standard_normal((2, 4))
    q, z = q / np.linalg.norm(q), z / np.linalg.norm(z)
    distribution = plane_likelihood(from_group(z), noise)
    deviation = compose(q * [1.0, -1.0, -1.0, -1.0], z)
    assert distribution.logpdf(from_group(q)) == pytest.approx(noise.logpdf(deviation), rel=1e-10)
    assert distribution.logpdf(from_group(-q)) == pytest.approx(distribution.logpdf(from_group(q)), rel=1e-14)


def moved_error(residual, turn, position, q, step):
    """Residual after the step (ω, v, η) of the pose and the plane."""
    rotation = turn * Rotation.from_rotvec(step[:3])
    moved = position + turn.apply(step[3:6])
    return residual(rotation.as_matrix(), moved, compose(q, from_rotation_vector(step[6:]))).error


@pytest.mark.parametrize("kind", [BinghamResidual, GaussianResidual])
def test_jacobians_match_differences(kind):
    rng = np.random.default_rng(3)
    noise = gaussian_to_noise(random_covariance(rng, 0.3))
    for _ in range(20):
        turn, position = random_pose(rng)
        q = rng.standard_normal(4)
        q /= np.linalg.norm(q)
        measured = observation(to_body(turn.as_matrix(), position, from_group(q)), noise, rng=rng)
        residual = kind(measured, noise)
        at = residual(turn.as_matrix(), position, q)
        columns = [
            (moved_error(residual, turn, position, q, e) - moved_error(residual, turn, position, q, -e)) / 2e-6
            for e in 1e-6 * np.eye(9)
        ]
        numeric = np.stack(columns, axis=1)
        np.testing.assert_allclose(np.hstack([at.pose_jacobian, at.plane_jacobian]), numeric, atol=1e-6)


@pytest.mark.parametrize("kind", [BinghamResidual, GaussianResidual])
def test_residual_at_the_measurement_is_zero_and_blind_to_signs(kind):
    noise = gaussian_to_noise(np.diag([0.1, 0.2, 0.3]))
    turn, position = random_pose(np.random.default_rng(4))
    q = np.array([0.5, 0.5, -0.5, 0.5])
    body = to_body(turn.as_matrix(), position, from_group(q))
    np.testing.assert_allclose(kind(body, noise)(turn.as_matrix(), position, q).error, 0.0, atol=1e-12)
    other = kind(-body, noise)(turn.as_matrix(), position, from_rotation_vector([0.1, 0.2, 0.3]))
    same = kind(body, noise)(turn.as_matrix(), position, from_rotation_vector([0.1, 0.2, 0.3]))
    assert np.sum(other.error**2) == pytest.approx(np.sum(same.error**2), rel=1e-10)


@needs_gtsam
def test_factor_error_is_the_negative_log_likelihood():
    import gtsam

    rng = np.random.default_rng(5)
    noise = gaussian_to_noise(random_covariance(rng, 0.3))
    turn, position = random_pose(rng)
    q = np.array([0.1, 0.7, 0.1, 0.7])
    q /= np.linalg.norm(q)
    body = to_body(turn.as_matrix(), position, from_group(q))
    measured = observation(body, noise, rng=rng)
    values = gtsam.Values()
    values.insert(0, gtsam.Pose3(gtsam.Rot3(turn.as_matrix()), position))
    values.insert(1, gtsam.Rot3(*q))
    error = plane_factor(0, 1, BinghamResidual(measured, noise)).error(values)
    distribution = plane_likelihood(measured, noise)
    assert error == pytest.approx(-distribution.logpdf(body) - distribution.log_normalizer, rel=1e-9)


def errors(run, solution):
    trajectory = np.sqrt(np.mean(np.sum((solution.positions - run.positions) ** 2, axis=1)))
    return trajectory, float(np.mean(plane_angle(solution.planes, run.planes)))


@needs_gtsam
def test_slam_with_small_noise_is_the_same_under_both_models_and_far_better_than_odometry():
    noise = gaussian_to_noise(np.diag([0.02, 0.02, 0.01]) ** 2)
    run = four_rooms(noise, poses=24, rng=0)
    ours, theirs = (solve_planar_slam(run.measurements, noise, model) for model in ("bingham", "gaussian"))
    assert ours.converged
    assert theirs.converged
    drift = dead_reckoning(run.measurements.turns, run.measurements.steps)[1] - run.positions
    assert errors(run, ours)[0] < 0.3 * np.sqrt(np.mean(np.sum(drift**2, axis=1)))
    np.testing.assert_allclose(ours.positions, theirs.positions, atol=5e-3)


@needs_gtsam
def test_slam_with_large_noise_is_no_worse_under_the_bingham_model():
    noise = gaussian_to_noise(np.diag([0.4, 0.4, 0.3]) ** 2)
    both = []
    for seed in range(4):
        run = four_rooms(noise, poses=24, rng=seed)
        solutions = [solve_planar_slam(run.measurements, noise, model) for model in ("bingham", "gaussian")]
        assert all(solution.converged for solution in solutions)
        both.append([errors(run, solution) for solution in solutions])
    mean = np.mean(both, axis=0)
    assert np.all(mean[0] <= mean[1])
    # Both go on from the better solution to nearly the same place: the gain lies in the way there.
    again = solve_planar_slam(run.measurements, noise, "gaussian", start=solutions[0])
    assert abs(errors(run, again)[0] - errors(run, solutions[0])[0]) < 0.1 * errors(run, solutions[0])[0]
