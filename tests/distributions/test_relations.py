"""Relations to other distributions, against the papers' numbers, samples and closed forms."""

import numpy as np
import pytest
from scipy.stats import vonmises

from bingham import Bingham, InvalidArgumentError
from bingham.distributions.relations import (
    angular_variance,
    from_gaussian,
    from_von_mises,
    from_von_mises_fisher,
    to_gaussian,
    to_von_mises,
    to_von_mises_fisher,
)


@pytest.mark.parametrize(
    ("z1", "small", "large"), [(-1.0, 1.5e-1, 3.8e-1), (-200.0, 4.7e-6, 2.5e-3), (-2.0, 8.8e-2, 2.8e-1)]
)
def test_plane_gaussians_of_the_paper(z1, small, large):
    """Kurz et al. 2014, eqs. 58–60, printed to two digits."""
    across, along = np.diag(to_gaussian(Bingham([z1, 0.0], np.eye(2))).covariance)
    assert float(f"{across:.1e}") == large
    assert float(f"{along:.1e}") == small


def test_angular_variances_of_the_2013_study():
    """By quadrature 0.5872 and 0.00251 (z₁ = −1, −200); the paper's sampled ones were 0.5956 and 0.0027."""
    assert angular_variance(Bingham([-1.0, 0.0], np.eye(2))) == pytest.approx(0.5872, abs=5e-5)
    assert angular_variance(Bingham([-200.0, 0.0], np.eye(2))) == pytest.approx(0.00251, abs=5e-6)


@pytest.mark.parametrize("z", [[-20.0, -8.0, -2.0, 0.0], [-500.0] * 3 + [0.0], [-3.0, -1.0, 0.0]])
def test_gaussian_covariance_is_that_of_samples_about_one_mode(z):
    p = Bingham(z, np.linalg.qr(np.random.default_rng(0).normal(size=(len(z),) * 2))[0])
    x = p.rvs(400_000, rng=1)
    x *= np.sign(x @ p.mode)[:, None]
    gaussian = to_gaussian(p)
    off = x - gaussian.mean
    sample = np.einsum("ni,nj->ij", off, off) / len(x)
    np.testing.assert_allclose(sample, gaussian.covariance, atol=6 * np.trace(sample) / np.sqrt(len(x)))


def test_projected_gaussian_has_the_moment_of_its_samples():
    rng = np.random.default_rng(2)
    mean, c = np.array([0.3, 0.0, -0.9, 0.2]), np.diag([0.2, 0.01, 0.1, 0.4])
    x = rng.multivariate_normal(mean, c, 400_000)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    sample = np.einsum("ni,nj->ij", x, x) / len(x)
    np.testing.assert_allclose(from_gaussian(mean, c).moment(), sample, atol=4 * 0.5 / np.sqrt(len(x)))


def test_von_mises_density_on_the_doubled_angle():
    p = from_von_mises(1.1, 3.0)
    assert to_von_mises(p) == pytest.approx((1.1, 3.0))
    theta = np.linspace(0, 2 * np.pi, 50)
    x = np.stack([np.cos(theta), np.sin(theta)], axis=1)
    # Two angles share each doubled one, and d(2θ) = 2 dθ: the densities per angle are equal.
    np.testing.assert_allclose(p.pdf(x), vonmises(3.0, loc=1.1).pdf(2 * theta), rtol=1e-11)


@pytest.mark.parametrize("d", [2, 3, 4, 6])
def test_von_mises_fisher_on_the_doubled_colatitude(d):
    """density(θ) sin^{d−2}θ (2 cos θ)^{d−2} ∝ exp(κ cos φ) sin^{d−2}φ at φ = 2θ."""
    mode = np.eye(d)[0]
    p = from_von_mises_fisher(mode, 4.0)
    found, kappa = to_von_mises_fisher(p)
    assert abs(found @ mode) == pytest.approx(1.0)
    assert kappa == pytest.approx(4.0, rel=1e-12)
    theta = np.linspace(0.05, 1.5, 20)
    x = np.outer(np.cos(theta), mode) + np.outer(np.sin(theta), np.eye(d)[1])
    ours = p.pdf(x) * np.sin(theta) ** (d - 2) * (2 * np.cos(theta)) ** (d - 2)
    theirs = np.exp(4.0 * np.cos(2 * theta)) * np.sin(2 * theta) ** (d - 2)
    np.testing.assert_allclose(ours / theirs, (ours / theirs)[0], rtol=1e-10)


def test_bad_input_is_named():
    with pytest.raises(InvalidArgumentError, match="distribution: expected dimension 2"):
        to_von_mises(Bingham.uniform(3))
    with pytest.raises(InvalidArgumentError, match="isotropic"):
        to_von_mises_fisher(Bingham([-9.0, -1.0, 0.0], np.eye(3)))
    with pytest.raises(InvalidArgumentError, match="covariance"):
        from_gaussian([1.0, 0.0], [[1.0, 0.0], [0.0, -1.0]])


@pytest.mark.parametrize("d", [2, 3, 4, 6])
@pytest.mark.parametrize("deviation", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12])
def test_narrow_gaussians_keep_their_digits(d, deviation):
    """N(m, σ² I) of a unit m is, projected, a narrow distribution with −2 z σ² = 1 + (d − 1) σ² + …."""
    m = np.random.default_rng(d).normal(size=d)
    m /= np.linalg.norm(m)
    p = from_gaussian(m, deviation**2 * np.eye(d))
    np.testing.assert_allclose(-2.0 * p.z[:-1] * deviation**2, 1.0 + (d - 1) * deviation**2, rtol=1e-11, atol=1e-15)
    assert abs(abs(p.mode @ m) - 1.0) < 1e-14
