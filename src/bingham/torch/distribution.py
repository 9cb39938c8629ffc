"""The Bingham distribution as a `torch.distributions.Distribution`."""

from __future__ import annotations

import math
from typing import Any, NoReturn

import torch
from torch import Tensor
from torch.distributions import Distribution, constraints, register_kl
from torch.distributions.constraints import Constraint

from bingham.errors import InvalidArgumentError
from bingham.torch import numeric
from bingham.torch.matrices import matrix_log_normalizer, matrix_moment, negative_log_likelihood

__all__ = ["Bingham", "UnitVector"]


class UnitVector(Constraint):
    """Vectors (..., d) of length one, within the rounding of their type."""

    event_dim = 1

    def check(self, value: Tensor) -> Tensor:
        """Return whether each vector of value (..., d) has length one."""
        tolerance = 4.0 * math.sqrt(torch.finfo(value.dtype).eps) if value.dtype == torch.float64 else 1e-3
        tolerance = max(tolerance, 4.0 * torch.finfo(value.dtype).eps)
        return (torch.linalg.vector_norm(value.to(numeric.result_type(value)), dim=-1) - 1.0).abs() <= tolerance


class Bingham(Distribution):
    """Distribution of an axis or rotation ±x on S^{d−1}: f(x) = exp(xᵀAx)/F(A), a density by surface area.

    Parameters
    ----------
    concentration_matrix : (..., d, d) Tensor, optional
        Symmetric A; A + c I is the same distribution.
    z : (..., d) Tensor, optional
        Concentrations in any order, with M in place of A.
    M : (..., d, d) Tensor, optional
        Orthogonal; column i is the principal axis of zᵢ.
    validate_args : bool, optional
        As in every distribution of PyTorch.

    Raises
    ------
    InvalidArgumentError
        If neither or both forms are given, or shapes do not fit.
    ValueError
        If validation is on and A is not symmetric or M not orthogonal, within rounding.

    Notes
    -----
    There is no `rsample`: exact samples come from a rejection method, and the reparameterisation by eigenframe and
    conditional distributions is singular where concentrations coincide. What pathwise gradients are mostly for is
    exact here without samples: `entropy`, `kl_divergence`, expectations of quadratic forms through `second_moment`.
    For other expectations use the score: ``(log_prob(x) * reward).mean()`` with x = `sample`.

    Examples
    --------
    >>> import torch
    >>> p = Bingham(torch.diag(torch.tensor([0.0, -30.0, -30.0, -30.0])))
    >>> p.mode.abs()
    tensor([1., 0., 0., 0.])
    >>> p.log_prob(torch.tensor([1.0, 0.0, 0.0, 0.0]))
    tensor(2.6652)
    """

    arg_constraints: Any = {"concentration_matrix": constraints.symmetric}  # noqa: RUF012
    support: Any = UnitVector()
    has_rsample = False

    def __init__(
        self,
        concentration_matrix: Tensor | None = None,
        *,
        z: Tensor | None = None,
        M: Tensor | None = None,
        validate_args: bool | None = None,
    ) -> None:
        if (concentration_matrix is None) == (z is None) or (z is None) != (M is None):
            raise InvalidArgumentError("concentration_matrix", "either a matrix, or z and M", "neither or a mixture")
        if z is not None and M is not None:
            concentration_matrix = _from_spectrum(z, M, validate_args)
        a = concentration_matrix
        if not isinstance(a, Tensor) or a.ndim < 2 or a.shape[-1] != a.shape[-2] or a.shape[-1] < 2:
            got = f"shape {tuple(a.shape)}" if isinstance(a, Tensor) else f"a {type(a).__name__}"
            raise InvalidArgumentError("concentration_matrix", "a tensor (..., d, d) with d >= 2", got)
        self.concentration_matrix = a
        super().__init__(a.shape[:-2], a.shape[-1:], validate_args=validate_args)

    def expand(self, batch_shape: Any, _instance: Any = None) -> Bingham:
        """Return the distribution with the batch shape, without copying."""
        kind: Any = Bingham
        new: Any = self._get_checked_instance(kind, _instance)
        new.concentration_matrix = self.concentration_matrix.expand(*batch_shape, *self.concentration_matrix.shape[-2:])
        super(kind, new).__init__(torch.Size(batch_shape), self.event_shape, validate_args=False)
        new._validate_args = self._validate_args
        return new

    def log_prob(self, value: Tensor) -> Tensor:
        """Return log f(value) (...), nats relative to surface area, for unit vectors (..., d)."""
        if self._validate_args:
            self._validate_sample(value)
        return -negative_log_likelihood(self.concentration_matrix, value)

    @property
    def log_normalizer(self) -> Tensor:
        """Log F(A) (...)."""
        return matrix_log_normalizer(self.concentration_matrix)

    @property
    def second_moment(self) -> Tensor:
        """E[xxᵀ] (..., d, d), trace 1."""
        return matrix_moment(self.concentration_matrix)

    @property
    def mean(self) -> Tensor:
        """E[x] = 0: x and −x are one axis. The direction is `mode`."""
        return torch.zeros_like(self.concentration_matrix[..., 0])

    @property
    def variance(self) -> Tensor:
        """E[xᵢ²] (..., d), the diagonal of `second_moment`."""
        return self.second_moment.diagonal(dim1=-2, dim2=-1)

    @property
    def mode(self) -> Tensor:
        """± the axis of the largest density (..., d), of either sign; differentiable once, exactly, where unique."""
        a = self.concentration_matrix
        frozen = a.detach()
        values, vectors = torch.linalg.eigh((0.5 * (frozen + frozen.mT)).to(numeric.result_type(a)))
        m, rest = vectors[..., -1:], vectors[..., :-1]
        # dm = Σ mᵢ (mᵢᵀ dA m)/(z − zᵢ) over the other axes; none where the mode is not unique.
        gap = values[..., -1:] - values[..., :-1]
        inverse = torch.where(gap > 0.0, 1.0 / gap, torch.zeros_like(gap))
        change = (a - frozen).to(m.dtype)
        return (m + rest @ (inverse[..., None] * (rest.mT @ (0.5 * (change + change.mT)) @ m)))[..., 0]

    def entropy(self) -> Tensor:
        """Return −E[log f(x)] (...) = log F(A) − tr(A E[xxᵀ]), nats."""
        a = self.concentration_matrix.to(torch.float64)
        value = matrix_log_normalizer(a) - (0.5 * (a + a.mT) * matrix_moment(a)).sum((-2, -1))
        return value.to(numeric.result_type(self.concentration_matrix))

    @torch.no_grad()
    def sample(self, sample_shape: Any = ()) -> Tensor:
        """Return exact samples ``(*sample_shape, *batch_shape, d)`` from PyTorch's random generator.

        Rejection from an angular central Gaussian envelope (Kent, Ganeiber & Mardia 2013).
        """
        a = self.concentration_matrix
        values, vectors = torch.linalg.eigh((0.5 * (a + a.mT)).to(numeric.result_type(a)))
        spread = values[..., -1:] - values
        shape = self._extended_shape(torch.Size(sample_shape))
        envelope = _envelope(spread).expand(*shape[:-1], 1)
        axes = _rejection(spread.expand(shape).reshape(-1, shape[-1]), envelope.reshape(-1, 1)).reshape(shape)
        return (vectors @ axes[..., None])[..., 0]

    def rsample(self, sample_shape: Any = ()) -> NoReturn:
        """Raise: there is no reparameterised sample; see the notes of the class."""
        raise NotImplementedError(
            "Bingham has no reparameterised samples; use sample() with the score log_prob(x), or entropy(), "
            "kl_divergence and second_moment, whose gradients are exact"
        )


