"""The first-order filter against a textbook implementation, its own distributions and its compiled loops."""

import numpy as np
import pytest

from bingham import (
    Bingham,
    BinghamFilter,
    Diffusion,
    Gate,
    Gyroscope,
    HeadingSensor,
    InvalidArgumentError,
    VectorSensor,
)
from bingham.models import ControlledRotation
from bingham.rotations import compose, conjugate, from_rotation_vector, to_rotation_vector

IDENTITY = {2: np.eye(2)[:, ::-1], 4: np.eye(4)[:, ::-1]}
# Kurz et al. 2014, eqs. 54–65.
NOISE = {
    2: (Bingham([-200.0, 0.0], IDENTITY[2]), Bingham([-2.0, 0.0], IDENTITY[2])),
    4: (Bingham([-200.0, -200.0, -2.0, 0.0], IDENTITY[4]), Bingham([-500.0] * 3 + [0.0], IDENTITY[4])),
}
PRIOR = {2: Bingham([-1.0, 0.0], np.eye(2)), 4: Bingham([-1.0, -1.0, -1.0, 0.0], np.eye(4))}
BOTH = pytest.mark.parametrize("d", [2, 4])
SIDES = pytest.mark.parametrize("side", ["right", "left"])


def simulate(d, steps, side="right", seed=0):
    w, v = NOISE[d]
    noise, error = w.rvs(steps, rng=seed), v.rvs(steps, rng=seed + 1)
    x = np.eye(d)[1]
    truth, measured = np.empty((steps, d)), np.empty((steps, d))
    for t in range(steps):
        x = compose(noise[t], x) if side == "left" else compose(x, noise[t])
        truth[t], measured[t] = x, compose(error[t], x) if side == "left" else compose(x, error[t])
    return truth, measured


def textbook_step(distribution, w, v, z, side):
    """Algorithms 1 and 2 of Kurz et al. 2014, element by element with dense matrices."""
    d = distribution.dim
    basis = np.eye(d)
    product = np.array([[compose(basis[i], basis[j]) for j in range(d)] for i in range(d)])
    a, b = distribution.moment(), w.moment()
    spec = "ik,jl,jim,lkn->mn" if side == "left" else "ik,jl,ijm,kln->mn"
    predicted = Bingham.from_moment(np.einsum(spec, a, b, product, product))
    axes = compose(conjugate(v.M.T), z) if side == "left" else compose(z, conjugate(v.M.T))
    likelihood = (axes.T * v.z) @ axes
    total = predicted.matrix + likelihood
    posterior = Bingham.from_matrix(total)
    top = np.linalg.eigvalsh(total)[-1]
    return posterior, posterior.log_normalizer + top - predicted.log_normalizer - v.log_normalizer


@BOTH
@SIDES
def test_compiled_run_object_steps_and_textbook_agree(d, side):
    w, v = NOISE[d]
    _, measured = simulate(d, 40, side)
    f = BinghamFilter(w, v, noise_side=side)
    track = f.run(PRIOR[d], measured)
    state = book = PRIOR[d]
    for t, z in enumerate(measured):
        state, info = f.update(f.predict(state), z)
        book, evidence = textbook_step(book, w, v, z, side)
        np.testing.assert_allclose(state.matrix, book.matrix, atol=1e-7)
        np.testing.assert_allclose(track.matrices[t], book.matrix, atol=1e-7)
        assert info.log_evidence == pytest.approx(evidence, abs=1e-9)
        assert track.log_evidence[t] == pytest.approx(evidence, abs=1e-9)
        assert info.accepted


