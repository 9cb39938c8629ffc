"""Every reader on files that nobody on this project made."""

import warnings

import numpy as np
import pytest

from bingham.io import RecordingWarning, detect_format, read_recording
from bingham.recording import ImuRecording, OrientationRecording


@pytest.mark.parametrize(
    ("original", "kept"),
    [
        ("01_undisturbed_slow_rotation_A.mat", "01_undisturbed_slow_rotation_A.npz"),
        ("32_disturbed_attached_magnet_1cm.hdf5", "32_disturbed_attached_magnet_1cm.npz"),
    ],
)
def test_broad_originals_agree_with_the_rounded_npz(data, original, kept):
    one = read_recording(data / "broad_original" / original)
    two = read_recording(data / "broad" / kept)
    assert detect_format(data / "broad_original" / original) == "broad"
    np.testing.assert_allclose(one.time, two.time, rtol=1e-12)
    assert one.time[1] == pytest.approx(7 / 2000, rel=1e-9)  # 2000/7 Hz
    for name in ("gyroscope", "accelerometer", "magnetometer"):  # float32
        np.testing.assert_allclose(getattr(two, name), getattr(one, name), rtol=1e-7, atol=1e-12)
    np.testing.assert_array_equal(np.isnan(one.reference), np.isnan(two.reference))
    known = np.isfinite(one.reference[:, 0])
    dot = np.abs(np.sum(one.reference[known] * two.reference[known], axis=1))
    angle = 2 * np.arccos(np.minimum(dot, 1))
    assert np.degrees(angle.max()) < 0.0035  # 16 bits
    np.testing.assert_array_equal(one.scored, two.scored)
    np.testing.assert_allclose(np.linalg.norm(one.accelerometer[:2000].mean(axis=0)), 9.81, atol=0.1)


def test_tum_text_is_normalised_with_a_warning_and_matches_its_npz(data):
    with pytest.warns(RecordingWarning, match=r"largest deviation from unit norm 8\.4e-05 at line 391"):
        text = read_recording(data / "tum_text" / "freiburg1_xyz-groundtruth.txt")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        archive = read_recording(data / "trajectories" / "tum_fr1_xyz_groundtruth.npz")
    assert "normalised" in str(caught[0].message)
    assert isinstance(text, OrientationRecording)
    assert text.size == archive.size == 3000
    np.testing.assert_allclose(np.linalg.norm(text.orientation, axis=1), 1, atol=1e-15)
    np.testing.assert_allclose(text.time, archive.time, atol=1e-5)
    np.testing.assert_allclose(text.position, archive.position, atol=1e-6)
    dot = np.abs(np.sum(text.orientation * archive.orientation, axis=1))
    np.testing.assert_allclose(dot, 1, atol=1e-7)
    first = np.array([-0.3986, 0.6132, 0.5962, -0.3311])  # the file's first line, scalar first
    np.testing.assert_allclose(text.orientation[0], first, atol=1e-4)


def test_measured_orientations_come_with_their_truth(data):
    arm = read_recording(data / "handeye" / "robot_arm.npz")
    assert (arm.size, arm.dim, arm.scored.sum()) == (1703, 4, 1687)
    angle = 2 * np.arccos(np.minimum(np.abs(np.sum(arm.orientation * arm.truth, axis=1)), 1))[arm.scored]
    assert np.degrees(np.median(angle)) == pytest.approx(0.44, abs=0.01)  # as its README says
    camera = read_recording(data / "handeye" / "prime_sense_1.npz")
    angle = 2 * np.arccos(np.minimum(np.abs(np.sum(camera.orientation * camera.truth, axis=1)), 1))
    assert np.degrees(np.median(angle)) == pytest.approx(1.04, abs=0.01)


def test_imu_without_magnetometer_and_truth_on_its_own_clock(data):
    room = read_recording(data / "tumvi" / "room4.npz")
    assert isinstance(room, ImuRecording)
    assert room.magnetometer is None
    assert room.truth.size == 13075
    assert room.truth.position.shape == (13075, 3)
    assert room.size / room.duration_s == pytest.approx(199.4, abs=0.1)


def test_every_trial_reads(data):
    files = sorted([*data.glob("broad/*.npz"), *data.glob("smartphone/*.npz")])
    assert files
    for file in files:
        recording = read_recording(file)
        assert recording.name == file.stem
        assert recording.scored.any()
