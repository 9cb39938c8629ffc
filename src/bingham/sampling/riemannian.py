"""Riemannian spherical sampling: equally weighted deterministic samples of any size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.errors import ConvergenceError, InvalidArgumentError
from bingham.sampling.descent import steepest_descent
from bingham.sampling.gaussian_lcd import standard_normal_points
from bingham.sampling.protocol import WeightedPoints, single
from bingham.sampling.trust_region import trust_region
from bingham.validation import check_number, integer

__all__ = ["RiemannianSampling", "gnomonic", "transported"]

FloatArray = NDArray[np.float64]

# Moment error, in units of the moments themselves, that a correction must reach.
TOLERANCE = 1e-10


def gnomonic(normal: FloatArray, z: FloatArray) -> FloatArray:
    """Return unit vectors (m, d) in the principal axes: x ∝ (σ, 1), σᵢ = sᵢ/√(−2 zᵢ), for normal points s (m, d−1).

    The tangent density at the mode is approximated by a Gaussian and retracted by the gnomonic map (Li et al. 2019,
    eqs. 9–12; the normaliser β of eqs. 10–11 cancels). Singular where zᵢ = 0.
    """
    if not z[-2] < 0.0:
        raise InvalidArgumentError("distribution", "z < 0 on every axis but the mode's, for map='gnomonic'", z,
                                   "use map='transport', which covers girdles and uniform ones")  # fmt: skip
    sigma = normal / np.sqrt(-2.0 * z[:-1])
    length = np.sqrt(1.0 + np.einsum("ij,ij->i", sigma, sigma))
    return np.column_stack([sigma, np.ones(len(sigma))]) / length[:, None]


def transported(normal: FloatArray, z: FloatArray, *, symmetric: bool) -> FloatArray:
    """Return unit vectors (m, d) in the principal axes, distributed right when the points s (m, d−1) are normal.

    Quantile by quantile, see ``kernels.transport``; symmetric says that the second half of s is the first one negated.
    """
    from bingham.kernels.transport import transport

    points = np.empty((len(normal), z.size))
    transport(normal, len(normal) // 2 if symmetric else 0, z, points)
    return points


@dataclass(frozen=True)
class RiemannianSampling:
    """m points of weight 1/m with Σ x xᵀ/m = E[x xᵀ] and higher moments close to the true (Li et al. 2019, Alg. 1).

    The optimal point set of the standard normal (`standard_normal_points`) is mapped to the sphere and moved there
    until its second moment is exact.

    Parameters
    ----------
    m : int
        Number of points, at least 2(d − 1); d when not symmetric.
    map : {"transport", "gnomonic"}
        "transport" carries the normal distribution to the Bingham distribution exactly, one coordinate after the
        other, and covers every distribution. "gnomonic" is the paper's: Gaussian on the tangent plane, then the
        gnomonic retraction; singular for girdles and the uniform distribution, approximate at low concentration.
    correction : {"newton", "descent", "trust_region", "none"}
        "newton" solves for the moment (``kernels.correction``), in microseconds and to rounding. "descent" is the
        paper's Riemannian steepest descent on ‖Σ x xᵀ/m − E[x xᵀ]‖² and "trust_region" its Newton method with conjugate
        gradients, both to an absolute tolerance.
    penalty : float
        λ ≥ 0 of the penalised objective of "descent" and "trust_region" (0: plain), which holds points near where they
        started.
    symmetric : bool
        Whether the normal point set is symmetric about 0, hence the samples about the mode.

    Examples
    --------
    >>> from bingham.distributions.bingham import Bingham
    >>> distribution = Bingham([-5.0, -1.0, 0.0], np.eye(3))
    >>> x, w = RiemannianSampling(20).sample(distribution)
    >>> bool(np.allclose((x.T * w) @ x, distribution.moment(), atol=1e-14))
    True
    """

    m: int = 100
    map: Literal["transport", "gnomonic"] = "transport"
    correction: Literal["newton", "descent", "trust_region", "none"] = "newton"
    penalty: float = 0.0
    symmetric: bool = True

    def __post_init__(self) -> None:
        integer(self.m, "m", 1)
        check_number(self.penalty, "penalty", "a finite number ≥ 0", minimum=0.0)
        if self.map not in ("transport", "gnomonic"):
            raise InvalidArgumentError("map", "'transport' or 'gnomonic'", repr(self.map))
        if self.correction not in ("newton", "descent", "trust_region", "none"):
            raise InvalidArgumentError(
                "correction", "'newton', 'descent', 'trust_region' or 'none'", repr(self.correction)
            )
        if not self.penalty >= 0.0 or (self.penalty > 0.0 and self.correction not in ("descent", "trust_region")):
            raise InvalidArgumentError(
                "penalty", "0, or positive with correction='descent' or 'trust_region'", self.penalty
            )

    def sample(self, distribution: Bingham) -> WeightedPoints:
        """Return points (m, d) and weights 1/m.

        Raises
        ------
        InvalidArgumentError
            If m is too small for the dimension, or the map does not cover the distribution.
        ConvergenceError
            If the correction does not reach the second moment.
        """
        z, w = single(distribution).z, distribution.axis_moments
        normal = standard_normal_points(z.size - 1, self.m, symmetric=self.symmetric)
        points = gnomonic(normal, z) if self.map == "gnomonic" else transported(normal, z, symmetric=self.symmetric)
        if self.correction == "newton":
            from bingham.kernels.correction import correct_moments

            error, steps = correct_moments(points, w)
            if not error <= TOLERANCE:
                problem = (
                    f"moment correction of {self.m} points for z = {z}: relative error {error:.3g} in {steps} steps"
                )
                raise ConvergenceError(problem, points, "use more points or map='transport'")
        elif self.correction == "descent":
            points = steepest_descent(points, np.diag(w), penalty=self.penalty).points
        elif self.correction == "trust_region":
            points = trust_region(points, np.diag(w), self.penalty)
        return WeightedPoints(points @ distribution.M.T, np.full(self.m, 1.0 / self.m))
