"""Kent's distribution of directions in space: elliptical contours about a mean direction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from bingham.distributions.fisher_bingham import FisherBingham
from bingham.distributions.sibling import weighted_sample
from bingham.errors import InvalidArgumentError
from bingham.kernels.linear_term import moments_linear
from bingham.notebook import Pictured
from bingham.validation import as_numbers, check_number

__all__ = ["Kent"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Kent(Pictured):
    """Distribution f(x) = exp(κ γ₁ᵀx + β ((γ₂ᵀx)² − (γ₃ᵀx)²))/c(κ, β) of directions x on S².

    Parameters
    ----------
    frame : (3, 3) array_like
        Orthogonal matrix with the columns γ₁ (mean direction), γ₂ (major) and γ₃ (minor axis).
    kappa : float
        Concentration κ ≥ 0.
    beta : float
        Ovalness β ≥ 0; with 2β ≤ κ there is one mode.

    Examples
    --------
    >>> p = Kent(np.eye(3), 10.0, 2.0)
    >>> bool(p.logpdf([0.8, 0.6, 0.0]) > p.logpdf([0.8, 0.0, 0.6]))
    True

    References
    ----------
    Kent, J. R. Statist. Soc. B 44 (1982) 71.
    """

    frame: FloatArray
    kappa: float
    beta: float

    def __post_init__(self) -> None:
        g = as_numbers(self.frame, "frame")
        if g.shape != (3, 3) or not np.abs(g.T @ g - np.eye(3)).max() <= 1e-6:
            raise InvalidArgumentError("frame", "an orthogonal matrix (3, 3)", g)
        for name, value in (("kappa", self.kappa), ("beta", self.beta)):
            check_number(value, name, "a finite number ≥ 0", minimum=0.0)
        object.__setattr__(self, "frame", g @ (1.5 * np.eye(3) - 0.5 * (g.T @ g)))

    @classmethod
    def fit(cls, x: ArrayLike, weights: ArrayLike | None = None) -> Self:
        """Return the distribution of greatest likelihood for unit vectors (n, 3), from Kent's moment estimate."""
        a, w = weighted_sample(x, weights)
        if a.shape[1] != 3:
            raise InvalidArgumentError("x", "directions in space, d = 3", f"d = {a.shape[1]}")
        mean, moment = w @ a, (a.T * w) @ a
        if not np.linalg.eigvalsh(moment)[0] > 1e-14:
            raise InvalidArgumentError("x", "directions that span the space", "a sample on a smaller sphere")
        start = _moment_frame(mean, moment)
        local_mean, local = start.T @ mean, start.T @ moment @ start
        # Narrow limit: variances 1/(κ − 2β) and 1/(κ + 2β) across the mean.
        major, minor = 1.0 / max(local[1, 1], 1e-9), 1.0 / max(local[2, 2], 1e-9)

        def negative(p: FloatArray) -> tuple[float, FloatArray]:
            g = Rotation.from_rotvec(p[:3]).as_matrix()
            kappa = np.exp(p[3])
            beta = kappa * p[4]
            found = moments_linear(np.array([0.0, beta, -beta]), np.array([kappa, 0.0, 0.0]))
            m, s = g.T @ local_mean, g.T @ local @ g
            spread = s[1, 1] - s[2, 2]
            value = kappa * m[0] + beta * spread - found.log_normalizer
            d_kappa = m[0] - found.mean[0]
            d_beta = spread - (found.moment[1, 1] - found.moment[2, 2])
            # Turning the frame by ω about its own axes moves γ₁ by γ₂ω₃ − γ₃ω₂ and so on.
            torque = np.array([
                4.0 * beta * s[1, 2],
                -kappa * m[2] - 2.0 * beta * s[0, 2],
                kappa * m[1] - 2.0 * beta * s[0, 1],
            ])  # fmt: skip
            gradient = np.concatenate(
                [_left_jacobian(p[:3]).T @ torque, [kappa * d_kappa + beta * d_beta, kappa * d_beta]]
            )
            return -float(value), -gradient

        kappa = 0.5 * (major + minor)
        first = np.append(np.zeros(3), [np.log(kappa), 0.25 * (minor - major) / kappa])
        p = minimize(negative, first, jac=True, method="BFGS", options={"gtol": 1e-7, "maxiter": 300}).x
        frame, beta = start @ Rotation.from_rotvec(p[:3]).as_matrix(), float(np.exp(p[3]) * p[4])
        if beta < 0.0:  # major and minor axis change places
            frame, beta = frame[:, [0, 2, 1]], -beta
        return cls(frame, float(np.exp(p[3])), beta)

    @property
    def dim(self) -> int:
        """Ambient dimension, 3."""
        return 3

    @property
    def parameter_count(self) -> int:
        """Free parameters: 5."""
        return 5

    def to_fisher_bingham(self) -> FisherBingham:
        """Return the same distribution as a `FisherBingham`."""
        g = self.frame
        matrix = self.beta * (np.outer(g[:, 1], g[:, 1]) - np.outer(g[:, 2], g[:, 2]))
        return FisherBingham(matrix, self.kappa * g[:, 0])

    def logpdf(self, x: ArrayLike) -> Any:
        """Return log f(x) (...) of unit vectors (..., 3)."""
        return self.to_fisher_bingham().logpdf(x)

    def pdf(self, x: ArrayLike) -> Any:
        """Return f(x) (...)."""
        return np.exp(self.logpdf(x))

    def rvs(self, size: int, *, rng: Any = None) -> FloatArray:
        """Return exact, independent samples (size, 3)."""
        return self.to_fisher_bingham().rvs(size, rng=rng)


def _moment_frame(mean: FloatArray, moment: FloatArray) -> FloatArray:
    """Return Kent's moment estimate of the frame: γ₁ along the mean, γ₂ and γ₃ principal axes across it."""
    length = float(np.linalg.norm(mean))
    first = mean / length if length > 1e-12 else np.linalg.eigh(moment)[1][:, -1]
    across = np.linalg.svd(first[None])[2][1:]
    axes = np.linalg.eigh(across @ moment @ across.T)[1]
    g = np.stack([first, axes[:, 1] @ across, axes[:, 0] @ across], axis=1)
    if np.linalg.det(g) < 0.0:
        g[:, 2] *= -1.0
    return g


def _left_jacobian(v: FloatArray) -> FloatArray:
    """Return the matrix that takes a change of a rotation vector v to the rotation in the rotated (body) frame."""
    angle = float(np.linalg.norm(v))
    k = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    if angle < 1e-6:
        return np.eye(3) - 0.5 * k
    return np.eye(3) - (1.0 - np.cos(angle)) / angle**2 * k + (angle - np.sin(angle)) / angle**3 * (k @ k)
