"""The Gaussian whose projection on the sphere has the second moment of a Bingham distribution."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution
from bingham.distributions.relations import from_gaussian, to_gaussian
from bingham.errors import ConvergenceError, InvalidArgumentError

__all__ = ["matching_covariance"]

FloatArray = NDArray[np.float64]


def matching_covariance(distribution: Bingham, *, padded: bool = False) -> FloatArray:
    """Return C (d, d) with E[x xᵀ/|x|²] = E_B[x xᵀ] for x ~ N(m, C), m a mode of the distribution B.

    This is how Glover & Kaelbling (2013, §6) give Kalman filters a Bingham noise: second moments are matched after the
    projection on the sphere, where `to_gaussian` has those before it. C has the axes of B. Its d − 1 variances across
    the mode solve as many equations; they leave the one along m free, here E_B[(1 − |mᵀx|)²], how far B really spreads
    along m, or the mean of the others if ``padded``. For a girdle m is any of its modes.

    Parameters
    ----------
    distribution : Bingham
        A single distribution.
    padded : bool
        Whether the variance along m is the mean of the others.

    Raises
    ------
    ConvergenceError
        If no such Gaussian is found: the uniform distribution has none.

    Examples
    --------
    >>> near = np.eye(4)[:, [1, 2, 3, 0]]
    >>> np.diag(matching_covariance(Bingham([-400.0, -400.0, -400.0, 0.0], near))).round(6)
    array([6.000e-06, 1.259e-03, 1.259e-03, 1.259e-03])
    """
    from scipy.optimize import root

    check_distribution(distribution, "distribution")
    if distribution.shape:
        raise InvalidArgumentError("distribution", "a single distribution", f"a batch of shape {distribution.shape}")
    d, z = distribution.dim, distribution.z
    own = Bingham(z, np.eye(d))
    mode, target = np.eye(d)[-1], own.axis_moments[:-1]
    along = float(to_gaussian(own).covariance[-1, -1])

    def covariance(log_s: FloatArray) -> FloatArray:
        s = np.exp(np.minimum(log_s, 20.0))
        return np.diag(np.append(s, s.mean() if padded else along))

    def excess(log_s: FloatArray) -> FloatArray:
        return np.log(np.diag(from_gaussian(mode, covariance(log_s)).moment())[:-1] / target)

    found: Any = root(excess, np.log(target), tol=1e-10)
    if np.abs(found.fun).max() > 1e-8:
        raise ConvergenceError("found no Gaussian of equal projected moment", found.fun)
    return distribution.M @ covariance(found.x) @ distribution.M.T
