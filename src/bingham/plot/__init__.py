"""Figures of distributions, mixtures and tracks: functions that take values and return a ``matplotlib.figure.Figure``.

`plot_fit` draws axes with their fitted distribution, mode and 95 % confidence ellipse, `plot_fabric` a
geologist's stereonet; `plot_density` a density without samples; `plot_mixture` a mixture;
`plot_track` rotations over time with their 95 % bands, `plot_planar_track` axes in the plane; `plot_profiles` what
`tune` found. Save a figure with ``savefig``. Matplotlib (``pip install 'bingham[plot]'``) is loaded by the first one
drawn.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # what the table below loads, for editors and type checkers
    from bingham.plot.axes import equal_area as equal_area
    from bingham.plot.axes import plot_fit as plot_fit
    from bingham.plot.density import plot_density as plot_density
    from bingham.plot.mixture import plot_mixture as plot_mixture
    from bingham.plot.mixture import plot_rotation_cloud as plot_rotation_cloud
    from bingham.plot.planar_track import plot_planar_track as plot_planar_track
    from bingham.plot.segmentation import plot_segmentation as plot_segmentation
    from bingham.plot.stereonet import draw_fabric as draw_fabric
    from bingham.plot.stereonet import plot_fabric as plot_fabric
    from bingham.plot.track import plot_track as plot_track
    from bingham.plot.tuning import plot_profiles as plot_profiles

# Public name → module that defines it.
_PUBLIC = {
    "draw_fabric": "stereonet",
    "equal_area": "axes",
    "plot_density": "density",
    "plot_fabric": "stereonet",
    "plot_fit": "axes",
    "plot_mixture": "mixture",
    "plot_planar_track": "planar_track",
    "plot_profiles": "tuning",
    "plot_rotation_cloud": "mixture",
    "plot_segmentation": "segmentation",
    "plot_track": "track",
}

__all__ = sorted(_PUBLIC)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'bingham.plot' has no attribute {name!r}")
    value = getattr(import_module(f"bingham.plot.{_PUBLIC[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
