import numpy as np
import pytest
from scipy.stats import chi2

from bingham import Bingham
from bingham.baselines.gaussian import GaussianState
from bingham.baselines.second_order_ekf import SpinningGaussian
from bingham.distributions.relations import from_gaussian, to_gaussian
from bingham.metrics import geodesic_error
from bingham.rotations import compose, conjugate, from_rotation_vector, rotate
from bingham.studies import load_study
from bingham.studies.ball_adapted import PUBLISHED, adapted_noises
from bingham.studies.ball_bingham import mixture_evidence
from bingham.studies.ball_bounce import bounce_chunk
from bingham.studies.ball_filters import run_filters
from bingham.studies.ball_flights import BOUNCE, SPIN_TYPES, VISIBLE, simulate_flight
from bingham.studies.ball_joint import out_of_sight
from bingham.studies.ball_noises import BACK, DARK, INFORMED, LOGO, PROCESS, SPIN_PRIOR
from bingham.studies.ball_scores import HALF_TURN, Found, logo_errors, score
from bingham.studies.execute import run_study
from bingham.studies.glover2013 import TABLE
from bingham.studies.glover2013_ball import (
    ASSUMED,
    DEFAULT,
    LOGO_NOISES,
    STUDY,
    run_chunk,
)
from bingham.studies.glover2013_composition import COMPOSED, composition_error
from bingham.studies.glover2013_runs import OBSERVED
from bingham.studies.glover2013_signals import IDENTITY, isotropic_distribution, noise_covariance, projected_draws
from bingham.studies.study import generator


@pytest.fixture(scope="module")
def result():
    with pytest.MonkeyPatch.context() as patch:
        # Shorter than the published 1000 steps, for speed.
        patch.setattr("bingham.studies.glover2013.STEPS", 300)
        patch.setattr("bingham.studies.glover2013.THIN", 5)
        patch.setattr("bingham.studies.glover2013_composition.COMPOSED_STEPS", 60)
        return run_study(load_study("glover2013"), runs=54, seed=2)


@pytest.mark.parametrize("padded", [False, True])
@pytest.mark.parametrize("z", [(-50.0,) * 3, (-200.0,) * 3, (-400.0, -400.0, -10.0)])
def test_projected_gaussians_have_the_second_moment_of_the_published_distribution(z, padded):
    distribution, covariance = isotropic_distribution(z), noise_covariance(z, padded)
    np.testing.assert_allclose(from_gaussian(IDENTITY, covariance).z, distribution.z, rtol=1e-8)
    x = projected_draws(covariance, 200_000, np.random.default_rng(0))
    moment = x.T @ x / len(x)
    spread = np.sqrt(np.einsum("ni,nj->ij", x**2, x**2) / len(x) - moment**2)
    assert np.all(np.abs(moment - distribution.moment()) * np.sqrt(len(x)) < 5.0 * spread)
    # Negative control: the Gaussian of equal moments before the projection, eq. (57) of Kurz et al. 2014.
    assert np.all(from_gaussian(*to_gaussian(distribution)).z[:-1] < 1.01 * np.array(z))


def test_the_bingham_filter_is_ahead_of_the_published_ekf(result):
    assert result.value("all signals, against ekf_fixed", "bingham", "wins") >= 54 * 268 / 270
    # Six short signals a cell: bounds well below the means of 30 long ones.
    for observation, least in (("-400/-400/-10", 30.0), ("-400", 8.0), ("-50", 4.0)):
        for process in (-50, -200, -400):
            case = f"process {process}, observation {observation}"
            assert result.value(f"{case}, against ekf_fixed", "bingham", "improvement_percent") > least


def test_the_bingham_filter_is_not_behind_the_fair_ekf_in_the_mean_of_a_cell(result):
    for row in result.table:
        if row.metric == "improvement_percent" and row.case.endswith("ekf_fair"):
            assert -row.stderr < row.value < 8.0, row.case


def test_only_the_bingham_filters_uncertainty_is_right_in_all_cells(result):
    for cell in {row.case for row in result.table if row.metric == "nees"}:
        # 360 values a cell, from six signals.
        assert 0.92 <= result.value(cell, "bingham", "coverage_95") <= 0.98
        assert result.value(cell, "bingham", "calibration_ks") < 0.09
        assert result.value(cell, "bingham", "nees") == pytest.approx(1.0, abs=0.12)
        # Negative control.
        assert result.value(cell, "ekf_fixed", "coverage_95") < 0.8
        assert result.value(cell, "ekf_fixed", "calibration_ks") > 0.2
        assert result.value(cell, "ekf_fixed", "nees") > 2.0


