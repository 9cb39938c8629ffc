import numpy as np
import pytest
from scipy.integrate import dblquad, quad
from scipy.optimize import minimize_scalar
from scipy.special import ive

from bingham import Bingham, log_normalizer
from bingham.distributions.fisher_bingham import FisherBingham
from bingham.distributions.gaussian_relations import (
    conditioned_gaussian,
    gaussian_of,
    to_fisher_bingham,
    trigonometric_moment,
)
from bingham.distributions.isotropic import fit_isotropic, isotropic_concentration
from bingham.errors import InvalidArgumentError


@pytest.mark.parametrize("d", [2, 3, 4, 7])
@pytest.mark.parametrize("c", [1e-5, 0.3, 5.0, 300.0, 1e6, 1e9])
def test_concentration_and_spread_are_inverses(c, d):
    z = np.append(np.full(d - 1, -c), 0.0)
    spread = Bingham(z, np.eye(d)).axis_moments[:-1].sum()
    assert isotropic_concentration(spread, d) == pytest.approx(c, rel=1e-9 if c > 1e-3 else 1e-6, abs=1e-9)


@pytest.mark.parametrize("d", [2, 3, 4, 6])
def test_isotropic_fit_is_the_constrained_maximum_of_the_likelihood(d):
    rng = np.random.default_rng(d)
    frame = np.linalg.qr(rng.normal(size=(d, d)))[0]
    x = Bingham([*(-np.linspace(5.0, 30.0, d - 1)), 0.0], frame).rvs(400, rng=rng)
    found = fit_isotropic(x)
    assert np.ptp(found.z[:-1]) == 0.0
    moment = x.T @ x / len(x)
    top = np.linalg.eigvalsh(moment)[-1]

    def loss(c):
        return log_normalizer(np.append(np.full(d - 1, -c), 0.0)) + c * (1.0 - top)

    # The stationary point: the derivative of the loss, not the flat loss itself, to 1e-10.
    spread = Bingham(found.z, np.eye(d)).axis_moments[:-1].sum()
    assert spread == pytest.approx(1.0 - top, rel=1e-10)
    best = minimize_scalar(loss, bracket=(1.0, 20.0), options={"xtol": 1e-12})
    assert loss(-found.z[0]) <= best.fun + 1e-12
    assert -found.z[0] == pytest.approx(best.x, rel=1e-6)
    # No other mode is more probable.
    for _ in range(20):
        m = found.mode + 0.05 * rng.normal(size=d)
        m /= np.linalg.norm(m)
        other = -found.z[0] * ((x @ m) ** 2).mean()
        assert other < -found.z[0] * top


def test_the_fit_through_von_mises_fisher_has_the_power_d_minus_2():
    for d in (2, 3, 4):
        p = Bingham([*[-12.0] * (d - 1), 0.0], np.eye(d))
        x = p.rvs(200_000, rng=1)
        found = fit_isotropic(x, method="von_mises_fisher")
        assert -found.z[0] == pytest.approx(12.0, rel=0.02)
        # Negative control: the printed power d − 1.
        cosine = np.abs(x @ found.mode)
        w = (2.0 * cosine) ** (d - 1)
        length = np.sum(w * (2.0 * cosine**2 - 1.0)) / w.sum()
        assert length > 1.002 * ive(0.5 * d, 6.0) / ive(0.5 * d - 1.0, 6.0)


