"""Units of recorded quantities: their factors to SI and the spellings under which files know them."""

from __future__ import annotations

import math
import re

__all__ = ["UNITS", "bracketed", "factor_of", "spelled"]

G = 9.80665  # m/s², standard gravity
UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "day": 86400.0},
    "gyroscope": {"rad_s": 1.0, "deg_s": math.pi / 180, "mdeg_s": math.pi / 180e3},
    "accelerometer": {"m_s2": 1.0, "g": G, "mg": 1e-3 * G, "cm_s2": 1e-2, "mm_s2": 1e-3},
    "magnetometer": dict.fromkeys(("ut", "nt", "mt", "t", "gauss", "mgauss", "any"), 1.0),
    "position": {"m": 1.0, "mm": 1e-3, "cm": 1e-2},
}
SIGNS = {"µ": "u", "μ": "u", "²": "2", "⁻¹": "-1", "⁻²": "-2", "·": " ", "**": "", "^": "", "°": "deg", "º": "deg"}
# Of the text with slashes and spaces as underscores.
SPELLINGS = {
    "sec": "s",
    "secs": "s",
    "second": "s",
    "seconds": "s",
    "msec": "ms",
    "millis": "ms",
    "milliseconds": "ms",
    "usec": "us",
    "micros": "us",
    "microseconds": "us",
    "nsec": "ns",
    "nanos": "ns",
    "nanoseconds": "ns",
    "minutes": "min",
    "hours": "h",
    "d": "day",
    "days": "day",
    "dps": "deg_s",
    "d_s": "deg_s",
    "deg_sec": "deg_s",
    "degrees_s": "deg_s",
    "degrees_sec": "deg_s",
    "degree_s": "deg_s",
    "degree_sec": "deg_s",
    "degrees_second": "deg_s",
    "deg_s-1": "deg_s",
    "mdps": "mdeg_s",
    "rad_sec": "rad_s",
    "rads_s": "rad_s",
    "radians_s": "rad_s",
    "radians_sec": "rad_s",
    "rad_s-1": "rad_s",
    "rps": "rad_s",
    "m_s_s": "m_s2",
    "m_sec2": "m_s2",
    "m_s-2": "m_s2",
    "m_(s2)": "m_s2",
    "mps2": "m_s2",
    "ms-2": "m_s2",
    "gs": "g",
    "g-force": "g",
    "cm_s-2": "cm_s2",
    "mm_s-2": "mm_s2",
    "microtesla": "ut",
    "utesla": "ut",
    "u_t": "ut",
    "nanotesla": "nt",
    "tesla": "t",
    "ga": "gauss",
    "mga": "mgauss",
    "mg": "mg",
    "a.u.": "any",
    "a.u": "any",
    "au": "any",
    "local_flux": "any",
    "arbitrary": "any",
    "normalised": "any",
}
OF_MAGNETOMETER = {"g": "gauss", "mg": "mgauss"}
NUMBER = re.compile(
    r"(?P<number>\d+(?:\.\d*)?(?:e[-+]?\d+)?)(?:/(?P<below>\d+(?:\.\d*)?(?:e[-+]?\d+)?))?\s*\*?\s*(?P<unit>[^\d.].*)"
)


def spelled(unit: str, quantity: str = "") -> str:
    """Return a unit as `UNITS` spells it, "deg_s" for "deg/s" and "°/s"; others as they are, in lower case.

    ``G`` is gauss of a magnetometer and gravity of an accelerometer.
    """
    text = unit.strip().lower()
    for sign, ascii_text in SIGNS.items():
        text = text.replace(sign, ascii_text)
    text = re.sub(r"\s*/\s*|\s+|_per_", "_", re.sub(r"\s+per\s+", "/", text.strip()))
    text = SPELLINGS.get(text, text)
    return OF_MAGNETOMETER.get(text, text) if quantity == "magnetometer" else text


def factor_of(unit: str, quantity: str) -> float | None:
    """Return the factor to SI of ``deg/s``, or of a step in a unit, ``100us`` or ``1/4096 g``; None if unknown.

    Examples
    --------
    >>> factor_of("250ms", "time"), factor_of("1/16.4 deg/s", "gyroscope") * 16.4 == factor_of("dps", "gyroscope")
    (0.25, True)
    """
    known = UNITS.get(quantity, {})
    if (name := spelled(unit, quantity)) in known:
        return known[name]
    found = NUMBER.fullmatch(unit.strip().lower().replace("µ", "u").replace("μ", "u"))
    if found is None or (name := spelled(found["unit"], quantity)) not in known:
        return None
    below = float(found["below"] or 1.0)
    step = float(found["number"]) / below if below else 0.0
    return step * known[name] if 0.0 < step < math.inf else None


def bracketed(column: str) -> tuple[str, str | None]:
    """Split ``Gyro X (deg/s)``, ``gx [deg/s]`` or ``gx{deg/s}`` into the name and the unit, None without brackets.

    An integer in brackets is an index and belongs to the name: ``gyro_rad[0]``.
    """
    found = re.fullmatch(r"(.*?)\s*(?:\[([^\[\]]*)\]|\((.*)\)|\{(.*)\}|<(.*)>)", column.strip())
    if found is None:
        return column.strip(), None
    inside = next(text for text in found.groups()[1:] if text is not None).strip()
    return (column.strip(), None) if inside.isdigit() else (found[1], inside)
