"""Xsens MT Manager and Movella (Xsens) DOT.

MT Manager exports tables separated by tabs below comments with the update rate; DOT commas below a preamble, with
microseconds in ``SampleTimeFine`` and degrees per second. Sources: MT Manager user manual, "Exporting"; Movella DOT
user manual, "Data export".
"""

from __future__ import annotations

import re

from bingham.io.presets.preset import Preset, Told

__all__ = ["PRESETS"]


def _update_rate(preamble: list[str]) -> Told:
    found = re.search(r"(?:Update|Output|Sample) ?Rate:?,?\s*([\d.]+)", "\n".join(preamble), re.IGNORECASE)
    rate = float(found[1]) if found else 0.0
    return Told({}, rate if 0.0 < rate < 1e5 else None)


PRESETS = [
    Preset(
        "xsens-mt-manager",
        "Xsens MT Manager: exported text, separated by tabs",
        needs=["(Packet)?Counter", "(Gyr|Acc|Mag|Quat|Mat|Euler).*"],
        mark=r"^//.*(start time|update rate|MT Manager|filter profile|firmware version)",
        columns={
            "counter": ["(?:Packet)?Counter"],
            "time": ["SampleTimeFine"],
            "gyroscope": ["Gyr_{}"],
            "accelerometer": ["Acc_{}"],
            "magnetometer": ["Mag_{}"],
            "estimate": ["Quat_q{}", "Quat_{}"],
        },
        units={"time": "100us", "gyroscope": "rad/s", "accelerometer": "m/s2"},
        preamble=_update_rate,
    ),
    Preset(
        "movella-dot",
        "Movella (Xsens) DOT: recording or stream exported as CSV",
        needs=["PacketCounter", "SampleTimeFine", "(Acc|Gyr|Mag|Quat|Euler|dq|FreeAcc)_.*"],
        columns={
            "time": ["SampleTimeFine"],
            "gyroscope": ["Gyr_{}"],
            "accelerometer": ["Acc_{}"],
            "magnetometer": ["Mag_{}"],
            "estimate": ["Quat_{}"],
        },
        units={"time": "us", "gyroscope": "deg/s", "accelerometer": "m/s2"},
    ),
]