@pytest.mark.parametrize("kappa", [0.0, 0.7, 8.0, 60.0])
@pytest.mark.parametrize("beta", [(0.0, -3.0, -20.0), (0.0, 4.0, -1.0), (0.0, 0.0, 0.0)])
def test_kents_normaliser_is_the_integral(kappa, beta):
    def density(phi, t):
        r = np.sqrt(1.0 - t * t)
        return np.exp(
            kappa * (t - 1.0) + beta[0] * t * t + beta[1] * (r * np.cos(phi)) ** 2 + beta[2] * (r * np.sin(phi)) ** 2
        )

    whole = dblquad(density, -1.0, 1.0, 0.0, 2.0 * np.pi, epsabs=1e-12, epsrel=1e-11)[0]
    # Definition 7: exp(κ γ₁ᵀx + Σ βⱼ (γⱼᵀx)²)/C, here with γ₁ the z axis; at the pole the exponent is κ + β₁.
    p = FisherBingham(np.diag([beta[1], beta[2], beta[0]]), [0.0, 0.0, kappa])
    assert p.logpdf([0.0, 0.0, 1.0]) == pytest.approx(beta[0] - np.log(whole), abs=1e-8)


@pytest.mark.parametrize("d", [2, 3, 4, 6])
def test_without_a_linear_term_it_is_bingham_and_without_a_matrix_von_mises_fisher(d):
    rng = np.random.default_rng(d)
    p = Bingham(-20.0 * rng.random(d), np.linalg.qr(rng.normal(size=(d, d)))[0])
    x = Bingham.uniform(d).rvs(20, rng=rng)
    np.testing.assert_allclose(to_fisher_bingham(p).logpdf(x), p.logpdf(x), atol=1e-9)
    kappa = 7.0
    fisher = FisherBingham(np.zeros((d, d)), kappa * np.eye(d)[0])
    exact = (0.5 * d) * np.log(2.0 * np.pi) + np.log(ive(0.5 * d - 1.0, kappa)) - (0.5 * d - 1.0) * np.log(kappa)
    assert fisher.logpdf(np.eye(d)[0]) == pytest.approx(-exact, abs=1e-8)


def test_a_gaussian_on_the_sphere_is_bingham():
    rng = np.random.default_rng(3)
    root = rng.normal(size=(3, 3))
    covariance = root @ root.T + 0.05 * np.eye(3)
    p = conditioned_gaussian(covariance)
    x = Bingham.uniform(3).rvs(50, rng=rng)
    log_gauss = -0.5 * np.einsum("ni,ij,nj->n", x, np.linalg.inv(covariance), x)
    assert np.ptp(p.logpdf(x) - log_gauss) < 1e-9
    # Every member of the family gives the distribution back; they differ.
    for largest in (0.2, 3.0):
        again = conditioned_gaussian(gaussian_of(p, largest))
        np.testing.assert_allclose(again.matrix, p.matrix, atol=1e-9)
    assert np.abs(gaussian_of(p, 0.2) - gaussian_of(p, 3.0)).max() > 0.1


@pytest.mark.parametrize("z", [-0.5, -8.0, -200.0])
def test_trigonometric_moments_are_the_integrals(z):
    angle = 0.7
    p = Bingham([z, 0.0], [[-np.sin(angle), np.cos(angle)], [np.cos(angle), np.sin(angle)]])
    for n in (0, 1, 2, 3, 4):
        real, imaginary = (
            quad(lambda t, g=g, n=n: p.pdf([np.cos(t), np.sin(t)]) * g(n * t), angle - np.pi, angle + np.pi,
                 points=[angle], epsabs=1e-11)[0]
            for g in (np.cos, np.sin)
        )  # fmt: skip
        assert trigonometric_moment(p, n) == pytest.approx(real + 1j * imaginary, abs=1e-9)
    # Remark 1: in the principal axes E[cos²] = (1 + Re m₂)/2, not Re m₂ as printed.
    own = Bingham([z, 0.0], [[0.0, 1.0], [1.0, 0.0]])
    second = trigonometric_moment(own, 2).real
    assert own.axis_moments[1] == pytest.approx(0.5 * (1.0 + second), abs=1e-12)
    assert abs(own.axis_moments[1] - second) > 1e-3


