"""Sequences through vector and heading sensors, by the compiled loop and row by row."""

import numpy as np
import pytest

from bingham import Bingham, BinghamFilter, Gate, Gyroscope, HeadingSensor, InvalidArgumentError, VectorSensor
from bingham.filters.smoother import smooth_fixed_interval
from bingham.metrics import geodesic_error
from bingham.models import RandomWalk
from bingham.rotations import compose, conjugate, from_rotation_vector, rotate

IDENTITY_LAST = np.eye(4)[:, ::-1]
NOISE = Bingham([-300.0, -300.0, -300.0, 0.0], IDENTITY_LAST)
FIELD = np.array([0.0, 0.4, -0.9]) / np.hypot(0.4, 0.9)


class Stepwise(BinghamFilter):
    """The same filter without its compiled loop."""

    @property
    def batched(self):
        return False

    def _compiled(self, prior, rows):
        return None


@pytest.fixture(scope="module")
def turning():
    """Irregular times, rates, body vectors of the field (0.02 rad of noise) and orientations of a tumbling body."""
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.02, 0.08, 400))
    rate = np.column_stack([np.sin(t), 0.7 * np.cos(0.6 * t), np.full_like(t, 0.4)])
    q = np.empty((len(t), 4))
    q[0] = [0.5, 0.5, -0.5, 0.5]
    for k in range(1, len(t)):
        q[k] = compose(q[k - 1], from_rotation_vector(rate[k] * (t[k] - t[k - 1])))
    body = rotate(conjugate(q), FIELD) + 0.02 * rng.normal(size=(len(t), 3))
    return t, rate, body, q


def test_a_gyroscope_and_one_vector_know_all_but_the_turn_about_it(turning):
    t, rate, body, q = turning
    seen = body.copy()
    seen[100:140] = np.nan
    f = BinghamFilter(Gyroscope(0.01), VectorSensor(FIELD, 1.0 / 0.02**2))
    track = f.run(Bingham.uniform(4), seen, controls=rate, times=t)
    assert np.all(track.decision[100:140] == -1) and np.all(track.decision[:100] == 1)
    # the rotation about a direction fixed in the world shows in neither sensor: a girdle for ever
    assert np.all(track.concentrations[:, 2] > -1e-6) and np.all(track.concentrations[50:, 1] < -100.0)
    truth = rotate(conjugate(q), FIELD)
    off = np.arccos(np.clip(np.sum(rotate(conjugate(track.modes), FIELD) * truth, axis=-1), -1.0, 1.0))
    assert np.degrees(off[20:]).max() < 3.0
    start = Bingham.from_covariance(q[0], 1e-4 * np.eye(3), frame="body")
    known = f.run(start, seen, controls=rate, times=t)
    assert np.degrees(2.0 * geodesic_error(known.modes, q)).max() < 6.0
    reversed_rate = f.run(start, seen, controls=-rate, times=t)
    assert np.degrees(2.0 * geodesic_error(reversed_rate.modes, q)).max() > 30.0


def test_the_last_distribution_alone_and_a_gate(turning):
    t, rate, body, _ = turning
    wrong = body.copy()
    wrong[300] = -body[300]
    f = BinghamFilter(Gyroscope(0.01), VectorSensor(FIELD, 1.0 / 0.02**2), gate=Gate(0.999))
    track = f.run(Bingham.uniform(4), wrong, controls=rate, times=t)
    last = f.run(Bingham.uniform(4), wrong, controls=rate, times=t, keep="last")
    assert track.decision[300] == 0 and track.nis[300] > track.threshold
    assert len(last) == 1
    np.testing.assert_array_equal(last.modes[0], track.modes[-1])


def test_headings_sharpen_a_level_body():
    prior = Bingham.from_covariance([1.0, 0.0, 0.0, 0.0], np.diag([1e-3, 1e-3, 0.5]), frame="world")
    noise = Bingham([-1e6, -1e6, -1e6, 0.0], IDENTITY_LAST)
    track = BinghamFilter(noise, HeadingSensor(100.0)).run(prior, np.tile([0.3, 1.0, -2.0], (20, 1)))
    variance = track.covariance(frame="world")[:, 2, 2]
    assert variance[-1] < 0.15 * variance[0]
    north = rotate(track.modes[-1], [0.3, 1.0, -2.0])
    assert abs(np.arctan2(north[0], north[1])) < 0.02


