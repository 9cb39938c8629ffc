"""Numbers for the autograd functions: double tensors in and out, nothing recorded.

On the CPU the compiled kernels of the package; elsewhere Triton's fused kernel where there is one, else tensor
operations. Under ``torch.compile`` each is one opaque operator (``torch.ops.bingham.…``).
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor, library

from bingham.distributions import matrices as on_cpu
from bingham.distributions.normalizer import log_normalizer_derivatives, solve_moments
from bingham.torch import on_device

__all__ = ["concentrations", "curvature", "derivatives", "likelihood", "moment", "precise", "result_type", "spectrum"]


def result_type(*tensors: Tensor) -> torch.dtype:
    """Return float64 if a tensor has it, else float32: half precision is too coarse for log-densities."""
    return torch.float64 if any(t.dtype == torch.float64 for t in tensors) else torch.float32


def precise(t: Tensor) -> Tensor:
    """Return t in double precision, contiguous, on a device that has it."""
    t = t.detach()
    if t.device.type == "mps":
        t = t.cpu()
    return t.to(torch.float64).contiguous()


def _rows(t: Tensor, keep: int) -> Any:
    return t.reshape(-1, *t.shape[t.ndim - keep :]).numpy()


def _operator(shapes: Callable[..., tuple[Any, ...]]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Make a function of tensors one opaque operator for the compiler and leave it as it is otherwise."""

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        operator = library.custom_op(f"bingham::{function.__name__}", function, mutates_args=())
        operator.register_fake(lambda *a: _empty(shapes(*a), a[0]))

        @functools.wraps(function)
        def call(*args: Any) -> Any:
            return operator(*args) if torch.compiler.is_compiling() else function(*args)

        return call

    return decorate


def _empty(shapes: tuple[Any, ...], like: Tensor) -> Any:
    made = [like.new_empty(shape) for shape in shapes]
    return tuple(made) if len(made) > 1 else made[0]


@_operator(lambda z: (z.shape[:-1], z.shape, (*z.shape, z.shape[-1])))
def derivatives(z: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Return log F, ω and the Hessian of log F at z (..., d)."""
    if z.device.type != "cpu":
        log_f, w, hessian = on_device.derivatives(z, 2)
        return log_f, w, hessian
    log_f, w, hessian = log_normalizer_derivatives(z.numpy())
    return torch.as_tensor(log_f), torch.from_numpy(w), torch.from_numpy(hessian)


@_operator(lambda w: (w.shape,))
def concentrations(w: Tensor) -> Tensor:
    """Return the z (..., d), max z = 0, with moments w (..., d)."""
    if w.device.type != "cpu":
        return on_device.concentrations(w)
    return torch.from_numpy(solve_moments(w.numpy())[0])


@_operator(lambda a: (a.shape[:-2], a.shape))
def moment(a: Tensor) -> tuple[Tensor, Tensor]:
    """Return log F(A) and E[yyᵀ] for A (..., d, d)."""
    if a.device.type != "cpu":
        log_f, s = on_device.moment(a)
        return log_f, s
    log_f, s = on_cpu.matrix_log_normalizer(_rows(a, 2))
    return torch.from_numpy(log_f).reshape(a.shape[:-2]), torch.from_numpy(s).reshape(a.shape)


@_operator(lambda a, x, tolerance: (a.shape[:-2], a.shape))
def likelihood(a: Tensor, x: Tensor, tolerance: float) -> tuple[Tensor, Tensor]:
    """Return log F(A) − uᵀAu, u = x/|x|, and E[yyᵀ] − uuᵀ for A (..., d, d) and x (..., d) of one batch shape."""
    if a.device.type != "cpu":
        value, gradient = on_device.likelihood(a, x)
        return value, gradient
    value, gradient = on_cpu.matrix_likelihood(_rows(a, 2), _rows(x, 1), tolerance)
    return torch.from_numpy(value).reshape(a.shape[:-2]), torch.from_numpy(gradient).reshape(a.shape)


@_operator(lambda a, v: (a.shape,))
def curvature(a: Tensor, v: Tensor) -> Tensor:
    """Return the derivative of E[yyᵀ] by A (..., d, d) along V (..., d, d)."""
    if a.device.type != "cpu":
        return on_device.curvature(a, v)
    return torch.from_numpy(on_cpu.matrix_curvature(_rows(a, 2), _rows(v, 2))).reshape(a.shape)


@_operator(lambda a: (a.shape[:-1], a.shape))
def spectrum(a: Tensor) -> tuple[Tensor, Tensor]:
    """Return eigenvalues (..., d), in no order, and eigenvectors by rows (..., d, d) of A (..., d, d)."""
    if a.device.type != "cpu":
        values, frames = on_device.spectrum(a)
        return values, frames
    values, frames = on_cpu.matrix_spectrum(_rows(a, 2))
    return torch.from_numpy(values).reshape(a.shape[:-1]), torch.from_numpy(frames).reshape(a.shape)