def test_anisotropic_noise_with_turned_mode_on_both_sides():
    """Nothing may depend on the noise's mode being the identity or its axes being the coordinate axes."""
    frame = np.linalg.qr(np.random.default_rng(5).normal(size=(4, 4)))[0]
    w, v = Bingham([-90.0, -30.0, -7.0, 0.0], frame), Bingham([-60.0, -20.0, -9.0, 0.0], frame[:, ::-1])
    z = simulate(4, 5)[1]
    for side in ("right", "left"):
        f = BinghamFilter(w, v, noise_side=side)
        track = f.run(PRIOR[4], z)
        book = PRIOR[4]
        for t in range(5):
            book, _ = textbook_step(book, w, v, z[t], side)
            np.testing.assert_allclose(track.matrices[t], book.matrix, atol=1e-8)


@BOTH
def test_split_run_is_bit_identical(d):
    f = BinghamFilter(*NOISE[d])
    _, measured = simulate(d, 300)
    whole = f.run(PRIOR[d], measured)
    first = f.run(PRIOR[d], measured[:123])
    second = f.run(first.final, measured[123:])
    for name in ("concentrations", "frames", "log_evidence"):
        np.testing.assert_array_equal(getattr(second, name), getattr(whole, name)[123:])


@BOTH
def test_batch_agrees_with_single_runs(d):
    f = BinghamFilter(*NOISE[d])
    runs = np.stack([simulate(d, 60, seed=s)[1] for s in (0, 10, 20)])
    batch = f.run(PRIOR[d], runs)
    assert batch.modes.shape == (3, 60, d)
    for b in range(3):
        np.testing.assert_allclose(batch.matrices[b], f.run(PRIOR[d], runs[b]).matrices, rtol=1e-9, atol=1e-9)
    last = f.run(PRIOR[d], runs, keep="last")
    np.testing.assert_array_equal(last.concentrations[:, 0], batch.concentrations[:, -1])


@BOTH
def test_evidence_integrates_to_one_over_measurements(d):
    """Mean of the predictive density over uniform measurements times the area: 1, a 5 % error would be seen."""
    f = BinghamFilter(NOISE[d][0], Bingham([-2.0] * (d - 1) + [0.0], IDENTITY[d]))
    state = f.predict(PRIOR[d])
    z = np.random.default_rng(3).normal(size=(4000, d))
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    area = {2: 2 * np.pi, 4: 2 * np.pi**2}[d]
    density = area * np.exp([f.update(state, row)[1].log_evidence for row in z])
    error = density.std() / np.sqrt(len(z))
    assert abs(density.mean() - 1.0) < 4 * error < 0.05


@BOTH
def test_tracks_better_than_the_measurements(d):
    truth, measured = simulate(d, 2000)
    track = BinghamFilter(*NOISE[d]).run(PRIOR[d], measured)

    def error(x):
        return np.sqrt(np.mean(np.arccos(np.minimum(1.0, np.abs(np.sum(x * truth, axis=1)))) ** 2))

    assert error(track.modes) < (0.55 if d == 2 else 0.95) * error(measured)


@BOTH
def test_missing_rows_are_predicted_only(d):
    f = BinghamFilter(*NOISE[d])
    measured = simulate(d, 20)[1]
    measured[7] = np.nan
    track = f.run(PRIOR[d], measured)
    expected = f.predict(track.distributions[6])
    np.testing.assert_allclose(track.matrices[7], expected.matrix, rtol=1e-9, atol=1e-9)
    assert track.log_evidence[7] == 0.0
    assert track.decision[7] == -1
    assert track.reasons()[7] == "missing"


@BOTH
def test_gate_rejects_outliers_and_says_why(d):
    w = Bingham([-5000.0] * (d - 1) + [0.0], IDENTITY[d])
    v = Bingham([-500.0] * (d - 1) + [0.0], IDENTITY[d])
    f = BinghamFilter(w, v, gate=Gate(0.999))
    measured = np.tile(np.eye(d)[0], (30, 1))
    measured[20] = np.eye(d)[1]
    track = f.run(Bingham.uniform(d), measured)
    assert list(np.flatnonzero(~track.accepted)) == [20]
    assert "above" in track.reasons()[20]
    state, info = f.update(f.predict(track.distributions[19]), measured[20])
    assert not info.accepted
    assert info.nis == pytest.approx(track.nis[20], rel=1e-9)
    assert info.nis > info.threshold
    assert f"{info.threshold:.4g}" in info.reason
    np.testing.assert_array_equal(state.mode, f.predict(track.distributions[19]).mode)


