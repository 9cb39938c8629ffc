"""One loop for all filters: the same calls, the same words for a missing measurement, the same refusals."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham import (
    Bingham,
    BinghamFilter,
    BinghamMixture,
    Diffusion,
    Gyroscope,
    MixtureFilter,
    SampledFilter,
    SecondOrderBinghamFilter,
    SpinState,
    VectorSensor,
)
from bingham.baselines import (
    AxialKalmanFilter,
    QuaternionEkf,
    ScalarKalmanFilter,
    SecondOrderQuaternionEkf,
    WrappedNormalFilter,
)
from bingham.baselines.gaussian import GaussianState
from bingham.baselines.scalar_kalman import AngleState
from bingham.baselines.second_order_ekf import SpinningGaussian
from bingham.baselines.wrapped_normal import DoubledAngleState
from bingham.errors import InvalidArgumentError
from bingham.filters import BankState, FilterBank, smooth_fixed_interval, smooth_fixed_lag
from bingham.filters.run import each_step
from bingham.metrics import geodesic_error
from bingham.models import ControlledRotation
from bingham.rotations import compose, conjugate, from_rotation_vector, rotate

DT = 0.125
LENGTH, MISSING_ROW = 12, 6
RATE = np.array([0.2, -0.1, 0.3])


def distribution(k, d):
    return Bingham([-k] * (d - 1) + [0.0], np.eye(d)[:, ::-1])


def log_likelihood(z, points):
    return 80.0 * (points @ z) ** 2


W = {d: distribution(3000.0, d) for d in (2, 4)}
V = {d: distribution(300.0, d) for d in (2, 4)}
WIDE = {d: distribution(3.0, d) for d in (2, 4)}
GAUSS = {d: GaussianState(np.eye(d)[0], 0.1 * np.eye(d)) for d in (2, 4)}
SMALL, SENSED = 1e-4 * np.eye(4), 1e-3 * np.eye(4)
SPIN = SpinningGaussian.independent(GaussianState(np.eye(4)[0], 0.1 * np.eye(4)), GaussianState(np.eye(4)[0], SENSED))
BANK = [BinghamFilter(W[4], V[4]), BinghamFilter(WIDE[4], V[4])]

# Name → filter, prior, its control: a rotation of the state, of the spin (none), or a rate.
FILTERS = {
    "bingham_2": (BinghamFilter(W[2], V[2]), WIDE[2], "turn"),
    "bingham_4": (BinghamFilter(W[4], V[4]), WIDE[4], "turn"),
    "bingham_left": (BinghamFilter(W[4], V[4], noise_side="left"), WIDE[4], "turn"),
    "known_rotation": (BinghamFilter(ControlledRotation(W[4]), V[4]), WIDE[4], "turn"),
    "diffusion": (BinghamFilter(Diffusion(0.05), V[4]), WIDE[4], "turn"),
    "gyroscope": (BinghamFilter(Gyroscope(0.05), V[4]), WIDE[4], "rate"),
    "mixture": (MixtureFilter(W[4], V[4]), BinghamMixture.single(WIDE[4]), "turn"),
    "sampled": (SampledFilter(process_noise=W[4], log_likelihood=log_likelihood, progressive=True), WIDE[4], "turn"),
    "second_order": (SecondOrderBinghamFilter(W[4], V[4]), SpinState(WIDE[4], distribution(1000.0, 4)), "spin"),
    "bank": (FilterBank(BANK), BankState([WIDE[4], WIDE[4]]), "turn"),
    "scalar_kalman": (ScalarKalmanFilter(1e-3, 1e-2), AngleState(np.array(0.0), np.array(0.1)), "turn"),
    "wrapped_normal": (WrappedNormalFilter(1e-3, 1e-2), DoubledAngleState(np.array(0.0), np.array(2.0)), "turn"),
    "axial_kalman_2": (AxialKalmanFilter(SMALL[:2, :2], SENSED[:2, :2]), GAUSS[2], "turn"),
    "axial_kalman_4": (AxialKalmanFilter(SMALL, SENSED), GAUSS[4], "turn"),
    "ekf_left": (QuaternionEkf(SMALL, SENSED), GAUSS[4], "turn"),
    "ekf_right": (QuaternionEkf(SMALL, SENSED, noise_side="right", rotate_noise=True), GAUSS[4], "turn"),
    "ekf_second_order": (SecondOrderQuaternionEkf(SMALL, SENSED), SPIN, "spin"),
}


@pytest.fixture(params=FILTERS, ids=list(FILTERS))
def entry(request):
    return FILTERS[request.param]


def recording(f, prior, kind):
    """Return a rotation at a constant rate about one axis (the side does not matter then), controls, signs mixed.

    The measurement at MISSING_ROW is NaN.
    """
    d = prior.mode.shape[-1]
    rng = np.random.default_rng(8)
    turn = from_rotation_vector(RATE * DT) if d == 4 else np.array([np.cos(0.03), np.sin(0.03)])
    truth = [np.eye(d)[0]]
    for _ in range(LENGTH):
        truth.append(compose(truth[-1], turn))
    truth = np.array(truth[1:])
    z = truth * rng.choice([-1.0, 1.0], (LENGTH, 1))
    z[MISSING_ROW] = np.nan
    controls = {"turn": turn, "rate": RATE, "spin": np.eye(d)[0]}[kind]
    return truth, z, np.tile(controls, (LENGTH, 1))


def test_one_loop_runs_every_filter(entry):
    f, prior, kind = entry
    truth, z, controls = recording(f, prior, kind)
    state, modes, evidence = prior, [], []
    for t in range(LENGTH):
        state = f.predict(state, controls[t], DT)
        predicted = state
        state, info = f.update(state, z[t])
        assert bool(info.accepted) == (t != MISSING_ROW)
        assert info.reason == ("missing" if t == MISSING_ROW else "")
        assert np.isfinite(info.log_evidence)
        if t == MISSING_ROW:
            assert info.log_evidence == 0.0
            np.testing.assert_array_equal(state.mode, predicted.mode)
        modes.append(state.mode)
        evidence.append(float(info.log_evidence))
    assert 2.0 * geodesic_error(np.array(modes)[-3:], truth[-3:]).max() < 0.1

    steps = list(each_step(f, prior, z, controls=controls, times=DT * np.arange(LENGTH), start_time=-DT))
    np.testing.assert_array_equal([state.mode for state, _ in steps], modes)
    np.testing.assert_array_equal([float(info.log_evidence) for _, info in steps], evidence)


def test_a_missing_measurement_leaves_the_state_as_it_is(entry):
    f, prior, kind = entry
    _, z, controls = recording(f, prior, kind)
    predicted = f.predict(prior, controls[0], DT)
    missing, _ = f.update(predicted, np.full(z.shape[1], np.nan))
    also, _ = f.update(predicted, [np.nan] * z.shape[1])
    # What comes after does not notice: the same second measurement gives the same state and evidence.
    seen = f.update(predicted, z[1])
    for state in (missing, also):
        again = f.update(state, z[1])
        np.testing.assert_array_equal(again[0].mode, seen[0].mode)
        assert again[1].log_evidence == seen[1].log_evidence


def test_only_motion_in_continuous_time_depends_on_the_length_of_a_step(entry):
    f, prior, kind = entry
    _, z, controls = recording(f, prior, kind)
    if isinstance(getattr(f, "process_noise", None), (Diffusion, Gyroscope)):
        short, long = f.predict(prior, controls[0], DT), f.predict(prior, controls[0], 100.0 * DT)
        assert long.z[0] > short.z[0] + 0.05  # less concentrated
        with pytest.raises(InvalidArgumentError, match="dt: expected a time step"):
            f.predict(prior, controls[0])
        return
    first, *others = (f.update(f.predict(prior, controls[0], dt), z[0]) for dt in (None, DT, 100.0 * DT))
    for state, info in others:
        np.testing.assert_array_equal(state.mode, first[0].mode)
        assert info.log_evidence == first[1].log_evidence


def test_a_measurement_that_is_nan_in_part_is_rejected(entry):
    f, prior, kind = entry
    _, z, controls = recording(f, prior, kind)
    for entry_of_nan in (0, -1):
        row = z[0].copy()
        row[entry_of_nan] = np.nan
        with pytest.raises(InvalidArgumentError, match=r"complete rows|log_likelihood"):
            f.update(f.predict(prior, controls[0], DT), row)


def test_scipy_rotations_are_taken_wherever_a_quaternion_is(entry):
    f, prior, kind = entry
    _, z, controls = recording(f, prior, kind)
    if z.shape[1] == 2:
        with pytest.raises(InvalidArgumentError, match=r"expected shape|unit vector"):
            f.update(f.predict(prior, None, DT), Rotation.identity())
        return
    turn = controls[0] if kind == "rate" else Rotation.from_quat(controls[0], scalar_first=True)
    a, b = f.predict(prior, controls[0], DT), f.predict(prior, turn, DT)
    assert geodesic_error(a.mode, b.mode) < 1e-12
    if isinstance(f, SampledFilter):
        return  # its measurements are the likelihood's own
    a, b = f.update(a, z[0])[0], f.update(b, Rotation.from_quat(z[0], scalar_first=True))[0]
    assert geodesic_error(a.mode, b.mode) < 1e-12
    if hasattr(f, "run") and kind == "turn" and not isinstance(getattr(f, "process_noise", None), Diffusion):
        known = z.copy()
        known[MISSING_ROW] = known[0]
        rotations = [Rotation.from_quat(x, scalar_first=True) for x in (known, controls)]
        a, b = f.run(prior, known, controls=controls), f.run(prior, rotations[0], controls=rotations[1])
        assert geodesic_error(a.modes, b.modes).max() < 1e-12


def test_other_sensors_follow_the_same_rule():
    up = np.array([0.0, 0.0, 1.0])
    f = BinghamFilter(Diffusion(0.1), VectorSensor(up, 100.0))
    state = f.predict(WIDE[4], None, DT)
    same, info = f.update(state, [np.nan] * 3)
    assert same is state and info.reason == "missing"
    body = rotate(conjugate(from_rotation_vector(RATE)), up)
    rows = np.array([body, np.full(3, np.nan), body])
    assert [info.accepted for _, info in each_step(f, WIDE[4], rows, times=[0.0, DT, 2 * DT])] == [True, False, True]


def test_a_loop_names_the_row_of_a_mistake():
    f = BinghamFilter(W[4], V[4])
    z = np.tile(np.eye(4)[0], (5, 1))
    z[3] *= 1.1
    with pytest.raises(InvalidArgumentError) as caught:
        list(each_step(f, WIDE[4], z))
    assert caught.value.__notes__ == ["in row 3 of the sequence"]
    for wrong in ({"controls": z[:4]}, {"times": [0.1]}):
        with pytest.raises(InvalidArgumentError, match=f"{next(iter(wrong))}: expected"):
            list(each_step(f, WIDE[4], z, **wrong))
    with pytest.raises(InvalidArgumentError, match="measurements: expected shape"):
        list(each_step(f, WIDE[4], z[0]))


CLOSE = 0.01 * np.eye(3)
SHEER = BinghamMixture.single(WIDE[4])


class OwnSensor:
    """A user's: nothing but the method of the protocol."""

    def likelihood(self, z, predicted):
        return VectorSensor([0.0, 0.0, 1.0], 50.0).likelihood(z, predicted)


