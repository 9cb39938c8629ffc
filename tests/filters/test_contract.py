"""One loop for all filters: the same calls, the same words for a missing measurement, the same refusals."""

import re
import types
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham import (
    Bingham,
    BinghamFilter,
    BinghamMixture,
    Diffusion,
    Gate,
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
from bingham.errors import InvalidArgumentError, RecordingWarning
from bingham.filters import BankState, FilterBank, smooth_fixed_interval, smooth_fixed_lag
from bingham.filters.run import RecursiveFilter, each_step, run
from bingham.filters.second_order_mixture import SecondOrderMixtureFilter, SpinMixture
from bingham.metrics import geodesic_error
from bingham.models import ControlledRotation
from bingham.rotations import compose, conjugate, from_rotation_vector, rotate
from bingham.validation import check_kind, unit_rows

DT = 0.125
LENGTH, MISSING_ROW = 12, 6
RATE = np.array([0.2, -0.1, 0.3])
# BLAS rounds by the processor and by where an array lies; the runs of the filters here carry that to 1e-13 rad at most.
ROUNDING = 1e-9


def distribution(k, d):
    return Bingham([-k] * (d - 1) + [0.0], np.eye(d)[:, ::-1])


def log_likelihood(z, points):
    # No matrix product: how BLAS rounds depends on where a row lies in memory.
    return 80.0 * np.sum(points * z, axis=1) ** 2


class OwnFilter(RecursiveFilter):
    """A user's: predict and update, nothing else."""

    def predict(self, state, control=None, dt=None):
        check_kind(state, Bingham, "state")
        return state if control is None else state.rotate(right=unit_rows(control, 4, "control"))

    def update(self, state, z):
        check_kind(state, Bingham, "state")
        return BinghamFilter(W[4], V[4]).update(state, z)


def documented():
    """The filter of CONTRIBUTING.md."""
    text = (Path(__file__).resolve().parents[2] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    code = next(block for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "RecursiveFilter[" in block)
    module = types.ModuleType("documented")
    exec(code, vars(module))
    return module


DOCUMENTED = documented()
W = {d: distribution(3000.0, d) for d in (2, 4)}
V = {d: distribution(300.0, d) for d in (2, 4)}
WIDE = {d: distribution(3.0, d) for d in (2, 4)}
GAUSS = {d: GaussianState(np.eye(d)[0], 0.1 * np.eye(d)) for d in (2, 4)}
SMALL, SENSED = 1e-4 * np.eye(4), 1e-3 * np.eye(4)
SPIN = SpinningGaussian.independent(GaussianState(np.eye(4)[0], 0.1 * np.eye(4)), GaussianState(np.eye(4)[0], SENSED))
ANGLE, DOUBLED = AngleState(np.array(0.0), np.array(0.1)), DoubledAngleState(np.array(0.0), np.array(2.0))
SPINNER = SecondOrderBinghamFilter(W[4], V[4])
SPUN = SpinState(WIDE[4], distribution(1000.0, 4))
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
    "second_order": (SPINNER, SPUN, "spin"),
    "spin_mixture": (SecondOrderMixtureFilter(SPINNER), SpinMixture([SPUN], [1.0]), "spin"),
    "bank": (FilterBank(BANK), BankState([WIDE[4], WIDE[4]]), "turn"),
    "scalar_kalman": (ScalarKalmanFilter(1e-3, 1e-2), ANGLE, "turn"),
    "wrapped_normal": (WrappedNormalFilter(1e-3, 1e-2), DOUBLED, "turn"),
    "axial_kalman_2": (AxialKalmanFilter(SMALL[:2, :2], SENSED[:2, :2]), GAUSS[2], "turn"),
    "axial_kalman_4": (AxialKalmanFilter(SMALL, SENSED), GAUSS[4], "turn"),
    "ekf_left": (QuaternionEkf(SMALL, SENSED), GAUSS[4], "turn"),
    "ekf_right": (QuaternionEkf(SMALL, SENSED, noise_side="right", rotate_noise=True), GAUSS[4], "turn"),
    "ekf_second_order": (SecondOrderQuaternionEkf(SMALL, SENSED), SPIN, "spin"),
    "bingham_list": (BinghamFilter(Gyroscope(0.05), (V[4], V[4]), noise_side="left"), WIDE[4], "rate"),
    "mixture_diffusion": (MixtureFilter(Diffusion(0.05), V[4]), BinghamMixture.single(WIDE[4]), "turn"),
    "sampled_diffusion": (SampledFilter(process_noise=Diffusion(0.05), log_likelihood=log_likelihood), WIDE[4], "turn"),
    "bank_diffusion": (FilterBank([BinghamFilter(Diffusion(0.05), V[4])]), BankState([WIDE[4], W[4]]), "turn"),
    "ekf_second": (QuaternionEkf(SMALL, SENSED, per_second=True), GAUSS[4], "turn"),
    "scalar_second": (ScalarKalmanFilter(1e-3, 1e-2, per_second=True), ANGLE, "turn"),
    "wrapped_second": (WrappedNormalFilter(1e-3, 1e-2, per_second=True), DOUBLED, "turn"),
    "axial_second": (AxialKalmanFilter(SMALL, SENSED, per_second=True), GAUSS[4], "turn"),
    "own": (OwnFilter(), WIDE[4], "turn"),
    "documented": (DOCUMENTED.FixedGainFilter(0.5), DOCUMENTED.Orientation(np.eye(4)[0]), "turn"),
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
    if getattr(f, "in_list", False):
        z = np.hstack([z, z])
    controls = {"turn": turn, "rate": RATE, "spin": np.eye(d)[0]}[kind]
    return truth, z, np.tile(controls, (LENGTH, 1))


def times_of(f, irregular=True):
    """Return times that suit the filter, irregular ones if it scales with time, and the time of its prior."""
    steps = np.full(LENGTH, DT)
    if irregular and not f.noise_per_step:
        steps[1::2] = 0.5 * DT
    return np.cumsum(steps) - DT, -DT


def same(a, b):
    """Equal within what rounding can do: sums whose order depends on where arrays lie in memory, before fits to 1e-10.

    What is promised bit for bit, compiled runs and their states, is compared so elsewhere.
    """
    np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-9)


def test_run_is_predict_and_update_row_by_row(entry):
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
            assert info.log_evidence == 0.0 and np.all(np.isnan(info.nis))
            same(state.mode, predicted.mode)
        modes.append(state.mode)
        evidence.append(float(info.log_evidence))
    assert 2.0 * geodesic_error(np.array(modes)[-3:], truth[-3:]).max() < (0.3 if kind == "spin" else 0.1)

    times, start = times_of(f, irregular=False)
    given = {"controls": controls, "times": times, "start_time": start}
    steps = list(each_step(f, prior, z, **given))
    same([state.mode for state, _ in steps], modes)
    same([float(info.log_evidence) for _, info in steps], evidence)
    track = f.run(prior, z, **given)
    # Compiled loops round otherwise.
    assert geodesic_error(track.modes, modes).max() < 1e-10
    np.testing.assert_allclose(track.log_evidence, evidence, atol=1e-8)
    same(track.time, times)
    same(track.missing, np.arange(LENGTH) == MISSING_ROW)
    assert not track.rejected.any() and track.accepted.sum() == LENGTH - 1
    assert [r != "" for r in track.reasons()] == track.missing.tolist()
    assert track.total_log_evidence == pytest.approx(sum(evidence))


def test_a_run_in_parts_is_the_whole_run(entry):
    f, prior, kind = entry
    _, z, controls = recording(f, prior, kind)
    times, start = times_of(f)
    whole = f.run(prior, z, controls=controls, times=times, start_time=start)
    for cut in (1, MISSING_ROW, MISSING_ROW + 1, LENGTH - 1):
        first = f.run(prior, z[:cut], controls=controls[:cut], times=times[:cut], start_time=start)
        second = f.run(first.final, z[cut:], controls=controls[cut:], times=times[cut:], start_time=times[cut - 1])
        for name in ("modes", "log_evidence", "nis", "decision"):
            same(getattr(first, name), getattr(whole, name)[:cut])
            same(getattr(second, name), getattr(whole, name)[cut:])
        same(whole[:cut].final.mode, first.final.mode)


def test_what_a_track_keeps(entry):
    f, prior, kind = entry
    _, z, controls = recording(f, prior, kind)
    times, start = times_of(f)
    given = {"controls": controls, "times": times, "start_time": start}
    whole, modes, last = (f.run(prior, z, **given, keep=keep) for keep in ("all", "modes", "last"))
    same(modes.modes, whole.modes)
    assert modes.states is None and len(last) == 1
    for name in ("modes", "log_evidence", "nis", "decision", "time"):
        same(getattr(last, name), getattr(whole, name)[-1:])
    for track in (modes, last):
        same(track.final.mode, whole.final.mode)
    for t in (0, LENGTH - 1):
        same(whole.states[t].mode, whole.modes[t])
    assert len(repr(whole).splitlines()) <= 3 and len(repr(f)) < 1000
    assert len(repr(whole.final).splitlines()) <= 3


def test_times(entry):
    f, prior, kind = entry
    _, z, controls = recording(f, prior, kind)
    irregular = np.cumsum(np.where(np.arange(LENGTH) % 2, DT, 3.0 * DT))
    if f.noise_per_step:
        with pytest.raises(InvalidArgumentError, match=r"times: expected regular times.*Diffusion"):
            f.run(prior, z, controls=controls, times=irregular)
    else:
        f.run(prior, z, controls=controls, times=irregular)
    if f.needs_times:
        with pytest.raises(InvalidArgumentError, match="times: expected seconds"):
            f.run(prior, z, controls=controls)
    for wrong in (irregular[:-1], irregular[::-1], np.zeros(LENGTH), np.full(LENGTH, np.nan)):
        with pytest.raises(InvalidArgumentError, match="times: expected"):
            f.run(prior, z, controls=controls, times=wrong)
    with pytest.raises(InvalidArgumentError, match="times: expected strictly increasing"):
        f.run(prior, z, controls=controls, times=irregular, start_time=irregular[0] + 0.1)
    if not f.needs_times:
        with pytest.raises(InvalidArgumentError, match="start_time: expected None"):
            f.run(prior, z, controls=controls, start_time=0.0)


def test_only_motion_in_continuous_time_depends_on_the_length_of_a_step(entry):
    f, prior, kind = entry
    _, z, controls = recording(f, prior, kind)
    if f.needs_times:
        short, long = (f.update(f.predict(prior, controls[0], dt), z[0])[1] for dt in (DT, 100.0 * DT))
        assert short.log_evidence != long.log_evidence
        with pytest.raises(InvalidArgumentError, match="dt: expected a time step"):
            f.predict(prior, controls[0])
        return
    if kind == "spin":
        short, long = (f.update(f.predict(prior, controls[0], dt), z[0])[1] for dt in (DT, 8.0 * DT))
        assert short.log_evidence != long.log_evidence
        return
    first, *others = (f.update(f.predict(prior, controls[0], dt), z[0]) for dt in (None, DT, 100.0 * DT))
    for state, info in others:
        assert geodesic_error(state.mode, first[0].mode) < ROUNDING
        np.testing.assert_allclose(info.log_evidence, first[1].log_evidence, atol=ROUNDING)


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
        assert geodesic_error(again[0].mode, seen[0].mode) < ROUNDING
        np.testing.assert_allclose(again[1].log_evidence, seen[1].log_evidence, atol=ROUNDING)


def test_mistakes_are_named(entry):
    f, prior, kind = entry
    _, z, controls = recording(f, prior, kind)
    times, start = times_of(f)
    given = {"controls": controls, "times": times, "start_time": start}

    def fails(match, prior=prior, measurements=z, **other):
        with pytest.raises(InvalidArgumentError, match=match):
            f.run(prior, measurements, **given | other)

    fails("keep: expected 'all', 'modes' or 'last', got 'some'", keep="some")
    fails("measurements: expected shape", measurements=z[0])
    fails("measurements: expected shape .* no rows", measurements=z[:0])
    fails("measurements: expected an array of numbers", measurements="abc")
    fails(f"controls: expected {LENGTH} rows", controls=controls[:-1])
    partly = z.copy()
    partly[3, 0] = np.nan
    fails("complete rows", measurements=partly)
    if kind != "rate":
        long = controls.copy()
        long[4] *= 1.1
        fails("controls?: expected unit vectors", controls=long)
    for wrong in (np.eye(4)[0], None, f):
        fails("(prior|state): expected", prior=wrong)
    with pytest.raises(InvalidArgumentError, match=r"complete rows|log_likelihood"):
        f.update(f.predict(prior, controls[0], DT), partly[3])


def test_scipy_rotations_are_taken_wherever_a_quaternion_is(entry):
    f, prior, kind = entry
    _, z, controls = recording(f, prior, kind)
    if z.shape[1] == 2:
        with pytest.raises(InvalidArgumentError, match=r"expected shape|unit vector"):
            f.update(f.predict(prior, None, DT), Rotation.identity())
        return
    turn = controls[0] if kind == "rate" else Rotation.from_quat(controls[0], scalar_first=True)
    a, b = f.predict(prior, controls[0], DT), f.predict(prior, turn, DT)
    assert geodesic_error(a.mode, b.mode) < ROUNDING
    if isinstance(f, SampledFilter) or z.shape[1] != 4:
        return  # its measurements are the likelihood's own, or those of several sensors
    a, b = f.update(a, z[0])[0], f.update(b, Rotation.from_quat(z[0], scalar_first=True))[0]
    assert geodesic_error(a.mode, b.mode) < ROUNDING
    times, start = times_of(f)
    known = z.copy()
    known[MISSING_ROW] = known[0]
    seen = Rotation.from_quat(known, scalar_first=True)
    turns = controls if kind == "rate" else Rotation.from_quat(controls, scalar_first=True)
    a = f.run(prior, known, controls=controls, times=times, start_time=start)
    b = f.run(prior, seen, controls=turns, times=times, start_time=start)
    assert geodesic_error(a.modes, b.modes).max() < ROUNDING


@pytest.mark.parametrize("name", [n for n, (f, _, _) in FILTERS.items() if f.batched])
def test_a_batch_is_its_recordings(name):
    f, prior, kind = FILTERS[name]
    _, z, controls = recording(f, prior, kind)
    times, start = times_of(f)
    given = {"times": times, "start_time": start}
    batch = f.run(prior, np.stack([z, z[::-1]]), controls=np.stack([controls, controls]), **given)
    assert batch.modes.shape[:2] == batch.decision.shape[:2] == (2, LENGTH)
    for b, rows in enumerate((z, z[::-1])):
        alone = f.run(prior, rows, controls=controls, **given)
        assert geodesic_error(batch.modes[b], alone.modes).max() < 1e-10
        np.testing.assert_allclose(batch.log_evidence[b], alone.log_evidence, atol=1e-9)


def test_a_missing_measurement_is_no_rejected_one():
    # The two sensors of a filter for each way a row can go.
    f = BinghamFilter(Diffusion(0.05), [V[4], V[4]], gate=Gate(0.999))
    good, bad, none = np.eye(4)[0], np.eye(4)[1], np.full(4, np.nan)
    rows = np.array([np.hstack(pair) for pair in ((good, good), (good, bad), (bad, none), (none, none), (none, good))])
    for kind in (f, Stepwise(f.process_noise, f.measurement_noise, gate=f.gate)):
        track = kind.run(W[4], rows, times=DT * np.arange(5))
        assert track.decision.tolist() == [[1, 1], [1, 0], [0, -1], [-1, -1], [-1, 1]]
        assert track.accepted.tolist() == [True, False, False, False, True]
        assert track.rejected.tolist() == [False, True, True, False, False]
        assert track.missing.tolist() == [False, False, False, True, False]
        assert [bool(r) for r in track.reasons()] == [False, True, True, True, False]
        assert "sensor 2: NIS" in track.reasons()[1] and track.reasons()[3] == "missing"
        np.testing.assert_allclose(track.threshold, Gate(0.999).threshold(3))
    assert f.update(W[4], (good, none))[1].decisions == (1, -1)


class Stepwise(BinghamFilter):
    """The same filter without its compiled loop."""

    @property
    def batched(self):
        return False

    def _compiled(self, prior, rows):
        return None


def test_anything_with_predict_and_update_runs():
    f = BinghamFilter(W[4], V[4])

    class Plain:
        predict, update = f.predict, f.update

    z = recording(f, WIDE[4], "turn")[1]
    a, b = run(Plain, WIDE[4], z, times=DT * np.arange(LENGTH)), f.run(WIDE[4], z, times=DT * np.arange(LENGTH))
    np.testing.assert_allclose(a.matrices, b.matrices, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(a.decision, b.decision)


def test_a_gate_that_rejects_most_says_so():
    rng = np.random.default_rng(0)
    z = Bingham.uniform(4).rvs(20, rng=rng)
    f = BinghamFilter(Diffusion(0.01), V[4], gate=Gate(0.99))
    with pytest.warns(RecordingWarning, match=r"the gate rejected \d+ of 20 measurements, the first in row"):
        f.run(W[4], z, times=np.arange(20.0))
    calm = np.tile(np.eye(4)[0], (20, 1))
    calm[4] = np.eye(4)[1]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert f.run(W[4], calm, times=np.arange(20.0)).rejected.sum() == 1
    pair = BinghamFilter(Diffusion(0.01), [V[4], V[4]], gate=Gate(0.99))
    with pytest.warns(RecordingWarning, match="measurements of sensor 2"):
        pair.run(W[4], (calm, z), times=np.arange(20.0))


def test_other_sensors_follow_the_same_rule():
    up = np.array([0.0, 0.0, 1.0])
    f = BinghamFilter(Diffusion(0.1), VectorSensor(up, 100.0))
    state = f.predict(WIDE[4], None, DT)
    same, info = f.update(state, [np.nan] * 3)
    assert same is state and info.reason == "missing"
    body = rotate(conjugate(from_rotation_vector(RATE)), up)
    rows = np.array([body, np.full(3, np.nan), body])
    steps = each_step(f, WIDE[4], rows, times=[0.0, DT, 2 * DT])
    assert [info.accepted for _, info in steps] == [True, False, True]


def test_a_loop_names_the_row_of_a_mistake():
    f = MixtureFilter(W[4], V[4])
    z = np.tile(np.eye(4)[0], (5, 1))
    z[3] *= 1.1
    with pytest.raises(InvalidArgumentError) as caught:
        f.run(SHEER, z)
    assert caught.value.__notes__ == ["in row 3 of the sequence"]


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
