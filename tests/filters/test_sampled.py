"""The sampled filter against conjugate updates, exact quadrature, other samplers; users' mistakes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham import Bingham, BinghamFilter, InvalidArgumentError
from bingham.filters.exact import exact_posterior
from bingham.filters.exact_vector import exact_vector_posterior
from bingham.filters.sampled import SampledFilter
from bingham.models.motion import ControlledRotation
from bingham.models.sensors import davenport_matrix
from bingham.rotations import compose, from_rotation_vector, rotate
from bingham.sampling import RandomSampling, RiemannianSampling, Unscented

IDENTITY_LAST = np.eye(4)[:, ::-1]
REFERENCE = np.array([0.0, 0.6, 0.8])


def frame(d, seed=1):
    return np.linalg.qr(np.random.default_rng(seed).normal(size=(d, d)))[0]


PRIOR = Bingham([-9.0, -5.0, -3.0, 0.0], frame(4))


def vector_log_likelihood(precision):
    """z = q ⊗ reference ⊗ q* + noise of the given precisions (3,); normalised in z."""
    constant = 0.5 * np.sum(np.log(np.asarray(precision) / (2.0 * np.pi)))

    def log_likelihood(z, q):
        return constant - 0.5 * (z - rotate(q, REFERENCE)) ** 2 @ precision

    return log_likelihood


def conjugate(prior, z, precision):
    """Exact posterior and log-evidence for isotropic noise: −½p|z − r|² = p zᵀr − ½p(|z|² + 1)."""
    a = prior.matrix + precision * davenport_matrix(z, REFERENCE)
    distribution = Bingham.from_matrix(a)
    top = np.linalg.eigvalsh(a)[-1]
    constant = 1.5 * np.log(precision / (2.0 * np.pi)) - 0.5 * precision * (z @ z + 1.0)
    return distribution, distribution.log_normalizer + top - prior.log_normalizer + constant


def measure(prior, precision, seed):
    rng = np.random.default_rng(seed)
    return rotate(prior.rvs(rng=rng), REFERENCE) + rng.normal(size=3) / np.sqrt(precision)


@pytest.mark.parametrize("precision", [4.0, 100.0, 1e4])
def test_exact_references_agree_with_the_conjugate_update(precision):
    z = measure(PRIOR, precision, 2)
    distribution, evidence = conjugate(PRIOR, z, precision)
    log_likelihood = vector_log_likelihood(np.full(3, precision))
    fast = exact_vector_posterior(
        PRIOR,
        REFERENCE,
        lambda r: 1.5 * np.log(precision / (2 * np.pi)) - 0.5 * precision * np.sum((z - r) ** 2, axis=1),
        z,
    )
    assert np.abs(fast.moment - distribution.moment()).max() < 1e-8
    assert fast.log_evidence == pytest.approx(evidence, abs=1e-7)
    if precision < 50.0:
        general = exact_posterior(PRIOR, lambda q: log_likelihood(z, q), tolerance=1e-5)
        assert np.abs(general.moment - distribution.moment()).max() < 1e-6
        assert general.log_evidence == pytest.approx(evidence, abs=1e-6)


@pytest.mark.parametrize("d", [2, 3])
def test_adaptive_quadrature_on_other_spheres(d):
    # exp(xᵀ L x) is conjugate in every dimension, to uniform and narrow priors.
    likelihood = np.diag(np.linspace(-300.0, 0.0, d))
    likelihood = frame(d, 5) @ likelihood @ frame(d, 5).T
    for prior in (Bingham.uniform(d), Bingham(np.linspace(-40.0, 0.0, d), frame(d))):
        exact = exact_posterior(prior, lambda x: np.einsum("ni,ij,nj->n", x, likelihood, x))
        distribution = Bingham.from_matrix(prior.matrix + likelihood)
        top = np.linalg.eigvalsh(prior.matrix + likelihood)[-1]
        assert np.abs(exact.moment - distribution.moment()).max() < 1e-9
        assert exact.log_evidence == pytest.approx(distribution.log_normalizer + top - prior.log_normalizer, abs=1e-8)


def test_both_exact_references_agree_for_anisotropic_noise():
    precision = np.array([20.0, 2.0, 5.0])
    z = measure(PRIOR, precision, 3)
    log_likelihood = vector_log_likelihood(precision)
    general = exact_posterior(PRIOR, lambda q: log_likelihood(z, q), tolerance=1e-5)
    constant = 0.5 * np.sum(np.log(precision / (2.0 * np.pi)))
    fast = exact_vector_posterior(PRIOR, REFERENCE, lambda r: constant - 0.5 * (z - r) ** 2 @ precision, z)
    assert np.abs(general.moment - fast.moment).max() < 1e-6
    assert general.log_evidence == pytest.approx(fast.log_evidence, abs=1e-6)


def moment_error(state, moment):
    return np.linalg.norm(state.moment() - moment)


@pytest.mark.parametrize("precision", [4.0, 100.0])
def test_updates_approach_the_exact_posterior(precision):
    log_likelihood = vector_log_likelihood(np.full(3, precision))
    errors, evidences = {}, {}
    samplers = {"ut": Unscented(), "rss 20": RiemannianSampling(20), "rss 300": RiemannianSampling(300)}
    for name, sampler in samplers.items():
        f = SampledFilter(log_likelihood=log_likelihood, sampler=sampler)
        cases = []
        for seed in range(10):
            z = measure(PRIOR, precision, seed)
            distribution, evidence = conjugate(PRIOR, z, precision)
            state, info = f.update(PRIOR, z)
            # A mean over n independent samples would have errors of about 1/√n.
            spread = np.sqrt(info.effective_sample_size)
            cases.append((moment_error(state, distribution.moment()), abs(info.log_evidence - evidence), 1.0 / spread))
        errors[name], evidences[name], expected = np.mean(cases, axis=0)
    assert errors["rss 300"] < errors["rss 20"] < errors["ut"]
    assert errors["rss 300"] < expected
    assert evidences["rss 300"] < min(0.5 * evidences["ut"], 2.0 * expected)


def test_progressive_update_succeeds_where_one_step_degenerates():
    precision = 1e4
    one = SampledFilter(log_likelihood=vector_log_likelihood(np.full(3, precision)))
    many = SampledFilter(log_likelihood=one.log_likelihood, progressive=True)
    errors = []
    for seed in range(8):
        z = measure(PRIOR, precision, seed)
        distribution, evidence = conjugate(PRIOR, z, precision)
        rough, rough_info = one.update(PRIOR, z)
        state, info = many.update(PRIOR, z)
        errors.append((moment_error(rough, distribution.moment()), moment_error(state, distribution.moment())))
        assert rough_info.fractions == (1.0,) and len(info.fractions) > 3
        assert sum(info.fractions) == pytest.approx(1.0, abs=1e-12)
        assert info.effective_sample_size >= 0.49 * 100 > rough_info.effective_sample_size
        assert info.log_evidence == pytest.approx(evidence, abs=1.0)
        assert not info.clamped
    errors = np.mean(errors, axis=0)
    assert errors[1] < 0.5 * errors[0]


def test_evidence_of_fractions_is_that_of_the_whole_for_a_flat_likelihood():
    f = SampledFilter(log_likelihood=lambda z, q: np.full(len(q), -3.5), progressive=True)
    state, info = f.update(PRIOR, None)
    assert info.log_evidence == pytest.approx(-3.5, abs=1e-12) and info.fractions == (1.0,)
    assert info.effective_sample_size == pytest.approx(100.0)
    assert np.abs(state.moment() - PRIOR.moment()).max() < 1e-13


@pytest.mark.parametrize("d", [2, 4])
@pytest.mark.parametrize("side", ["right", "left"])
def test_prediction_of_a_linear_motion_is_exact(d, side):
    # x ⊕ u preserves what second moments say, so sampling loses nothing.
    rng = np.random.default_rng(4)
    state = Bingham(-np.sort(rng.uniform(0, 30, d))[::-1], frame(d, 2))
    noise = Bingham(-np.sort(rng.uniform(5, 90, d))[::-1], frame(d, 3))
    u = rng.normal(size=d)
    u /= np.linalg.norm(u)
    exact = BinghamFilter(ControlledRotation(noise, left=side == "left"), noise).predict(state, u)

    def motion(x, control, dt):
        return compose(control, x) if side == "left" else compose(x, control)

    for sampler in (Unscented(), RiemannianSampling(40)):
        f = SampledFilter(motion=motion, process_noise=noise, noise_side=side, sampler=sampler)
        assert np.abs(f.predict(state, u).moment() - exact.moment()).max() < 1e-12
    if side == "right":
        plain = SampledFilter(process_noise=noise).predict(state, u)
        assert np.abs(plain.moment() - exact.moment()).max() < 1e-12


def test_nonlinear_prediction_matches_random_samples():
    def motion(q, control, dt):  # a rotation whose speed depends on where the body's z axis points
        rate = rotate(q, [0.0, 0.0, 1.0])[:, :1] * np.array([0.0, 0.0, 1.5]) + control
        return compose(q, from_rotation_vector(rate * dt))

    control = np.array([0.3, 0.0, 0.0])
    predicted = {
        m: SampledFilter(motion=motion, sampler=sampler).predict(PRIOR, control, 0.5).moment()
        for m, sampler in {
            "ut": Unscented(),
            "rss": RiemannianSampling(300),
            "many": RandomSampling(200_000, rng=1),
        }.items()
    }
    standard_error = 0.5 / np.sqrt(200_000)
    assert np.abs(predicted["rss"] - predicted["many"]).max() < 5 * standard_error
    assert np.abs(predicted["ut"] - predicted["many"]).max() > 5 * standard_error


def test_run_equals_single_steps_and_skips_missing_rows():
    precision = np.array([100.0, 10.0, 10.0])
    f = SampledFilter(
        motion=lambda q, c, dt: compose(q, from_rotation_vector(c * dt)),
        process_noise=Bingham([-50.0, -50.0, -50.0, 0.0], IDENTITY_LAST),
        log_likelihood=vector_log_likelihood(precision),
        sampler=RiemannianSampling(30),
    )
    times = np.array([0.0, 0.1, 0.25, 0.3])
    controls = np.tile([0.0, 0.5, 0.0], (4, 1))
    zs = np.array([measure(PRIOR, precision, s) for s in range(4)])
    zs[2] = np.nan
    track = f.run(PRIOR, zs, controls=controls, times=times, start_time=-0.1)
    state = PRIOR
    for t, dt in enumerate([0.1, 0.1, 0.15, 0.05]):
        state = f.predict(state, controls[t], float(np.diff([-0.1, *times])[t]))
        evidence = 0.0
        if t != 2:
            state, info = f.update(state, zs[t])
            evidence = info.log_evidence
        # Products of the samples go through BLAS, whose bits depend on where arrays lie.
        np.testing.assert_allclose(track.concentrations[t], state.z, rtol=1e-12)
        np.testing.assert_allclose(track.frames[t], state.M, rtol=0, atol=1e-13)
        assert track.log_evidence[t] == pytest.approx(evidence, rel=1e-12, abs=1e-13)
        assert dt == pytest.approx(float(np.diff([-0.1, *times])[t]))
    assert list(track.decision) == [1, 1, -1, 1]


def test_tracks_a_rotated_vector_ahead_of_the_unscented_filter():
    # The model of Li et al. 2019 at its lowest noise; 100 samples, fused progressively, against 7.
    process = Bingham([-10.0, -10.0, -10.0, 0.0], IDENTITY_LAST)
    u = from_rotation_vector([0.0, 0.2, 0.0])
    precision = 1e4 / np.array([1.0, 10.0, 10.0])
    rng = np.random.default_rng(6)
    errors = {}
    q, truth = np.array([1.0, 0.0, 0.0, 0.0]), []
    for _ in range(40):
        q = compose(compose(q, u), process.rvs(rng=rng))
        truth.append(rotate(q, REFERENCE))
    zs = np.array(truth) + rng.normal(size=(40, 3)) / np.sqrt(precision)
    for name, sampler in {"ut": Unscented(), "rss": RiemannianSampling(100)}.items():
        f = SampledFilter(
            process_noise=process,
            log_likelihood=vector_log_likelihood(precision),
            sampler=sampler,
            progressive=name == "rss",
        )
        track = f.run(process, zs, controls=np.tile(u, (40, 1)))
        cosine = np.sum(rotate(track.modes, REFERENCE) * np.array(truth), axis=1)
        errors[name] = np.sqrt(np.mean(np.arccos(np.clip(cosine, -1, 1)) ** 2))
    assert errors["rss"] < 0.06 < 0.2 < errors["ut"]


def bad_shape(z, q):
    return np.zeros(len(q) + 1)


def has_nan(z, q):
    return np.where(np.arange(len(q)) == 3, np.nan, 0.0)


def infinite(z, q):
    return np.full(len(q), np.inf)


def impossible(z, q):
    return np.full(len(q), -np.inf)


@pytest.mark.parametrize("function", [bad_shape, has_nan, infinite, impossible])
@pytest.mark.parametrize("progressive", [True, False])
def test_bad_likelihoods_are_named_with_the_step_and_leave_the_state(function, progressive):
    state = Bingham([-9.0, -5.0, -3.0, 0.0], frame(4))
    before = (state.z.copy(), state.M.copy())
    f = SampledFilter(log_likelihood=function, progressive=progressive, sampler=RiemannianSampling(20))
    with pytest.raises(InvalidArgumentError, match=f"log_likelihood '{function.__name__}' in update"):
        f.update(state, [0.0])
    with pytest.raises(InvalidArgumentError, match=f"{function.__name__}' in update(?s:.)*in row 1"):
        f.run(state, [[np.nan], [0.0]])
    assert np.array_equal(state.z, before[0]) and np.array_equal(state.M, before[1])


@pytest.mark.parametrize(
    ("motion", "said"),
    [
        (lambda x, c, dt: x[:3], "shape"),
        (lambda x, c, dt: x * np.nan, "unit vectors"),
        (lambda x, c, dt: 2.0 * x, "length 2"),
    ],
)
def test_bad_motions_are_named_with_the_step(motion, said):
    f = SampledFilter(motion=motion)
    with pytest.raises(InvalidArgumentError, match=f"motion '.*lambda.*' in predict.*{said}"):
        f.predict(PRIOR)


def test_a_function_cannot_spoil_the_samples_it_gets():
    def greedy(z, q):
        q[:] = 0.0
        return np.zeros(len(q))

    with pytest.raises(ValueError, match="read-only"):
        SampledFilter(log_likelihood=greedy).update(PRIOR, None)


def test_partly_impossible_likelihoods_are_fused():
    # Half the sphere about the mode is ruled out; the evidence is the prior's mass of the rest.
    def log_likelihood(z, q):
        return np.where(np.abs(q @ PRIOR.mode) > 0.8, 0.0, -np.inf)

    x = PRIOR.rvs(400_000, rng=1)
    mass = np.mean(np.abs(x @ PRIOR.mode) > 0.8)
    for progressive in (True, False):
        f = SampledFilter(log_likelihood=log_likelihood, sampler=RiemannianSampling(300), progressive=progressive)
        state, info = f.update(PRIOR, None)
        assert np.exp(info.log_evidence) == pytest.approx(mass, abs=0.03)
        assert state.axis_moments[-1] > PRIOR.axis_moments[-1]


def test_a_single_surviving_sample_is_reported():
    f = SampledFilter(log_likelihood=vector_log_likelihood(np.full(3, 1e8)), sampler=Unscented())
    state, info = f.update(PRIOR, measure(PRIOR, 1e8, 1))
    assert info.clamped and info.effective_sample_size == pytest.approx(1.0)
    assert np.isfinite(state.z).all() and state.axis_moments[0] == pytest.approx(f.least_moment, rel=1e-6)


def test_rotation_objects_and_other_likelihoods():
    f = SampledFilter(log_likelihood=vector_log_likelihood(np.full(3, 10.0)))
    rotated = f.predict(PRIOR, Rotation.from_rotvec([0.0, 0.0, 0.5]))
    assert np.allclose(rotated.mode, PRIOR.rotate(right=Rotation.from_rotvec([0.0, 0.0, 0.5])).mode) or np.allclose(
        rotated.mode, -PRIOR.rotate(right=Rotation.from_rotvec([0.0, 0.0, 0.5])).mode
    )
    flat, _ = f.update(PRIOR, None, log_likelihood=lambda z, q: np.zeros(len(q)))
    assert np.abs(flat.moment() - PRIOR.moment()).max() < 1e-13


def test_bad_arguments_are_rejected():
    with pytest.raises(InvalidArgumentError, match="log_likelihood"):
        SampledFilter().update(PRIOR, None)
    with pytest.raises(InvalidArgumentError, match="sampler"):
        SampledFilter(sampler="ut")
    with pytest.raises(InvalidArgumentError, match="min_share"):
        SampledFilter(min_share=1.0)
    with pytest.raises(InvalidArgumentError, match="noise_side"):
        SampledFilter(noise_side="both")
    with pytest.raises(InvalidArgumentError, match="dimension 4"):
        SampledFilter(process_noise=PRIOR).predict(Bingham.uniform(2))


def test_collapsed_samples_end_the_progression_and_are_reported():
    # Seven points that miss a narrow ridge lose whole axes; creeping on from there would take for ever.
    collapsed = Bingham([-5e8, -5e8, -3.5, 0.0], frame(4, 9))
    precision = 1e4 / np.array([1.0, 10.0, 10.0])
    f = SampledFilter(log_likelihood=vector_log_likelihood(precision), sampler=Unscented(), progressive=True)
    z = -rotate(collapsed.mode, REFERENCE)
    state, info = f.update(collapsed, z)
    assert sum(info.fractions) == pytest.approx(1.0, abs=1e-9) and len(info.fractions) <= 500
    assert info.clamped and np.isfinite(state.z).all() and np.isfinite(info.log_evidence)
