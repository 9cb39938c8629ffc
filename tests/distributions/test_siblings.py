"""Distributions beside Bingham's: one set of laws for all, and published values."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import vonmises_fisher

from bingham import Bingham, InvalidArgumentError, concentrations
from bingham.distributions.angular_central_gaussian import AngularCentralGaussian
from bingham.distributions.fibre import FibreLobe
from bingham.distributions.fisher_bingham import FisherBingham
from bingham.distributions.kent import Kent
from bingham.distributions.matrix_fisher import MatrixFisher
from bingham.distributions.sibling import Uniform, select
from bingham.distributions.von_mises_fisher import VonMisesFisher
from bingham.distributions.watson import Watson
from bingham.kernels.linear_term import moments_linear

AXIAL = Path(__file__).resolve().parents[2] / "../shared/data/axial"
FRAME = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
FAMILY = {
    "watson": Watson(FRAME[:, 0], 6.0),
    "watson girdle": Watson(FRAME[:, 1], -8.0),
    "angular central Gaussian": AngularCentralGaussian(FRAME @ np.diag([1.0, 3.0, 9.0]) @ FRAME.T),
    "von Mises–Fisher": VonMisesFisher(FRAME[:, 2], 5.0),
    "von Mises–Fisher d = 4": VonMisesFisher([0.5, 0.5, 0.5, -0.5], 3.0),
    "Kent": Kent(FRAME, 9.0, 3.0),
    "Fisher–Bingham": FisherBingham(FRAME @ np.diag([-7.0, -3.0, 0.0]) @ FRAME.T, [2.0, -1.0, 1.0]),
    "Fisher–Bingham d = 4": FisherBingham(np.diag([-9.0, -2.0, -1.0, 0.0]), [1.0, 2.0, 0.5, -1.0]),
    "uniform": Uniform(3),
}


@pytest.mark.parametrize("name", FAMILY)
def test_density_integrates_to_one_and_samples_follow_it(name):
    p = FAMILY[name]
    n = 100_000
    u = Uniform(p.dim).rvs(n, rng=1)
    area = np.exp(-Uniform(p.dim).logpdf(u[0]))
    ratio = area * p.pdf(u)
    assert ratio.mean() == pytest.approx(1.0, abs=4 * ratio.std() / np.sqrt(n) + 1e-12)
    x = p.rvs(n, rng=2)
    for value in (lambda v: v[:, 0], lambda v: v[:, 0] * v[:, -1], lambda v: v[:, 1] ** 2):
        expected, error = np.mean(ratio * value(u)), np.std(ratio * value(u)) / np.sqrt(n)
        assert value(x).mean() == pytest.approx(expected, abs=4.5 * (error + value(x).std() / np.sqrt(n)))


@pytest.mark.parametrize("name", [name for name in FAMILY if name != "uniform"])
def test_fit_is_a_maximum_near_the_truth(name):
    p = FAMILY[name]
    x = p.rvs(4000, rng=3)
    fitted = type(p).fit(x)
    gain = np.sum(fitted.logpdf(x) - p.logpdf(x))
    # Twice the gain is χ² with as many degrees as there are parameters.
    assert 0.0 <= 2 * gain < 6 * p.parameter_count
    tilted = Rotation.from_rotvec([0.02, -0.03, 0.01]).as_matrix()
    if p.dim == 3:
        assert np.sum(fitted.logpdf(x @ tilted)) < np.sum(fitted.logpdf(x))
    counts = np.random.default_rng(0).integers(0, 3, len(x))
    a, b = type(p).fit(x, counts), type(p).fit(np.repeat(x, counts, axis=0))
    np.testing.assert_allclose(a.logpdf(x[:9]), b.logpdf(x[:9]), rtol=1e-5, atol=1e-6)


def test_families_meet():
    x = Uniform(3).rvs(50, rng=1)
    np.testing.assert_allclose(Kent(FRAME, 7.0, 0.0).logpdf(x), VonMisesFisher(FRAME[:, 0], 7.0).logpdf(x), rtol=1e-12)
    np.testing.assert_allclose(
        FisherBingham(np.diag([-9.0, -4.0, 0.0]), np.zeros(3)).logpdf(x),
        Bingham([-9.0, -4.0, 0.0], np.eye(3)).logpdf(x), rtol=1e-12,
    )  # fmt: skip
    np.testing.assert_allclose(VonMisesFisher([0, 0, 1], 4.0).logpdf(x), vonmises_fisher([0, 0, 1], 4.0).logpdf(x))
    np.testing.assert_allclose(VonMisesFisher([0, 0, 1], 1e6).logpdf([0, 0, 1]), np.log(1e6 / (2 * np.pi)), rtol=1e-11)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e5])
def test_normaliser_with_a_linear_term(size):
    """b = κ e₃ alone: 4π sinh(κ)/κ; and its mean coth κ − 1/κ."""
    found = moments_linear(np.zeros(3), np.array([0.0, 0.0, size]))
    log_sinh = size + np.log1p(-np.exp(-2 * size)) - np.log(2)
    assert found.log_normalizer == pytest.approx(np.log(4 * np.pi) + log_sinh - np.log(size), rel=1e-13)
    assert found.mean[2] == pytest.approx(1 / np.tanh(size) - 1 / size, rel=1e-7)
    assert np.trace(found.moment) == pytest.approx(1.0, abs=1e-13)


def test_quetico_lineations_prefer_bingham_narrowly():
    """Watson's κ is 9.81189, and twice the gain of Bingham's distribution over it 4.493."""
    if not AXIAL.is_dir():
        pytest.skip("no samples of axes beside the project")
    rows = np.loadtxt(AXIAL / "quetico_lineations.csv", delimiter=",", skiprows=2, usecols=(2, 3, 4))
    x = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    result = select(x, ["watson", "bingham", "uniform"])
    found = {f.name: f for f in result.ranking}
    assert found["watson"].distribution.kappa == pytest.approx(9.81189, abs=5e-6)
    assert 2 * (found["bingham"].log_likelihood - found["watson"].log_likelihood) == pytest.approx(4.493, abs=5e-4)
    assert result.ranking[-1].name == "uniform"


def test_table_of_mardia_and_zemroch():
    """Published concentrations agree within 0.005 + 0.05 % in 99 % of the rows that satisfy the equations at all."""
    if not AXIAL.is_dir():
        pytest.skip("no samples of axes beside the project")
    table = np.loadtxt(AXIAL / "mardia_zemroch_table.csv", delimiter=",", skiprows=1)
    table = table[table[:, 4] <= 2e-4]
    assert len(table) == 203
    w = np.column_stack([table[:, :2], 1 - table[:, :2].sum(axis=1)])
    z = concentrations(w)
    k = z[:, :2] - z[:, 2:]
    near = np.all(np.abs(k - table[:, 2:4]) <= 0.005 + 5e-4 * np.abs(table[:, 2:4]), axis=1)
    assert near.mean() >= 0.99


def test_selection_finds_the_family():
    rng = np.random.default_rng(0)
    for name, p in (("watson", FAMILY["watson"]), ("kent", FAMILY["Kent"]), ("uniform", Uniform(3)),
                    ("von_mises_fisher", FAMILY["von Mises–Fisher"]),
                    ("fisher_bingham", FisherBingham(np.diag([-30.0, -4.0, 0.0]), [1.5, 1.0, 1.5])),
                    ("angular_central_gaussian", FAMILY["angular central Gaussian"])):  # fmt: skip
        assert select(p.rvs(3000, rng=rng)).best.name == name
    flat = np.stack([np.cos(np.arange(9.0)), np.sin(np.arange(9.0)), np.zeros(9)], axis=1)
    result = select(flat, ["bingham", "uniform"])
    assert result.best.name == "uniform"
    assert "smaller sphere" in result.failed["bingham"]


def test_matrix_fisher_is_bingham():
    p = MatrixFisher(np.diag([25.0, 5.0, 1.0]))
    assert p.log_normalizer == pytest.approx(25.195066286054, abs=1e-12)
    np.testing.assert_allclose(np.linalg.svd(p.mean())[1], [0.963744, 0.895432, 0.892817], atol=5e-7)
    F = np.random.default_rng(1).normal(size=(2, 3, 3)) * 5
    p = MatrixFisher(F)
    np.testing.assert_allclose(MatrixFisher.from_bingham(p.to_bingham()).F, F, atol=1e-12)
    turned = Rotation.random(7, rng=2)
    density = p.to_bingham()[0].logpdf(turned) + np.log(2 * np.pi**2)
    np.testing.assert_allclose(MatrixFisher(F[0]).logpdf(turned), density, rtol=1e-12)
    r = MatrixFisher(F[0]).rvs(50_000, rng=3)
    np.testing.assert_allclose(r.mean(axis=0), MatrixFisher(F[0]).mean(), atol=0.012)
    fitted = MatrixFisher.fit(Rotation.from_matrix(r))
    np.testing.assert_allclose(fitted.F, F[0], atol=0.5)
    assert np.linalg.det(p.mode) == pytest.approx([1.0, 1.0])


def test_fibre_lobes():
    lobe = FibreLobe([1.0, 1.0, 2.0], [30.0, 15.0, 30.0], [10.0, 4.0, 10.0])
    np.testing.assert_allclose(lobe.fibre_density, [0.37665, 0.90674, 0.7533], atol=5e-6)
    np.testing.assert_allclose(lobe.fibre_spread, [0.37665, 0.90674, 0.37665], atol=5e-6)
    assert lobe.dispersion.minor[0] == pytest.approx(2 / np.pi * np.arctan(1 / 30))
    assert np.all(lobe.dispersion.minor < lobe.dispersion.total)
    assert np.all(lobe.dispersion.total < lobe.dispersion.major)
    swapped = FibreLobe([1.0, 1.0, 2.0], [10.0, 4.0, 10.0], [30.0, 15.0, 30.0])  # dipy's order
    np.testing.assert_allclose(swapped.fibre_density, lobe.fibre_density)
    np.testing.assert_allclose(swapped.dispersion, lobe.dispersion)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Watson([1.0, 1.0, 0.0], 1.0), "axis: expected"),
        (lambda: VonMisesFisher([0, 0, 1], -1.0), "kappa: expected a finite number ≥ 0"),
        (lambda: VonMisesFisher.fit([[0, 0, 1.0]] * 3), "x: expected directions that scatter"),
        (lambda: Kent(np.ones((3, 3)), 1.0, 0.0), "frame: expected an orthogonal matrix"),
        (lambda: Kent.fit(np.eye(4)), "x: expected directions in space"),
        (lambda: FisherBingham(np.eye(2), [1.0, 0, 0]), "matrix: expected a finite symmetric matrix"),
        (lambda: AngularCentralGaussian(-np.eye(3)), "shape: expected a positive definite matrix"),
        (lambda: AngularCentralGaussian.fit(np.eye(3)[:2]), "x: expected axes that span the space"),
        (lambda: select(np.eye(3), ["normal"]), "models: expected some of uniform"),
        (lambda: select(np.eye(3), criterion="dic"), "criterion: expected 'bic' or 'aic'"),
        (lambda: select(np.eye(3), weights=[1, 2]), "weights: expected 3 finite"),
        (lambda: MatrixFisher([[1.0]]), "F: expected finite matrices"),
        (lambda: MatrixFisher.from_bingham(Bingham.uniform(3)), "distribution: expected one of rotations"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(InvalidArgumentError, match=message):
        call()