class OwnMotion:
    """A user's: a dimension and the method of the protocol."""

    dim = 4

    def propagate(self, state, control, dt):
        return state


def test_sensors_and_motions_of_users_are_taken():
    for kind, prior in ((BinghamFilter, WIDE[4]), (MixtureFilter, SHEER)):
        f = kind(OwnMotion(), OwnSensor())
        assert f.update(f.predict(prior), [0.0, 0.0, 1.0])[1].accepted


@pytest.mark.parametrize("kind", [BinghamFilter, MixtureFilter])
@pytest.mark.parametrize(("arguments", "message"), [
    ((V[4], Gyroscope(0.01)), "measurement_noise: expected .*distribution.*likelihood.*got a Gyroscope; swap them"),
    ((VectorSensor([0, 0, 1.0], 9.0), V[4]), "process_noise: expected .*propagate.*got a VectorSensor; swap them"),
    ((Gyroscope(0.01), CLOSE), r"measurement_noise: .*array of shape \(3, 3\); .*Bingham.from_covariance"),
    ((CLOSE, V[4]), r"process_noise: .*array of shape \(3, 3\); .*Bingham.from_covariance"),
    ((0.3, V[4]), "process_noise: .* got 0.3; .*Diffusion"),
    ((Gyroscope, V[4]), "process_noise: .* got the class Gyroscope"),
    ((W[4], None), "measurement_noise: .* got None"),
])  # fmt: skip
def test_noises_that_are_none_are_named_when_the_filter_is_made(kind, arguments, message):
    with pytest.raises(InvalidArgumentError, match=message):
        kind(*arguments)


