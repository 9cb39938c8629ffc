"""Orientations beside the gyroscope: a camera with outliers, a bias, gaps, and no accelerometer."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from bingham import Bingham, BinghamFilter, Gyroscope, ImuFilter, ImuRecording
from bingham.errors import InvalidArgumentError, RecordingWarning
from bingham.filters import Gate, ImuStream, align_orientations
from bingham.recording import OrientationRecording, amended

FloatArray = NDArray[np.float64]
RATE, NOISE = 100.0, 0.01
BIAS = np.array([0.02, -0.02, 0.02])
# Simulated sensors have neither delay nor mounting.
FILTER = ImuFilter(gyroscope_delay=0.0, alignment_error=0.0)


class Body:
    """A tumbling body, its gyroscope with bias, its accelerometer, and a camera."""

    def __init__(self, seed: int, seconds: float = 60.0, camera_times: FloatArray | None = None) -> None:
        rng = np.random.default_rng(seed)
        self.time = np.arange(int(seconds * RATE)) / RATE
        phases = rng.uniform(0.0, 6.0, (3, 3))
        frequency = np.array([0.11, 0.27, 0.7])
        rate = 1.2 * np.sin(2.0 * np.pi * self.time[:, None, None] * frequency + phases).sum(axis=-1)
        steps = [Rotation.random(random_state=seed), *Rotation.from_rotvec(rate[1:] / RATE)]
        q = [steps[0]]
        for step in steps[1:]:
            q.append(q[-1] * step)
        self.truth = Rotation.concatenate(q)
        self.gyroscope = rate + BIAS + 2e-3 * rng.standard_normal(rate.shape)
        self.accelerometer = self.truth.inv().apply([0.0, 0.0, 9.81]) + 0.05 * rng.standard_normal(rate.shape)
        times = np.arange(0.113, seconds - 0.1, 0.5) if camera_times is None else camera_times
        seen = Rotation.from_rotvec(NOISE * rng.standard_normal((len(times), 3))) * Slerp(self.time, self.truth)(times)
        self.wrong = rng.random(len(times)) < 0.1
        self.wrong[:2] = False
        random = Rotation.random(len(times), random_state=seed + 1)
        q = np.where(self.wrong[:, None], random.as_quat(scalar_first=True), seen.as_quat(scalar_first=True))
        self.camera = (times, q, NOISE**2 * np.eye(3), "world")

    def recording(self, *, accelerometer: bool = True) -> ImuRecording:
        return ImuRecording(
            "s", self.time, self.gyroscope, self.accelerometer if accelerometer else None, orientations=self.camera
        )

    def error(self, modes: FloatArray, start: float = 2.0) -> float:
        """RMS of the rotation error in degrees from `start` on."""
        rows = self.time > start
        e = Rotation.from_quat(modes[rows], scalar_first=True) * self.truth[rows].inv()
        return float(np.degrees(np.sqrt(np.mean(e.magnitude() ** 2))))


@pytest.mark.parametrize("accelerometer", [True, False])
@pytest.mark.parametrize("seed", [11, 12])
def test_camera_with_outliers_and_a_bias(seed: int, accelerometer: bool) -> None:
    body = Body(seed)
    for track in (FILTER.run(body.recording(accelerometer=accelerometer)),
                  FILTER.smooth(body.recording(accelerometer=accelerometer))):  # fmt: skip
        assert body.error(track.modes, 20.0) < 0.5
        assert np.all(np.abs(track.bias[-1] - BIAS) < 3.0 * track.bias_std[-1])
        assert track.bias_std[-1].max() < 0.002
        np.testing.assert_array_equal(track.orientations.rejected[2:-1], body.wrong[2:-1])
        assert np.all(track.orientations.log_evidence[2:-1][body.wrong[2:-1]] < 0.0)
        rows = body.time > 2.0
        e = (Rotation.from_quat(track.modes[rows], scalar_first=True) * body.truth[rows].inv()).as_rotvec()
        nees = np.einsum("ni,nij,nj->n", e, np.linalg.inv(track.covariance(frame="world")[rows]), e)
        assert np.mean(nees < 16.3) > 0.98  # three deviations of three numbers: 0.999
    without = FILTER.run(amended(body.recording(), orientations=None))
    assert np.isnan(body.error(without.modes)) or body.error(without.modes) > 5.0  # the camera is what does it


@pytest.mark.parametrize("rate", [30.0, 170.0])
def test_any_times_and_gaps(rate: float) -> None:
    rng = np.random.default_rng(5)
    times = np.sort(rng.uniform(0.0, 39.9, int(40 * rate)))
    times = times[(times < 10.0) | (times > 15.0)]  # the camera is blind
    body = Body(21, 40.0, times)
    there = (body.time < 25.0) | (body.time > 28.0)  # so is the gyroscope
    recording = body.recording(accelerometer=False)
    part = amended(recording, time=body.time[there], gyroscope=recording.gyroscope[there])
    modes = FILTER.run(part).modes
    late = (part.time > 5.0) & ((part.time < 25.0) | (part.time > 30.0))
    error = np.degrees((Rotation.from_quat(modes[late], scalar_first=True) * body.truth[there][late].inv()).magnitude())
    assert np.sqrt(np.mean(error**2)) < 0.5
    assert error.max() < 2.0


def test_parts_and_stream_equal_the_whole() -> None:
    body = Body(31, 8.0)
    recording = body.recording()
    whole = FILTER.run(recording)
    parts, state = [], None
    for rows in (slice(0, 217), slice(217, 400), slice(400, None)):
        part = ImuRecording("s", body.time[rows], body.gyroscope[rows], body.accelerometer[rows])
        object.__setattr__(part, "orientations", recording.orientations)
        track = FILTER.run(part, state=state)
        parts.append(track.modes)
        state = track.final
    np.testing.assert_array_equal(np.concatenate(parts), whole.modes)
    stream, given = ImuStream(FILTER), recording.orientations
    waiting = list(zip(given.time, given.orientation, given.covariance, strict=True))
    for k, t in enumerate(body.time):
        while waiting and waiting[0][0] < t:
            stream.orientation(*waiting.pop(0), frame="world")
        stream.gyroscope(t, body.gyroscope[k])
        stream.accelerometer(t, body.accelerometer[k])
        if k % 50 == 0:
            np.testing.assert_allclose(stream.orientation, whole.modes[k], rtol=0, atol=1e-12)
    assert stream.orientation_decision[0] == 1
    assert stream.log_evidence == pytest.approx(whole.log_evidence.sum(), rel=1e-9)


def test_covariance_in_body_axes_is_that_in_world_axes() -> None:
    body = Body(41, 4.0)
    t, q, _, _ = body.camera
    c = np.diag([1e-4, 4e-4, 9e-4])
    r = Rotation.from_quat(q, scalar_first=True).as_matrix()
    tracks = [
        FILTER.run(ImuRecording("s", body.time, body.gyroscope, orientations=(t, q, given, frame)))
        for given, frame in ((c, "body"), (r @ c @ np.swapaxes(r, 1, 2), "world"))
    ]
    np.testing.assert_allclose(tracks[0].modes, tracks[1].modes, rtol=0, atol=1e-12)


def test_a_gate_that_rejects_most_says_so() -> None:
    body = Body(51, 20.0)
    t, q, c, frame = body.camera
    mounted = (Rotation.from_quat(q, scalar_first=True) * Rotation.from_rotvec([0.5, -0.4, 0.9])).as_quat(
        scalar_first=True
    )
    with pytest.warns(RecordingWarning, match=r"of \d+ orientations rejected.*align_orientations"):
        FILTER.run(
            ImuRecording("s", body.time, body.gyroscope, body.accelerometer, orientations=(t, mounted, c, frame))
        )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        FILTER.run(body.recording())


def test_first_order_filter_says_that_a_bias_makes_its_gate_reject_most() -> None:
    body = Body(52, 60.0)
    t, q, c, _ = body.camera
    noise = Bingham.from_covariance([1.0, 0.0, 0.0, 0.0], c, frame="world")
    rows = np.full((len(body.time), 4), np.nan)
    rows[np.searchsorted(body.time, t)] = q
    f = BinghamFilter(Gyroscope(2e-4), noise, gate=Gate(0.999))
    with pytest.warns(RecordingWarning, match=r"the gate rejected \d+ of \d+ measurements.*gyroscope biased"):
        f.run(Bingham.uniform(4), rows, controls=body.gyroscope, times=body.time)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        f.run(Bingham.uniform(4), rows, controls=body.gyroscope - BIAS, times=body.time)


@pytest.mark.parametrize("accelerometer", [True, False])
def test_constant_rotations_are_found(accelerometer: bool) -> None:
    body = Body(55)
    t, q, _, _ = body.camera
    mounting, world = Rotation.from_rotvec([0.5, -1.4, 0.9]), Rotation.from_rotvec([1.2, 0.3, -2.0])
    seen = world * Rotation.from_quat(q, scalar_first=True) * mounting
    recording = amended(body.recording(accelerometer=accelerometer), orientations=(t, seen))
    found = align_orientations(recording, world=accelerometer)
    off = (Rotation.from_quat(found.mounting, scalar_first=True) * mounting.inv()).magnitude()
    assert off < 3.0 * found.mounting_std < 0.03
    assert found.noise == pytest.approx(NOISE, rel=0.15)
    left = Rotation.from_quat(found.world, scalar_first=True) * world
    up = left.apply([0.0, 0.0, 1.0])
    assert not accelerometer or np.arccos(up[2]) < 0.005
    track = FILTER.run(amended(recording, orientations=found.apply(recording.orientations)))
    rows = body.time > 20.0
    e = Rotation.from_quat(track.modes[rows], scalar_first=True) * (left * body.truth[rows]).inv()
    assert np.sqrt(np.mean(e.magnitude() ** 2)) < np.radians(0.7)
    np.testing.assert_array_equal(track.orientations.rejected[2:], body.wrong[2:])


def test_what_cannot_be_aligned_is_said() -> None:
    body = Body(56, 20.0)
    t, q, _, _ = body.camera
    spin = np.zeros_like(body.gyroscope)
    spin[:, 2] = 1.0
    turned = Rotation.from_rotvec(np.outer(t, [0.0, 0.0, 1.0]))
    about_one_axis = ImuRecording("s", body.time, spin, orientations=(t, turned))
    with pytest.raises(InvalidArgumentError, match=r"shows the mounting.*all their axes"):
        align_orientations(about_one_axis, world=False)
    with pytest.raises(InvalidArgumentError, match=r"world.*accelerometer"):
        align_orientations(about_one_axis)
    backwards = Rotation.from_quat(q, scalar_first=True).inv()
    with pytest.raises(InvalidArgumentError, match=r"rotations as the gyroscope's.*world to body"):
        align_orientations(amended(body.recording(), orientations=(t, backwards)))
    with pytest.raises(InvalidArgumentError, match="at least 10 pairs"):
        align_orientations(amended(body.recording(), orientations=(t[:5], q[:5])))


def test_a_slow_turn_is_no_bias_where_a_camera_sees_it() -> None:
    t = np.arange(6000) / RATE
    rng = np.random.default_rng(8)
    truth = Rotation.from_rotvec(np.outer(t, [0.0, 0.0, 0.12]))
    gyroscope = np.array([0.0, 0.0, 0.12]) + 1e-3 * rng.standard_normal((len(t), 3))
    force = np.array([0.0, 0.0, 9.81]) + 0.02 * rng.standard_normal((len(t), 3))
    seen = Rotation.from_rotvec(NOISE * rng.standard_normal((120, 3))) * truth[::50]
    for accelerometer in (force, None):
        track = FILTER.run(ImuRecording("s", t, gyroscope, accelerometer, orientations=(t[::50], seen)))
        error = (Rotation.from_quat(track.modes[2000:], scalar_first=True) * truth[2000:].inv()).magnitude()
        assert np.sqrt(np.mean(error**2)) < np.radians(0.6)
        assert np.abs(track.bias[-1]).max() < 0.003
    alone = FILTER.run(ImuRecording("s", t, gyroscope, force))
    assert alone.bias[-1, 2] > 0.05  # without the camera it is taken for one


def test_relative_heading_is_what_six_axes_know() -> None:
    body = Body(61, 30.0)
    recording = amended(body.recording(), orientations=None, gyroscope=body.gyroscope - BIAS)
    track = FILTER.run(recording)
    std = track.relative_heading_std
    assert track.heading_std.min() > 1.5  # nothing is known of the heading itself
    assert 0.0 < std[-1] < np.radians(10.0)
    e = Rotation.from_quat(track.modes, scalar_first=True) * body.truth.inv()
    x = e.as_quat(scalar_first=True)
    drift = 2.0 * np.unwrap(np.arctan2(x[:, 3], x[:, 0]), period=np.pi)
    assert np.all(np.abs(drift - drift[0]) < 3.0 * std + 0.02)
    with_camera = FILTER.run(body.recording())
    assert np.isnan(with_camera.relative_heading_std[-1])
    assert np.isfinite(track[100:].relative_heading_std).all()


def test_mistakes_name_argument_and_hint() -> None:
    body = Body(71, 2.0)
    t, q, c, _ = body.camera
    ok = {"name": "s", "time": body.time, "gyroscope": body.gyroscope}
    cases = [
        ((t + 100.0, q), "orientations.*same zero"),
        ((t, q, c), "orientations.*body.*world"),
        ((t, q, c, "camera"), "frame.*body.*world"),
        ((t, q, 0.01, "body"), "orientations.*np.eye"),
        (q, "orientations.*tuple"),
        (OrientationRecording("flat", t, np.tile([1.0, 0.0], (len(t), 1))), "orientations.*quaternions"),
    ]
    for given, text in cases:
        with pytest.raises(InvalidArgumentError, match=f"(?s){text}"):
            ImuRecording(**ok, orientations=given)
    stream = ImuStream()
    with pytest.raises(InvalidArgumentError, match="frame"):
        stream.orientation(0.0, [1.0, 0.0, 0.0, 0.0], 0.01 * np.eye(3))
    with pytest.raises(InvalidArgumentError, match="q"):
        stream.orientation(0.0, [1.0, 0.0, 0.0], 0.01 * np.eye(3), frame="body")
    wrong = replace(ImuRecording(**ok, orientations=(t, q)), orientations=None)
    with pytest.raises(InvalidArgumentError, match="accelerometer"):
        ImuFilter().run(wrong)


def test_a_track_tells_of_its_sensors_not_of_samples_of_sensors_that_are_not_there() -> None:
    body = Body(3, seconds=20.0)
    track = FILTER.run(body.recording(accelerometer=False))
    used, rejected = int(track.orientations.used.sum()), int(track.orientations.rejected.sum())
    assert rejected > 0
    assert f": {used} orientations used, {rejected} rejected; log-evidence" in repr(track)
    assert "missing" not in repr(track)
    alone = FILTER.run(ImuRecording("s", body.time, body.gyroscope, body.accelerometer))
    assert ": no magnetometer; log-evidence" in repr(alone)
    field = body.truth.inv().apply([0.0, 20.0, -40.0])
    field[::2] = np.nan
    both = FILTER.run(ImuRecording("s", body.time, body.gyroscope, body.accelerometer, field))
    assert "magnetometer " in repr(both) and " accepted, 0 rejected" not in repr(both)
