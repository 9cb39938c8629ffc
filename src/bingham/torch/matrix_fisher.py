"""The matrix Fisher distribution of rotation matrices: the Bingham distribution of their quaternions."""

from __future__ import annotations

import math
from typing import Any

import torch
from torch import Tensor
from torch.distributions import Distribution, constraints, register_kl
from torch.distributions.constraints import Constraint

from bingham.errors import InvalidArgumentError
from bingham.torch import numeric
from bingham.torch.distribution import Bingham
from bingham.torch.matrices import matrix_log_normalizer, matrix_moment

__all__ = ["MatrixFisher"]


class _RotationMatrix(Constraint):
    event_dim = 2

    def check(self, value: Tensor) -> Tensor:
        wide = value.to(numeric.result_type(value))
        off = (wide.mT @ wide - torch.eye(3, dtype=wide.dtype, device=wide.device)).abs().amax((-2, -1))
        return (off < 1e-3) & (torch.linalg.det(wide) > 0.0)


class MatrixFisher(Distribution):
    """Distribution of a rotation R: f(R) = exp(tr(Kᵀ R))/c(K), a density by the uniform probability on SO(3).

    tr(Kᵀ R(q)) = qᵀ A q with A linear in K, so that ±q has the `Bingham` distribution of matrix A and
    c(K) = F(A)/2π²; everything is computed there. (log 2π² = 2.98 is what a Bingham log-density, by surface area, is
    lower.)

    Parameters
    ----------
    K : (..., 3, 3) Tensor
        Any real matrix; the mode is the rotation nearest to it.

    Examples
    --------
    >>> import torch
    >>> p = MatrixFisher(5.0 * torch.eye(3))
    >>> p.log_prob(torch.eye(3)).round(decimals=3)
    tensor(5.0250)

    References
    ----------
    Downs, Biometrika 59 (1972) 665; Prentice, J. R. Stat. Soc. B 48 (1986) 214; Mohlin, Sullivan & Bianchi (2020).
    """

    arg_constraints: Any = {"K": constraints.independent(constraints.real, 2)}  # noqa: RUF012
    support: Any = _RotationMatrix()
    has_rsample = False

    def __init__(self, K: Tensor, validate_args: bool | None = None) -> None:
        if not isinstance(K, Tensor) or K.ndim < 2 or K.shape[-2:] != (3, 3):
            got = f"shape {tuple(K.shape)}" if isinstance(K, Tensor) else f"a {type(K).__name__}"
            raise InvalidArgumentError("K", "a tensor (..., 3, 3)", got)
        self.K = K  # pyright: ignore[reportConstantRedefinition]
        super().__init__(K.shape[:-2], K.shape[-2:], validate_args=validate_args)

    def expand(self, batch_shape: Any, _instance: Any = None) -> MatrixFisher:
        """Return the distribution with the batch shape, without copying."""
        kind: Any = MatrixFisher
        new: Any = self._get_checked_instance(kind, _instance)
        new.K = self.K.expand(*batch_shape, 3, 3)
        super(kind, new).__init__(torch.Size(batch_shape), self.event_shape, validate_args=False)
        new._validate_args = self._validate_args
        return new

    @property
    def bingham(self) -> Bingham:
        """The distribution of the quaternion ±q (w, x, y, z), by surface area of S³."""
        return Bingham(_quadratic(self.K), validate_args=False)

    def log_prob(self, value: Tensor) -> Tensor:
        """Return log f(value) (...) for rotation matrices (..., 3, 3)."""
        if self._validate_args:
            self._validate_sample(value)
        wide = self.K.to(torch.float64)
        log_c = matrix_log_normalizer(_quadratic(wide)) - math.log(2.0 * math.pi**2)
        return ((wide * value.to(torch.float64)).sum((-2, -1)) - log_c).to(numeric.result_type(self.K, value))

    @property
    def mean(self) -> Tensor:
        """E[R] (..., 3, 3), which is no rotation; `mode` is the nearest one."""
        return _expected_rotation(matrix_moment(_quadratic(self.K)))

    @property
    def mode(self) -> Tensor:
        """The rotation (..., 3, 3) of the largest density."""
        m = self.bingham.mode
        return _expected_rotation(m[..., :, None] * m[..., None, :])

    def entropy(self) -> Tensor:
        """Return −E[log f(R)] (...), nats; 0 for the uniform distribution."""
        return self.bingham.entropy() - math.log(2.0 * math.pi**2)

    @torch.no_grad()
    def sample(self, sample_shape: Any = ()) -> Tensor:
        """Return exact samples ``(*sample_shape, *batch_shape, 3, 3)``."""
        q = self.bingham.sample(sample_shape)
        return _expected_rotation(q[..., :, None] * q[..., None, :])


def _quadratic(k: Tensor) -> Tensor:
    """Return A (..., 4, 4) with tr(Kᵀ R(q)) = qᵀ A q."""
    trace = k.diagonal(dim1=-2, dim2=-1).sum(-1)[..., None, None]
    skew = torch.stack([k[..., 2, 1] - k[..., 1, 2], k[..., 0, 2] - k[..., 2, 0], k[..., 1, 0] - k[..., 0, 1]], -1)
    block = k + k.mT - trace * torch.eye(3, dtype=k.dtype, device=k.device)
    top = torch.cat([trace, skew[..., None, :]], -1)
    return torch.cat([top, torch.cat([skew[..., :, None], block], -1)], -2)


def _expected_rotation(s: Tensor) -> Tensor:
    """Return E[R(q)] (..., 3, 3) from E[qqᵀ] (..., 4, 4): the transpose of `_quadratic`."""
    v, w = s[..., 1:, 1:], s[..., 0, 1:]
    scalar = s[..., 0, 0] - v.diagonal(dim1=-2, dim2=-1).sum(-1)
    zero = torch.zeros_like(scalar)
    cross = torch.stack([zero, -w[..., 2], w[..., 1], w[..., 2], zero, -w[..., 0], -w[..., 1], w[..., 0], zero], -1)
    eye = torch.eye(3, dtype=s.dtype, device=s.device)
    return scalar[..., None, None] * eye + 2.0 * (v + cross.unflatten(-1, (3, 3)))


@register_kl(MatrixFisher, MatrixFisher)
def _kl(p: MatrixFisher, q: MatrixFisher) -> Tensor:
    return torch.distributions.kl_divergence(p.bingham, q.bingham)
