import numpy as np
import pytest

from bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.filters.first_order import BinghamFilter
from bingham.filters.second_order import SecondOrderBinghamFilter, SpinState
from bingham.metrics import geodesic_error
from bingham.models.sensors import OrientationSensor
from bingham.rotations import compose, from_rotation_vector

NEAR = np.eye(4)[:, [1, 2, 3, 0]]
PROCESS = Bingham([-4e3, -4e3, -4e3, 0.0], NEAR)
NOISE = Bingham([-300.0, -200.0, -60.0, 0.0], NEAR)


def random_distribution(rng, scale=50.0):
    return Bingham(-scale * rng.random(4), np.linalg.qr(rng.normal(size=(4, 4)))[0])


def same_distribution(a, b, tolerance=1e-8):
    return np.abs(a.matrix - b.matrix).max() < tolerance * max(1.0, np.abs(b.matrix).max())


def flight(rng, spin, length, noise=NOISE, side="left"):
    x = compose(from_rotation_vector(rng.normal(size=3)), [0.5, 0.5, 0.5, 0.5])
    truth = []
    for _ in range(length):
        x = compose(spin, x)
        truth.append(x)
    v = noise.rvs(length, rng=rng)
    truth = np.array(truth)
    return truth, compose(v, truth) if side == "left" else compose(truth, v)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_step_is_the_papers_formula(side):
    # §4, with the distribution's own operations: x' from B_v ∘ B_x; v' from f_w ∘ u ∘ (B_v · (f_{y|x} ∘ B_x⁻¹)).
    rng = np.random.default_rng(0)
    x, v = random_distribution(rng), random_distribution(rng)
    f = SecondOrderBinghamFilter(PROCESS, NOISE, noise_side=side)
    u, y = from_rotation_vector([0.3, -0.1, 0.2]), from_rotation_vector([1.0, 0.4, -2.0])
    predicted = f.predict(SpinState(x, v), u)
    assert same_distribution(predicted.orientation, v.compose(x))
    assert same_distribution(predicted.spin, PROCESS.compose(v.rotate(left=u)))
    state, info = f.update(predicted, y)
    likelihood = Bingham.from_matrix(OrientationSensor(NOISE, left=side == "left").likelihood(y).matrix)
    assert same_distribution(state.orientation, predicted.orientation.multiply(likelihood))
    found = v.multiply(likelihood.compose(x.inverse()))
    assert same_distribution(state.spin, PROCESS.compose(found.rotate(left=u)))
    # Negative control: the spin after u and w, conditioned, is another one.
    assert not same_distribution(state.spin, predicted.spin.multiply(likelihood.compose(x.inverse())), 1e-3)
    _, plain = BinghamFilter(PROCESS, NOISE, noise_side=side).update(predicted.orientation, y)
    assert info.log_evidence == pytest.approx(plain.log_evidence, abs=1e-9)


def test_the_spins_likelihood_is_the_true_one_in_the_narrow_limit():
    # F(C(v)): the density of x' ⊗ x* where x' has the likelihood of y as its density.
    rng = np.random.default_rng(1)
    before, likelihood = Bingham([-4e3, -3e3, -2e3, 0.0], NEAR), Bingham([-9e3, -5e3, -4e3, 0.0], NEAR)
    matched = likelihood.compose(before.inverse())
    s = matched.rvs(200, rng=rng)
    assert np.abs(likelihood.composed_logpdf(before.inverse(), s) - matched.logpdf(s)).mean() < 2e-3


def test_spin_is_found_from_nothing():
    rng = np.random.default_rng(2)
    spin = from_rotation_vector([0.2, -0.9, 0.6])
    truth, z = flight(rng, spin, 60)
    f = SecondOrderBinghamFilter(PROCESS, NOISE)
    state = SpinState(Bingham.uniform(4), Bingham([-1.0, -1.0, -1.0, 0.0], NEAR))
    for row in z:
        state, _ = f.update(f.predict(state), row)
    assert 2.0 * geodesic_error(state.spin.mode, spin) < 0.06
    assert 2.0 * geodesic_error(state.mode, truth[-1]) < 0.2


def test_known_accelerations_are_followed():
    rng = np.random.default_rng(3)
    push = from_rotation_vector([0.0, 0.0, 0.02])
    spin, x = from_rotation_vector([0.3, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0])
    f = SecondOrderBinghamFilter(Bingham([-1e5] * 3 + [0.0], NEAR), NOISE)
    states = {name: SpinState(Bingham.uniform(4), Bingham([-3.0] * 3 + [0.0], NEAR)) for name in ("with", "without")}
    for _ in range(60):
        x = compose(spin, x)
        spin = compose(push, spin)
        z = compose(NOISE.rvs(rng=rng), x)
        states["with"], _ = f.update(f.predict(states["with"], push), z)
        states["without"], _ = f.update(f.predict(states["without"]), z)
    error = {name: 2.0 * geodesic_error(state.spin.mode, spin) for name, state in states.items()}
    assert error["with"] < 0.04
    assert error["without"] > 2.0 * error["with"]


def test_a_missing_observation_only_predicts():
    f = SecondOrderBinghamFilter(PROCESS, NOISE)
    state = f.predict(SpinState(random_distribution(np.random.default_rng(4)), Bingham([-3.0] * 3 + [0.0], NEAR)))
    after, info = f.update(state, np.full(4, np.nan))
    assert after is state
    assert info.log_evidence == 0.0 and not info.accepted


def test_the_likelier_interpretation_is_used():
    rng = np.random.default_rng(5)
    half_turn = np.array([0.0, 0.0, 0.0, 1.0])
    spin = from_rotation_vector([0.7, 0.1, 0.0])
    truth, z = flight(rng, spin, 30, side="right")
    f = SecondOrderBinghamFilter(PROCESS, NOISE, noise_side="right")
    prior = SpinState(Bingham([-900.0] * 3 + [0.0], NEAR).rotate(left=truth[0]), Bingham([-3.0] * 3 + [0.0], NEAR))
    clear = ambiguous = prior
    for n, row in enumerate(z):
        clear, _ = f.update(f.predict(clear), row)
        both = np.stack([row, compose(row, half_turn)])[:: 1 if n % 2 else -1]
        ambiguous, _ = f.update(f.predict(ambiguous), both)
    assert 2.0 * geodesic_error(clear.mode, ambiguous.mode) < 1e-9
    # Negative control: always taking the wrong one loses the ball.
    wrong = prior
    for row in z:
        wrong, _ = f.update(f.predict(wrong), compose(row, half_turn))
    assert 2.0 * geodesic_error(wrong.mode, truth[-1]) > 1.0


def test_refusals():
    with pytest.raises(InvalidArgumentError, match="noise_side"):
        SecondOrderBinghamFilter(PROCESS, NOISE, noise_side="below")
    with pytest.raises(InvalidArgumentError, match="spin"):
        SpinState(Bingham.uniform(4), Bingham.uniform(3))
    with pytest.raises(InvalidArgumentError, match="shape"):
        f = SecondOrderBinghamFilter(PROCESS, NOISE)
        f.update(SpinState(Bingham.uniform(4), Bingham.uniform(4)), [1.0, 0.0])
    with pytest.raises(InvalidArgumentError, match="process_noise: expected a single distribution of dimension 4"):
        SecondOrderBinghamFilter(Bingham.uniform(2), Bingham.uniform(2))
    with pytest.raises(InvalidArgumentError, match="measurement_noise: expected a single distribution of dimension 4"):
        SecondOrderBinghamFilter(PROCESS, NOISE.rotate(left=np.eye(4)))
