"""Distributions, losses and parameterisations in PyTorch, beside the NumPy ones and by sampling."""

import math

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed")

from scipy.spatial.transform import Rotation  # noqa: E402
from torch.distributions import kl_divergence  # noqa: E402

import bingham  # noqa: E402
from bingham import BinghamFilter  # noqa: E402
from bingham.errors import InvalidArgumentError  # noqa: E402
from bingham.torch import (  # noqa: E402
    Bingham,
    BinghamMixtureNLLLoss,
    BinghamNLLLoss,
    MatrixFisher,
    compose,
    from_cholesky,
    from_eigen,
    from_numbers,
    isotropic_noise,
    sequence_log_evidence,
)
from learning.test_torch_normalizer import turned, unit  # noqa: E402

Z = np.array([[-900.0, -500.0, -3.0, 0.0], [-5.0, -5.0, -5.0, 0.0], [0.0, 0.0, 0.0, 0.0], [-40.0, 0.0, 0.0, 0.0]])


def both(z=Z, seed=0, shift=0.0):
    a = turned(z, seed) + shift * np.eye(z.shape[-1])
    return Bingham(torch.tensor(0.5 * (a + np.swapaxes(a, -1, -2)))), bingham.Bingham.from_matrix(a)


@pytest.mark.parametrize("shift", [0.0, 300.0])
def test_agrees_with_the_numpy_distribution(shift):
    p, q = both(shift=shift)
    r, s = both(seed=1)
    x = unit(7, 4, 4)
    np.testing.assert_allclose(p.log_prob(torch.tensor(x)), q.logpdf(x), atol=1e-10)
    np.testing.assert_allclose(p.entropy(), q.entropy(), atol=1e-10)
    np.testing.assert_allclose(p.second_moment, q.moment(), atol=1e-12)
    np.testing.assert_allclose(kl_divergence(p, r), q.kl_divergence(s), atol=1e-9)
    np.testing.assert_allclose(np.abs(np.sum(p.mode[:2].numpy() * q.mode[:2], -1)), 1.0, atol=1e-12)
    assert p.batch_shape == (4,)
    assert p.event_shape == (4,)
    assert p.expand((3, 4)).log_prob(torch.tensor(x[:3])).shape == (3, 4)


def test_spectral_form_is_the_matrix_form():
    frame = np.linalg.qr(np.random.default_rng(0).normal(size=(4, 4)))[0]
    p = Bingham(z=torch.tensor(Z[0]), M=torch.tensor(frame))
    assert torch.allclose(p.mode.abs(), torch.tensor(np.abs(frame[:, -1])))
    z = torch.tensor(Z[0], requires_grad=True)
    (g,) = torch.autograd.grad(Bingham(z=z, M=torch.tensor(frame)).log_normalizer, z)
    np.testing.assert_allclose(g, bingham.moments(Z[0]), atol=1e-12)


def test_samples_have_the_moments_of_the_distribution():
    torch.manual_seed(1)
    n = 40_000
    p, _ = both()
    x = p.sample((n,))
    moment = torch.einsum("n...i,n...j->...ij", x, x) / n
    # Entries of xxᵀ have standard deviations of at most ½.
    assert float((moment - p.second_moment).abs().max()) < 5 * 0.5 / math.sqrt(n)
    assert float((moment - p.second_moment.roll(1, 0)).abs().max()) > 5 * 0.5 / math.sqrt(n)
    ours = p.log_prob(x)
    error = ours.std(0) / math.sqrt(n)
    assert bool(((-ours.mean(0) - p.entropy()).abs() < 5 * error + 1e-9).all())


