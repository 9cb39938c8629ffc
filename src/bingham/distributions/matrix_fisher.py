"""The matrix Fisher distribution of rotations, which is the Bingham distribution of their quaternions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.notebook import Pictured
from bingham.rotations import as_quaternion
from bingham.validation import as_numbers, check_kind

__all__ = ["MatrixFisher"]

FloatArray = NDArray[np.float64]

# ∫ dR over all rotations is 1, the area of S³ is 2π².
LOG_AREA = math.log(2.0 * math.pi**2)


@dataclass(frozen=True, slots=True, eq=False)
class MatrixFisher(Pictured):
    """Distribution f(R) = exp(tr(FᵀR))/c(F) of rotation matrices, a density with respect to their uniform distribution.

    tr(FᵀR(q)) = qᵀKq with K linear in F (Davenport's matrix), so that the unit quaternions ±q of R have the Bingham
    distribution with A = K, exactly: log c(F) = log F_B(K) − log 2π² (Prentice 1986).

    Parameters
    ----------
    F : (..., 3, 3) array_like
        Any real matrix; with F = U diag(s) Vᵀ, U and V rotations, the mode is U Vᵀ.

    Examples
    --------
    >>> p = MatrixFisher(np.diag([25.0, 5.0, 1.0]))
    >>> round(float(p.log_normalizer), 12)
    25.195066286054

    References
    ----------
    Downs, Biometrika 59 (1972) 665; Khatri & Mardia, J. R. Statist. Soc. B 39 (1977) 95; Prentice, J. R. Statist. Soc.
    B 48 (1986) 214.
    """

    F: FloatArray

    def __post_init__(self) -> None:
        a = as_numbers(self.F, "F")
        if a.shape[-2:] != (3, 3) or not np.all(np.isfinite(a)):
            raise InvalidArgumentError("F", "finite matrices, shape (..., 3, 3)", a.shape)
        object.__setattr__(self, "F", a)

    @classmethod
    def from_bingham(cls, distribution: Bingham) -> Self:
        """Return the matrix Fisher distribution of the rotations of a Bingham distribution of quaternions, d = 4."""
        check_kind(distribution, Bingham, "distribution")
        if distribution.dim != 4:
            raise InvalidArgumentError("distribution", "one of rotations, d = 4", f"d = {distribution.dim}")
        a = distribution.matrix
        a = a - np.trace(a, axis1=-2, axis2=-1)[..., None, None] / 4.0 * np.eye(4)
        # The basis K₍ᵢⱼ₎ of trace-free symmetric matrices is orthogonal, with squared norm 4.
        return cls(0.25 * np.einsum("ijab,...ab->...ij", BASIS, a))

    @classmethod
    def fit(cls, x: ArrayLike | Rotation, weights: ArrayLike | None = None) -> Self:
        """Return the distribution of greatest likelihood for rotations: ``Rotation`` or quaternions (n, 4), w first."""
        return cls.from_bingham(Bingham.fit(as_quaternion(x, scalar_first=True), weights))

    def to_bingham(self) -> Bingham:
        """Return the distribution of the quaternions (w, x, y, z)."""
        return Bingham.from_matrix(np.einsum("ijab,...ij->...ab", BASIS, self.F))

    @property
    def log_normalizer(self) -> Any:
        """Log c(F) (...)."""
        # to_bingham drops the largest eigenvalue, tr of the proper singular values.
        return self.to_bingham().log_normalizer + np.sum(self.singular_values, axis=-1) - LOG_AREA

    @property
    def singular_values(self) -> FloatArray:
        """Proper singular values (..., 3), s₁ ≥ s₂ ≥ |s₃|: F = U diag(s) Vᵀ with rotations U and V."""
        return _proper(self.F)[1]

    @property
    def mode(self) -> FloatArray:
        """Rotation matrix (..., 3, 3) of the highest density, U Vᵀ."""
        u, _, v = _proper(self.F)
        return u @ v

    def mean(self) -> FloatArray:
        """Return E[R] (..., 3, 3)."""
        return np.einsum("ijab,...ab->...ij", BASIS, self.to_bingham().moment())

    def logpdf(self, x: ArrayLike | Rotation) -> Any:
        """Return log f (...) at rotation matrices (..., 3, 3) or a ``Rotation``."""
        r = x.as_matrix() if isinstance(x, Rotation) else as_numbers(x, "x")
        if r.shape[-2:] != (3, 3) or np.abs(np.swapaxes(r, -1, -2) @ r - np.eye(3)).max(initial=0.0) > 1e-6:
            raise InvalidArgumentError("x", "rotation matrices (..., 3, 3)", f"shape {r.shape}")
        return (np.einsum("...ij,...ij->...", self.F, r) - self.log_normalizer)[()]

    def rvs(self, size: int | tuple[int, ...] | None = None, *, rng: Any = None) -> FloatArray:
        """Return exact, independent rotation matrices ``(*shape, *size, 3, 3)``."""
        return _matrix(self.to_bingham().rvs(size, rng=rng))


def _matrix(q: FloatArray) -> FloatArray:
    """Return R(q) (..., 3, 3), Rᵢⱼ = qᵀ K₍ᵢⱼ₎ q."""
    return np.einsum("ijab,...a,...b->...ij", BASIS, q, q)


def _basis() -> FloatArray:
    """Return the symmetric K (3, 3, 4, 4) with R(q)ᵢⱼ = qᵀ K₍ᵢⱼ₎ q for unit quaternions, by polarisation."""
    pairs = np.array([[np.eye(4)[a] + np.eye(4)[b] for b in range(4)] for a in range(4)])
    square = np.sum(pairs**2, axis=-1)

    def quadratic(q: FloatArray) -> FloatArray:
        unit = q / np.linalg.norm(q, axis=-1, keepdims=True)
        r = Rotation.from_quat(unit.reshape(-1, 4), scalar_first=True).as_matrix().reshape(*q.shape[:-1], 3, 3)
        return r

    both = quadratic(pairs) * square[..., None, None]
    single = quadratic(np.eye(4))
    k = 0.5 * (both - single[:, None] - single[None, :])
    return np.moveaxis(k, (2, 3), (0, 1)).round(12)


BASIS = _basis()


def _proper(f: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    u, s, v = np.linalg.svd(f)
    sign = np.linalg.det(u) * np.linalg.det(v)
    s, u, v = s.copy(), u.copy(), v.copy()
    s[..., 2] *= sign
    u[..., :, 2] *= np.linalg.det(u)[..., None]
    v[..., 2, :] *= np.linalg.det(v)[..., None]
    return u, s, v
