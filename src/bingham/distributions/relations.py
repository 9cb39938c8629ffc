"""Relations to Gaussian, von Mises and von Mises–Fisher distributions (Kurz et al. 2014, Appendices A–C, eq. 57)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import quad_vec

from bingham.distributions.bingham import Bingham
from bingham.distributions.normalizer import solve_moments, solve_spectrum
from bingham.distributions.uncertainty import colatitude_density
from bingham.errors import InvalidArgumentError
from bingham.kernels.numpy_rule import diagonalize_one
from bingham.validation import unit_rows

__all__ = ["Gaussian", "angular_variance", "from_gaussian", "from_von_mises", "from_von_mises_fisher", "to_gaussian",
           "to_von_mises", "to_von_mises_fisher"]  # fmt: skip

FloatArray = NDArray[np.float64]

HALF_TURN = 0.5 * np.pi


class Gaussian(NamedTuple):
    """N(mean, covariance) in the space that holds the sphere: mean (d,), covariance (d, d)."""

    mean: FloatArray
    covariance: FloatArray


def _single(distribution: Bingham) -> FloatArray:
    if distribution.shape:
        raise InvalidArgumentError("distribution", "a single distribution", f"a batch {distribution.shape}")
    return distribution.z


def angular_variance(distribution: Bingham) -> float:
    """Return E[φ²], rad², of the angle φ = arccos |xᵀ mode| of a single distribution.

    For d = 2 this is the variance of the Gaussian that a scalar Kalman filter for axes would use (Kurz et al. 2013).

    Examples
    --------
    >>> import numpy as np
    >>> round(angular_variance(Bingham([-1.0, 0.0], np.eye(2))), 4)
    0.5872
    """
    phi, weight = colatitude_density(_single(distribution), HALF_TURN)
    return float(weight @ phi**2)


def to_gaussian(distribution: Bingham) -> Gaussian:
    """Return the Gaussian about one mode m: C = E[(x − m)(x − m)ᵀ | xᵀm > 0] (Kurz et al. 2014, eq. 57).

    By symmetry C = M diag(ω₁, …, ω_{d−1}, 1 + ω_d − 2 E|mᵀx|) Mᵀ; the last mean is one quadrature. The integral is
    normalised to one mode, as the paper's numbers (58)–(60) are.

    Examples
    --------
    >>> import numpy as np
    >>> to_gaussian(Bingham([-1.0, 0.0], np.eye(2))).covariance.round(2) + 0.0
    array([[0.38, 0.  ],
           [0.  , 0.15]])
    """
    phi, weight = colatitude_density(_single(distribution), HALF_TURN)
    w = distribution.axis_moments.copy()
    # 1 + cos²φ − 2 cos φ = 4 sin⁴(φ/2), without cancellation for narrow distributions.
    w[-1] = weight @ (4.0 * np.sin(0.5 * phi) ** 4)
    return Gaussian(np.array(distribution.mode), (distribution.M * w) @ distribution.M.T)


def from_gaussian(mean: ArrayLike, covariance: ArrayLike) -> Bingham:
    """Return the Bingham distribution with the second moment of x/‖x‖, x ~ N(mean, covariance).

    E[x xᵀ/‖x‖²] = ∫₀^∞ E[x xᵀ e^{−t‖x‖²}] dt, whose integrand is e^{−t mᵀG m} |I + 2tC|^{−1/2} (G m mᵀ G + C G) with
    G = (I + 2tC)⁻¹: one integral in any dimension.

    Raises
    ------
    InvalidArgumentError
        If the covariance (d, d) is not symmetric positive semidefinite of the size of mean (d,).
    """
    m, c = np.asarray(mean, dtype=np.float64), np.asarray(covariance, dtype=np.float64)
    d = m.size
    if m.ndim != 1 or d < 2 or not np.all(np.isfinite(m)):
        raise InvalidArgumentError("mean", "a finite vector (d,), d >= 2", mean)
    if c.shape != (d, d) or not np.allclose(c, c.T, rtol=1e-10, atol=1e-14):
        raise InvalidArgumentError("covariance", f"a symmetric matrix ({d}, {d})", covariance)
    values = np.linalg.eigvalsh(c)
    if not values[0] >= -1e-12 * max(values[-1], 0.0):
        raise InvalidArgumentError("covariance", "no negative eigenvalue", values[0])
    # In axes of which the first is the mean, and with the others in units of their deviation, so that narrow
    # distributions keep their digits: no difference of near numbers is taken.
    basis = np.linalg.qr(np.column_stack([m, np.eye(d)]))[0]
    a = basis.T @ m
    values, axes = np.linalg.eigh(basis.T @ c @ basis)
    values = np.maximum(values, 0.0)
    scale = float(a @ a + values.sum())
    unit = np.full(d, float(np.sqrt(values.sum() / scale)) or 1.0)
    unit[0] = 1.0

    def integrand(u: float) -> FloatArray:
        # t = u/(1 − u)/scale maps [0, 1) to all t.
        t = u / (1.0 - u) / scale
        g = 1.0 / (1.0 + 2.0 * t * values)
        spread = (axes * (values * g)) @ axes.T
        moved = -2.0 * t * (spread @ a)
        moved[0] = axes[0] * g @ (axes.T @ a)
        factor = np.exp(-t * float(g @ (axes.T @ a) ** 2)) * np.sqrt(np.prod(g)) / (scale * (1.0 - u) ** 2)
        return factor * (np.outer(moved, moved) + spread) / np.outer(unit, unit)

    moment, _ = quad_vec(integrand, 0.0, 1.0, epsabs=1e-13, epsrel=1e-11)
    moment *= np.outer(unit, unit)
    w, frame = diagonalize_one(0.5 * (moment + moment.T) / np.trace(moment))
    z, log_f = solve_spectrum(w) if w[0] > 0.0 else solve_moments(w)[:2]
    return Bingham.from_spectrum(z, np.ascontiguousarray(basis @ frame), log_f)


def to_von_mises(distribution: Bingham) -> tuple[float, float]:
    """Return (μ, κ) of the von Mises distribution of 2θ, x = (cos θ, sin θ): κ = −z₁/2 (eq. 76), d = 2."""
    z = _single(distribution)
    if distribution.dim != 2:
        raise InvalidArgumentError("distribution", "dimension 2", distribution.dim)
    c, s = distribution.mode
    return float(2.0 * np.arctan2(s, c) % (2.0 * np.pi)), float(-0.5 * z[0])


def from_von_mises(mu: float, kappa: float) -> Bingham:
    """Return the d = 2 distribution of θ whose doubled angle is von Mises with mean μ (rad) and concentration κ ≥ 0."""
    if not (np.isfinite(mu) and np.isfinite(kappa) and kappa >= 0.0):
        raise InvalidArgumentError("mu, kappa", "finite, kappa >= 0", (mu, kappa))
    c, s = np.cos(0.5 * mu), np.sin(0.5 * mu)
    return Bingham([-2.0 * kappa, 0.0], [[-s, c], [c, s]])


def to_von_mises_fisher(distribution: Bingham) -> tuple[FloatArray, float]:
    """Return (mode, κ = −z₁/2) of an isotropic distribution, any d.

    Along the angle θ from the mode the Bingham density is ∝ exp(κ cos 2θ): reweighted by (2 cos θ)^{d−2}, the ratio of
    the areas of the circles at 2θ and θ, the doubled angle follows the von Mises–Fisher distribution (Appendix C; with
    the area factor sin^{d−2}, where the paper prints d − 1).

    Raises
    ------
    InvalidArgumentError
        If the first d − 1 concentrations differ by more than 1e-9 of their size.
    """
    z = _single(distribution)
    if np.ptp(z[:-1]) > 1e-9 * abs(z[0]):
        raise InvalidArgumentError("distribution", "equal concentrations but the last (an isotropic distribution)", z)
    return np.array(distribution.mode), float(-0.5 * z[:-1].mean())


def from_von_mises_fisher(mode: ArrayLike, kappa: float) -> Bingham:
    """Return the isotropic distribution with mode (d,) and z = (−2κ, …, −2κ, 0); inverse of `to_von_mises_fisher`."""
    if not (np.isfinite(kappa) and kappa >= 0.0):
        raise InvalidArgumentError("kappa", "a finite number >= 0", kappa)
    m = unit_rows(mode, None, "mode")
    if m.ndim != 1 or m.size < 2:
        raise InvalidArgumentError("mode", "a unit vector (d,), d >= 2", m.shape)
    return Bingham.from_matrix(2.0 * kappa * np.outer(m, m))
