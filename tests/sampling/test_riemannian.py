"""Riemannian spherical sampling: exact second moments everywhere, fourth moments, maps and corrections."""

import numpy as np
import pytest

from bingham import Bingham, InvalidArgumentError
from bingham.sampling import RandomSampling, RiemannianSampling, Sampler, Unscented, with_antipodes
from bingham.sampling.descent import moment_residual, steepest_descent
from bingham.sampling.riemannian import gnomonic, transported

# C_B = −diag(…) of Example III.1 with its sample sizes; the largest concentration is the mode's.
EXAMPLE = [((1, a), m) for a in (5, 10, 30) for m in (10, 30, 50)]
EXAMPLE += [((1, 5, a), m) for a in (5, 10, 30, 40) for m in (50, 200, 500)]
EXAMPLE += [((1, 5, 5, 5), m) for m in (50, 200, 500)]

SPECTRA = [
    [0.0, 0.0],
    [-1e-3, 0.0],
    [-1e6, 0.0],
    [0.0, 0.0, 0.0],
    [-5.0, 0.0, 0.0],
    [-1e6, 0.0, 0.0],
    [-1e6, -1e-3, 0.0],
    [0.0, 0.0, 0.0, 0.0],
    [-8.0, -8.0, 0.0, 0.0],
    [-1e6, 0.0, 0.0, 0.0],
    [-1e6, -1e3, -1.0, 0.0],
    [-1e6, -1e6, -1e6, 0.0],
    [-1e6, -1e4, -1e2, -1.0, 0.0],
]


def distribution_of(c):
    return Bingham(-np.array(c, dtype=float), np.eye(len(c)))


def frame(d, seed=1):
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(d, d)))[0]


def fourth_moment_error(sample, distribution, fourth_moments):
    y = sample.points @ distribution.M
    tensor = np.einsum("n,ni,nj,nk,nl->ijkl", sample.weights, y, y, y, y, optimize=True)
    pairs = fourth_moments(distribution)
    true = np.zeros_like(tensor)
    d = distribution.dim
    for i in range(d):
        for j in range(d):
            true[i, i, j, j] = true[i, j, i, j] = true[i, j, j, i] = pairs[i, j]
    return np.linalg.norm(tensor - true)


@pytest.mark.parametrize(("c", "m"), EXAMPLE)
def test_example_of_the_paper(c, m, fourth_moments):
    distribution = distribution_of(c)
    unscented = fourth_moment_error(Unscented().sample(distribution), distribution, fourth_moments)
    sample = RiemannianSampling(m).sample(distribution)
    assert moment_residual(sample.points, distribution.moment()) < 1e-24
    assert fourth_moment_error(sample, distribution, fourth_moments) < unscented
    published = RiemannianSampling(m, map="gnomonic").sample(distribution)
    assert moment_residual(published.points, distribution.moment()) < 1e-24
    assert fourth_moment_error(sample, distribution, fourth_moments) < fourth_moment_error(
        published, distribution, fourth_moments
    )


@pytest.mark.parametrize("z", SPECTRA)
@pytest.mark.parametrize("m", [8, 11, 50, 100])
@pytest.mark.parametrize("map", ["transport", "gnomonic"])
def test_second_moment_to_rounding_at_every_concentration(z, m, map):
    distribution = Bingham(z, np.eye(len(z)))
    sampler = RiemannianSampling(m, map=map)
    if map == "gnomonic" and z[-2] == 0.0:
        with pytest.raises(InvalidArgumentError, match="transport"):
            sampler.sample(distribution)
        return
    x, w = sampler.sample(distribution)
    root = np.sqrt(distribution.axis_moments)
    assert np.abs((x.T * w) @ x / np.outer(root, root) - np.eye(len(z))).max() < 1e-10
    assert np.abs(np.linalg.norm(x, axis=1) - 1.0).max() < 1e-14
    rotated = Bingham(z, frame(len(z)))
    sample = sampler.sample(rotated)
    assert moment_residual(sample.points, rotated.moment()) < 1e-24
    assert np.abs(with_antipodes(sample).weights @ with_antipodes(sample).points).max() < 1e-15