def test_published_figures_stand_beside_ours(result):
    paper = {(row.case, row.metric): row.paper for row in result.table if row.paper is not None}
    improvements = [value for (_, metric), value in paper.items() if metric == "improvement_percent"]
    assert improvements == [37.3, 45.6, 54.3, 19.9, 3.33, 1.52, 3.42, 0.72, 0.47]
    assert improvements == [value for value, _ in TABLE.values()]
    assert paper["all signals, against ekf_fixed", "wins"] == 268
    assert len(paper) == 9 + 9 + 1 + 2


def test_runs_of_figure_2_lie_within_their_bounds(result):
    for k in range(len(OBSERVED)):
        c = {name: result.curves[f"run/{k}/{name}"] for name in ("truth", "modes", "low", "high", "error", "bound")}
        # 200 steps, neighbours alike.
        assert 0.75 < np.mean(c["error"] <= c["bound"]) <= 1.0
        assert np.mean((c["low"] <= c["modes"]) & (c["modes"] <= c["high"])) > 0.97
        assert np.abs(np.diff(c["truth"], axis=0)).max() < 0.5
    # Negative control: the wide run's errors are not within the bounds of the narrow one.
    assert np.mean(c["error"] <= result.curves["run/0/bound"]) < 0.5


def test_the_motion_is_as_fast_as_the_papers(result):
    for process, degrees in ((-50, 18.0), (-200, 9.0), (-400, 7.0)):
        assert result.value(f"process {process}, observation -50", "truth", "step_deg") == pytest.approx(
            degrees, rel=0.07
        )


def test_composition_errors_are_of_the_published_size(result):
    mean = result.value("composition, mean of all", "bingham", "kl")
    largest = result.value("composition, largest", "bingham", "kl")
    assert 0.0012 / 3.0 < mean < 0.0012 * 1.5
    assert 0.0197 / 4.0 < largest < 0.0197 * 1.5
    # As published, the largest occurs with both noises the widest, the last pair.
    values = result.curves["composition/kl"]
    assert values.shape[0] == len(COMPOSED) ** 2 and mean == values.mean()
    assert largest == values[-1].max() == values.max()


def test_composition_error_equals_a_plain_quadrature():
    # About one axis everything lies on a circle: distributions concentrated in two directions, free in the third.
    p, q = isotropic_distribution((-10.0, -10.0, -1.0)), isotropic_distribution((-10.0, -10.0, -1.0))
    matched = p.compose(q)
    x = Bingham.uniform(4).rvs(200_000, rng=3)
    log_b = matched.logpdf(x)
    integrand = 2.0 * np.pi**2 * np.exp(log_b) * (log_b - p.composed_logpdf(q, x))
    plain, stderr = integrand.mean(), integrand.std() / np.sqrt(len(x))
    found = composition_error(p, q, 20_000, np.random.default_rng(4))
    assert found == pytest.approx(plain, abs=4.0 * stderr)
    assert composition_error(Bingham.uniform(4), q, 100, np.random.default_rng(0)) == pytest.approx(0.0, abs=1e-10)


def test_flights_are_as_described():
    for kind in range(12):
        flight, _ = simulate_flight(kind, LOGO_NOISES[0], generator(0, kind))
        seen = ~np.isnan(flight["seen"]).any(axis=(1, 2))
        assert seen.sum() >= 12
        turn = np.degrees(2.0 * np.arccos(np.abs(SPIN_TYPES[kind, 0])))
        assert turn == pytest.approx((45.0, 67.5, 90.0)[kind % 3])
        assert abs(flight["spin"] @ SPIN_TYPES[kind]) > np.cos(0.5 * 0.35)


def test_out_of_sight_is_the_other_half():
    # The published distribution of unseen orientations is the fit to the half of the sphere where the flights hide the
    # logo.
    rng = np.random.default_rng(4)
    x = rng.standard_normal((200_000, 4))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    logo = rotate(x, [0.0, 0.0, 1.0])[:, 2]
    hidden = compose(conjugate(BACK), x[logo <= VISIBLE])
    np.testing.assert_allclose(hidden.T @ hidden / len(hidden), DARK.moment(), atol=3e-3)
    # Negative control: a limit 10 degrees lower.
    lower = compose(conjugate(BACK), x[logo <= -np.sin(np.radians(10.0))])
    assert np.abs(lower.T @ lower / len(lower) - DARK.moment()).max() > 0.01


