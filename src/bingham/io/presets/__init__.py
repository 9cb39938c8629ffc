"""Loggers whose text files are known by their header.

``bingham formats`` lists them.
"""

from __future__ import annotations

from collections.abc import Sequence

from bingham.io.presets import autopilots, gyroflow, phones, ros_text, wearables, x_io, xsens
from bingham.io.presets.preset import Preset

__all__ = ["PRESETS", "Preset", "find_preset"]

PRESETS: list[Preset] = [
    *xsens.PRESETS,
    *x_io.PRESETS,
    *wearables.PRESETS,
    *phones.PRESETS,
    *autopilots.PRESETS,
    *gyroflow.PRESETS,
    *ros_text.PRESETS,
]


def find_preset(names: Sequence[str], preamble: Sequence[str]) -> Preset | None:
    """Return the preset of the logger that wrote a file with these columns, None if it is none of the known ones."""
    return next((preset for preset in PRESETS if preset.fits(names, preamble)), None)