@pytest.mark.parametrize(("call", "message"), [
    (lambda: BinghamFilter(W[4], V[4], gate=0.999), r"gate: expected a Gate, got 0.999; write gate=Gate\(0.999\)"),
    (lambda: BinghamFilter(W[4], SHEER), "measurement_noise: .*BinghamMixture; MixtureFilter takes mixtures"),
    (lambda: SampledFilter(process_noise=CLOSE), "process_noise: expected a Bingham distribution"),
    (lambda: SecondOrderBinghamFilter(CLOSE, V[4]), "process_noise: expected a Bingham distribution"),
    (lambda: SpinState([1.0, 0, 0, 0], WIDE[4]), "orientation: .*got a list; make one by"),
])  # fmt: skip
def test_what_makes_no_filter_is_named(call, message):
    with pytest.raises(InvalidArgumentError, match=message):
        call()


@pytest.mark.parametrize("name", FILTERS)
def test_a_state_of_another_kind_is_named_and_its_hint(name):
    f, z = FILTERS[name][0], np.eye(4)[0]
    for state in (np.eye(4)[0], [1.0, 0.0, 0.0, 0.0], None):
        for call in (f.predict, lambda s: f.update(s, z)):
            with pytest.raises(InvalidArgumentError, match="state: expected a"):
                call(state)


@pytest.mark.parametrize(("call", "message"), [
    (lambda f: f.update(SHEER, np.eye(4)[0]), "state: .*MixtureFilter; one of the distributions"),
    (lambda f: f.predict(f.run(WIDE[4], np.eye(4))), "state: .*got a BinghamTrack; the last .* is track.final"),
    (lambda f: MixtureFilter(W[4], V[4]).update(WIDE[4], np.eye(4)[0]), "state: .*BinghamMixture.single"),
    (lambda f: SampledFilter().run(np.eye(4)[0], np.eye(4)), "prior: expected a Bingham distribution"),
    (lambda f: smooth_fixed_lag(WIDE[4], f, np.eye(4), 2), "bingham_filter: .*got a Bingham; the filter comes first"),
    (lambda f: smooth_fixed_interval(f, f.run(WIDE[4], np.eye(4)), np.eye(4)), "prior: .* got a BinghamTrack"),
    (lambda f: smooth_fixed_lag(f, WIDE[4], np.eye(4), 2.5), "lag: expected an integer"),
])  # fmt: skip
def test_laws_and_tracks_are_not_exchanged(call, message):
    with pytest.raises(InvalidArgumentError, match=message):
        call(BinghamFilter(W[4], V[4]))
