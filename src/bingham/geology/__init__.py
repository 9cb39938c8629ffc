"""What structural geologists and palaeomagnetists measure and report."""

from bingham.geology.angles import (
    from_declination_inclination,
    from_dip_direction,
    from_strike_dip,
    from_trend_plunge,
    to_declination_inclination,
    to_dip_direction,
    to_strike_dip,
    to_trend_plunge,
)

__all__ = [
    "from_declination_inclination",
    "from_dip_direction",
    "from_strike_dip",
    "from_trend_plunge",
    "to_declination_inclination",
    "to_dip_direction",
    "to_strike_dip",
    "to_trend_plunge",
]