def _from_spectrum(z: Tensor, frame: Tensor, validate_args: bool | None) -> Tensor:
    d = z.shape[-1] if z.ndim else 0
    if d < 2 or frame.ndim < 2 or frame.shape[-2:] != (d, d):
        raise InvalidArgumentError("M", f"shape (..., {d}, {d}) to go with z of shape {tuple(z.shape)}", frame.shape)
    if validate_args is not False and __debug__ and not torch.compiler.is_compiling():
        off = (frame.mT @ frame - torch.eye(d, dtype=frame.dtype, device=frame.device)).detach().abs()
        if frame.numel() and not bool((off < 1e3 * torch.finfo(frame.dtype).eps + 1e-6).all()):
            raise InvalidArgumentError("M", "an orthogonal matrix", f"max |MᵀM − I| = {float(off.max()):.3g}")
    return frame @ (z[..., None] * frame.mT)


def _envelope(spread: Tensor) -> Tensor:
    """Return the b (..., 1) with Σ 1/(b + 2λᵢ) = 1 for λ = max z − z (..., d)."""
    low, high = torch.zeros_like(spread[..., :1]), torch.full_like(spread[..., :1], float(spread.shape[-1]))
    for _ in range(50):
        b = 0.5 * (low + high)
        above = (1.0 / (b + 2.0 * spread)).sum(-1, keepdim=True) > 1.0
        low, high = torch.where(above, b, low), torch.where(above, high, b)
    return high


def _rejection(spread: Tensor, b: Tensor) -> Tensor:
    """Return one sample (n, d) for each row of spread = max z − z (n, d) and b (n, 1), in the eigenframe."""
    n, d = spread.shape
    precision = 1.0 + 2.0 * spread / b
    bound = 0.5 * (d - b) - 0.5 * d * torch.log(d / b)
    out, open_rows = torch.empty_like(spread), torch.arange(n, device=spread.device)
    while len(open_rows):
        y = torch.randn(len(open_rows), d, dtype=spread.dtype, device=spread.device) / precision[open_rows].sqrt()
        x = torch.nn.functional.normalize(y, dim=-1)
        square = x * x
        ratio = -(spread[open_rows] * square).sum(-1) + 0.5 * d * (precision[open_rows] * square).sum(-1).log()
        accepted = torch.rand_like(ratio).log() < ratio + bound[open_rows, 0]
        out[open_rows[accepted]] = x[accepted]
        open_rows = open_rows[~accepted]
    return out


@register_kl(Bingham, Bingham)
def _kl(p: Bingham, q: Bingham) -> Tensor:
    """KL(p ‖ q) = tr((A_p − A_q) S_p) + log F_q − log F_p."""
    a, b = p.concentration_matrix.to(torch.float64), q.concentration_matrix.to(torch.float64)
    moment = matrix_moment(a)
    value = ((a - b) * moment).sum((-2, -1)) + matrix_log_normalizer(b) - matrix_log_normalizer(a)
    return value.to(numeric.result_type(p.concentration_matrix, q.concentration_matrix))