@pytest.mark.parametrize("d", [2, 4])
def test_rows_and_the_compiled_loop_agree(d):
    axes = np.eye(d)[:, ::-1]
    noise, sensor = Bingham([*np.linspace(-90, -40, d - 1), 0.0], axes), Bingham([*np.full(d - 1, -30.0), 0.0], axes)
    f = BinghamFilter(noise, sensor, gate=Gate(0.9))
    y = sensor.rvs(60, rng=5)
    y[20:25] = np.nan
    times = np.arange(60.0)
    compiled = f.run(Bingham.uniform(d), y, times=times)
    rows = Stepwise(noise, sensor, gate=Gate(0.9)).run(Bingham.uniform(d), y, times=times)
    assert 0 < np.sum(compiled.decision == 0) < 30
    np.testing.assert_array_equal(rows.decision, compiled.decision)
    np.testing.assert_allclose(rows.concentrations, compiled.concentrations, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(rows.log_evidence, compiled.log_evidence, atol=1e-9)
    np.testing.assert_allclose(rows.nis, compiled.nis, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(rows.time, compiled.time)


def test_mistakes_are_named_with_their_row(turning):
    t, rate, body, _ = turning
    f = BinghamFilter(Gyroscope(0.01), VectorSensor(FIELD, 100.0))
    bad = body.copy()
    bad[7, 1] = np.nan
    with pytest.raises(InvalidArgumentError, match=r"measurements: expected complete rows.* at row 7"):
        f.run(Bingham.uniform(4), bad, controls=rate, times=t)
    zero = body.copy()
    zero[7] = 0.0
    with pytest.raises(InvalidArgumentError, match=r"measurements: expected a non-zero vector, .* at row 7"):
        f.run(Bingham.uniform(4), zero, controls=rate, times=t)
    with pytest.raises(InvalidArgumentError, match="z: expected") as caught:
        Stepwise(f.motion, f.sensors[0]).run(Bingham.uniform(4), zero, controls=rate, times=t)
    assert caught.value.__notes__ == ["in row 7 of the sequence"]
    with pytest.raises(InvalidArgumentError, match="controls: expected 400 rows"):
        f.run(Bingham.uniform(4), body, controls=rate[:9], times=t)
    with pytest.raises(InvalidArgumentError, match="one by one"):
        Stepwise(f.motion, f.sensors[0]).run(Bingham.uniform(4), body[None], controls=rate, times=t)
    with pytest.raises(InvalidArgumentError, match="times: expected seconds"):
        f.run(Bingham.uniform(4), body, controls=rate)


def test_vectors_are_smoothed_too(turning):
    t, rate, body, q = turning
    seen = body[:200].copy()
    seen[100:140] = np.nan
    f = BinghamFilter(Gyroscope(0.05), VectorSensor(FIELD, 1.0 / 0.02**2))
    start = Bingham.from_covariance(q[0], 1e-4 * np.eye(3), frame="body")
    given = {"controls": rate[:200], "times": t[:200]}
    filtered, smoothed = f.run(start, seen, **given), smooth_fixed_interval(f, start, seen, **given)
    np.testing.assert_allclose(smoothed.concentrations[-1], filtered.concentrations[-1], rtol=1e-6)

    def error(track):
        to_field = np.sum(rotate(conjugate(track.modes), FIELD) * rotate(conjugate(q[:200]), FIELD), axis=-1)
        return np.sqrt(np.mean(np.arccos(np.clip(to_field, -1.0, 1.0)) ** 2))

    assert error(smoothed) < 0.8 * error(filtered)
    with pytest.raises(InvalidArgumentError, match="bingham_filter: expected sensors whose likelihood"):
        smooth_fixed_interval(BinghamFilter(Gyroscope(0.05), HeadingSensor(50.0)), start, seen, **given)


def test_lengths_of_vectors_do_not_matter_and_none_is_missing():
    f = BinghamFilter(RandomWalk(NOISE), [VectorSensor(FIELD, 50.0), HeadingSensor(20.0)])
    vectors = np.array([[0.1, 0.3, -0.8], [0.2, 0.4, -0.7], [0.0, 0.5, -0.9]])
    plain = f.run(Bingham.uniform(4), (vectors, None))
    for size in (1e-200, 1e200):
        scaled = f.run(Bingham.uniform(4), (size * vectors, None))
        np.testing.assert_allclose(scaled.concentrations, plain.concentrations, rtol=1e-12, atol=1e-12)
    assert plain.decision.tolist() == [[1, -1]] * 3
    _, info = f.update(Bingham.uniform(4), (vectors[0], None))
    assert info.decisions == (1, -1)
    assert VectorSensor(FIELD, 50.0) == VectorSensor(2.0 * FIELD, 50.0) and len({*f.sensors, *f.sensors}) == 2
