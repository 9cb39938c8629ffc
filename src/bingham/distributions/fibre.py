"""Fibre lobes of diffusion MRI: Bingham functions f₀ exp(−k₁ (μ₁ᵀx)² − k₂ (μ₂ᵀx)²), as dipy fits them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.normalizer import log_normalizer
from bingham.errors import InvalidArgumentError
from bingham.validation import as_numbers

__all__ = ["FibreLobe", "OrientationDispersion"]

FloatArray = NDArray[np.float64]


class OrientationDispersion(NamedTuple):
    """Dispersion indices (2/π) arctan(1/k), 0 for parallel fibres, towards 1 for dispersed ones.

    ``major`` across the widest fan (the smaller k), ``minor`` across the narrowest, ``total`` of √(k₁ k₂).
    """

    major: Any
    minor: Any
    total: Any


@dataclass(frozen=True, slots=True, eq=False)
class FibreLobe:
    """One lobe of a fibre orientation distribution, in the parameters of dipy's ``bingham`` module; batches (...).

    Parameters
    ----------
    f0 : (...) array_like
        Amplitude at the peak, not negative.
    k1, k2 : (...) array_like
        Concentrations ≥ 0 across the peak, in either order; dipy's k₁ is the smaller one.

    Examples
    --------
    >>> [round(float(FibreLobe(1.0, k1, k2).fibre_density), 5) for k1, k2 in ((30.0, 10.0), (15.0, 4.0))]
    [0.37665, 0.90674]

    References
    ----------
    Riffert et al., NeuroImage 100 (2014) 176; Tariq et al., NeuroImage 133 (2016) 207 (dispersion index).
    """

    f0: FloatArray
    k1: FloatArray
    k2: FloatArray

    def __post_init__(self) -> None:
        values = [as_numbers(getattr(self, name), name) for name in ("f0", "k1", "k2")]
        for name, value in zip(("f0", "k1", "k2"), values, strict=True):
            if not np.all((value >= 0.0) & np.isfinite(value)):
                raise InvalidArgumentError(name, "finite numbers ≥ 0", value)
            object.__setattr__(self, name, value)

    @property
    def fibre_density(self) -> Any:
        """∫ f₀ exp(−k₁ x₁² − k₂ x₂²) dx over the sphere (...), both ends of every fibre counted: f₀ F(−k₁, −k₂, 0)."""
        k1, k2 = np.broadcast_arrays(self.k1, self.k2)
        z = np.stack([-k1, -k2, np.zeros_like(k1)], axis=-1)
        return (self.f0 * np.exp(log_normalizer(z)))[()]

    @property
    def fibre_spread(self) -> Any:
        """Fibre density over the amplitude (...), the width of the lobe in steradians."""
        return (np.asarray(self.fibre_density) / self.f0)[()]

    @property
    def dispersion(self) -> OrientationDispersion:
        """Orientation dispersion indices (...)."""
        with np.errstate(divide="ignore"):
            minor, major, total = (
                2.0 / np.pi * np.arctan(1.0 / k)
                for k in (np.maximum(self.k1, self.k2), np.minimum(self.k1, self.k2), np.sqrt(self.k1 * self.k2))
            )
        return OrientationDispersion(major[()], minor[()], total[()])

    def to_bingham(self, axes: ArrayLike) -> Bingham:
        """Return the distribution of a fibre's axis, with the columns of axes (..., 3, 3): μ₁, μ₂ and the peak."""
        k1, k2 = np.broadcast_arrays(self.k1, self.k2)
        return Bingham(np.stack([-k1, -k2, np.zeros_like(k1)], axis=-1), axes)
