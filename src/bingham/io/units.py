"""Units of recorded quantities: their factors to SI and the spellings under which files know them."""

from __future__ import annotations

import math
import re

__all__ = ["UNITS", "bracketed", "spelled"]

UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "gyroscope": {"rad_s": 1.0, "deg_s": math.pi / 180},
    "accelerometer": {"m_s2": 1.0, "g": 9.80665},
    "magnetometer": {"ut": 1.0, "nt": 1.0, "mt": 1.0, "t": 1.0, "gauss": 1.0, "mgauss": 1.0},
    "position": {"m": 1.0, "mm": 1e-3},
}
SPELLINGS = {"sec": "s", "dps": "deg_s", "deg_sec": "deg_s", "rad_sec": "rad_s", "m_s_s": "m_s2", "m_sec2": "m_s2"}
SIGNS = {"µ": "u", "μ": "u", "²": "2", "**": "", "^": "", "°": "deg", "/": "_"}


def spelled(unit: str) -> str:
    """Return a unit as `UNITS` spells it, "deg_s" for "deg/s" and "°/s"; others as they are, in lower case."""
    text = unit.strip().lower()
    for sign, plain in SIGNS.items():
        text = text.replace(sign, plain)
    return SPELLINGS.get(text, text)


def bracketed(column: str) -> tuple[str, str | None]:
    """Split ``Gyro X (deg/s)`` or ``gx [deg/s]`` into the name and the unit, None without brackets."""
    found = re.fullmatch(r"(.*?)\s*[\[(]\s*(.*?)\s*[\])]", column)
    return (found[1], spelled(found[2])) if found else (column, None)