def _two_frames(hidden):
    """Return a flight of two frames that show the logo, the later one without it if ``hidden``."""
    flight, _ = simulate_flight(5, LOGO_NOISES[0], generator(0, 5))
    seen = ~np.isnan(flight["seen"]).any(axis=(1, 2))
    first = int(np.flatnonzero(seen[:-1] & seen[1:])[0])
    pair = flight["seen"][first : first + 2].copy()
    if hidden:
        pair[1] = np.nan
    return {"orientation": flight["orientation"][:2], "spin": flight["spin"], "seen": pair}


@pytest.mark.parametrize("hidden", [False, True])
def test_the_fair_first_order_filter_has_the_papers_likelihood_of_raw_observations(hidden):
    # Two frames: B_v · (f(y'|x') ∘ f(y|x)⁻¹), the distributions of x written out; the rotated noise is the same
    # distribution.
    two = _two_frames(hidden)
    before = LOGO.inverse().rotate(left=two["seen"][0, 0])
    now = DARK.inverse().rotate(left=BACK) if hidden else LOGO.inverse().rotate(left=two["seen"][1, 0])
    prior = PROCESS.compose(PROCESS.compose(SPIN_PRIOR))
    both = [prior.multiply(now.rotate(right=turn).compose(before.inverse())) for turn in ([1.0, 0, 0, 0], HALF_TURN)]
    errors = [2.0 * geodesic_error(distribution.mode, two["spin"]) for distribution in both]
    name = "bingham_first_order_fair"
    found = run_filters(two, 5, SPIN_TYPES, [name])[f"spin_error/{name}"]
    assert min(abs(found[1] - error) for error in errors) < 1e-9


@pytest.mark.parametrize("hidden", [False, True])
def test_the_published_first_order_filter_has_fixed_noise(hidden):
    # f(y|v) ∝ B(v; Λ, V⁻¹ ∘ y), §4, y the difference of two observations and Λ that of two noises.
    two = _two_frames(hidden)
    later = np.atleast_2d(BACK) if hidden else two["seen"][1]
    noise = (DARK if hidden else LOGO).compose(LOGO.inverse())
    prior = PROCESS.compose(PROCESS.compose(SPIN_PRIOR))
    distributions = [
        prior.multiply(noise.inverse().rotate(right=y)) for y in compose(later, conjugate(two["seen"][0, 0]))
    ]
    errors = [2.0 * geodesic_error(distribution.mode, two["spin"]) for distribution in distributions]
    name = "bingham_first_order"
    found = run_filters(two, 5, SPIN_TYPES, [name])[f"spin_error/{name}"]
    assert min(abs(found[1] - error) for error in errors) < 1e-9


def test_spins_are_found_and_classified():
    found = run_chunk(DEFAULT, 3, 0, 12, adapted_on=1)
    assert found["correct/bingham_second_order"][:, 29].sum() >= 10
    assert np.median(found["spin_error/bingham_second_order"][:, 29]) < 0.17
    assert np.median(found["spin_error/random_guess"][:, 29]) > 0.5
    second, kalman = (
        found[f"spin_error/{name}"][:, :30].mean() for name in ("bingham_second_order", "ekf_second_order")
    )
    assert second < kalman < found["spin_error/random_guess"].mean()


@pytest.mark.parametrize(("level", "flights"), [(DEFAULT, 146), (ASSUMED, 36)])
def test_the_papers_order_appears(level, flights):
    names = ("bingham_second_order", "bingham_first_order", "ekf_first_order", "ekf_second_order")
    right, error = (dict.fromkeys(names, 0.0) for _ in range(2))
    for run in range(flights):
        kind = run % len(SPIN_TYPES)
        flight, _ = simulate_flight(kind, LOGO_NOISES[level], generator(1, level, run))
        found = run_filters(flight, kind, SPIN_TYPES, names)
        for name in names:
            right[name] += found[f"correct/{name}"][:30].mean() / flights
            error[name] += found[f"spin_error/{name}"][:30].mean() / flights
    second, *firsts, last = names
    for first in firsts:
        assert right[second] > right[first] > right[last]
        assert error[second] < error[first] < error[last]


@pytest.fixture
def guess():
    """Return a flight of 30 frames, guesses of orientations and spin, some half a turn off, and their noise."""
    distribution, rng = isotropic_distribution((-40.0, -40.0, -10.0)), np.random.default_rng(7)
    flight = {"orientation": Bingham.uniform(4).rvs(30, rng=rng), "spin": SPIN_TYPES[2]}
    orientations = compose(flight["orientation"], distribution.inverse().rvs(30, rng=rng))
    orientations[10:20] = compose(orientations[10:20], HALF_TURN)
    return flight, orientations, compose(distribution.inverse().rvs(30, rng=rng), flight["spin"]), distribution


