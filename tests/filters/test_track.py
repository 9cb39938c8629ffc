"""What every track can do, whichever filter made it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bingham import (
    Bingham,
    BinghamFilter,
    BinghamMixture,
    Diffusion,
    Gate,
    ImuFilter,
    InvalidArgumentError,
    MixtureFilter,
)
from bingham.baselines import GaussianState, QuaternionEkf
from bingham.rotations import compose, from_rotation_vector
from bingham.simulate import simulate_imu, simulate_tumbling

AXES = np.eye(4)[:, ::-1]
NOISE = Bingham([-400.0] * 3 + [0.0], AXES)
TIMES = np.arange(40) / 10.0


def measured():
    z = compose(from_rotation_vector(np.outer(TIMES, [0.0, 0.0, 0.3])), NOISE.rvs(40, rng=1))
    z[7] = np.nan
    z[20] = [0.0, 1.0, 0.0, 0.0]
    return z


@pytest.fixture(scope="module")
def track():
    return BinghamFilter(Diffusion(0.3), NOISE, gate=Gate(0.999)).run(Bingham.uniform(4), measured(), times=TIMES)


def test_rows_and_seconds(track):
    assert len(track) == 40 and track.missing.sum() == track.rejected.sum() == 1
    part = track[5:25]
    np.testing.assert_array_equal(part.modes, track.modes[5:25])
    np.testing.assert_array_equal(part.concentrations, track.concentrations[5:25])
    np.testing.assert_array_equal(part.final.M, track.distributions[24].M)
    assert part.reasons()[2] == "missing" and "NIS" in part.reasons()[15]
    np.testing.assert_array_equal(track.between(0.5, 2.5).time, track.time[5:25])
    used = track[track.accepted]
    assert len(used) == 38 and used.accepted.all() and used.final is track.final
    assert track[3].modes.shape == (1, 4) and track[[4, 2]].time.tolist() == [0.4, 0.2]
    assert len(track[:0]) == 0 and track[:0].final is None
    assert track[-3:].final is track.final


def test_angles_and_rotations(track):
    expected = Rotation.from_quat(track.modes, scalar_first=True)
    assert (track.rotations * expected.inv()).magnitude().max() < 1e-12
    np.testing.assert_allclose(track.as_euler("ZYX", degrees=True), expected.as_euler("ZYX", degrees=True))
    drift = np.polyfit(track.time[5:], np.unwrap(track.as_euler()[5:, 0]), 1)[0]
    assert drift == pytest.approx(0.3, abs=0.02)
    planar = BinghamFilter(Diffusion(0.1, 2), Bingham([-9.0, 0.0], np.eye(2)[:, ::-1]))
    with pytest.raises(InvalidArgumentError, match="d = 2"):
        planar.run(Bingham.uniform(2), np.eye(2), times=[0.0, 1.0]).as_euler()


def test_dataframe(track):
    pytest.importorskip("pandas")
    frame = track.to_dataframe()
    assert list(frame.columns) == [
        "time_s", "qw", "qx", "qy", "qz", "log_evidence", "nis", "accepted", "missing", "z1", "z2", "z3", "z4",
    ]  # fmt: skip
    np.testing.assert_array_equal(frame[["qw", "qx", "qy", "qz"]], track.modes)
    assert frame.accepted.sum() == 38 and frame.missing.sum() == 1
    batch = BinghamFilter(NOISE, NOISE).run(Bingham.uniform(4), np.stack([measured()] * 3)).to_dataframe()
    assert len(batch) == 120 and batch.sequence.tolist() == [0] * 40 + [1] * 40 + [2] * 40


def test_repr_is_short(track):
    assert repr(track).startswith("<BinghamTrack of 40 rows, d = 4, 0 to 3.9 s: 38 accepted, 1 rejected, 1 missing;")
    kalman = QuaternionEkf(1e-3 * np.eye(4), 1e-2 * np.eye(4))
    state = GaussianState(np.eye(4)[0], np.eye(4))
    for thing in (track[:2], kalman.run(state, measured()), kalman.run(state, measured()).states, state):
        assert len(repr(thing).splitlines()) <= 3 and len(repr(thing)) < 240


def test_batches_and_other_states_slice_alike():
    z = np.stack([measured(), measured()[::-1]])
    batch = BinghamFilter(NOISE, NOISE).run(Bingham.uniform(4), z)
    np.testing.assert_array_equal(batch[10:12].matrices, batch.matrices[:, 10:12])
    prior = GaussianState(np.eye(4)[0], 0.1 * np.eye(4))
    kalman = QuaternionEkf(1e-3 * np.eye(4), 1e-2 * np.eye(4)).run(prior, z)
    np.testing.assert_array_equal(kalman[10:12].states.mean, kalman.states.mean[:, 10:12])
    np.testing.assert_array_equal(kalman[10:12].final.covariance, kalman.states.covariance[:, 11])
    mixture = MixtureFilter(NOISE, NOISE).run(BinghamMixture.single(Bingham.uniform(4)), z[0])
    assert mixture[10:12].final is mixture.states[11]


def test_keep():
    f, z = BinghamFilter(Diffusion(0.3), NOISE), measured()
    whole, modes, last = (f.run(Bingham.uniform(4), z, times=TIMES, keep=k) for k in ("all", "modes", "last"))
    np.testing.assert_array_equal(modes.modes, whole.modes)
    np.testing.assert_array_equal(modes.final.M, whole.final.M)
    assert modes[:3].final is None and len(last) == 1 and last.time.tolist() == [3.9]
    with pytest.raises(InvalidArgumentError, match="keep: expected 'all'"):
        _ = modes.concentrations


def test_plot(track, tmp_path):
    pytest.importorskip("matplotlib")
    ax = track.plot()
    assert [line.get_label() for line in ax.lines] == ["yaw", "pitch", "roll", "rejected"]
    np.testing.assert_allclose(ax.lines[0].get_ydata(), track.as_euler(degrees=True)[:, 0])
    assert track.plot(ax) is ax
    ax.figure.savefig(tmp_path / "angles.png")
    planar = BinghamFilter(Diffusion(0.1, 2), Bingham([-9.0, 0.0], np.eye(2)[:, ::-1]))
    axes = [[0.0, 1.0], [-1e-3, -1.0]]
    angle = planar.run(Bingham.uniform(2), axes, times=[0.0, 1.0]).plot().lines[0].get_ydata()
    assert abs(abs(angle[0]) - 90.0) < 1.0 and np.isnan(angle[1])  # the axis came round: no line across


def test_inertial_tracks_do_the_same():
    motion = simulate_tumbling(3.0, 100.0, rng=0, rest_s=1.0)
    track = ImuFilter().run(simulate_imu(motion, rng=1))
    assert len(repr(track).splitlines()) == 1
    part = track[50:100]
    np.testing.assert_array_equal(part.covariance(frame="body"), track.covariance(frame="body")[50:100])
    assert part.final is None and track[1:].final is track.final
    np.testing.assert_array_equal(track.between(1.0, 2.0).bias, track.bias[100:200])
    assert np.all(track.decision[track.magnetometer_code == 1] == 1) and track.accepted.sum() > 100
    assert (track[-1:].rotations * Rotation.from_quat(track.modes[-1], scalar_first=True).inv()).magnitude() < 1e-12
