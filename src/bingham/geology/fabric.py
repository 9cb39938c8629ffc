"""Fabric of a set of lines or poles: eigenvalues, shape, mean axis, best-fit plane and fold axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.geology.angles import to_strike_dip, to_trend_plunge
from bingham.inference.ellipse import ConfidenceEllipse, confidence_ellipse
from bingham.inference.result import axes_of
from bingham.notebook import Tabled

__all__ = ["Fabric", "fabric"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Fabric(Tabled):
    """What a structural geologist reports of a sample of lines or poles; see `fabric`.

    Parameters
    ----------
    size : int
        Number of axes n.
    eigenvalues : (..., 3) ndarray
        S₁ ≥ S₂ ≥ S₃ of the orientation tensor Σ x xᵀ/n, sum 1.
    eigenvalue_errors : (..., 3) ndarray
        Their standard errors √((E[(mᵢᵀx)⁴] − Sᵢ²)/n).
    eigenvectors : (..., 3, 3) ndarray
        Columns in the same order: mean axis, intermediate axis, pole of the best-fit plane.
    distribution : Bingham
        Fitted by maximum likelihood.
    mean_ellipse, pole_ellipse : ConfidenceEllipse
        Confidence regions of the mean axis and of the pole of the best-fit plane, which for poles of folded layers is
        the fold axis.
    """

    size: int
    eigenvalues: FloatArray
    eigenvalue_errors: FloatArray
    eigenvectors: FloatArray
    distribution: Bingham
    mean_ellipse: ConfidenceEllipse
    pole_ellipse: ConfidenceEllipse

    @property
    def K(self) -> Any:
        """Woodcock's (1977) shape ln(S₁/S₂)/ln(S₂/S₃): above 1 a cluster, below 1 a girdle."""
        s = self.eigenvalues
        with np.errstate(divide="ignore", invalid="ignore"):
            return (np.log(s[..., 0] / s[..., 1]) / np.log(s[..., 1] / s[..., 2]))[()]

    @property
    def C(self) -> Any:
        """Woodcock's (1977) strength ln(S₁/S₃)."""
        return np.log(self.eigenvalues[..., 0] / self.eigenvalues[..., 2])[()]

    @property
    def P(self) -> Any:
        """Vollmer's (1990) point index S₁ − S₂; P + G + R = 1."""
        return (self.eigenvalues[..., 0] - self.eigenvalues[..., 1])[()]

    @property
    def G(self) -> Any:
        """Vollmer's (1990) girdle index 2(S₂ − S₃)."""
        return (2.0 * (self.eigenvalues[..., 1] - self.eigenvalues[..., 2]))[()]

    @property
    def R(self) -> Any:
        """Vollmer's (1990) random index 3 S₃."""
        return (3.0 * self.eigenvalues[..., 2])[()]

    @property
    def mean_axis(self) -> tuple[FloatArray, FloatArray]:
        """Trend and plunge of the mean axis, degrees."""
        return to_trend_plunge(self.eigenvectors[..., :, 0])

    @property
    def fold_axis(self) -> tuple[FloatArray, FloatArray]:
        """Trend and plunge of the pole of the best-fit plane, degrees."""
        return to_trend_plunge(self.eigenvectors[..., :, 2])

    @property
    def best_plane(self) -> tuple[FloatArray, FloatArray]:
        """Strike (right-hand rule) and dip of the plane that the axes lie closest to, degrees."""
        return to_strike_dip(self.eigenvectors[..., :, 2])


def fabric(x: ArrayLike, level: float = 0.95, method: Any = "likelihood") -> Fabric:
    """Return eigenvalues, shape, mean axis, best-fit plane and fold axis of lines or poles.

    Parameters
    ----------
    x : (..., n, 3) array_like
        Unit vectors in north, east, down whose signs do not matter, n > 3; `bingham.geology.from_trend_plunge` and its
        like make them.
    level : float
        Probability of the confidence ellipses.
    method : str
        As in `bingham.inference.confidence_ellipse`.

    Examples
    --------
    >>> from bingham.geology import from_trend_plunge
    >>> result = fabric(from_trend_plunge([54, 61, 74, 80, 62, 68], [13, 15, 14, 20, 25, 6]))
    >>> [round(float(angle), 1) for angle in result.mean_axis], result.eigenvalues.round(3)
    ([66.5, 15.7], array([0.969, 0.021, 0.01 ]))

    References
    ----------
    Woodcock, Geol. Soc. Am. Bull. 88 (1977) 1231; Vollmer, Geol. Soc. Am. Bull. 102 (1990) 786.
    """
    if np.shape(x)[-1:] != (3,):
        hint = "angles become such by bingham.geology.from_trend_plunge and its like"
        raise InvalidArgumentError("x", "axes in space (north, east, down), shape (..., n, 3)", np.shape(x), hint)
    a = axes_of(x, "x", 4)
    n = a.shape[-2]
    distribution = Bingham.fit(a)
    order = slice(None, None, -1)
    vectors = np.ascontiguousarray(distribution.M[..., order])
    values = np.ascontiguousarray(distribution.axis_moments[..., order])
    fourth = np.mean((a @ vectors) ** 4, axis=-2)
    return Fabric(
        size=n,
        eigenvalues=values,
        eigenvalue_errors=np.sqrt(np.maximum(fourth - values**2, 0.0) / n),
        eigenvectors=vectors,
        distribution=distribution,
        mean_ellipse=confidence_ellipse(a, level, method),
        pole_ellipse=confidence_ellipse(a, level, method, axis=0),
    )
