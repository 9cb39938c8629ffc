"""From the numbers a network puts out to concentration matrices A (..., d, d)."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from bingham.errors import InvalidArgumentError

__all__ = ["from_cholesky", "from_eigen", "from_numbers"]


def from_numbers(v: Tensor) -> Tensor:
    """Return the symmetric A (..., d, d) whose upper triangle, row by row, is v (..., d(d+1)/2); 10 numbers for d = 4.

    The form to begin with (Peretroukhin et al. 2020): linear, without constraints, continuous over all rotations and
    distributions. One number too many, the common offset of the eigenvalues, which the likelihood does not see. The
    numbers are concentrations: for targets known to 1° (A of the order −1e4) let the network put out v / 100 or so, or
    it spends its time on growing.

    Examples
    --------
    >>> import torch
    >>> from_numbers(torch.arange(3.0))
    tensor([[0., 1.],
            [1., 2.]])
    """
    n = v.shape[-1]
    d = round(0.5 * (math.sqrt(8 * n + 1) - 1))
    if d < 2 or d * (d + 1) // 2 != n:
        raise InvalidArgumentError("v", "d(d+1)/2 numbers: 3, 6 or 10 for d = 2, 3 or 4", f"{n} numbers")
    row, column = torch.triu_indices(d, d, device=v.device)
    place = torch.empty(d, d, dtype=torch.long, device=v.device)
    place[row, column] = place[column, row] = torch.arange(n, device=v.device)
    return v[..., place]


def from_cholesky(v: Tensor) -> Tensor:
    """Return A = −L Lᵀ (..., d, d), L (d, d−1) lower trapezoidal, filled row by row with v; 9 numbers for d = 4.

    Every Bingham distribution has such an A, with largest eigenvalue 0. The numbers are square roots of concentrations:
    a network reaches 1e4 with outputs of 100. Pitfalls: the gradient vanishes at v = 0, the uniform distribution, so
    begin elsewhere; signs of columns are free, so different v mean the same A, which averages of v do not respect.

    Examples
    --------
    >>> import torch
    >>> from_cholesky(torch.tensor([3.0, 0.0]))
    tensor([[-9., -0.],
            [-0., -0.]])
    """
    n = v.shape[-1]
    d = round(0.5 * (math.sqrt(8 * n + 9) - 1))
    if d < 2 or (d + 2) * (d - 1) // 2 != n:
        raise InvalidArgumentError("v", "(d+2)(d−1)/2 numbers: 2, 5 or 9 for d = 2, 3 or 4", f"{n} numbers")
    row, column = torch.tril_indices(d, d - 1, device=v.device)
    factor = torch.zeros(*v.shape[:-1], d, d - 1, dtype=v.dtype, device=v.device)
    factor[..., row, column] = v
    return -factor @ factor.mT


def from_eigen(frame: Tensor, gaps: Tensor) -> Tensor:
    """Return A = M diag(z) Mᵀ (..., 4, 4) from 8 + 3 numbers: M = L(p) R(q), z from softplus of the gaps.

    p and q are the halves of frame (..., 8), normalised; every frame of determinant 1 is such a product of a left and a
    right multiplication (one quaternion alone reaches a few of them). The mode, the last column, is the
    quaternion p ⊗ (0, 0, 0, 1) ⊗ q. z₃ = 0, z₂ = −softplus(g₀), z₁ = z₂ − softplus(g₁), z₀ = z₁ − softplus(g₂).

    For networks that should say "where" and "how sure" in separate heads. Pitfalls: not continuous over all rotations
    (M is an ordered frame; `from_numbers` has no such seams); where two z are equal the gradient by their axes is 0, so
    that a network at a symmetric answer learns no axes; half precision of p and q turns the axes.
    """
    if frame.shape[-1] != 8 or gaps.shape[-1] != 3 or frame.shape[:-1] != gaps.shape[:-1]:
        got = f"{tuple(frame.shape)} and {tuple(gaps.shape)}"
        raise InvalidArgumentError("frame", "shapes (..., 8) and (..., 3) of frame and gaps", got)
    p, q = torch.nn.functional.normalize(frame.unflatten(-1, (2, 4)), dim=-1).unbind(-2)
    left = torch.einsum("ijk,...j->...ik", hamilton(p), p)
    right = torch.einsum("ijk,...k->...ij", hamilton(q), q)
    m = left @ right
    z = -torch.cumsum(torch.nn.functional.softplus(gaps), -1).flip(-1)
    z = torch.nn.functional.pad(z, (0, 1))
    return m @ (z[..., None] * m.mT)


def hamilton(like: Tensor, d: int = 4) -> Tensor:
    """Return C (d, d, d) with (x ⊕ y)ᵢ = Σ Cᵢⱼₖ xⱼ yₖ: Hamilton's product, scalar first, or complex numbers (d = 2)."""
    c = torch.zeros(d, d, d, dtype=like.dtype)
    c[0] = -torch.eye(d)
    c[0, 0, 0] = 1.0
    for i in range(1, d):
        c[i, 0, i] = c[i, i, 0] = 1.0
    if d == 4:
        for i, j, k in ((1, 2, 3), (2, 3, 1), (3, 1, 2)):
            c[i, j, k], c[i, k, j] = 1.0, -1.0
    return c.to(like.device)
