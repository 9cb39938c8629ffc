"""Banks: which hypothesis speaks, what they say, and what they reject."""

import numpy as np
import pytest

from bingham import Bingham, BinghamFilter, Gate
from bingham.baselines import ScalarKalmanFilter
from bingham.baselines.scalar_kalman import AngleState
from bingham.errors import InvalidArgumentError
from bingham.filters.bank import BankState, FilterBank
from bingham.filters.second_order import SecondOrderBinghamFilter, SpinState, classify_spin
from bingham.rotations import compose, from_rotation_vector

NEAR = np.eye(4)[:, [1, 2, 3, 0]]
PROCESS = Bingham([-4e3, -4e3, -4e3, 0.0], NEAR)
NOISE = Bingham([-300.0, -200.0, -60.0, 0.0], NEAR)


def flight(rng, spin, length):
    x = compose(from_rotation_vector(rng.normal(size=3)), [0.5, 0.5, 0.5, 0.5])
    truth = []
    for _ in range(length):
        x = compose(spin, x)
        truth.append(x)
    return compose(NOISE.rvs(length, rng=rng), truth)


def test_a_bank_selects_the_hypothesis_that_made_the_data():
    rng = np.random.default_rng(6)
    types = from_rotation_vector([[0.8, 0, 0], [0, 1.2, 0], [0, 0, -1.6], [-0.8, 0, 0]])
    f = SecondOrderBinghamFilter(PROCESS, NOISE)
    bank = FilterBank([f])
    priors = [Bingham([-30.0] * 3 + [0.0], NEAR).rotate(left=s) for s in types]
    for kind, spin in enumerate(types):
        z = flight(rng, spin, 12)
        state = BankState([SpinState(Bingham.uniform(4), prior) for prior in priors])
        total = 0.0
        for row in z:
            state, info = bank.update(bank.predict(state), row)
            total += info.log_evidence
        assert state.best == kind
        assert classify_spin(state.selected.spin, types)[0] == kind
        assert state.probabilities.sum() == pytest.approx(1.0)
        # The bank is a mixture: its evidence is the mean of its members'.
        assert total == pytest.approx(np.log(np.mean(np.exp(state.totals - state.totals.max()))) + state.totals.max())


def test_the_banks_evidence_is_that_of_the_mixture_with_the_priors_given():
    a, b = Bingham([-30.0, 0.0], np.eye(2)), Bingham([-3.0, 0.0], np.eye(2)[::-1])
    f = BinghamFilter(Bingham([-200.0, 0.0], np.eye(2)[::-1]), Bingham([-40.0, 0.0], np.eye(2)[::-1]))
    z = [0.6, 0.8]
    alone = [f.update(distribution, z)[1].log_evidence for distribution in (a, b)]
    state, info = FilterBank([f]).update(BankState([a, b], np.log([0.2, 0.8])), z)
    assert info.log_evidence == pytest.approx(np.log(0.2 * np.exp(alone[0]) + 0.8 * np.exp(alone[1])), abs=1e-12)
    assert [m.log_evidence for m in info.members] == alone
    share = 0.2 * np.exp(alone[0] - info.log_evidence)
    np.testing.assert_allclose(state.probabilities, [share, 1.0 - share], rtol=1e-12)
    ruled_out, _ = FilterBank([f]).update(BankState([a, b], [0.0, -np.inf]), z)
    assert ruled_out.best == 0 and ruled_out.probabilities[1] == 0.0


def test_the_bank_says_what_its_members_say():
    identity = Bingham([-400.0] * 3 + [0.0], NEAR)
    gated = BinghamFilter(PROCESS, NOISE, gate=Gate(0.99))
    far = from_rotation_vector([2.0, 0.0, 0.0])
    _, info = FilterBank([gated]).update(BankState([identity, identity]), far)
    assert not info.accepted and info.reason.startswith("NIS")
    _, info = FilterBank([gated, BinghamFilter(PROCESS, NOISE)]).update(BankState([identity, identity]), far)
    assert info.accepted and info.reason == "" and [m.accepted for m in info.members] == [False, True]


def test_refusals():
    distribution = Bingham.uniform(4)
    f = BinghamFilter(PROCESS, NOISE)
    with pytest.raises(InvalidArgumentError, match="members"):
        FilterBank([])
    with pytest.raises(InvalidArgumentError, match="one for each filter"):
        FilterBank([f, f]).predict(BankState([distribution]))
    with pytest.raises(InvalidArgumentError, match="states: expected at least one"):
        BankState([])
    for wrong in (np.zeros(1), np.zeros(3), 0.0, np.zeros((2, 2))):
        with pytest.raises(InvalidArgumentError, match=r"log_evidence: expected shape \(2,\)"):
            BankState([distribution, distribution], wrong)
    for wrong in ([np.nan, 0.0], [0.0, np.inf], [-np.inf, -np.inf]):
        with pytest.raises(InvalidArgumentError, match="log_evidence: expected numbers"):
            BankState([distribution, distribution], wrong)
    kalman = ScalarKalmanFilter(0.1, 0.1)
    batch = AngleState(np.zeros(3), np.ones(3))
    with pytest.raises(InvalidArgumentError, match=r"state: expected single states.* one bank a recording"):
        FilterBank([kalman]).update(BankState([batch, batch]), [1.0, 0.0])