@pytest.mark.parametrize("m", [7, 300])
def test_smallest_and_large_sets(m):
    for z in ([0.0] * 4, [-1e6, -1e3, -1e-3, 0.0], [-10.0, -10.0, -10.0, 0.0]):
        distribution = Bingham(z, frame(4))
        x = RiemannianSampling(m).sample(distribution).points
        assert moment_residual(x, distribution.moment()) < 1e-24


BROAD = [[-4.0, 0.0], [0.0, 0.0, 0.0], [-9.0, -4.0, 0.0], [-30.0, 0.0, 0.0, 0.0], [-50.0, -8.0, -1.0, 0.0]]


@pytest.mark.parametrize("z", [*BROAD, [-20.0, -9.0, -5.0, -1.0, 0.0]])
def test_transport_of_normal_samples_follows_the_distribution(z, fourth_moments):
    # 40 000 random normals: moments within five standard errors; the gnomonic map fails the same test (control).
    normal = np.random.default_rng(7).normal(size=(40_000, len(z) - 1))
    distribution = Bingham(z, np.eye(len(z)))

    def deviation(x):
        pairs = np.einsum("ni,nj->nij", x * x, x * x)
        error = (pairs.mean(axis=0) - fourth_moments(distribution)) / (pairs.std(axis=0) / 200.0)
        return np.abs(error).max()

    assert deviation(transported(normal, distribution.z, symmetric=False)) < 5.0
    if z[-2] < 0.0:
        assert deviation(gnomonic(normal, distribution.z)) > 10.0


def test_transport_is_the_gaussian_scaling_at_high_concentration():
    normal = np.random.default_rng(8).normal(size=(50, 3)).clip(-3, 3)
    z = np.array([-4e8, -1e8, -2.5e7, 0.0])
    assert np.allclose(transported(normal, z, symmetric=False), gnomonic(normal, z), rtol=3e-3, atol=3e-7)


def test_samples_are_symmetric_about_the_mode_and_repeat():
    distribution = Bingham([-9.0, -4.0, -2.0, 0.0], np.eye(4))
    x = RiemannianSampling(20).sample(distribution).points
    assert np.allclose(x[:10, :3], -x[10:, :3], atol=1e-13) and np.allclose(x[:10, 3], x[10:, 3], atol=1e-13)
    assert np.array_equal(x, RiemannianSampling(20).sample(distribution).points)
    free = RiemannianSampling(20, symmetric=False).sample(distribution).points
    assert moment_residual(free, distribution.moment()) < 1e-24


def test_plain_descent_reaches_the_moment_near_the_start():
    distribution = distribution_of((1, 8, 70))
    start = RiemannianSampling(150, map="gnomonic", correction="none").sample(distribution).points
    assert moment_residual(start, distribution.moment()) > 1e-4
    plain = steepest_descent(start, distribution.moment())
    assert plain.residual < 1e-18 and moment_residual(plain.points, distribution.moment()) < 1e-18
    x = RiemannianSampling(150, map="gnomonic", correction="descent").sample(distribution).points
    assert np.allclose(x, plain.points, atol=1e-12)
    # A penalty trades residual for less movement.
    held = steepest_descent(start, distribution.moment(), penalty=1e-3)
    assert held.residual > plain.residual
    assert np.sum((held.points - start) ** 2) < np.sum((plain.points - start) ** 2)
    # Newton's correction moves the points about as little as the descent.
    newton = RiemannianSampling(150, map="gnomonic").sample(distribution).points
    assert np.sum((newton - start) ** 2) < 2.0 * np.sum((plain.points - start) ** 2)