@pytest.mark.parametrize("factor", [0.1, 1.0, 10.0])
def test_what_is_covered_lies_within_the_credible_angle_of_the_nearer_twin(guess, factor):
    flight, orientations, spins, distribution = guess
    distribution = Bingham(factor * distribution.z, distribution.M)
    distributions = [distribution.rotate(left=q) for q in orientations], [distribution.rotate(right=v) for v in spins]
    angle = distribution.credible_angle(0.95)
    twins = [geodesic_error(orientations, compose(flight["orientation"], h)) for h in ([1.0, 0, 0, 0], HALF_TURN)]
    inside = np.minimum(*twins) <= angle, geodesic_error(spins, flight["spin"]) <= angle
    # Frames 10, 20 and 30, moved through the flight, so that all are seen.
    for shift in range(0, 30, 3):
        rotated = {"orientation": np.roll(flight["orientation"], shift, axis=0), "spin": flight["spin"]}
        found = score(Found(*(_rolled(x, shift) for x in distributions), [0] * 30), rotated, 0)
        for key, expected in zip(("orientation_covered", "spin_covered"), inside, strict=True):
            np.testing.assert_array_equal(found[key], np.roll(expected, shift)[[9, 19, 29]])
    share = {0.1: (0.95, 1.0), 1.0: (0.85, 1.0), 10.0: (0.0, 0.5)}[factor]
    assert all(share[0] <= part.mean() <= share[1] for part in inside)


def _rolled(distributions, shift):
    return distributions[-shift:] + distributions[:-shift] if shift else distributions


@pytest.mark.parametrize("deviation", [0.02, 0.05])
def test_gaussians_cover_by_their_nees(guess, deviation):
    flight, orientations, spins, _ = guess
    covariance = deviation**2 * np.eye(4)
    found = score(
        Found(*([GaussianState(q, covariance) for q in x] for x in (orientations, spins)), [0] * 30), flight, 0
    )
    limit = deviation * np.sqrt(chi2.ppf(0.95, 3))
    np.testing.assert_array_equal(found["spin_covered"], (0.5 * found["spin_error"] <= limit)[[9, 19, 29]])
    np.testing.assert_array_equal(
        found["orientation_covered"], (0.5 * found["orientation_error"] <= limit)[[9, 19, 29]]
    )


def _model_flight(rng):
    """Return a flight of 30 frames that obeys the filters' model, the logo always in sight, and its spin at the end."""
    kind = int(rng.integers(12))
    spin, x = compose(INFORMED.rvs(1, rng=rng)[0], SPIN_TYPES[kind]), Bingham.uniform(4).rvs(1, rng=rng)[0]
    orientation = np.empty((30, 4))
    for n, w in enumerate(PROCESS.rvs(30, rng=rng)):
        orientation[n] = x = compose(spin, x)
        spin = compose(w, spin)
    seen = compose(orientation, LOGO.rvs(30, rng=rng))[:, None]
    return {"orientation": orientation, "spin": spin, "seen": seen}, kind


def test_the_second_order_filter_covers_what_its_model_makes(monkeypatch):
    flights = [_model_flight(np.random.default_rng([8, run])) for run in range(200)]

    def covered():
        parts = [run_filters(flight, kind, SPIN_TYPES, ["bingham_oracle"]) for flight, kind in flights]
        names = ("orientation_covered/bingham_oracle", "spin_covered/bingham_oracle")
        return [np.mean([part[name][-1] for part in parts]) for name in names]

    # Binomial standard error: 0.015.
    assert np.all(np.abs(np.array(covered()) - 0.95) < 0.045)
    # Negative control: noises taken for a third as wide.
    monkeypatch.setattr("bingham.studies.ball_bingham.LOGO", isotropic_distribution((-360.0, -360.0, -90.0)))
    monkeypatch.setattr("bingham.studies.ball_bingham.PROCESS", isotropic_distribution((-3600.0,) * 3))
    assert max(covered()) < 0.7


@pytest.mark.parametrize(
    ("error", "axis", "angle"),
    [
        ((0.3, 0, 0), 0.3, 0),
        ((0, 0.2, 0), 0.2, 0),
        ((0, 0, 0.4), 0, 0.4),
        ((0, 0, np.pi - 0.1), 0, 0.1),
        ((np.pi, 0, 0), np.pi, None),
    ],
)
def test_logo_errors_split_a_rotation_into_tilt_and_twist(error, axis, angle):
    truth = Bingham.uniform(4).rvs(5, rng=0)
    tilt, twist = logo_errors(compose(truth, from_rotation_vector(np.array(error, dtype=float))), truth)
    np.testing.assert_allclose(tilt, axis, atol=1e-7)
    if angle is not None:
        np.testing.assert_allclose(twist, angle, atol=1e-7)


