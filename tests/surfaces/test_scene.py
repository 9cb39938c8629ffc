"""Normals and plane directions: closed forms, the rendered room, and recorded clouds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bingham import Bingham, BinghamMixture, InvalidArgumentError
from bingham.simulate.scene import DepthCamera, Rectangle, corridor, render
from bingham.surfaces.normals import back_project, cloud_normals, organised_normals
from bingham.surfaces.segmentation import fit_directions, lift

RECORDED = Path(__file__).resolve().parents[2] / "../shared/data/planes"


def angle_between(a, b):
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1))


@pytest.fixture(scope="module")
def room():
    scene, camera = corridor()
    # A quarter of the pixels: the planes stay large, the fit is four times as fast.
    camera = replace(camera, width=320, height=240, focal=0.5 * camera.focal)
    view = render(scene, camera, rng=0)
    normals = organised_normals(back_project(view.depth, *camera.intrinsics)).normals
    return camera, view, normals


def test_noise_free_depth_gives_the_plane_exactly():
    tilt = np.array([0.0, -np.sin(0.4), -np.cos(0.4)])
    scene = [Rectangle(np.array([0.0, 0.0, 3.0]), np.array([5.0, 0, 0]), np.cross(tilt, [5.0, 0, 0]))]
    camera = DepthCamera(np.eye(3), np.zeros(3), width=64, height=48, focal=60.0)
    view = render(scene, camera, noise=0.0, missing=0.0)
    normals = organised_normals(back_project(view.depth, *camera.intrinsics), radius=3).normals
    inside = normals[4:-4, 4:-4]
    assert np.all(view.label == 0)
    np.testing.assert_allclose(angle_between(inside, view.normals[0]), 0.0, atol=1e-7)


def test_loose_cloud_of_a_plane_points_to_the_viewer():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-1, 1, (500, 2)), np.full(500, 2.0)])
    normals = cloud_normals(points, neighbours=10)
    np.testing.assert_allclose(normals.normals, np.broadcast_to([0.0, 0.0, -1.0], (500, 3)), atol=1e-9)
    np.testing.assert_allclose(normals.residual, 0.0, atol=1e-9)
    with pytest.raises(InvalidArgumentError, match="neighbours"):
        cloud_normals(points, neighbours=2)


def test_rendered_room_is_labelled_by_its_plane_directions(room):
    camera, view, normals = room
    found = fit_directions(normals, range(6, 9), restarts=2, rng=0)
    label = found.predict(normals)
    seen = view.depth > 0.0
    assert np.mean(np.isfinite(normals[seen][:, 0])) > 0.999
    nearest = np.append(found.directions, [[np.nan] * 3], axis=0)[label]
    right = angle_between(nearest, view.normals[view.label]) < np.deg2rad(10.0)
    assert np.mean(right[seen]) >= 0.97
    # The floor, the direction that the report misses, and both long walls apart.
    world = found.directions @ camera.rotation.T
    for direction in ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]):
        assert np.rad2deg(angle_between(world, np.array(direction)).min()) < 2.0


def test_axial_laws_merge_opposite_walls_and_signs_part_them():
    rng = np.random.default_rng(1)
    wall = Bingham([-300.0, -300.0, 0.0], np.eye(3)).rvs(2000, rng=rng)
    wall *= np.sign(wall[:, 2:])
    wall[:900] *= -1.0
    axial = fit_directions(wall, range(1, 4), signed=False, rng=0)
    signed = fit_directions(wall, range(1, 4), rng=0)
    assert len(axial.directions) == 1
    assert len(signed.directions) == 2
    assert signed.directions[0] @ signed.directions[1] == pytest.approx(-1.0, abs=1e-12)
    np.testing.assert_allclose(signed.weights, [0.55, 0.45], atol=0.01)
    assert np.mean((signed.predict(wall) == 1)[:900]) > 0.99


def test_lifting_to_pure_quaternions_gains_nothing():
    rng = np.random.default_rng(2)
    wall = Bingham([-300.0, -300.0, 0.0], np.eye(3)).rvs(1000, rng=rng)
    signed = wall * np.sign(wall[:, 2:]) * np.where(np.arange(1000) < 500, 1.0, -1.0)[:, None]
    # The lifted moment is singular: a free fit is rejected, a bounded one gives ± the same density.
    with pytest.raises(InvalidArgumentError, match="smaller sphere"):
        Bingham.fit(lift(signed))
    fitted = BinghamMixture.fit(lift(signed), 2, background=False, max_concentration=900.0, restarts=2, rng=0)
    np.testing.assert_array_equal(fitted.logpdf(lift(signed)), fitted.logpdf(lift(-signed)))
    np.testing.assert_array_equal(fitted.predict(lift(signed)), fitted.predict(lift(-signed)))


def test_recorded_cloud_has_the_plane_of_its_reference():
    path = RECORDED / "sac_plane_test.npz"
    if not path.is_file():
        pytest.skip("recorded clouds are not there")
    with np.load(path) as data:
        points, reference = data["xyz"].astype(float), data["plane_abc_over_d"]
    normals = cloud_normals(points, neighbours=20).normals
    found = fit_directions(normals, range(1, 5), signed=False, rng=0)
    expected = reference / np.linalg.norm(reference)
    assert np.rad2deg(np.arccos(abs(found.directions[0] @ expected))) < 2.0


def test_recorded_office_has_three_directions_nearly_at_right_angles():
    path = RECORDED / "office1.npz"
    if not path.is_file():
        pytest.skip("recorded clouds are not there")
    with np.load(path) as data:
        points = np.where(np.any(data["xyz_mm"], axis=-1, keepdims=True), data["xyz_mm"] / 1000.0, np.nan)
    normals = organised_normals(points).normals
    found = fit_directions(normals, range(3, 5), signed=False, restarts=2, rng=0)
    cosine = np.abs(found.directions[:1] @ found.directions[1:].T)
    assert np.rad2deg(np.arccos(cosine.min())) > 80.0
