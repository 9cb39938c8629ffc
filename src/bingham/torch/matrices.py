# PyTorch calls these methods with the arguments of each function.
# pyright: reportIncompatibleMethodOverride=false
"""log F(A), E[xxᵀ] and log-likelihoods from symmetric matrices, differentiable twice without eigenvector derivatives.

d log F = ⟨E[xxᵀ], dA⟩, and the derivative of E[xxᵀ] needs divided differences of the moments that are moments
themselves (`kernels.frames.curvature_rows`): repeated eigenvalues are nothing special.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor
from torch.autograd import Function
from torch.autograd.function import once_differentiable

from bingham.errors import InvalidArgumentError
from bingham.torch import numeric

__all__ = ["logpdf", "matrix_from_moment", "matrix_log_normalizer", "matrix_moment", "negative_log_likelihood", "pdf"]

# Squared lengths of x may differ from one by this much (rounding of the type), on the CPU, where it is looked at.
LENGTH_TOLERANCE = {torch.float64: 1e-5, torch.float32: 1e-4, torch.float16: 1e-2, torch.bfloat16: 5e-2}


def matrix_log_normalizer(A: Tensor) -> Tensor:
    """Return log F(A) (...), F(A) = ∫ exp(xᵀAx) dx over S^{d−1}, of the symmetric part of A (..., d, d).

    Its gradient by A is `matrix_moment`; A + c I adds c.

    Examples
    --------
    >>> import torch
    >>> A = torch.diag(torch.tensor([-3.0, -3.0, 0.0])).requires_grad_()
    >>> gradient, = torch.autograd.grad(matrix_log_normalizer(A), A)
    >>> bool(torch.allclose(gradient, matrix_moment(A)))
    True
    """
    return _first(A)[0]


def matrix_moment(A: Tensor) -> Tensor:
    """Return E[xxᵀ] (..., d, d) for x with density exp(xᵀAx)/F(A), A (..., d, d); trace 1."""
    return _first(A)[1]


def negative_log_likelihood(A: Tensor, x: Tensor) -> Tensor:
    """Return −log f(x) = log F(A) − uᵀAu (...), u = x/|x|, the symmetric part of A counting.

    Parameters
    ----------
    A : (..., d, d) Tensor
        A + c I gives the same; computed in double precision, so that float32 does not lose digits to a large c.
    x : (..., d) Tensor
        Unit vectors or unit quaternions (w, x, y, z), broadcast against the batch of A; on the CPU lengths off by more
        than rounding raise.

    Returns
    -------
    (...) Tensor
        In nats relative to surface area; float64 if A or x is, else float32.

    Examples
    --------
    >>> import torch
    >>> A = torch.zeros(4, 4)
    >>> negative_log_likelihood(A, torch.tensor([1.0, 0.0, 0.0, 0.0]))  # log 2π²
    tensor(2.9826)
    """
    _check(A, "A")
    if not isinstance(x, Tensor) or not x.is_floating_point() or x.ndim < 1 or x.shape[-1] != A.shape[-1]:
        got = f"{x.dtype} of shape {tuple(x.shape)}" if isinstance(x, Tensor) else f"a {type(x).__name__}"
        raise InvalidArgumentError("x", f"a floating-point tensor (..., {A.shape[-1]})", got)
    if A.shape[:-2] == x.shape[:-1]:
        return _likelihood(A, x)[0]
    try:
        shape = torch.broadcast_shapes(A.shape[:-2], x.shape[:-1])
    except RuntimeError:
        got = f"{tuple(x.shape)} beside A of shape {tuple(A.shape)}"
        raise InvalidArgumentError("x", "a batch that broadcasts against that of A", got) from None
    if A.shape[:-2].numel() < shape.numel() and not torch.compiler.is_compiling():
        # Many points for one matrix: its spectrum is computed once.
        kind = numeric.result_type(A, x)
        a = A.to(torch.float64)
        u = torch.nn.functional.normalize(x.to(torch.float64), dim=-1)
        return (matrix_log_normalizer(a) - torch.einsum("...i,...ij,...j->...", u, a, u)).to(kind)
    return _likelihood(A.expand(*shape, *A.shape[-2:]), x.expand(*shape, x.shape[-1]))[0]


def logpdf(matrix: Any, x: Tensor) -> Tensor:
    """Return log f(x) (...) of the distribution with this constant matrix (..., d, d), an array of NumPy."""
    a = torch.as_tensor(matrix, dtype=torch.float64, device=x.device)
    return -negative_log_likelihood(a, x).to(numeric.result_type(x))


def pdf(matrix: Any, x: Tensor) -> Tensor:
    """Return f(x) (...); see `logpdf`."""
    return logpdf(matrix, x).exp()


def matrix_from_moment(S: Tensor) -> Tensor:
    """Return the A (..., d, d), largest eigenvalue 0, with E[xxᵀ] = S; the inverse of `matrix_moment`.

    S (..., d, d) is symmetric and positive definite and is divided by its trace. Differentiable once, implicitly; the
    derivative is that of the A whose eigenvalue on the heaviest axis stays 0.
    """
    _check(S, "S")
    return _MatrixFromMoment.apply(S / S.diagonal(dim1=-2, dim2=-1).sum(-1)[..., None, None])


def _check(a: Any, name: str) -> None:
    ok = isinstance(a, Tensor) and a.is_floating_point() and a.ndim >= 2
    if not ok or a.shape[-1] != a.shape[-2] or a.shape[-1] < 2:
        got = f"{a.dtype} of shape {tuple(a.shape)}" if isinstance(a, Tensor) else f"a {type(a).__name__}"
        numbers = isinstance(a, Tensor) and a.ndim >= 1 and a.shape[-1] == 10
        hint = "bingham.torch.from_numbers makes a matrix of ten numbers" if numbers else ""
        raise InvalidArgumentError(name, "a floating-point tensor (..., d, d) with d >= 2", got, hint)


def _first(a: Tensor) -> tuple[Tensor, Tensor]:
    _check(a, "A")
    return (_LogNormalizer if torch.compiler.is_compiling() else _LogNormalizerForward).apply(a)


def _curvature(a: Tensor, v: Tensor) -> Tensor:
    return (_Curvature if torch.compiler.is_compiling() else _CurvatureForward).apply(a, v)


def _likelihood(a: Tensor, x: Tensor) -> tuple[Tensor, Tensor]:
    return (_Likelihood if torch.compiler.is_compiling() else _LikelihoodForward).apply(a, x)


def _front(t: Tensor, dim: int | None, size: int) -> Tensor:
    return t.expand(size, *t.shape) if dim is None else t.movedim(dim, 0)


class _LogNormalizer(Function):
    """A ↦ (log F, E[yyᵀ])."""

    @staticmethod
    def forward(a: Tensor) -> tuple[Tensor, Tensor]:
        log_f, s = numeric.moment(numeric.precise(a))
        kind = {"dtype": numeric.result_type(a), "device": a.device}
        return log_f.to(**kind), s.to(**kind)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Tensor], output: tuple[Tensor, Tensor]) -> None:
        ctx.set_materialize_grads(False)
        ctx.save_for_backward(inputs[0], output[1])
        ctx.save_for_forward(inputs[0], output[1])

    @staticmethod
    def backward(ctx: Any, g: Tensor | None, gs: Tensor | None) -> Tensor | None:
        a, s = ctx.saved_tensors
        out = None if g is None else g[..., None, None] * s
        if gs is None:
            return out
        second = _curvature(a, gs)
        return second if out is None else out + second

    @staticmethod
    def vmap(info: Any, in_dims: tuple[int | None], a: Tensor) -> tuple[Any, Any]:
        return _first(a.movedim(in_dims[0] or 0, 0)), (0, 0)


class _LogNormalizerForward(_LogNormalizer):
    @staticmethod
    def jvp(ctx: Any, da: Tensor) -> tuple[Tensor, Tensor]:
        a, s = ctx.saved_tensors
        da = da.to(s.dtype)
        return (s * da).sum((-2, -1)), _curvature(a, da)


class _Curvature(Function):
    """(A, V) ↦ dE[yyᵀ] along V: linear and self-adjoint in V."""

    @staticmethod
    def forward(a: Tensor, v: Tensor) -> Tensor:
        return numeric.curvature(numeric.precise(a), numeric.precise(v)).to(dtype=v.dtype, device=v.device)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Tensor, Tensor], output: Tensor) -> None:
        ctx.save_for_backward(inputs[0])
        ctx.save_for_forward(inputs[0])

    @staticmethod
    def backward(ctx: Any, g: Tensor) -> tuple[None, Tensor]:
        if ctx.needs_input_grad[0]:
            raise NotImplementedError(THIRD)
        return None, _curvature(ctx.saved_tensors[0], g)

    @staticmethod
    def vmap(info: Any, in_dims: tuple[int | None, int | None], a: Tensor, v: Tensor) -> tuple[Any, Any]:
        return _curvature(_front(a, in_dims[0], info.batch_size), _front(v, in_dims[1], info.batch_size)), 0


THIRD = (
    "third derivatives by a matrix (and jacfwd of jacfwd, which forms them on its way) are not implemented; "
    "use torch.func.hessian, or bingham.torch.log_normalizer(z), which has them by concentrations"
)


class _CurvatureForward(_Curvature):
    @staticmethod
    def jvp(ctx: Any, da: Tensor | None, dv: Tensor | None) -> Tensor:
        if da is not None:
            raise NotImplementedError(THIRD)
        assert dv is not None
        return _curvature(ctx.saved_tensors[0], dv)


class _Likelihood(Function):
    """(A, x) ↦ (log F(A) − uᵀAu, G = E[yyᵀ] − uuᵀ), u = x/|x|, on one batch shape."""

    @staticmethod
    def forward(a: Tensor, x: Tensor) -> tuple[Tensor, Tensor]:
        tolerance = max(LENGTH_TOLERANCE[a.dtype], LENGTH_TOLERANCE[x.dtype])
        value, gradient = numeric.likelihood(numeric.precise(a), numeric.precise(x), tolerance)
        kind = {"dtype": numeric.result_type(a, x), "device": a.device}
        return value.to(**kind), gradient.to(**kind)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Tensor, Tensor], output: tuple[Tensor, Tensor]) -> None:
        ctx.set_materialize_grads(False)
        ctx.save_for_backward(*inputs, output[1])
        ctx.save_for_forward(*inputs, output[1])

    @staticmethod
    def backward(ctx: Any, g: Tensor | None, gg: Tensor | None) -> tuple[Tensor | None, Tensor | None]:
        a, x, gradient = ctx.saved_tensors
        ga = None if g is None else g[..., None, None] * gradient
        if gg is not None and ctx.needs_input_grad[0]:
            second = _curvature(a, gg)
            ga = second if ga is None else ga + second
        if not ctx.needs_input_grad[1]:
            return ga, None
        pull = _pull(a, x, g, gg)
        return ga, pull

    @staticmethod
    def vmap(info: Any, in_dims: tuple[int | None, int | None], a: Tensor, x: Tensor) -> tuple[Any, Any]:
        a, x = _front(a, in_dims[0], info.batch_size), _front(x, in_dims[1], info.batch_size)
        return _likelihood(a, x), (0, 0)


class _LikelihoodForward(_Likelihood):
    @staticmethod
    def jvp(ctx: Any, da: Tensor | None, dx: Tensor | None) -> tuple[Tensor, Tensor]:
        a, x, gradient = ctx.saved_tensors
        dv, dg = torch.zeros_like(gradient[..., 0, 0]), torch.zeros_like(gradient)
        if da is not None:
            da = da.to(gradient.dtype)
            dv, dg = dv + (gradient * da).sum((-2, -1)), dg + _curvature(a, da)
        if dx is not None:
            u, dx = _unit(x.to(torch.float64)), dx.to(torch.float64)
            length = torch.linalg.vector_norm(x.to(torch.float64), dim=-1, keepdim=True)
            du = (dx - (dx * u).sum(-1, keepdim=True) * u) / length
            twice = a.to(torch.float64) + a.to(torch.float64).mT
            dv = dv - torch.einsum("...i,...ij,...j->...", du, twice, u).to(dv.dtype)
            dg = dg - (du[..., :, None] * u[..., None, :] + u[..., :, None] * du[..., None, :]).to(dg.dtype)
        return dv, dg


def _unit(x: Tensor) -> Tensor:
    return x / torch.linalg.vector_norm(x, dim=-1, keepdim=True)


def _pull(a: Tensor, x: Tensor, g: Tensor | None, gg: Tensor | None) -> Tensor:
    """Gradient by x of g (−uᵀAu) + ⟨gg, −uuᵀ⟩, in double precision: large A cancel against u's length."""
    a, x = a.to(torch.float64), x.to(torch.float64)
    weight = torch.zeros_like(a)
    if g is not None:
        weight = weight + g.to(torch.float64)[..., None, None] * a
    if gg is not None:
        weight = weight + gg.to(torch.float64)
    u = _unit(x)
    pulled = -((weight + weight.mT) @ u[..., None])[..., 0]
    tangent = pulled - (pulled * u).sum(-1, keepdim=True) * u
    return tangent / torch.linalg.vector_norm(x, dim=-1, keepdim=True)


