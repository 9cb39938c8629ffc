"""Angles that geologists and palaeomagnetists read off a compass, and unit vectors in north, east, down.

Everything in degrees; azimuths clockwise from north, plunges, dips and inclinations downwards from the horizontal.
An axis or a pole has no sign: of both ends the lower one is returned. Arrays of any broadcastable shapes are taken.

Sources: Allmendinger, Cardozo & Fisher, "Structural Geology Algorithms", 2012, ch. 2 (trend and plunge, right-hand
rule); Tauxe, "Essentials of Paleomagnetism", 2010, ch. 2 (declination and inclination).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.errors import InvalidArgumentError

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

FloatArray = NDArray[np.float64]


def from_trend_plunge(trend: ArrayLike, plunge: ArrayLike) -> FloatArray:
    """Return x = (cos p cos t, cos p sin t, sin p), the line with trend t and plunge p.

    Parameters
    ----------
    trend : (...,) array_like
        Azimuth of the end that plunges, degrees.
    plunge : (...,) array_like
        Angle below the horizontal, −90 to 90 degrees.

    Returns
    -------
    ndarray, shape (..., 3)
        Unit vectors: north, east, down.

    Raises
    ------
    InvalidArgumentError
        If an angle is no finite number, or a plunge beyond 90 degrees.

    Examples
    --------
    >>> from_trend_plunge(90.0, 30.0).round(4)
    array([0.   , 0.866, 0.5  ])
    """
    t = np.radians(_angles(trend, "trend"))
    p = np.radians(_angles(plunge, "plunge", -90.0, 90.0))
    return _stacked(np.cos(p) * np.cos(t), np.cos(p) * np.sin(t), np.sin(p))


def to_trend_plunge(x: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return trend and plunge of the lower end of an axis; ±x give the same.

    Parameters
    ----------
    x : (..., 3) array_like
        Axes: north, east, down; their length does not matter.

    Returns
    -------
    trend, plunge : ndarray, shape (...,)
        Degrees, 0 ≤ trend < 360 and 0 ≤ plunge ≤ 90; of a horizontal line the trend below 180; of a vertical one 0.

    Raises
    ------
    InvalidArgumentError
        If the shape is not (..., 3) or a vector is zero or not finite.

    Examples
    --------
    >>> [round(float(angle), 4) for angle in to_trend_plunge([0.0, -0.866025, -0.5])]
    [90.0, 30.0]
    """
    azimuth, below = to_declination_inclination(x)
    upper = (below < 0.0) | ((below == 0.0) & (azimuth >= 180.0))
    trend = np.where(upper, (azimuth + 180.0) % 360.0, azimuth)
    return np.where(np.abs(below) == 90.0, 0.0, trend), np.abs(below)


def from_strike_dip(strike: ArrayLike, dip: ArrayLike) -> FloatArray:
    """Return the pole of a plane given by the right-hand rule: looking along the strike, the plane dips to the right.

    Parameters
    ----------
    strike : (...,) array_like
        Azimuth of the horizontal line in the plane, degrees.
    dip : (...,) array_like
        Angle of the plane with the horizontal, 0 to 90 degrees (up to 180 if overturned).

    Returns
    -------
    ndarray, shape (..., 3)
        Unit normals: north, east, down; the lower end unless the plane is overturned.

    Examples
    --------
    >>> trend, plunge = to_trend_plunge(from_strike_dip(30.0, 20.0))  # dips to 120°
    >>> round(float(trend), 6), round(float(plunge), 6)
    (300.0, 70.0)
    """
    strike = _angles(strike, "strike")
    dip = _angles(dip, "dip", 0.0, 180.0)
    return from_trend_plunge(strike - 90.0, 90.0 - dip)


def to_strike_dip(pole: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return strike (right-hand rule) and dip of the plane with a pole (..., 3), 0 ≤ strike < 360, 0 ≤ dip ≤ 90."""
    trend, plunge = to_trend_plunge(pole)
    return (trend + 90.0) % 360.0, 90.0 - plunge


def from_dip_direction(dip: ArrayLike, dip_direction: ArrayLike) -> FloatArray:
    """Return the pole of a plane given by its dip and the azimuth to which it dips.

    Parameters
    ----------
    dip : (...,) array_like
        Angle of the plane with the horizontal, 0 to 90 degrees (up to 180 if overturned).
    dip_direction : (...,) array_like
        Azimuth of the steepest line downwards, degrees: 90 more than the strike.

    Returns
    -------
    ndarray, shape (..., 3)
        Unit normals: north, east, down.

    Examples
    --------
    >>> trend, plunge = to_trend_plunge(from_dip_direction(22.52, 136.72))
    >>> round(float(trend), 6), round(float(plunge), 6)
    (316.72, 67.48)
    """
    return from_strike_dip(_angles(dip_direction, "dip_direction") - 90.0, dip)


def to_dip_direction(pole: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return dip, 0 to 90 degrees, and dip direction, 0 ≤ direction < 360, of the plane with a pole (..., 3)."""
    strike, dip = to_strike_dip(pole)
    return dip, (strike + 90.0) % 360.0


def from_declination_inclination(declination: ArrayLike, inclination: ArrayLike) -> FloatArray:
    """Return x = (cos i cos d, cos i sin d, sin i), the direction with declination d and inclination i.

    Parameters
    ----------
    declination : (...,) array_like
        Azimuth of the horizontal part, degrees east of north.
    inclination : (...,) array_like
        Angle below the horizontal, −90 to 90 degrees.

    Returns
    -------
    ndarray, shape (..., 3)
        Unit vectors: north, east, down.

    Examples
    --------
    >>> from_declination_inclination(180.0, -45.0).round(4)
    array([-0.7071,  0.    , -0.7071])
    """
    d = _angles(declination, "declination")
    return from_trend_plunge(d, _angles(inclination, "inclination", -90.0, 90.0))


def to_declination_inclination(x: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return declination, 0 ≤ d < 360, and inclination, −90 to 90, of directions (..., 3) with their sign."""
    x = np.asarray(x, dtype=np.float64)
    if x.shape[-1:] != (3,):
        raise InvalidArgumentError("x", "shape (..., 3): north, east, down", f"shape {x.shape}")
    if not (np.isfinite(x).all() and x.any(axis=-1).all()):
        raise InvalidArgumentError("x", "finite vectors that are not zero", x)
    north, east, down = np.moveaxis(x, -1, 0)
    horizontal = np.hypot(north, east)
    azimuth = np.degrees(np.arctan2(east, north)) % 360.0 % 360.0  # −1e-15 % 360 rounds to 360
    return np.where(horizontal == 0.0, 0.0, azimuth), np.degrees(np.arctan2(down, horizontal))


def _angles(values: ArrayLike, name: str, lowest: float = -np.inf, highest: float = np.inf) -> FloatArray:
    try:
        angles = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidArgumentError(name, "angles in degrees", values) from None
    if not np.isfinite(angles).all():
        raise InvalidArgumentError(name, "finite angles in degrees", values)
    if ((angles < lowest) | (angles > highest)).any():
        worst = angles.ravel()[int(np.argmax(np.maximum(lowest - angles, angles - highest)))]
        raise InvalidArgumentError(
            name, f"{lowest:g} to {highest:g} degrees", float(worst), "check the order of angles"
        )
    return angles


def _stacked(*components: FloatArray) -> FloatArray:
    return np.stack(np.broadcast_arrays(*components), axis=-1)