def test_samples_pass_the_constraint_and_others_do_not():
    p, _ = both()
    # Asked for: torch.compile turns the default off for the whole process.
    p = Bingham(p.concentration_matrix, validate_args=True)
    assert bool(Bingham.support.check(p.sample((10,))).all())
    with pytest.raises(ValueError, match="support"):
        p.log_prob(torch.full((4, 4), 0.6, dtype=torch.float64))
    with pytest.raises(ValueError, match="concentration_matrix"):
        Bingham(torch.arange(16.0).reshape(4, 4), validate_args=True)
    with pytest.raises(InvalidArgumentError, match="orthogonal"):
        Bingham(z=torch.zeros(4), M=2.0 * torch.eye(4))
    with pytest.raises(InvalidArgumentError, match="either"):
        Bingham()
    with pytest.raises(NotImplementedError, match="entropy"):
        p.rsample()


def test_the_mode_is_differentiable_beside_equal_concentrations():
    a = torch.diag(torch.tensor([-5.0, -5.0, -5.0, 0.0], dtype=torch.float64)).requires_grad_()
    assert torch.autograd.gradcheck(lambda a: Bingham(0.5 * (a + a.mT)).mode.square(), (a,))


def test_matrix_fisher_is_a_change_of_variables():
    torch.manual_seed(0)
    k = 3.0 * torch.randn(4, 3, 3, dtype=torch.float64)
    p = MatrixFisher(k)
    q = unit(4, 4)
    r = torch.tensor(Rotation.from_quat(q, scalar_first=True).as_matrix())
    torch.testing.assert_close(p.log_prob(r), p.bingham.log_prob(torch.tensor(q)) + math.log(2 * math.pi**2))
    torch.testing.assert_close(p.log_prob(r) - p.log_prob(r.roll(1, 0)), (k * (r - r.roll(1, 0))).sum((-2, -1)))
    # The mode is the nearest rotation, by singular values.
    u, _, vt = torch.linalg.svd(k)
    u[..., -1] *= torch.linalg.det(u @ vt)[..., None]
    torch.testing.assert_close(p.mode, u @ vt)
    # E[R] is the gradient of log c(K).
    k.requires_grad_()
    (g,) = torch.autograd.grad(MatrixFisher(k).log_prob(r).sum(), k)
    torch.testing.assert_close(r - g, p.mean)
    n = 20_000
    samples = p.sample((n,))
    assert float((samples.mean(0) - p.mean.detach()).abs().max()) < 5 / math.sqrt(n)
    # One dimension: for K = k I the angle has density (1 − cos θ) e^{2k cos θ}/π over its integral.
    angle = np.linspace(0.0, np.pi, 20001)
    density = (1 - np.cos(angle)) / np.pi
    log_c = np.log(np.trapezoid(density * np.exp(2.0 * (1 + 2 * np.cos(angle))), angle))
    eye = torch.eye(3, dtype=torch.float64)
    assert abs(float(MatrixFisher(2.0 * eye).log_prob(eye)) - (6.0 - log_c)) < 1e-7
    assert abs(float(MatrixFisher(0.0 * eye).entropy())) < 1e-12


def test_losses_reduce():
    a, x = torch.tensor(turned(Z)), torch.tensor(unit(4, 4))
    each = BinghamNLLLoss("none")(a, x)
    torch.testing.assert_close(each, -Bingham(a).log_prob(x))
    torch.testing.assert_close(BinghamNLLLoss()(a, x), each.mean())
    torch.testing.assert_close(BinghamNLLLoss("sum")(a, x), each.sum())
    with pytest.raises(InvalidArgumentError, match="reduction"):
        BinghamNLLLoss("average")
    one = BinghamMixtureNLLLoss("none")(torch.zeros(4, 1, dtype=a.dtype), a[:, None], x)
    torch.testing.assert_close(one, each)
    two = torch.stack([a, a.roll(1, 0)], 1)
    logits = torch.tensor([[0.3, -0.2]], dtype=a.dtype).expand(4, 2)
    expected = sum(w * Bingham(two[:, k]).log_prob(x).exp() for k, w in enumerate(torch.softmax(logits[0], -1)))
    torch.testing.assert_close(BinghamMixtureNLLLoss("none")(logits, two, x), -expected.log())


