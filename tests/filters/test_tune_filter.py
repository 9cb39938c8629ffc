"""Noises of the first-order filter by maximum evidence, against profile likelihood, truth and PyTorch's gradient."""

import numpy as np
import pytest

from bingham import Bingham, BinghamFilter, Diffusion, Gate
from bingham.errors import ConvergenceError, InvalidArgumentError
from bingham.filters import tune_filter
from bingham.rotations import compose, from_rotation_vector

IDENTITY = np.eye(4)[:, ::-1]


def walk(count, walk_std, noise, seed):
    rng = np.random.default_rng(seed)
    q = [np.array([1.0, 0.0, 0.0, 0.0])]
    for step in rng.normal(size=(count - 1, 3)) * walk_std:
        q.append(compose(q[-1], from_rotation_vector(step)))
    return compose(np.array(q), noise.rvs(count, rng=rng))


@pytest.fixture(scope="module")
def case():
    noise = Bingham([-800.0, -400.0, -200.0, 0.0], IDENTITY)
    z = walk(1500, 0.05, noise, 1)
    start = BinghamFilter(Diffusion(0.5), Bingham([-8000.0, -4000.0, -2000.0, 0.0], IDENTITY), gate=Gate(0.99))
    return start, z, np.arange(1500.0)


def test_maximum_is_that_of_the_profile_likelihood_and_near_the_truth(case):
    start, z, times = case
    prior = Bingham.uniform(4)
    found = tune_filter(start, prior, z, times=times)
    assert found.log_evidence > found.start_log_evidence + 100.0
    assert found.filter.gate == start.gate

    def evidence(process, measurement):
        f = BinghamFilter(Diffusion(process), Bingham(start.measurement_noise.z / measurement**2, IDENTITY))
        return np.nansum(f.run(prior, z, times=times).log_evidence)

    best = (0.5 * found.process_scale, found.measurement_scale)
    # Profile likelihood: for a grid of process noises, the best measurement noise of a fine grid.
    factors = np.exp(np.linspace(-0.15, 0.15, 31))
    profile = [max(evidence(best[0] * p, best[1] * m) for m in factors[::3]) for p in factors]
    assert abs(int(np.argmax(profile)) - 15) <= 1
    assert found.log_evidence >= max(profile) - 1e-6
    # Where the profile has fallen by half is one standard error away.
    fallen = found.log_evidence - np.array(profile)
    curvature = np.polyfit(np.log(factors), fallen, 2)[0]
    assert abs(1.0 / np.sqrt(2.0 * curvature) / found.relative_error["process"] - 1.0) < 0.15
    assert abs(np.log(best[0] / 0.05)) < 4.0 * found.relative_error["process"]
    truth = np.sqrt(start.measurement_noise.z[0] / -800.0)
    assert abs(np.log(best[1] / truth)) < 4.0 * found.relative_error["measurement"]


def test_gradient_in_pytorch_is_that_of_the_compiled_run(case):
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    from bingham.torch import sequence_log_evidence

    z = case[1][:40]
    w, v = Bingham([-900.0, -700.0, -800.0, 0.0], IDENTITY), Bingham([-300.0, -150.0, -200.0, 0.0], IDENTITY)
    prior = Bingham([-3.0, -2.0, -1.0, 0.0], IDENTITY)

    def compiled(x):
        f = BinghamFilter(Bingham(w.z * np.exp(-2 * x[0]), w.M), Bingham(v.z * np.exp(-2 * x[1]), v.M))
        return np.nansum(f.run(prior, z).log_evidence)

    x = torch.zeros(2, dtype=torch.float64, requires_grad=True)
    scaled = [torch.tensor(p.matrix) * torch.exp(-2 * x[i]) for i, p in enumerate((w, v))]
    value = sequence_log_evidence(torch.tensor(prior.matrix), torch.tensor(z), *scaled)
    (gradient,) = torch.autograd.grad(value, x)
    e = 1e-4 * np.eye(2)
    numeric = [(compiled(d) - compiled(-d)) / 2e-4 for d in e]
    np.testing.assert_allclose(float(value.detach()), compiled(np.zeros(2)), rtol=1e-10)
    np.testing.assert_allclose(gradient, numeric, rtol=1e-6)


def test_what_a_sequence_does_not_tell_is_said():
    # A body at rest without noise: the evidence grows with every narrower noise.
    z = np.tile([1.0, 0.0, 0.0, 0.0], (50, 1))
    start = BinghamFilter(Diffusion(0.1), Bingham([-50.0, -50.0, -50.0, 0.0], IDENTITY))
    with pytest.raises(ConvergenceError, match=r"without end|did not settle"):
        tune_filter(start, Bingham.uniform(4), z, times=np.arange(50.0))


def test_wrong_arguments_are_named():
    with pytest.raises(InvalidArgumentError, match="filter"):
        tune_filter(3.0, Bingham.uniform(4), np.eye(4))
