"""The array version of the normaliser: oracle of the compiled one, and differentiable where the library is."""

import numpy as np
import pytest

from bingham import log_normalizer, moments
from bingham.kernels.contour import log_normalizer_array


@pytest.mark.parametrize("d", [2, 3, 4, 5, 6, 9, 15, 30, 50])
def test_compiled_rule_agrees_with_the_contour(d):
    z = -(10.0 ** np.random.default_rng(d).uniform(-4, 9, (100, d)))
    z[:10] = z[:10, :1]
    np.testing.assert_allclose(log_normalizer(z), log_normalizer_array(z), rtol=1e-13, atol=1e-11 if d > 6 else 2e-12)


def test_torch_tensors_are_differentiated():
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    z = np.array([[-900.0, -500.0, -3.0, 0.0], [0.0, 0.0, 0.0, 0.0], [-1.0, -2.0, -3.0, -4.0]])
    t = torch.tensor(z, dtype=torch.float64, requires_grad=True)
    value = log_normalizer(t)
    np.testing.assert_allclose(value.detach().numpy(), log_normalizer(z), atol=2e-12)
    (gradient,) = torch.autograd.grad(value.sum(), t, create_graph=True)
    np.testing.assert_allclose(gradient.detach().numpy(), moments(z), rtol=1e-9, atol=1e-12)
    assert torch.autograd.gradgradcheck(lambda x: log_normalizer(x), (t[2:].detach().requires_grad_(),), atol=1e-6)
