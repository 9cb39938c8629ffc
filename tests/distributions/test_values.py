"""Distributions as values: equality, hash, repr, exactly sorted parameters, angles of rotations."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bingham
from bingham import Bingham, InvalidArgumentError


def random(d, seed, low=-3.0, high=8.0):
    rng = np.random.default_rng([d, seed])
    return Bingham(-(10.0 ** rng.uniform(low, high, d)), np.linalg.qr(rng.normal(size=(d, d)))[0])


@pytest.mark.parametrize("d", [2, 3, 4, 7])
def test_equal_values_are_equal_and_hash_alike(d):
    p = random(d, 0)
    for same in (Bingham(p.z, p.M), pickle.loads(pickle.dumps(p)), Bingham.from_spectrum(p.z.copy(), -p.M)):
        assert p == same
        assert hash(p) == hash(same)
    for other in (random(d, 1), Bingham(2.0 * p.z, p.M), "p", p.z):
        assert p != other
    assert Bingham.uniform(d) == Bingham.from_spectrum(np.zeros(d), p.M.copy())
    assert len({p, Bingham(p.z, p.M), Bingham.uniform(d)}) == 2


def test_repr_is_short():
    assert repr(Bingham([-3.0, -2.0, -1.0, 0.0], np.eye(4))) == "Bingham(z=[-3. -2. -1.  0.], mode=[0. 0. 0. 1.])"
    assert repr(Bingham(np.zeros((5, 3)), np.eye(3))) == "<Bingham: a batch (5,) of distributions, d = 3>"


def test_the_angle_of_a_rotation_is_twice_that_on_the_sphere():
    p = random(4, 2, 1.0, 3.0)
    x = p.rvs(40_000, rng=3)
    angle = 2.0 * np.arccos(np.abs(x @ p.mode))
    assert abs(np.mean(angle <= p.credible_rotation_angle(0.7)) - 0.7) < 4 * np.sqrt(0.21 / 40_000)
    assert abs(np.mean(angle <= p.credible_angle(0.7)) - 0.7) > 0.1
    with pytest.raises(InvalidArgumentError):
        Bingham.uniform(3).credible_rotation_angle(0.5)


@pytest.mark.parametrize("d", [2, 3, 4, 5])
def test_concentrations_beyond_the_largest_are_named(d):
    w = np.full(d, 1.0 / (d - 1))
    w[0] = 1e-30
    assert np.isfinite(bingham.log_normalizer(bingham.concentrations(w / w.sum())))
    w[0] = 1e-31
    with pytest.raises(InvalidArgumentError, match="at least"):
        bingham.concentrations(w)


@settings(max_examples=150, deadline=None)
@given(
    st.integers(2, 5),
    st.lists(st.floats(-12.0, 12.0), min_size=5, max_size=5),
    st.integers(0, 2**31),
    st.sampled_from([0.0, 1e-15, 1e-9, 1.0]),
)
def test_every_way_in_gives_sorted_concentrations(d, exponents, seed, tilt):
    """Over 1e-12 … 1e12 and frames near the identity, the eigenvalues' ties included."""
    rng = np.random.default_rng(seed)
    z = -(10.0 ** np.array(exponents[:d]))
    z[rng.integers(d)] = z[0]
    frame = np.linalg.qr(np.eye(d) + tilt * rng.normal(size=(d, d)))[0]
    p = Bingham(z, frame)
    made = [p, Bingham.from_matrix(p.matrix), p.multiply(p), Bingham.from_spectrum(p.z.copy(), p.M.copy())]
    if p.axis_moments[0] > 1e-14:
        made.append(Bingham.from_moment(p.moment()))
    if d in (2, 4):
        made += [p.compose(p), p.compose(Bingham.uniform(d)), Bingham.uniform(d).compose(p), p.inverse()]
    for q in made:
        assert np.all(np.isfinite(q.z))
        assert np.all(np.diff(q.z) >= 0.0)
        assert q.z[-1] == 0.0
        np.testing.assert_allclose(q.M.T @ q.M, np.eye(d), rtol=0, atol=1e-12)
        assert np.all(q.axis_moments > 0.0)
        assert abs(q.axis_moments.sum() - 1.0) < 1e-12
        assert q.kl_divergence(p) >= 0.0
        assert np.isfinite(q.log_normalizer)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(-12.0, 12.0), min_size=4, max_size=4), st.integers(0, 2**31))
def test_a_step_never_says_a_negative_nis(exponents, seed):
    rng = np.random.default_rng(seed)
    state, noise = (random(4, rng.integers(2**31), -12.0, 12.0) for _ in "12")
    f = bingham.BinghamFilter(Bingham(-(10.0 ** np.array(exponents)), np.eye(4)), noise)
    predicted = f.predict(state)
    posterior, info = f.update(predicted, predicted.mode if seed % 2 else noise.mode)
    assert info.nis >= 0.0
    assert np.isfinite(info.log_evidence)
    assert posterior.z[-1] == 0.0
    assert np.all(np.diff(posterior.z) >= 0.0)
