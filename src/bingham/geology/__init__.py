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
from bingham.geology.contours import exponential_density, fitted_density, kamb_density
from bingham.geology.fabric import Fabric, fabric
from bingham.geology.projection import project, unproject
from bingham.geology.stereonet import draw_axes, draw_contours, draw_ellipse, draw_great_circle, draw_net

__all__ = [
    "Fabric",
    "draw_axes",
    "draw_contours",
    "draw_ellipse",
    "draw_great_circle",
    "draw_net",
    "exponential_density",
    "fabric",
    "fitted_density",
    "from_declination_inclination",
    "from_dip_direction",
    "from_strike_dip",
    "from_trend_plunge",
    "kamb_density",
    "project",
    "to_declination_inclination",
    "to_dip_direction",
    "to_strike_dip",
    "to_trend_plunge",
    "unproject",
]
