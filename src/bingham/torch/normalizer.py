# PyTorch calls these methods with the arguments of each function.
# pyright: reportIncompatibleMethodOverride=false
"""log F(z), its gradient and the inverse of the gradient, differentiable to any order."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor
from torch.autograd import Function

from bingham.errors import InvalidArgumentError
from bingham.torch import numeric, on_device

__all__ = ["concentrations", "log_normalizer", "moments"]

# Moments must sum to one within this; the rest is rounding and is divided out.
SUM_TOLERANCE = {torch.float64: 1e-8, torch.float32: 1e-5, torch.bfloat16: 3e-2, torch.float16: 4e-3}


def log_normalizer(z: Tensor) -> Tensor:
    """Return log F(z), F(z) = ∫ exp(Σ zᵢ xᵢ²) dx over S^{d−1}; the gradient is `moments`.

    Parameters
    ----------
    z : (..., d) Tensor
        Concentrations in any order; a common offset c adds c.

    Returns
    -------
    (...) Tensor
        float64 for float64, else float32.

    Raises
    ------
    InvalidArgumentError
        If z is no floating-point tensor of d ≥ 2, or, on the CPU, not finite.

    Examples
    --------
    >>> import torch
    >>> z = torch.tensor([-8.0, -2.0, 0.0], dtype=torch.float64, requires_grad=True)
    >>> value = log_normalizer(z)
    >>> gradient, = torch.autograd.grad(value, z)
    >>> bool(torch.allclose(gradient, moments(z)))
    True
    """
    return _first(z)[0]


def moments(z: Tensor) -> Tensor:
    """Return ω (..., d), ωᵢ = E[xᵢ²] for x with density exp(Σ zᵢ xᵢ²)/F(z); Σω = 1.

    Examples
    --------
    >>> import torch
    >>> moments(torch.zeros(2))
    tensor([0.5000, 0.5000])
    """
    return _first(z)[1]


def concentrations(w: Tensor) -> Tensor:
    """Return the z (..., d) with moments(z) = w and max z = 0; its derivative is implicit, dz = H(z)⁻¹ dw.

    Parameters
    ----------
    w : (..., d) Tensor
        Positive second moments with sum 1 (float64: within 1e-8), in any order.

    Raises
    ------
    InvalidArgumentError
        If, on the CPU, an entry is not positive or a row does not sum to 1.

    Notes
    -----
    Where two largest moments are equal, max z = 0 has a kink: the derivative is one of the two one-sided ones.

    Examples
    --------
    >>> import torch
    >>> z = torch.tensor([-30.0, -3.0, 0.0, -1.0], dtype=torch.float64)
    >>> bool(torch.allclose(concentrations(moments(z)), z))
    True
    """
    _check(w, "w")
    total = w.to(torch.float64 if w.device.type != "mps" else torch.float32).sum(-1, keepdim=True)
    if w.device.type == "cpu" and not torch.compiler.is_compiling():
        off = float((total.detach() - 1.0).abs().max()) if w.numel() and not _wrapped(w) else 0.0
        if not off <= SUM_TOLERANCE[w.dtype]:
            hint = "divide by the sum if they are unnormalised moments"
            raise InvalidArgumentError(
                "w", f"rows with sum 1 within {SUM_TOLERANCE[w.dtype]:g}", f"off by {off:g}", hint
            )
    rows = (w / total).to(numeric.result_type(w))
    return (_Concentrations if torch.compiler.is_compiling() else _ConcentrationsForward).apply(rows)


def _first(z: Tensor) -> tuple[Tensor, Tensor]:
    _check(z, "z")
    return (_LogNormalizer if torch.compiler.is_compiling() else _LogNormalizerForward).apply(z)


def _hessian(z: Tensor) -> Tensor:
    return (_Hessian if torch.compiler.is_compiling() else _HessianForward).apply(z)


def _wrapped(t: Tensor) -> bool:
    """Whether values cannot be looked at, inside a transformation of ``torch.func``."""
    return torch._C._functorch.is_functorch_wrapped_tensor(t)  # pyright: ignore[reportAttributeAccessIssue]


def _check(t: Any, name: str) -> None:
    if not isinstance(t, Tensor) or not t.is_floating_point() or t.ndim == 0 or t.shape[-1] < 2:
        got = f"{t.dtype} of shape {tuple(t.shape)}" if isinstance(t, Tensor) else f"a {type(t).__name__}"
        raise InvalidArgumentError(name, "a floating-point tensor (..., d) with d >= 2", got)


class _LogNormalizer(Function):
    """Z ↦ (log F, ω), with dω = H dz."""

    @staticmethod
    def forward(z: Tensor) -> tuple[Tensor, Tensor]:
        log_f, w, _ = numeric.derivatives(numeric.precise(z))
        kind = {"dtype": numeric.result_type(z), "device": z.device}
        return log_f.to(**kind), w.to(**kind)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Tensor], output: tuple[Tensor, Tensor]) -> None:
        ctx.set_materialize_grads(False)
        ctx.save_for_backward(inputs[0], output[1])
        ctx.save_for_forward(inputs[0], output[1])

    @staticmethod
    def backward(ctx: Any, g: Tensor | None, gw: Tensor | None) -> Tensor | None:
        z, w = ctx.saved_tensors
        out = None if g is None else g[..., None] * w
        if gw is None:
            return out
        second = (_hessian(z) @ gw[..., None])[..., 0]
        return second if out is None else out + second

    @staticmethod
    def vmap(info: Any, in_dims: tuple[int | None], z: Tensor) -> tuple[Any, Any]:
        return _first(z.movedim(in_dims[0] or 0, 0)), (0, 0)


class _LogNormalizerForward(_LogNormalizer):
    @staticmethod
    def jvp(ctx: Any, dz: Tensor) -> tuple[Tensor, Tensor]:
        z, w = ctx.saved_tensors
        dz = dz.to(w.dtype)
        return (w * dz).sum(-1), (_hessian(z) @ dz[..., None])[..., 0]


class _Hessian(Function):
    """Z ↦ H; its derivatives come from differentiating the contour sum itself."""

    @staticmethod
    def forward(z: Tensor) -> Tensor:
        return numeric.derivatives(numeric.precise(z))[2].to(dtype=numeric.result_type(z), device=z.device)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Tensor], output: Tensor) -> None:
        ctx.save_for_backward(inputs[0])
        ctx.save_for_forward(inputs[0])

    @staticmethod
    def backward(ctx: Any, g: Tensor) -> Tensor:
        (z,) = ctx.saved_tensors
        return torch.func.vjp(_contour_hessian, z)[1](g)[0]

    @staticmethod
    def vmap(info: Any, in_dims: tuple[int | None], z: Tensor) -> tuple[Any, Any]:
        return _hessian(z.movedim(in_dims[0] or 0, 0)), 0


class _HessianForward(_Hessian):
    @staticmethod
    def jvp(ctx: Any, dz: Tensor) -> Tensor:
        (z,) = ctx.saved_tensors
        # Forward mode does not nest: the transpose of the transpose instead.
        value, pull, *_ = torch.func.vjp(_contour_hessian, z)
        return torch.func.vjp(lambda v: pull(v)[0], torch.zeros_like(value))[1](dz.to(z.dtype))[0]


def _contour_hessian(z: Tensor) -> Tensor:
    return on_device.derivatives(z.to(torch.float64), 2)[2].to(numeric.result_type(z))


class _Concentrations(Function):
    """W ↦ z, Σw = 1; H dz = dw on the entries whose z is not the largest, which stays 0."""

    @staticmethod
    def forward(w: Tensor) -> Tensor:
        rows = numeric.precise(w)
        z = numeric.concentrations(rows / rows.sum(-1, keepdim=True))
        return z.to(dtype=w.dtype, device=w.device)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Tensor], output: Tensor) -> None:
        ctx.save_for_backward(output)
        ctx.save_for_forward(output)

    @staticmethod
    def backward(ctx: Any, g: Tensor) -> Tensor:
        (z,) = ctx.saved_tensors
        return _solve(z, g)

    @staticmethod
    def vmap(info: Any, in_dims: tuple[int | None], w: Tensor) -> tuple[Any, Any]:
        return concentrations(w.movedim(in_dims[0] or 0, 0)), 0


class _ConcentrationsForward(_Concentrations):
    @staticmethod
    def jvp(ctx: Any, dw: Tensor) -> Tensor:
        (z,) = ctx.saved_tensors
        return _solve(z, dw)


def _solve(z: Tensor, v: Tensor) -> Tensor:
    """Return H⁻¹ v on the entries other than the largest z and 0 there: symmetric, so that it is its own transpose."""
    order = z.detach().argsort(dim=-1)
    rows = order[..., None].expand(*order.shape, z.shape[-1])
    hessian = _hessian(z.to(torch.float64)).gather(-2, rows).gather(-1, rows.mT)[..., :-1, :-1]
    # Rows and columns scaled by √Hᵢᵢ: the spectrum of H spans the square of that of ω.
    scale = hessian.detach().diagonal(dim1=-2, dim2=-1).sqrt()
    right = v.to(torch.float64).gather(-1, order)[..., :-1] / scale
    solution = (
        torch.linalg.solve(hessian / (scale[..., :, None] * scale[..., None, :]), right[..., None])[..., 0] / scale
    )
    full = torch.nn.functional.pad(solution, (0, 1)).to(v.dtype)
    return full.gather(-1, order.argsort(dim=-1))
