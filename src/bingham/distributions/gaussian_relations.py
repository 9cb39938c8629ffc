"""Conditioned Gaussians, Fisher–Bingham distributions and trigonometric moments.

Relations of Kurz, Gilitschenski, Julier & Hanebeck (2014), Appendices A and D and Remark 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.fisher_bingham import FisherBingham
from bingham.errors import InvalidArgumentError
from bingham.validation import as_numbers, check_kind, covariance_matrix

__all__ = ["conditioned_gaussian", "gaussian_of", "to_fisher_bingham", "trigonometric_moment"]

FloatArray = NDArray[np.float64]


def to_fisher_bingham(distribution: Bingham) -> FisherBingham:
    """Return the same distribution as one with a linear term, which is 0 (Appendix D, Definition 7 with κ = 0).

    Examples
    --------
    >>> to_fisher_bingham(Bingham([-5.0, -1.0, 0.0], np.eye(3))).linear
    array([0., 0., 0.])
    """
    check_kind(distribution, Bingham, "distribution")
    if distribution.shape:
        raise InvalidArgumentError("distribution", "a single distribution", f"a batch of shape {distribution.shape}")
    return FisherBingham(distribution.matrix, np.zeros(distribution.dim))


def conditioned_gaussian(covariance: ArrayLike) -> Bingham:
    """Return the distribution of x ~ N(0, Σ) given |x| = 1: A = −Σ⁻¹/2 (eq. 69).

    Examples
    --------
    >>> conditioned_gaussian(np.diag([0.01, 0.5])).z
    array([-49.,   0.])
    """
    c = covariance_matrix(covariance, None, "covariance")
    values, axes = np.linalg.eigh(c)
    if not values[0] > 0.0:
        raise InvalidArgumentError("covariance", "positive definite", f"smallest eigenvalue {values[0]:.3g}")
    return Bingham(-0.5 / values, axes)


def gaussian_of(distribution: Bingham, largest: float = 1.0) -> FloatArray:
    """Return a covariance Σ (d, d) whose conditioned Gaussian is the distribution; ``largest`` is its largest variance.

    Adding a multiple of the identity to A changes Σ but not the distribution: a family, told apart by one number.
    """
    if not (np.isfinite(largest) and largest > 0.0):
        raise InvalidArgumentError("largest", "a variance > 0", largest)
    if distribution.shape:
        raise InvalidArgumentError("distribution", "a single distribution", f"a batch of shape {distribution.shape}")
    return (distribution.M / (1.0 / largest - 2.0 * distribution.z)) @ distribution.M.T


def trigonometric_moment(distribution: Bingham, n: ArrayLike) -> NDArray[np.complex128]:
    """Return E[e^{inθ}] (...), x = (cos θ, sin θ), for integers n (...), d = 2.

    Odd ones vanish by symmetry; E[e^{2ikθ}] = I_k(κ)/I₀(κ) e^{2ikν}, κ = −z₁/2, ν the mode's angle. With the mode on
    the first axis E[cos²θ] = (1 + Re m₂)/2, where the paper's Remark 1 prints Re m₂.

    Examples
    --------
    >>> p = Bingham([-4.0, 0.0], [[0.0, 1.0], [1.0, 0.0]])
    >>> np.allclose(0.5 * (1.0 + trigonometric_moment(p, 2).real), p.moment()[0, 0])
    True
    """
    from scipy.special import ive

    if distribution.dim != 2 or distribution.shape:
        raise InvalidArgumentError("distribution", "a single distribution of dimension 2", repr(distribution))
    orders = as_numbers(n, "n")
    if not np.all(orders == np.round(orders)):
        raise InvalidArgumentError("n", "integers", n)
    kappa = -0.5 * float(distribution.z[0])
    angle = float(np.arctan2(distribution.mode[1], distribution.mode[0]))
    size = ive(np.abs(0.5 * orders), kappa) / ive(0.0, kappa)
    return np.where(orders % 2 == 0, size, 0.0) * np.exp(1j * orders * angle)
