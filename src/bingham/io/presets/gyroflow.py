"""Gyroflow's ``.gcsv``: integers below a preamble with their scales to s, rad/s and g.

Source: https://docs.gyroflow.xyz/app/technical-details/gcsv-format
"""

from __future__ import annotations

import re

from bingham.io.presets.preset import Preset, Told

__all__ = ["PRESETS"]

SCALES = {"tscale": ("time", "s"), "gscale": ("gyroscope", "rad/s"), "ascale": ("accelerometer", "g")}


def _scales(preamble: list[str]) -> Told:
    units: dict[str, str] = {}
    for line in preamble:
        found = re.fullmatch(r"\s*(\w+)\s*[,:]\s*(\d*\.?\d+(?:e[-+]?\d+)?)\s*", line, re.IGNORECASE | re.ASCII)
        if found and found[1].lower() in SCALES:
            quantity, unit = SCALES[found[1].lower()]
            units[quantity] = f"{float(found[2])!r}{unit}"
    return Told(units, None)


PRESETS = [
    Preset(
        "gcsv",
        "Gyroflow: .gcsv",
        needs=["t", "gx", "gy", "gz"],
        mark="^GYROFLOW IMU LOG",
        columns={
            "time": ["t"],
            "gyroscope": ["g{}"],
            "accelerometer": ["a{}"],
            "magnetometer": ["m{}"],
        },
        preamble=_scales,
    )
]