class _MatrixFromMoment(Function):
    """S ↦ A, tr S = 1: the inverse, on the sphere's terms, of A ↦ E[yyᵀ]."""

    @staticmethod
    def forward(ctx: Any, s: Tensor) -> Tensor:
        w, frames = numeric.spectrum(numeric.precise(s))
        if bool((w <= 0.0).any()):
            hint = "the data lie on a smaller sphere; add their noise variance"
            raise InvalidArgumentError("S", "a positive definite second moment", float(w.min()), hint)
        z = numeric.concentrations(w / w.sum(-1, keepdim=True))
        ctx.save_for_backward(z, frames)
        return (frames.mT @ (z[..., None] * frames)).to(dtype=numeric.result_type(s), device=s.device)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, g: Tensor) -> Tensor:
        z, frames = ctx.saved_tensors
        _, w, hessian = numeric.derivatives(z)
        inner = frames @ (0.5 * (g + g.mT)).to(device=z.device, dtype=z.dtype) @ frames.mT
        from bingham.torch.normalizer import _solve

        on = _solve(z, inner.diagonal(dim1=-2, dim2=-1))
        inner = 0.5 * inner / (hessian + w[..., :, None] * w[..., None, :])
        inner = inner - torch.diag_embed(inner.diagonal(dim1=-2, dim2=-1)) + torch.diag_embed(on)
        return (frames.mT @ inner @ frames).to(dtype=g.dtype, device=g.device)