def test_parameterisations_reach_every_distribution():
    a = torch.tensor(turned(Z)[0])
    row, column = torch.triu_indices(4, 4)
    torch.testing.assert_close(from_numbers(a[row, column]), a)
    # −A = G Gᵀ with G (4, 3); an LQ decomposition makes G trapezoidal.
    values, vectors = torch.linalg.eigh(-a)
    g = vectors[:, 1:] * values[1:].sqrt()
    lower = torch.linalg.qr(g.T)[1].T
    row, column = torch.tril_indices(4, 3)
    torch.testing.assert_close(from_cholesky(lower[row, column]), a, atol=1e-9, rtol=1e-9)
    v, gaps = torch.randn(6, 8, dtype=torch.float64), torch.randn(6, 3, dtype=torch.float64)
    made = from_eigen(v, gaps)
    z = torch.linalg.eigvalsh(made)
    steps = torch.nn.functional.softplus(gaps)
    torch.testing.assert_close(
        z, torch.stack([-steps.sum(-1), -steps[:, :2].sum(-1), -steps[:, 0], 0 * steps[:, 0]], -1)
    )
    p, q = torch.nn.functional.normalize(v.reshape(6, 2, 4), dim=-1).unbind(1)
    axis = torch.tensor([[0.0, 0.0, 0.0, 1.0]], dtype=torch.float64).expand(6, 4)
    mode = bingham.rotations.compose(bingham.rotations.compose(p.numpy(), axis.numpy()), q.numpy())
    np.testing.assert_allclose(np.abs((Bingham(made, validate_args=False).mode.numpy() * mode).sum(-1)), 1.0)
    for wrong in (
        lambda: from_numbers(torch.zeros(9)),
        lambda: from_cholesky(torch.zeros(10)),
        lambda: from_eigen(v, v),
    ):
        with pytest.raises(InvalidArgumentError):
            wrong()


@pytest.mark.parametrize(("d", "side"), [(4, "right"), (4, "left"), (2, "right")])
def test_log_evidence_is_that_of_the_filter(d, side):
    identity = np.eye(d)[:, ::-1]
    prior, w, v = (
        bingham.Bingham([*z[: d - 1], 0.0], identity) for z in ([-5, -3, -1], [-300, -200, -250], [-60, -40, -50])
    )
    y = v.rvs(30, rng=0)
    y[7] = np.nan
    track = BinghamFilter(w, v, noise_side=side).run(prior, y)
    expected = np.where(np.isfinite(track.log_evidence), track.log_evidence, 0.0).sum()
    tensors = [torch.tensor(m, requires_grad=True) for m in (prior.matrix, w.matrix, v.matrix)]
    found = sequence_log_evidence(tensors[0], torch.tensor(y), *tensors[1:], noise_side=side)
    assert abs(float(found.detach()) - expected) < 1e-8
    gradients = torch.autograd.grad(found, tensors)
    e = 1e-4
    for k in range(3):
        direction = torch.diag(torch.arange(1.0, d + 1, dtype=torch.float64)) * 0.1

        def moved(s, k=k, direction=direction):
            inputs = [t.detach() + (s * direction if i == k else 0.0) for i, t in enumerate(tensors)]
            return float(sequence_log_evidence(inputs[0], torch.tensor(y), *inputs[1:], noise_side=side))

        numeric = (moved(e) - moved(-e)) / (2 * e)
        assert abs(numeric - float((gradients[k] * direction).sum())) < 1e-5 * (1 + abs(numeric))


def test_compose_is_that_of_the_distribution():
    (p, q), (r, s) = both(Z[0]), both(Z[1], seed=3)
    expected = q.compose(s)
    np.testing.assert_allclose(
        compose(p.concentration_matrix, r.concentration_matrix), expected.matrix, rtol=1e-7, atol=1e-7
    )
    std = torch.tensor(0.02, dtype=torch.float64)
    law = bingham.Bingham.from_matrix(isotropic_noise(std).numpy())
    np.testing.assert_allclose(law.covariance(frame="body"), 0.02**2 * np.eye(3), rtol=1e-3, atol=1e-12)
