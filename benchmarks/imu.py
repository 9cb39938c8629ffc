"""Orientation from gyroscope, accelerometer and magnetometer: time a sample, and the error as a check of fairness."""

from __future__ import annotations

import numpy as np
from bingham import ImuFilter
from bingham.filters import InertialFilter
from bingham.metrics import broad_rmse
from bingham.simulate import simulate_imu, simulate_tumbling

from timing import Row, best_of, best_once

TOPIC = "IMU with magnetometer, 285.7 Hz"


def measure() -> list[Row]:
    """Return the rows of this topic."""
    import ahrs
    import vqf

    rate = 2000.0 / 7.0
    motion = simulate_tumbling(120.0, rate, rest_s=10.0, rng=1)
    recording = simulate_imu(motion, gyroscope_bias=(0.003, -0.002, 0.004), rng=2)
    gyr, acc, mag = recording.gyroscope.copy(), recording.accelerometer.copy(), recording.magnetometer.copy()
    n, part = len(gyr), 2000

    def ours():
        return ImuFilter().run(recording)

    def without_bias():
        return InertialFilter().run(recording)

    def peer_vqf():
        return vqf.VQF(1.0 / rate).updateBatch(gyr, acc, mag)

    def peer_basic():
        return vqf.BasicVQF(1.0 / rate).updateBatch(gyr, acc, mag)

    def peer_madgwick(k: int = part):
        return ahrs.filters.Madgwick(gyr[:k], acc[:k], mag[:k] * 1e3, frequency=rate).Q

    def peer_ekf(k: int = part):
        return ahrs.filters.EKF(gyr[:k], acc[:k], frequency=rate, frame="ENU").Q

    def error(modes: np.ndarray) -> str:
        total = broad_rmse(modes, recording.reference, recording.scored).total
        return f"total RMSE {np.degrees(total):.2f}°"

    return [
        Row(TOPIC, "bingham, `ImuFilter.run`", best_of(ours, per=n), "sample", True, 6e-6, error(ours().modes)),
        Row(
            TOPIC,
            "bingham, `InertialFilter.run` (no bias)",
            best_of(without_bias, per=n),
            "sample",
            limit=5e-6,
            note=error(without_bias().modes),
        ),
        Row(TOPIC, "vqf, VQF (C++)", best_of(peer_vqf, per=n), "sample", note=error(peer_vqf()["quat9D"])),
        Row(TOPIC, "vqf, BasicVQF (C++)", best_of(peer_basic, per=n), "sample", note=error(peer_basic()["quat9D"])),
        Row(TOPIC, "ahrs 0.4, Madgwick", best_once(peer_madgwick, per=part), "sample"),
        Row(TOPIC, "ahrs 0.4, EKF (no magnetometer)", best_once(peer_ekf, per=part), "sample"),
    ]