def test_descent_against_the_trust_region_of_pymanopt():
    pymanopt = pytest.importorskip("pymanopt")
    distribution = distribution_of((1, 8, 70))
    start = RiemannianSampling(40, map="gnomonic", correction="none").sample(distribution).points
    moment, m = distribution.moment(), len(start)
    manifold = pymanopt.manifolds.Oblique(3, m)

    @pymanopt.function.numpy(manifold)
    def cost(x):
        return moment_residual(x.T, moment)

    @pymanopt.function.numpy(manifold)
    def euclidean_gradient(x):
        return 4.0 / m * (x @ x.T / m - moment) @ x

    @pymanopt.function.numpy(manifold)
    def euclidean_hessian(x, v):
        return 4.0 / m * ((x @ x.T / m - moment) @ v + (v @ x.T + x @ v.T) / m @ x)

    problem = pymanopt.Problem(
        manifold, cost, euclidean_gradient=euclidean_gradient, euclidean_hessian=euclidean_hessian
    )
    optimizer = pymanopt.optimizers.TrustRegions(verbosity=0, min_gradient_norm=1e-12)
    theirs = optimizer.run(problem, initial_point=start.T.copy()).point.T
    ours = steepest_descent(start, moment).points
    assert moment_residual(theirs, moment) < 1e-10 and moment_residual(ours, moment) < 1e-18
    assert np.sum((ours - start) ** 2) < 1.2 * np.sum((theirs - start) ** 2)


def test_random_sampling_is_unbiased_seeded_and_moves_on():
    distribution = Bingham([-3.0, -1.0, 0.0], frame(3))
    sampler = RandomSampling(20_000, rng=5)
    x, w = sampler.sample(distribution)
    assert np.allclose(w, 1 / 20_000) and isinstance(sampler, Sampler) and isinstance(Unscented(), Sampler)
    assert np.abs(x.T @ x / len(x) - distribution.moment()).max() < 5 / np.sqrt(len(x))
    assert np.abs(x.T @ x / len(x) - Bingham([-3.0, -2.0, 0.0], frame(3)).moment()).max() > 5 / np.sqrt(len(x))
    assert not np.array_equal(x, sampler.sample(distribution).points)
    assert np.array_equal(x, RandomSampling(20_000, rng=5).sample(distribution).points)


def test_bad_arguments_are_rejected():
    with pytest.raises(InvalidArgumentError, match="at least 6"):
        RiemannianSampling(5).sample(Bingham.uniform(4))
    with pytest.raises(InvalidArgumentError, match="map"):
        RiemannianSampling(10, map="stereographic")
    with pytest.raises(InvalidArgumentError, match="correction"):
        RiemannianSampling(10, correction="magic")
    with pytest.raises(InvalidArgumentError, match="penalty"):
        RiemannianSampling(10, penalty=1.0)
    with pytest.raises(InvalidArgumentError, match=r"m: expected an integer ≥ 1, got 20\.5"):
        RiemannianSampling(20.5)
    with pytest.raises(InvalidArgumentError, match="distribution: expected a Bingham distribution, got a list"):
        RiemannianSampling(10).sample([1.0, 0.0, 0.0, 0.0])
    with pytest.raises(InvalidArgumentError, match="rng: expected None, an integer"):
        RandomSampling(10, rng="a")
    with pytest.raises(InvalidArgumentError, match="single distribution"):
        RiemannianSampling(10).sample(Bingham([[-1.0, 0.0], [-2.0, 0.0]], np.eye(2)))


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("d", [3, 4])
def test_every_size_reaches_the_moment_at_every_concentration(d, symmetric):
    # Isotropic, spread, a girdle and the uniform distribution.
    spectra = [[-(10.0**k)] * (d - 1) for k in range(-1, 7)]
    spectra += [[-1e3, *[-2.0] * (d - 2)], [-50.0, *[0.0] * (d - 2)], [0.0] * (d - 1)]
    for m in range(2 * (d - 1), 61):
        for z in spectra:
            distribution = Bingham([*z, 0.0], np.eye(d))
            x, w = RiemannianSampling(m, symmetric=symmetric).sample(distribution)
            assert np.abs((x.T * w) @ x - distribution.moment()).max() <= 1e-10, (m, z)


@pytest.mark.parametrize("correction", ["newton", "descent", "trust_region"])
def test_all_corrections_reach_the_moment(correction):
    distribution = Bingham([-20.0, -5.0, -1.0, 0.0], np.eye(4))
    x, w = RiemannianSampling(30, map="gnomonic", correction=correction).sample(distribution)
    assert np.sum(((x.T * w) @ x - distribution.moment()) ** 2) < 1e-15
    # Negative control.
    x, w = RiemannianSampling(30, map="gnomonic", correction="none").sample(distribution)
    assert np.sum(((x.T * w) @ x - distribution.moment()) ** 2) > 1e-6
