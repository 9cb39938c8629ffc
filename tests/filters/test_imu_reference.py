"""The compiled inertial filter against its model in plain NumPy (`imu_reference`), on a recorded motion."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from bingham import ImuFilter, ImuRecording

HERE = Path(__file__).parent
SAMPLES = 3000  # 10 s at 286 Hz


def reference():
    """Load the module beside this file, whatever the import mode of the tests."""
    spec = importlib.util.spec_from_file_location("imu_reference", HERE / "imu_reference.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Reference


def filtered(filter, r):
    """Return orientations (N, 4), covariances (N, 3, 3) and biases (N, 3)."""
    rate, force = np.array(r.gyroscope), np.array(r.accelerometer)
    field = None if r.magnetometer is None else np.array(r.magnetometer)
    one, rows = reference()(filter, r.time[0], rate[0], force[0]), []
    for k, t in enumerate(r.time):
        if k:
            if one.sum.dt >= filter.update_interval - 5e-7:
                one.update()
            one.gyroscope(t, rate[k])
            one.accelerometer(t, force[k])
        if field is not None:
            one.magnetometer(field[k])
        rows.append((*one.report(), one.b))
    return [np.array(column) for column in zip(*rows, strict=True)]


@pytest.mark.parametrize(("start", "magnetometer"), [(0, True), (12000, False)])
def test_same_numbers_on_a_recording(start, magnetometer):
    content = np.load(HERE.parent / "data" / "broad_06_excerpt.npz")
    gyroscope, accelerometer, field = (content[k][start : start + SAMPLES].astype(float) for k in ("gyr", "acc", "mag"))
    time = np.arange(SAMPLES) / float(content["rate"])
    r = ImuRecording("excerpt", time, gyroscope, accelerometer, field if magnetometer else None)
    track = ImuFilter().run(r)
    faults = track.final.faults
    assert not any(faults.values()), faults  # of which the reference knows nothing
    modes, covariance, bias = filtered(ImuFilter(), r)
    sign = np.sign(np.sum(modes * track.modes, axis=1, keepdims=True))
    np.testing.assert_allclose(sign * modes, track.modes, rtol=0, atol=1e-9)
    np.testing.assert_allclose(covariance, track.rotation_covariance, rtol=0, atol=1e-9)
    np.testing.assert_allclose(bias, track.bias, rtol=0, atol=1e-9)
    if magnetometer:
        other = ImuFilter(magnetometer_time=1.1).run(r)
        assert np.abs(other.modes - track.modes).max() > 1e-6  # the comparison would notice