@pytest.mark.parametrize("d", [2, 3, 4])
@pytest.mark.parametrize("c", [0.0, 1e-4, 2.0, 400.0, 1e8])
@pytest.mark.parametrize("weighted", [False, True])
def test_the_compiled_isotropic_fit_is_the_root_of_the_likelihood_equation(d, c, weighted):
    rng = np.random.default_rng(d)
    x = Bingham([*[-c] * (d - 1), 0.0], np.linalg.qr(rng.normal(size=(d, d)))[0]).rvs(300, rng=rng)
    w = rng.uniform(size=300) if weighted else None
    found = fit_isotropic(x, w)
    share = np.full(300, 1.0 / 300) if w is None else w / w.sum()
    # The spread by the samples' parts across the mode: no small difference of large numbers.
    across = x - (x @ found.mode)[:, None] * found.mode
    spread = share @ np.sum(across**2, axis=1)
    assert isinstance(found.z[0], float) and -found.z[0] == pytest.approx(
        isotropic_concentration(min(spread, 1.0 - 1.0 / d), d), rel=1e-10 if c < 1e6 else 1e-7, abs=1e-10
    )
    assert found.log_normalizer == pytest.approx(log_normalizer(found.z), abs=2e-12)
    np.testing.assert_allclose(found.M.T @ found.M, np.eye(d), atol=1e-14)
    # However the same rows are laid out, and whatever their signs.
    signs = rng.choice([-1.0, 1.0], size=(300, 1))
    for other in ((signs * x).tolist(), np.asfortranarray(x), np.repeat(x, 2, axis=1)[:, ::2]):
        assert fit_isotropic(other, w).z[0] == pytest.approx(found.z[0], rel=1e-9 if c < 1e6 else 1e-7, abs=1e-9)


@pytest.mark.parametrize(
    ("x", "weights", "match"),
    [
        ([[1.0, 0.0, 0.0], [0.0, 1.1, 0.0]], None, "row 1"),
        ([[1.0, 0.0, 0.0], [0.0, np.nan, 0.0]], None, "NaN"),
        ([[0.0, 0.6, 0.8]] * 4, None, "two different axes"),
        ([[1.0, 0.0], [0.0, 1.0]], [0.0, 0.0], "weights"),
        ([[1.0, 0.0], [0.0, 1.0]], [np.nan, 1.0], "weights"),
        ([[1.0]], None, "shape"),
    ],
)
def test_an_isotropic_fit_of_nonsense_says_so(x, weights, match):
    with pytest.raises(InvalidArgumentError, match=match):
        fit_isotropic(np.array(x), weights)


@pytest.mark.parametrize("d", [2, 3, 4, 6])
@pytest.mark.parametrize("method", ["likelihood", "von_mises_fisher"])
def test_a_batch_of_isotropic_fits_is_the_fits_one_by_one(d, method):
    rng = np.random.default_rng(d)
    c = np.array([[0.5, 8.0, 300.0], [0.0, 40.0, 1e5]])
    z = np.zeros((2, 3, d))
    z[..., :-1] = -c[..., None]
    x = np.stack([[Bingham(z[i, j], np.eye(d)).rvs(25, rng=rng) for j in range(3)] for i in range(2)])
    w = rng.uniform(size=(3, 25))
    for weights in (None, w):
        found = fit_isotropic(x, weights, method=method)
        assert found.shape == (2, 3)
        for i in range(2):
            for j in range(3):
                one = fit_isotropic(x[i, j], None if weights is None else w[j], method=method)
                np.testing.assert_allclose(found.z[i, j], one.z, rtol=1e-9, atol=1e-9)
                np.testing.assert_allclose(np.abs(found.mode[i, j] @ one.mode), 1.0, atol=1e-12)
                assert found.log_normalizer[i, j] == pytest.approx(one.log_normalizer, abs=1e-9)
    same = np.array(x)
    same[1, 0] = same[1, 0, 0]
    with pytest.raises(InvalidArgumentError, match="sample 3"):
        fit_isotropic(same)
    with pytest.raises(InvalidArgumentError, match="weights"):
        fit_isotropic(x, np.ones(24))
