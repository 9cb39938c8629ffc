"""Orientations with crystal symmetry against exact properties and repeated scans of one nickel surface."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham import Bingham, InvalidArgumentError
from bingham.distributions.crystal import GROUPS, likely_symmetry, misorientation, symmetry_group
from bingham.distributions.symmetric import SymmetricBingham, SymmetricMixture
from bingham.inference import mean_rotation
from bingham.rotations import compose

NICKEL = Path(__file__).resolve().parents[2] / "../shared/data/nickel_ebsd/nickel.npz"
P = Bingham([-900.0, -700.0, -300.0, 0.0], np.linalg.qr(np.random.default_rng(0).normal(size=(4, 4)))[0])
ORDERS = {"1": 1, "2": 2, "3": 3, "4": 4, "6": 6, "222": 4, "32": 6, "422": 8, "622": 12, "23": 12, "432": 24}


@pytest.mark.parametrize("name", GROUPS)
def test_groups(name):
    g = symmetry_group(name)
    assert len(g) == ORDERS[name]
    np.testing.assert_allclose(np.abs(g[0]), [1, 0, 0, 0], atol=1e-12)
    x = Rotation.random(20, rng=1).as_quat(scalar_first=True)
    symmetric = SymmetricBingham(P, name)
    for turn in g:
        np.testing.assert_allclose(symmetric.logpdf(compose(x, turn)), symmetric.logpdf(x), rtol=1e-9)
        np.testing.assert_allclose(misorientation(x, compose(x, turn), name).angle, 0.0, atol=1e-7)
    u = Bingham.uniform(4).rvs(100_000, rng=2)
    ratio = symmetric.pdf(u) * 2 * np.pi**2
    assert ratio.mean() == pytest.approx(1.0, abs=4 * ratio.std() / np.sqrt(len(u)))


def test_misorientation_of_cubes():
    """No cube is farther than 62.80° from another (Mackenzie 1958)."""
    p, q = Rotation.random(20_000, rng=1), Rotation.random(20_000, rng=2)
    angle = np.degrees(misorientation(p, q, "432").angle)
    assert 60.0 < angle.max() < 62.80
    assert np.mean(angle) == pytest.approx(40.74, abs=0.35)
    found = misorientation(Rotation.identity(), Rotation.from_rotvec([0, 0, np.radians(80)]), "432")
    np.testing.assert_allclose(np.abs(found.axis), [0, 0, 1], atol=1e-12)
    assert np.degrees(found.angle) == pytest.approx(10.0)


def test_fit_sees_through_the_symmetry():
    truth = SymmetricBingham(P, "432")
    x = truth.rvs(2000, rng=1)
    fitted = SymmetricBingham.fit(x, "432", rng=0)
    assert np.degrees(misorientation(fitted.distribution.mode, P.mode, "432").angle) < 0.5
    errors = fitted.distribution.standard_errors(2000).concentrations
    assert np.all(np.abs(fitted.distribution.z - P.z)[:3] < 4 * errors[:3])
    assert np.sum(fitted.logpdf(x)) >= np.sum(truth.logpdf(x))
    nearest = fitted.equivalent(x)
    assert np.all(nearest @ fitted.distribution.mode > 0.9)
    # The control: without the group it is next to uniform.
    assert Bingham.fit(x).z[0] > -2.0


def test_mixture_with_background():
    two = Bingham(np.tile(P.z, (2, 1)), [P.M, np.roll(P.M, 1, axis=0)])
    truth = SymmetricMixture([0.5, 0.3], two, "622", 0.2)
    x = truth.rvs(1500, rng=1)
    fitted = SymmetricMixture.fit(x, "622", range(1, 4), rng=0)
    assert fitted.weights.size == 2
    assert fitted.background == pytest.approx(0.2, abs=0.04)
    np.testing.assert_allclose(np.sort(fitted.weights), [0.3, 0.5], atol=0.05)
    found = [misorientation(fitted.components.mode, mode, "622").angle.min() for mode in two.mode]
    assert np.degrees(max(found)) < 1.0
    assert np.mean(fitted.predict(x) == -1) == pytest.approx(0.2, abs=0.05)
    assert fitted.predict_proba(x).sum(axis=1) == pytest.approx(1.0)


@pytest.mark.parametrize("name", ["222", "32", "422", "622", "23", "432"])
def test_symmetry_is_found_only_where_it_is(name):
    assert likely_symmetry(SymmetricBingham(P, name).rvs(150, rng=1)) == name
    for other in (Bingham.uniform(4), Bingham([-9.0, 0.0, 0.0, 0.0], np.eye(4)), P):
        assert likely_symmetry(other.rvs(300, rng=1)) is None


def test_mean_of_rotations_has_the_covariance_it_reports():
    rng = np.random.default_rng(4)
    means, reported = [], []
    for _ in range(150):
        x = np.concatenate([P.rvs(30, rng=rng), Bingham.uniform(4).rvs(6, rng=rng)])
        result = mean_rotation(x, rng=rng)
        e = compose(P.mode * [1, -1, -1, -1], result.mean)
        means.append(2 * e[1:] * np.sign(e[0]))
        reported.append(result.covariance(frame="body"))
    # Mahalanobis distances of three components have mean 3.
    square = [m @ np.linalg.solve(c, m) for m, c in zip(means, reported, strict=True)]
    assert np.mean(square) == pytest.approx(3.0, abs=1.2)
    plain = mean_rotation(x, robust=False)
    assert np.trace(plain.covariance(frame="world")) > 4 * np.trace(result.covariance(frame="world"))
    with pytest.raises(InvalidArgumentError, match="frame: expected"):
        result.covariance()


def test_nickel_grains_repeat_over_the_scans():
    if not NICKEL.is_file():
        pytest.skip("no scans beside the project")
    scans = np.load(NICKEL)
    good = scans["is_rotation"]
    q = scans["quat"][good].astype(float)
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    place, scan = scans["location"][good], scans["rep"][good]
    assert likely_symmetry(q) == "432"
    rng = np.random.default_rng(0)
    trial = q[rng.choice(len(q), 300, replace=False)]
    held = [np.sum(misorientation(trial, t, "432").angle < np.radians(3)) for t in trial[:60]]
    seed = trial[int(np.argmax(held))]
    near = misorientation(q, seed, "432").angle < np.radians(3)
    # Places of the grain: where most scans agree. All their records count, wrong ones too.
    inside = np.isin(place, [k for k in np.unique(place[near]) if near[place == k].sum() >= 8])
    fits = [SymmetricMixture.fit(q[inside & (scan == k)], "432", rng=0, restarts=3) for k in range(1, 15)]
    modes = np.array([f.components.mode[0] for f in fits])
    apart = np.degrees(misorientation(modes, modes[0], "432").angle)
    spread = np.degrees(np.sqrt(np.trace(fits[0].components[0].covariance(frame="body")) / 3))
    assert np.all(apart < 2 * spread)
    assert apart.max() < 0.5
    # Records that agree with the grain are kept, others go to the background.
    label = fits[0].predict(q[inside & (scan == 1)])
    angle = np.degrees(misorientation(q[inside & (scan == 1)], modes[0], "432").angle)
    assert np.all(label[angle > 8] == -1)
    assert np.all(label[angle < 1] == 0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: symmetry_group("5"), "group: expected one of 1, 2, 3, 4, 6, 222"),
        (lambda: symmetry_group([[1.0, 0, 0, 0], [0.8, 0.6, 0, 0]]), "group: expected rotations closed"),
        (lambda: symmetry_group(None), "group: expected a name such as '432'"),
        (lambda: SymmetricBingham(Bingham.uniform(3), "432"), "distribution: expected a single one of rotations"),
        (lambda: SymmetricMixture.fit(np.eye(4), "432", 2), "components: expected at most 1 for 4 orientations"),
        (lambda: mean_rotation(np.eye(4)), "x: expected five rotations at least"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(InvalidArgumentError, match=message):
        call()
