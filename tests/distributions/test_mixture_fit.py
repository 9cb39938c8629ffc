"""Fitting mixtures: monotone likelihood, recovery within standard errors, BIC, signs, the ceiling, recorded sets."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from bingham import Bingham, BinghamMixture, InvalidArgumentError
from bingham.distributions.bounded import bounded_concentrations
from bingham.distributions.em import expectation_maximization
from bingham.distributions.normalizer import log_normalizer_derivatives, moments
from bingham.errors import AccuracyWarning

from .test_mixture import random_mixture

RECORDED = Path(__file__).resolve().parents[2] / "../shared/data/riss_bingham_sim"


@pytest.mark.parametrize("d", [2, 3, 4, 5])
def test_likelihood_never_decreases(d):
    rng = np.random.default_rng(d)
    truth = random_mixture(rng, d, 3, 0.1, 5.0, 300.0, 20.0)
    x = truth.rvs(2000, rng=rng)
    weights = rng.uniform(0.0, 2.0, len(x))
    start = random_mixture(rng, d, 4, 0.3, 2.0, 20.0, 1.0)
    run = expectation_maximization(x, start, weights=weights, tolerance=0.0, max_iterations=200)
    assert np.diff(run.trace).min() > -1e-9 * abs(run.trace[-1])
    assert run.trace[-1] > run.trace[0] + 100.0
    assert run.log_likelihood == pytest.approx(np.sum(weights * run.mixture.logpdf(x)), rel=1e-12)


@pytest.mark.parametrize("d", [3, 4])
@pytest.mark.parametrize("size", [2, 4, 6])
def test_recovers_known_mixtures_within_three_standard_errors(d, size):
    rng = np.random.default_rng(100 * d + size)
    shares = rng.dirichlet(np.full(size, 5.0))
    truth = BinghamMixture(shares, random_mixture(rng, d, size).components)
    x = truth.rvs(20_000, rng=rng)
    fitted = BinghamMixture.fit(x, size, background=False, restarts=4, rng=1)
    ours, theirs = linear_sum_assignment(-np.abs(truth.components.mode @ fitted.components.mode.T))
    deviations: list[float] = []
    for i, j in zip(ours, theirs, strict=True):
        p, q = truth.components[int(i)], fitted.components[int(j)]
        error = p.standard_errors(len(x) * shares[i])
        deviations += list((q.z - p.z)[:-1] / error.concentrations[:-1])
        turn = p.M.T @ q.M
        for a in range(d):
            for b in range(a + 1, d):
                deviations.append(np.arcsin(np.clip(turn[a, b], -1.0, 1.0)) / error.axes[a, b])
    deviations_array = np.abs(deviations)
    assert deviations_array.max() < 3.0
    # Errors far below the standard errors would mean that those are wrong.
    assert 0.6 < np.sqrt(np.mean(deviations_array**2)) < 1.4


def outlier_sample(seed):
    rng = np.random.default_rng(seed)
    d, size = 3 + seed % 2, 2 + (seed // 2) % 5
    inliers = random_mixture(rng, d, size).components.rvs(600, rng=rng).reshape(-1, d)
    outliers = rng.standard_normal((round(len(inliers) / 9), d))
    outliers /= np.linalg.norm(outliers, axis=1, keepdims=True)
    return np.concatenate([inliers, outliers]), size


@pytest.mark.parametrize("seed", [0, 3, 5, 9])
def test_bic_finds_the_number_of_components_among_outliers(seed):
    x, size = outlier_sample(seed)
    fitted = BinghamMixture.fit(x, range(1, size + 3), rng=seed)
    assert fitted.size == size
    assert fitted.background == pytest.approx(0.1, abs=0.03)


def test_signs_of_samples_change_no_bit():
    x, size = outlier_sample(1)
    flips = np.where(np.random.default_rng(0).random(len(x)) < 0.5, -1.0, 1.0)[:, None]
    for method in ("em", "sac"):
        a = BinghamMixture.fit(x, size, method=method, restarts=3, rng=0)
        b = BinghamMixture.fit(flips * x, size, method=method, restarts=3, rng=0)
        assert np.array_equal(a.weights, b.weights)
        assert np.array_equal(a.components.z, b.components.z)
        assert np.array_equal(a.components.M, b.components.M)
        assert np.array_equal(a.predict(x), b.predict(-x))


def test_chunks_and_threads_give_the_sum_of_the_parts():
    x = random_mixture(np.random.default_rng(4), 3, 2).rvs(40_000, rng=0)
    start = random_mixture(np.random.default_rng(5), 3, 2, 0.1, 5.0, 20.0)
    whole = expectation_maximization(x, start, max_iterations=1).trace[0]
    assert whole == pytest.approx(float(np.sum(start.logpdf(x))), rel=1e-12)


def test_weights_stand_for_repeated_rows():
    x, size = outlier_sample(2)
    counts = np.random.default_rng(0).integers(0, 3, len(x)).astype(float)
    repeated = np.repeat(x, counts.astype(int), axis=0)
    start = BinghamMixture.fit(x, size, restarts=2, rng=0)
    a = expectation_maximization(x, start, weights=counts).mixture
    b = expectation_maximization(repeated, start).mixture
    np.testing.assert_allclose(a.components.z, b.components.z, rtol=1e-6)


def test_sample_consensus_splits_a_girdle_through_two_modes():
    rng = np.random.default_rng(11)
    truth = random_mixture(rng, 4, 3, 0.1, 300.0, 500.0, 60.0)
    x = truth.rvs(3000, rng=rng)
    # At the uniform density one girdle through two modes gains more than either mode alone.
    for density in (None, 200.0 / (2.0 * np.pi**2)):
        found = BinghamMixture.fit(x, 6, method="sac", min_points=200, min_density=density, rng=0)
        assert found.size == 3
        assert np.abs(truth.components.mode @ found.components.mode.T).max(axis=1).min() > np.cos(0.02)


def test_bounded_concentrations_solve_their_conditions():
    rng = np.random.default_rng(0)
    for w in [
        *np.sort(rng.dirichlet(np.ones(4), 20), axis=1),
        [0.0, 0.0, 0.3, 0.7],
        [0.0, 0.0, 0.0, 1.0],
        [1e-9, 1e-5, 0.5, 0.5 - 1.0001e-5],
    ]:
        row = np.sort(np.asarray(w, dtype=float))
        z, log_f = bounded_concentrations(row, 900.0)
        value, gradient, _ = log_normalizer_derivatives(z)
        residual = row - gradient
        bound = z <= -900.0
        assert np.all(z >= -900.0)
        assert z[-1] == 0.0
        assert np.all(residual[bound] <= 0.0)
        # An entry tied with the largest one wants to pass it, which the range of the spectrum forbids.
        np.testing.assert_allclose(residual[~bound & (z < 0.0)], 0.0, atol=1e-9)
        assert np.all(residual[~bound & (z == 0.0)] >= -1e-9)
        assert log_f == pytest.approx(value, rel=1e-12)


def test_bounded_concentrations_are_free_below_the_ceiling():
    z = np.array([-800.0, -20.0, -1.0, 0.0])
    np.testing.assert_allclose(bounded_concentrations(moments(z), 1e6)[0], z, rtol=1e-9, atol=1e-9)


def test_noise_free_data_reach_the_ceiling_only():
    angle = np.linspace(0.0, np.pi, 200)
    x = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle, 0.0 * angle], axis=1)
    fitted = BinghamMixture.fit(x, 1, background=False, max_concentration=900.0, restarts=1)
    np.testing.assert_allclose(fitted.components.z[0, :2], -900.0)
    assert fitted.components.z[0, 2] > -1.0


def test_rejects_and_says_when_it_fails():
    x = np.eye(3)
    with pytest.raises(InvalidArgumentError, match="min_points"):
        BinghamMixture.fit(x, 1)
    with pytest.raises(InvalidArgumentError, match="method"):
        BinghamMixture.fit(np.tile(x, (5, 1)), 1, method="k-means")
    with pytest.raises(InvalidArgumentError, match="components"):
        BinghamMixture.fit(x, 0)


def stored_mixture(path):
    """Read a mixture of the C library; its normalisers are not read: ours replace them."""
    weights, spectra, frames, background = [], [], [], 0.0
    for line in path.read_text().splitlines():
        values = np.array(line.split()[3:], dtype=float)
        axes = values[9:].reshape(3, 4)
        if not axes.any():
            background += values[0]
            continue
        u, _, v = np.linalg.svd(axes)
        weights.append(values[0])
        spectra.append([*values[6:9], 0.0])
        frames.append(np.column_stack([(u @ v[:3]).T, v[3]]))
    total = sum(weights) + background
    return BinghamMixture(np.array(weights) / total, Bingham(spectra, frames), background / total)


def recorded_set(name):
    lines = (RECORDED / f"{name}.csv").read_text().replace(",", " ").splitlines()
    rows = np.array([line.split() for line in lines if len(line.split()) == 4], dtype=float)
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


@pytest.fixture(scope="module")
def faces():
    if not RECORDED.is_dir():
        pytest.skip("recorded quaternion sets are not there")
    return {f"face_{k}_{s}": recorded_set(f"cuboid_face_{k}_{s}") for k in range(1, 7) for s in ("init", "final")}


@pytest.mark.parametrize("stage", ["init", "final"])
def test_file_names_pair_each_fit_with_the_wrong_face(faces, stage):
    # By likelihood the fit of face k belongs to the samples of face k + 1 (cyclic), not to those of its own name.
    for k in range(1, 7):
        stored = stored_mixture(RECORDED / f"glover_fit_face_{k}_{stage}.txt")
        score = {m: stored.score(faces[f"face_{m}_{stage}"]) for m in range(1, 7)}
        assert max(score, key=lambda m: score[m]) == k % 6 + 1


@pytest.mark.parametrize(
    "name", [*(f"face_{k}_{s}" for k in (1, 3, 6) for s in ("init", "final")), "syn_12", "syn_123", "syn_46"]
)
def test_em_beats_the_stored_sample_consensus_fit(faces, name):
    stored = stored_mixture(RECORDED / f"glover_fit_{name}.txt")
    if name.startswith("face"):
        x = faces[f"face_{int(name[5]) % 6 + 1}_{name[7:]}"]
    else:
        x = recorded_set(f"syn_face_{name[4:]}")
    # The stored fits end on a grid of concentrations; EM gets the ceiling that each of them reached.
    ceiling = float(-stored.components.z.min())
    fitted = BinghamMixture.fit(
        x, stored.size, background=stored.background > 0.0, max_concentration=ceiling, restarts=4, rng=0
    )
    assert fitted.size <= stored.size
    assert fitted.score(x) >= stored.score(x) - 1e-9


def three_clusters(seed, d):
    rng = np.random.default_rng(seed)
    frames = [np.linalg.qr(rng.normal(size=(d, d)))[0] for _ in range(3)]
    parts = [Bingham([*(-rng.uniform(40.0, 300.0, d - 1)), 0.0], m).rvs(300, rng=rng) for m in frames]
    modes = np.array([m[:, -1] for m in frames])
    apart = np.abs(modes @ modes.T)[np.triu_indices(3, 1)].max() < 0.8
    return np.concatenate([*parts, Bingham.uniform(d).rvs(100, rng=rng)]), modes, apart


@pytest.mark.parametrize("d", [3, 4])
def test_sample_consensus_finds_three_of_up_to_six(d):
    right = []
    for seed in range(30):
        x, modes, apart = three_clusters(seed, d)
        if apart:
            found = BinghamMixture.fit(x, 6, method="sac", rng=seed)
            reached = np.abs(modes @ found.components.mode.T).max(axis=1) > 0.99
            right.append(found.size == 3 and reached.all())
    assert len(right) >= 10
    assert all(right)


def test_too_many_components_give_the_best_mixture_and_a_warning():
    x = Bingham([-500.0, -500.0, 0.0], np.eye(3)).rvs(12, rng=1)
    with pytest.warns(AccuracyWarning, match="5 components are too many"):
        mixture = BinghamMixture.fit(x, 5, rng=0)
    assert mixture.size == 1
    assert abs(mixture.mode[2]) > 0.99