def test_gate_lets_regular_measurements_through_at_its_probability():
    """Narrow distributions: the NIS is χ² with 3 degrees of freedom."""
    w, v = Bingham([-4e4] * 3 + [0.0], IDENTITY[4]), Bingham([-3e4] * 3 + [0.0], IDENTITY[4])
    n = 4000
    x, error = np.array([1.0, 0, 0, 0]), v.rvs(n, rng=1)
    noise = w.rvs(n, rng=2)
    z = np.empty((n, 4))
    for t in range(n):
        x = compose(x, noise[t])
        z[t] = compose(x, error[t])
    track = BinghamFilter(w, v, gate=Gate(0.9)).run(Bingham.uniform(4), z)
    free = BinghamFilter(w, v).run(Bingham.uniform(4), z)
    share = np.mean(free.nis <= track.threshold)
    assert share == pytest.approx(0.9, abs=4 * np.sqrt(0.09 / n))


@BOTH
def test_irregular_times_diffuse_exactly_and_gaps_widen(d):
    """One step over 3 s equals three of 1 s; with no measurement the distribution tends to the uniform one."""
    f = BinghamFilter(Diffusion(0.3, dim=d), NOISE[d][1])
    z = np.full((4, d), np.nan)
    z[0] = np.eye(d)[0]
    one = f.run(Bingham.uniform(d), z[[0, 1]], times=[0.0, 3.0])
    three = f.run(Bingham.uniform(d), z, times=[0.0, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(one.final.moment(), three.final.moment(), rtol=1e-11)
    later = f.run(Bingham.uniform(d), z[[0, 1]], times=[0.0, 1e4])
    np.testing.assert_allclose(later.final.z, 0.0, atol=1e-10)
    entropies = three.distributions.entropy()
    assert np.all(np.diff(entropies) > 0)


def test_diffusion_is_brownian_motion_on_rotations():
    """The moment after t seconds is that of simulated small random rotations."""
    rng = np.random.default_rng(0)
    n, sigma, t, steps = 40_000, 0.8, 1.0, 60
    x = np.tile([1.0, 0, 0, 0], (n, 1))
    for _ in range(steps):
        x = compose(x, from_rotation_vector(rng.normal(scale=sigma * np.sqrt(t / steps), size=(n, 3))))
    needle = Bingham([-1e12] * 3 + [0.0], IDENTITY[4])
    predicted = Diffusion(sigma).propagate(needle, None, t)
    sample = np.einsum("ni,nj->ij", x, x) / n
    np.testing.assert_allclose(sample, predicted.moment(), atol=4 * 0.4 / np.sqrt(n) + 2e-3)
    assert abs(sample[0, 0] - Diffusion(0.7).propagate(needle, None, t).moment()[0, 0]) > 0.03  # the control


def test_gyroscope_follows_a_known_rate_over_irregular_steps():
    rng = np.random.default_rng(1)
    steps = rng.uniform(0.001, 0.3, 200)
    times = np.cumsum(steps)
    rate = rng.normal(size=(200, 3))
    q = np.array([1.0, 0, 0, 0])
    for dt, r in zip(steps[1:], rate[1:], strict=True):
        q = compose(q, from_rotation_vector(r * dt))
    z = np.full((200, 4), np.nan)
    z[0] = [1.0, 0, 0, 0]
    track = BinghamFilter(Gyroscope(1e-4), NOISE[4][1]).run(Bingham.uniform(4), z, controls=rate, times=times)
    assert np.linalg.norm(to_rotation_vector(compose(conjugate(q), track.modes[-1]))) < 1e-9


def test_known_rotation_turns_the_distribution():
    w, v = NOISE[4]
    u = from_rotation_vector([0.3, -0.2, 0.5])
    z = simulate(4, 6)[1]
    f = BinghamFilter(ControlledRotation(w), v)
    track = f.run(PRIOR[4], z, controls=np.tile(u, (6, 1)))
    state = PRIOR[4]
    for row in z:
        state, _ = f.update(f.predict(state, u), row)
    np.testing.assert_allclose(track.final.matrix, state.matrix, atol=1e-8)


def test_vectors_give_the_orientation():
    """Two known directions determine a rotation; one leaves a girdle about it."""
    q = from_rotation_vector([0.4, -0.7, 0.2])
    from bingham.rotations import rotate

    up, north = np.array([0.0, 0, 1]), np.array([0.0, 1, 0])
    motion = Diffusion(0.0)
    state, _ = BinghamFilter(motion, VectorSensor(up, 1e4)).update(Bingham.uniform(4), rotate(conjugate(q), up))
    np.testing.assert_allclose(state.z, [-2e4, -2e4, 0.0, 0.0], atol=1e-6)
    state, info = BinghamFilter(motion, VectorSensor(north, 1e4)).update(state, rotate(conjugate(q), north))
    assert abs(state.mode @ q) == pytest.approx(1.0, abs=1e-12)
    assert np.isfinite(info.log_evidence)


def test_heading_leaves_the_inclination_alone():
    q = from_rotation_vector([0.3, 0.2, -0.4])
    prior = Bingham.from_covariance(q, np.diag([1.5e-4, 1.5e-4, 0.05]), frame="world")
    from bingham.rotations import rotate

    field = rotate(conjugate(compose(from_rotation_vector([0, 0, 0.3]), q)), [0.0, 20.0, -40.0])
    state, _ = BinghamFilter(Diffusion(0.0), HeadingSensor(400.0)).update(prior, field)
    change = to_rotation_vector(compose(state.mode, conjugate(q)))
    assert change[2] == pytest.approx(0.3 * 0.05 / (0.05 + 1 / 400), rel=0.02)
    np.testing.assert_allclose(change[:2], 0.0, atol=1e-3)
    np.testing.assert_allclose(
        state.covariance(frame="world")[:2, :2], prior.covariance(frame="world")[:2, :2], rtol=0.05, atol=1e-6
    )


def test_long_runs_stay_orthonormal_and_sorted():
    """10 million steps in chunks of half a million, resumed each time."""
    f = BinghamFilter(*NOISE[4])
    z = simulate(4, 1000)[1]
    chunk = np.tile(z, (500, 1))
    state = PRIOR[4]
    for _ in range(20):
        track = f.run(state, chunk, keep="last")
        state = track.final
        assert np.isfinite(track.log_evidence).all()
        assert np.abs(state.M.T @ state.M - np.eye(4)).max() < 1e-14
        assert np.all(np.diff(state.z) >= 0)
        assert state.z[-1] == 0.0


@pytest.mark.parametrize(("call", "message"), [
    (lambda f: f.run(PRIOR[4], np.ones((3, 4))), "measurements: expected unit vectors"),
    (lambda f: f.run(PRIOR[4], np.ones((3, 3))), "measurements: expected shape"),
    (lambda f: f.run(PRIOR[2], np.eye(4)), "prior: expected a distribution of dimension 4"),
    (lambda f: f.run(PRIOR[4], np.eye(4), times=[0, 1, 1, 2]), "times: expected strictly increasing"),
    (lambda f: f.run(PRIOR[4], np.eye(4), times=[0, 1, 2]), "times: expected shape"),
    (lambda f: f.run(PRIOR[4], np.eye(4), times=[0, 1, 2, 9]), "regular times"),
    (lambda f: f.run(PRIOR[4], np.eye(4), keep="some"), "keep: expected 'all', 'modes' or 'last'"),
    (lambda f: f.update(PRIOR[2], [1.0, 0, 0, 0]), "state: expected a single distribution of dimension 4"),
    (lambda f: f.run(PRIOR[4], [[1.0, 0, 0, 0], [1.0, 0, 0, np.nan]]), "measurements: .* all NaN .* nan\\] at row 1"),
    (lambda f: f.update(PRIOR[4], [1.0, np.nan, 0, 0]), "z: expected complete rows, or all NaN where missing"),
    (lambda f: BinghamFilter(*NOISE[4], noise_side="front"), "noise_side"),
    (lambda f: BinghamFilter(NOISE[4][0], NOISE[2][1]), "measurement_noise: expected dimension 4"),
    (lambda f: Gate(1.5), "probability"),
    (lambda f: Gyroscope(0.1).propagate(PRIOR[4], [1.0, 2.0], 0.1), "control: expected a finite angular rate"),
    (lambda f: Diffusion(0.1).propagate(PRIOR[4], None, -1.0), "dt: expected a time step"),
    (lambda f: Diffusion(-1.0), "random_walk"),
    (lambda f: VectorSensor([0.0, 0, 0], 1.0), "reference"),
    (lambda f: VectorSensor("up", 1.0), "reference: expected an array of numbers, got 'up'"),
    (lambda f: VectorSensor([0.0, 0, 1], "x"), "concentration: expected a finite number > 0, got 'x'"),
    (lambda f: Gyroscope("x"), "noise_density: expected a finite number >= 0, or three .*, rad/s/√Hz, got 'x'"),
    (lambda f: Diffusion(0.1).propagate(PRIOR[4], None, "x"), "dt: expected a time step"),
    (lambda f: f.run(PRIOR[4], "abc"), "measurements: expected an array of numbers, got 'abc'"),
])  # fmt: skip
def test_bad_input_is_named(call, message):
    with pytest.raises(InvalidArgumentError, match=message):
        call(BinghamFilter(*NOISE[4]))


def test_scipy_rotations_are_taken():
    from scipy.spatial.transform import Rotation

    z = simulate(4, 20)[1]
    f = BinghamFilter(*NOISE[4])
    a, b = f.run(PRIOR[4], z), f.run(PRIOR[4], Rotation.from_quat(z, scalar_first=True))
    np.testing.assert_allclose(a.matrices, b.matrices, rtol=1e-9, atol=1e-9)


def test_a_rate_that_is_not_finite_is_named_by_its_row():
    rate = np.zeros((5, 3))
    rate[3, 1] = np.nan
    f = BinghamFilter(Gyroscope(0.1), NOISE[4][1])
    with pytest.raises(InvalidArgumentError, match="at row 3"):
        f.run(PRIOR[4], simulate(4, 5)[1], controls=rate, times=np.arange(5.0))


def test_prior_and_measurements_are_not_exchanged():
    f = BinghamFilter(Diffusion(0.1), Bingham.from_covariance([1.0, 0, 0, 0], 0.01 * np.eye(3), frame="body"))
    with pytest.raises(
        InvalidArgumentError,
        match=r"prior: expected a Bingham distribution, got an array of shape .*; the prior comes before",
    ):
        f.run(np.array([[1.0, 0, 0, 0]]), Bingham.uniform(4), times=[0.0])


def test_covariances_of_a_track_without_clear_modes_are_nan_or_rejected():
    track = BinghamFilter(*NOISE[4]).run(Bingham.uniform(4), [[np.nan] * 4, [1.0, 0, 0, 0]])
    assert np.isnan(track.covariance(frame="body")).all(axis=(1, 2)).tolist() == [True, False]
    with pytest.raises(InvalidArgumentError, match="distribution: expected one clear mode"):
        track.covariance(frame="body", undefined="raise")
