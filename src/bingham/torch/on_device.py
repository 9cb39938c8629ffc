"""The same numbers by tensor operations, for other devices than CPUs; Triton's fused kernel for d = 4 on CUDA."""

from __future__ import annotations

import functools
import importlib.util
from typing import Any

import torch
from torch import Tensor

from bingham.errors import ConvergenceError
from bingham.kernels.array_rule import derivatives_array

__all__ = ["concentrations", "curvature", "derivatives", "has_triton", "likelihood", "moment", "spectrum"]

# Rows at once: the nodes of the rule lie along an axis of their own, about 1 kB a row.
CHUNK = 1 << 20
MAX_EVALUATIONS, TOLERANCE = 20, 1e-6


def derivatives(z: Tensor, order: int) -> tuple[Tensor, ...]:
    """Return log F, ω and the Hessian at z (..., d), as far as `order` says; differentiable, the contour held fixed."""
    constant = functools.partial(torch.as_tensor, dtype=z.dtype, device=z.device)
    return derivatives_array(z, torch, order, constant=constant, freeze=torch.Tensor.detach)


def _derivatives(z: Tensor, order: int) -> tuple[Tensor, ...]:
    rows = z.reshape(-1, z.shape[-1])
    parts = (
        [derivatives(part, order) for part in rows.split(CHUNK)] if len(rows) > CHUNK else [derivatives(rows, order)]
    )
    joined = [torch.cat([part[k] for part in parts]) for k in range(order + 1)]
    return tuple(t.reshape(*z.shape[:-1], *t.shape[1:]) for t in joined)


def spectrum(a: Tensor) -> tuple[Tensor, Tensor]:
    """Return eigenvalues and eigenvectors by rows."""
    values, columns = torch.linalg.eigh(0.5 * (a + a.mT))
    return values, columns.mT.contiguous()


def moment(a: Tensor) -> tuple[Tensor, Tensor]:
    """Return log F(A) and E[yyᵀ]."""
    if a.is_cuda and a.shape[-1] == 4 and has_triton():
        return _triton().fused(a, None)
    values, frames = spectrum(a)
    log_f, w = _derivatives(values, 1)
    return log_f, frames.mT @ (w[..., None] * frames)


def likelihood(a: Tensor, x: Tensor) -> tuple[Tensor, Tensor]:
    """Return log F(A) − uᵀAu, u = x/|x|, and E[yyᵀ] − uuᵀ."""
    if a.is_cuda and a.shape[-1] == 4 and has_triton():
        return _triton().fused(a, x)
    log_f, s = moment(a)
    u = x / torch.linalg.vector_norm(x, dim=-1, keepdim=True)
    return log_f - torch.einsum("...i,...ij,...j->...", u, a, u), s - u[..., :, None] * u[..., None, :]


def curvature(a: Tensor, v: Tensor) -> Tensor:
    """Return the derivative of E[yyᵀ] along V; see `kernels.frames.curvature_rows`."""
    values, frames = spectrum(a)
    _, w, hessian = _derivatives(values, 2)
    inner = frames @ (0.5 * (v + v.mT)) @ frames.mT
    off = inner * 2.0 * (hessian + w[..., :, None] * w[..., None, :])
    on = (hessian @ inner.diagonal(dim1=-2, dim2=-1)[..., None])[..., 0]
    off = off - torch.diag_embed(off.diagonal(dim1=-2, dim2=-1)) + torch.diag_embed(on)
    return frames.mT @ off @ frames


def concentrations(w: Tensor) -> Tensor:
    """Solve ∇ log F(z) = w by the iteration of `kernels.newton`."""
    w, order = (w / w.sum(-1, keepdim=True)).sort(dim=-1)
    s2, s3 = (w**2).sum(-1, keepdim=True), (w**3).sum(-1, keepdim=True)
    v = w / (1.0 + 2.0 * (w * s3 / s2**2 - w**2 / s2))
    v = v / v.sum(-1, keepdim=True)
    top = 0.5 / v[..., -1:]
    z = w
    for _ in range(MAX_EVALUATIONS):
        z = torch.cat([top - 0.5 / v[..., :-1], torch.zeros_like(top)], -1)
        _, g, hessian = _derivatives(z, 2)
        residual, h = (w - g)[..., :-1], hessian[..., :-1, :-1]
        scale = h.diagonal(dim1=-2, dim2=-1).sqrt()
        scaled = h / (scale[..., :, None] * scale[..., None, :])
        step = torch.linalg.solve(scaled, (residual / scale)[..., None])[..., 0] / scale
        if bool((residual.abs() < TOLERANCE * w[..., :-1]).all()):
            z = torch.cat([z[..., :-1] + step, torch.zeros_like(top)], -1)
            return torch.empty_like(z).scatter_(-1, order, z)
        u = v[..., :-1]
        change = 2.0 * u * u * step
        v = torch.cat([torch.where(change > -0.9 * u, u + change, 0.1 * u), v[..., -1:]], -1)
    raise ConvergenceError("concentrations: Newton's method did not converge", z)


@functools.cache
def has_triton() -> bool:
    """Whether Triton is installed."""
    return importlib.util.find_spec("triton") is not None


def _triton() -> Any:
    from bingham.torch import on_cuda

    return on_cuda