def test_a_bounce_is_a_control():
    errors = bounce_chunk(LOGO_NOISES[DEFAULT], 3, 0, 12)
    told, untold = (np.median(errors[f"bounce/bingham_second_order/{name}"][:, BOUNCE]) for name in ("told", "untold"))
    assert told < 0.3 < untold


def test_noises_are_adapted_by_evidence_on_flights_of_their_own():
    noise = LOGO_NOISES[DEFAULT]
    found = adapted_noises(DEFAULT, noise, 4, 3)
    # Four times as narrow as published, and near the truth; wobble adds to it.
    assert np.all(found.logo.z[:2] < -80.0) and np.all(found.logo.z[:2] > -400.0)
    assert -250.0 < found.logo.z[2] < -30.0
    assert found.process.z[0] < 4.0 * PROCESS.z[0]
    # On other flights, too, they are more probable than the published ones.
    other = [simulate_flight(kind, noise, generator(4, DEFAULT, kind))[0]["seen"] for kind in (0, 5)]
    evidence = [sum(mixture_evidence(seen, *noises) for seen in other) for noises in (found, PUBLISHED)]
    assert evidence[0] > evidence[1] + 10.0


def test_the_table_states_coverage_after_each_frame(monkeypatch):
    monkeypatch.setattr("bingham.studies.glover2013_ball.adapted_noises", lambda *_: PUBLISHED)
    result = run_study(STUDY, runs=2, seed=5)
    for level in (DEFAULT, ASSUMED):
        found = run_chunk(level, 5, 0, 2)
        logo = "/".join(f"{z:g}" for z in LOGO_NOISES[level])
        for k, frame in enumerate((10, 20, 30)):
            case = f"logo noise {logo}, frame {frame}"
            for name in ("bingham_second_order", "ekf_second_order", "bingham_first_order"):
                expected = found[f"spin_covered/{name}"][:, k].mean()
                assert result.value(case, name, "spin_coverage_95") == expected
            expected = found["orientation_covered/bingham_second_order"][:, k].mean()
            assert result.value(case, "bingham_second_order", "coverage_95") == expected


def test_out_of_sight_is_a_logo_below_the_horizon():
    rng = np.random.default_rng(2)
    root = 0.004 * rng.normal(size=(8, 8))
    covariance = root @ root.T
    # Logo on the horizon, well above it, well below it.
    for tilt in (0.5 * np.pi, 0.5 * np.pi - 0.02, 0.5 * np.pi + 0.6):
        x = compose(from_rotation_vector([tilt, 0.0, 0.0]), from_rotation_vector([0.0, 0.0, 1.0]))
        mean = np.concatenate([x, from_rotation_vector([0.0, 0.8, 0.0])])
        posterior, log_evidence = out_of_sight(SpinningGaussian(mean[None], covariance[None]))
        samples = rng.multivariate_normal(mean, covariance, size=400_000)
        height = rotate(samples[:, :4] / np.linalg.norm(samples[:, :4], axis=1, keepdims=True), [0.0, 0.0, 1.0])[:, 2]
        below = samples[height < 0.0]
        assert np.exp(log_evidence[0]) == pytest.approx(len(below) / len(samples), abs=0.01)
        size = np.sqrt(np.diag(covariance))
        centre = below.mean(axis=0).reshape(2, 4)
        centre = (centre / np.linalg.norm(centre, axis=1, keepdims=True)).ravel()
        assert np.abs((posterior.mean[0] - centre) / size).max() < 0.05
        assert np.abs((posterior.covariance[0] - np.cov(below.T)) / np.outer(size, size)).max() < 0.05
    # Where the logo is known to be far below, to be out of sight says nothing.
    np.testing.assert_allclose(posterior.covariance[0], covariance, atol=1e-9)
    np.testing.assert_allclose(log_evidence, 0.0, atol=1e-9)


def test_the_joint_covariance_finds_the_spin_better_at_the_same_noises():
    names = ["bingham_mixture_published", "ekf_mixture"]
    error = {name: [] for name in names}
    for kind in (1, 2, 5):
        flight, _ = simulate_flight(kind, LOGO_NOISES[DEFAULT], generator(9, DEFAULT, kind))
        found = run_filters(flight, kind, SPIN_TYPES, names)
        for name in names:
            error[name].append(found[f"spin_error/{name}"][29])
        assert found["correct/ekf_mixture"][29] == 1.0
    assert np.mean(error["ekf_mixture"]) < np.mean(error["bingham_mixture_published"])
