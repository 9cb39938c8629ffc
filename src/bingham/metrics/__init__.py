"""How far estimates are from the truth, and whether their reported uncertainty is right."""

from bingham.metrics.broad import BroadErrors, broad_errors, broad_rmse, heading_offset
from bingham.metrics.calibration import (
    angle_probability,
    chi_square_probability,
    coverage,
    normal_probability,
    uniformity_statistic,
)
from bingham.metrics.error import geodesic_error, nees, root_mean_square

__all__ = [
    "BroadErrors",
    "angle_probability",
    "broad_errors",
    "broad_rmse",
    "chi_square_probability",
    "coverage",
    "geodesic_error",
    "heading_offset",
    "nees",
    "normal_probability",
    "root_mean_square",
    "uniformity_statistic",
]
