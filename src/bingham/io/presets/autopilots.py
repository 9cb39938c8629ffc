"""Autopilots: PX4's ulog2csv, ArduPilot's logs as CSV, Betaflight's and iNav's blackbox.

Their axes are forward, right, down. A blackbox has the gyroscope in degrees per second and the accelerometer in counts,
1 g of which its header ``acc_1G`` tells. Sources: PX4 msg/SensorCombined.msg; ArduPilot AP_InertialSensor log
structures (IMU: rad/s, m/s²); betaflight/blackbox-log-viewer and blackbox-tools, README.
"""

from __future__ import annotations

import re

from bingham.io.presets.preset import Preset, Told

__all__ = ["PRESETS"]

FRD = "NED"  # world axes that go with axes forward, right, down


def _counts(preamble: list[str]) -> Told:
    found = re.search(r"\"?acc_1G\"?\s*[,:]\s*\"?(\d+)", "\n".join(preamble))
    return Told({"accelerometer": f"1/{found[1]}g"} if found and int(found[1]) else {}, None)


PRESETS = [
    Preset(
        "ulog2csv",
        "PX4: ulog2csv of sensor_combined, vehicle_attitude, vehicle_imu",
        needs=["timestamp", r"gyro_rad\[0\]|q\[0\]"],
        columns={
            "time": ["timestamp"],
            "gyroscope": [r"gyro_rad\[{}\]"],
            "accelerometer": [r"accelerometer_m_s2\[{}\]"],
            "magnetometer": [r"magnetometer_ga\[{}\]"],
            "estimate": [r"q\[{}\]"],
        },
        units={"time": "us", "gyroscope": "rad/s", "accelerometer": "m/s2"},
        earth_frame=FRD,
    ),
    Preset(
        "ardupilot",
        "ArduPilot: IMU messages of a DataFlash log as CSV (mavlogdump, UAV Log Viewer)",
        needs=["TimeUS|timestamp", "GyrX", "AccX"],
        columns={
            "time": ["TimeUS", "timestamp"],
            "gyroscope": ["Gyr{}"],
            "accelerometer": ["Acc{}"],
            "magnetometer": ["Mag{}"],
        },
        units={"gyroscope": "rad/s", "accelerometer": "m/s2"},
        earth_frame=FRD,
    ),
    Preset(
        "blackbox",
        "Betaflight, iNav: CSV of blackbox_decode or the blackbox viewer",
        needs=["loopIteration", r"time(?: \(us\))?", r"gyroADC\[0\](?: \(.*\))?"],
        columns={
            "time": [r"time(?: \(us\))?"],
            "gyroscope": [r"gyroADC\[{}\](?: \(.*\))?"],
            "accelerometer": [r"accSmooth\[{}\](?: \(.*\))?"],
            "magnetometer": [r"magADC\[{}\](?: \(.*\))?"],
        },
        units={"time": "us", "gyroscope": "deg/s"},
        preamble=_counts,
        earth_frame=FRD,
    ),
]
