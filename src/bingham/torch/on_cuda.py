# Triton's language is built at run time and knows no static types.
# pyright: basic, reportMissingImports=false, reportAttributeAccessIssue=false, reportCallIssue=false
# pyright: reportIndexIssue=false, reportOperatorIssue=false, reportArgumentType=false
"""One fused Triton kernel for d = 4: a matrix to each lane, from A to log F and its gradient without memory between.

Eigenproblem by the rotations of `kernels.eigen_lanes`, a fixed number of sweeps; sums over the nodes as in
`kernels.rule.node_4`. Constants come from memory: Triton would round literals to single precision.
"""

from __future__ import annotations

import functools
import math

import torch
import triton
import triton.language as tl
from torch import Tensor

from bingham.kernels.numpy_rule import CI, CR, SI, SR

__all__ = ["fused"]

BLOCK = 64
# Cyclic Jacobi on 4×4 matrices has converged to rounding after six sweeps, mostly after five.
SWEEPS = 7


def fused(a: Tensor, x: Tensor | None) -> tuple[Tensor, Tensor]:
    """Return log F(A) (...) and E[yyᵀ] for A (..., 4, 4); with x (..., 4): log F(A) − uᵀAu, E[yyᵀ] − uuᵀ, u = x/|x|.

    Rows that are not finite come out not finite.
    """
    rows = a.reshape(-1, 16).contiguous()
    n = len(rows)
    values, gradients = torch.empty(n, dtype=torch.float64, device=a.device), torch.empty_like(rows)
    points = rows if x is None else x.reshape(-1, 4).contiguous()
    if n:
        grid = ((n + BLOCK - 1) // BLOCK,)
        _fused[grid](rows, points, _table(a.device), values, gradients, n, x is not None, BLOCK, SWEEPS, num_warps=2)
    return values.reshape(a.shape[:-2]), gradients.reshape(a.shape)


@functools.cache
def _table(device: torch.device) -> Tensor:
    """Return the nodes and weights of the rule, one node a row, and 2π²."""
    rows = [v for k in range(len(SR)) for v in (SR[k], SI[k], CR[k], CI[k])]
    return torch.tensor([*rows, 2.0 * math.pi**2], dtype=torch.float64, device=device)


@triton.jit
def _rotation(p, q, x):
    """Cosine, sine and eigenvalue shift of the rotation that clears x between diagonal entries p and q."""
    gap, xx = q - p, x * x
    root = tl.sqrt(gap * gap + 4.0 * xx)
    h = gap + tl.where(gap < 0.0, -root, root)
    h = tl.where(h == 0.0, h + 1.0, h)
    n = 1.0 / tl.sqrt(h * h + 4.0 * xx)
    return tl.abs(h) * n, tl.where(h < 0.0, -2.0 * n, 2.0 * n) * x, 2.0 * xx / h


@triton.jit
def _turn(c, s, y, z):
    return c * y - s * z, s * y + c * z


@triton.jit
def _swap(away, y, z):
    return tl.where(away, z, y), tl.where(away, y, z)


@triton.jit
def _fused(
    a_ptr, x_ptr, table, value_ptr, gradient_ptr, n, HAS_X: tl.constexpr, BLOCK: tl.constexpr, SWEEPS: tl.constexpr
):
    row = tl.program_id(0) * BLOCK + tl.arange(0, BLOCK)
    mask = row < n
    a = a_ptr + row * 16
    b0, b1 = tl.load(a, mask, 0.0), tl.load(a + 5, mask, 0.0)
    b2, b3 = tl.load(a + 10, mask, 0.0), tl.load(a + 15, mask, 0.0)
    b01 = 0.5 * (tl.load(a + 1, mask, 0.0) + tl.load(a + 4, mask, 0.0))
    b02 = 0.5 * (tl.load(a + 2, mask, 0.0) + tl.load(a + 8, mask, 0.0))
    b03 = 0.5 * (tl.load(a + 3, mask, 0.0) + tl.load(a + 12, mask, 0.0))
    b12 = 0.5 * (tl.load(a + 6, mask, 0.0) + tl.load(a + 9, mask, 0.0))
    b13 = 0.5 * (tl.load(a + 7, mask, 0.0) + tl.load(a + 13, mask, 0.0))
    b23 = 0.5 * (tl.load(a + 11, mask, 0.0) + tl.load(a + 14, mask, 0.0))
    zero = 0.0 * b0
    one = zero + 1.0
    form = zero
    u0, u1, u2, u3 = zero, zero, zero, zero
    if HAS_X:
        x = x_ptr + row * 4
        u0, u1 = tl.load(x, mask, 1.0), tl.load(x + 1, mask, 0.0)
        u2, u3 = tl.load(x + 2, mask, 0.0), tl.load(x + 3, mask, 0.0)
        k = 1.0 / tl.sqrt(u0 * u0 + u1 * u1 + u2 * u2 + u3 * u3)
        u0, u1, u2, u3 = u0 * k, u1 * k, u2 * k, u3 * k
        form = b0 * u0 * u0 + b1 * u1 * u1 + b2 * u2 * u2 + b3 * u3 * u3
        form += 2.0 * (b01 * u0 * u1 + b02 * u0 * u2 + b03 * u0 * u3 + b12 * u1 * u2 + b13 * u1 * u3 + b23 * u2 * u3)
    f00, f01, f02, f03 = one, zero, zero, zero
    f10, f11, f12, f13 = zero, one, zero, zero
    f20, f21, f22, f23 = zero, zero, one, zero
    f30, f31, f32, f33 = zero, zero, zero, one
    for _ in range(SWEEPS):
        c, s, t = _rotation(b0, b1, b01)
        b0, b1, b01 = b0 - t, b1 + t, zero
        b02, b12 = _turn(c, s, b02, b12)
        b03, b13 = _turn(c, s, b03, b13)
        f00, f10 = _turn(c, s, f00, f10)
        f01, f11 = _turn(c, s, f01, f11)
        f02, f12 = _turn(c, s, f02, f12)
        f03, f13 = _turn(c, s, f03, f13)
        c, s, t = _rotation(b2, b3, b23)
        b2, b3, b23 = b2 - t, b3 + t, zero
        b02, b03 = _turn(c, s, b02, b03)
        b12, b13 = _turn(c, s, b12, b13)
        f20, f30 = _turn(c, s, f20, f30)
        f21, f31 = _turn(c, s, f21, f31)
        f22, f32 = _turn(c, s, f22, f32)
        f23, f33 = _turn(c, s, f23, f33)
        c, s, t = _rotation(b0, b2, b02)
        b0, b2, b02 = b0 - t, b2 + t, zero
        b01, b12 = _turn(c, s, b01, b12)
        b03, b23 = _turn(c, s, b03, b23)
        f00, f20 = _turn(c, s, f00, f20)
        f01, f21 = _turn(c, s, f01, f21)
        f02, f22 = _turn(c, s, f02, f22)
        f03, f23 = _turn(c, s, f03, f23)
        c, s, t = _rotation(b1, b3, b13)
        b1, b3, b13 = b1 - t, b3 + t, zero
        b01, b03 = _turn(c, s, b01, b03)
        b12, b23 = _turn(c, s, b12, b23)
        f10, f30 = _turn(c, s, f10, f30)
        f11, f31 = _turn(c, s, f11, f31)
        f12, f32 = _turn(c, s, f12, f32)
        f13, f33 = _turn(c, s, f13, f33)
        c, s, t = _rotation(b0, b3, b03)
        b0, b3, b03 = b0 - t, b3 + t, zero
        b01, b13 = _turn(c, s, b01, b13)
        b02, b23 = _turn(c, s, b02, b23)
        f00, f30 = _turn(c, s, f00, f30)
        f01, f31 = _turn(c, s, f01, f31)
        f02, f32 = _turn(c, s, f02, f32)
        f03, f33 = _turn(c, s, f03, f33)
        c, s, t = _rotation(b1, b2, b12)
        b1, b2, b12 = b1 - t, b2 + t, zero
        b01, b02 = _turn(c, s, b01, b02)
        b13, b23 = _turn(c, s, b13, b23)
        f10, f20 = _turn(c, s, f10, f20)
        f11, f21 = _turn(c, s, f11, f21)
        f12, f22 = _turn(c, s, f12, f22)
        f13, f23 = _turn(c, s, f13, f23)
    # The largest eigenvalue last.
    away = b0 > b3
    b0, b3 = _swap(away, b0, b3)
    f00, f30 = _swap(away, f00, f30)
    f01, f31 = _swap(away, f01, f31)
    f02, f32 = _swap(away, f02, f32)
    f03, f33 = _swap(away, f03, f33)
    away = b1 > b3
    b1, b3 = _swap(away, b1, b3)
    f10, f30 = _swap(away, f10, f30)
    f11, f31 = _swap(away, f11, f31)
    f12, f32 = _swap(away, f12, f32)
    f13, f33 = _swap(away, f13, f33)
    away = b2 > b3
    b2, b3 = _swap(away, b2, b3)
    f20, f30 = _swap(away, f20, f30)
    f21, f31 = _swap(away, f21, f31)
    f22, f32 = _swap(away, f22, f32)
    f23, f33 = _swap(away, f23, f33)
    z0, z1, z2 = b0 - b3, b1 - b3, b2 - b3
    total, g0, g1, g2, g3 = zero, zero, zero, zero, zero
    for k in range(8):
        sr, si = tl.load(table + 4 * k), tl.load(table + 4 * k + 1)
        cr, ci = tl.load(table + 4 * k + 2), tl.load(table + 4 * k + 3)
        a0, a1, a2, ss = sr - z0, sr - z1, sr - z2, si * si
        m0, m1, m2, m3 = a0 * a0 + ss, a1 * a1 + ss, a2 * a2 + ss, zero + (sr * sr + ss)
        # √(s − zᵢ) factor by factor, the root with positive imaginary part, since Im s > 0.
        tr, ti = zero + cr, zero + ci
        tr, ti = _divide_root(tr, ti, a0, si, m0)
        tr, ti = _divide_root(tr, ti, a1, si, m1)
        tr, ti = _divide_root(tr, ti, a2, si, m2)
        tr, ti = _divide_root(tr, ti, zero + sr, si, m3)
        total += ti
        # Im t/(s − zᵢ)
        g0 += (ti * a0 - tr * si) / m0
        g1 += (ti * a1 - tr * si) / m1
        g2 += (ti * a2 - tr * si) / m2
        g3 += (ti * sr - tr * si) / m3
    log_f = tl.log(total * tl.load(table + 32)) + b3
    k = 1.0 / (g0 + g1 + g2 + g3)
    g0, g1, g2, g3 = g0 * k, g1 * k, g2 * k, g3 * k
    tl.store(value_ptr + row, log_f - form, mask)
    g = gradient_ptr + row * 16
    e00, e01, e02, e03 = g0 * f00, g0 * f01, g0 * f02, g0 * f03
    e10, e11, e12, e13 = g1 * f10, g1 * f11, g1 * f12, g1 * f13
    e20, e21, e22, e23 = g2 * f20, g2 * f21, g2 * f22, g2 * f23
    e30, e31, e32, e33 = g3 * f30, g3 * f31, g3 * f32, g3 * f33
    tl.store(g, e00 * f00 + e10 * f10 + e20 * f20 + e30 * f30 - u0 * u0, mask)
    tl.store(g + 5, e01 * f01 + e11 * f11 + e21 * f21 + e31 * f31 - u1 * u1, mask)
    tl.store(g + 10, e02 * f02 + e12 * f12 + e22 * f22 + e32 * f32 - u2 * u2, mask)
    tl.store(g + 15, e03 * f03 + e13 * f13 + e23 * f23 + e33 * f33 - u3 * u3, mask)
    s01 = e00 * f01 + e10 * f11 + e20 * f21 + e30 * f31 - u0 * u1
    tl.store(g + 1, s01, mask)
    tl.store(g + 4, s01, mask)
    s02 = e00 * f02 + e10 * f12 + e20 * f22 + e30 * f32 - u0 * u2
    tl.store(g + 2, s02, mask)
    tl.store(g + 8, s02, mask)
    s03 = e00 * f03 + e10 * f13 + e20 * f23 + e30 * f33 - u0 * u3
    tl.store(g + 3, s03, mask)
    tl.store(g + 12, s03, mask)
    s12 = e01 * f02 + e11 * f12 + e21 * f22 + e31 * f32 - u1 * u2
    tl.store(g + 6, s12, mask)
    tl.store(g + 9, s12, mask)
    s13 = e01 * f03 + e11 * f13 + e21 * f23 + e31 * f33 - u1 * u3
    tl.store(g + 7, s13, mask)
    tl.store(g + 13, s13, mask)
    s23 = e02 * f03 + e12 * f13 + e22 * f23 + e32 * f33 - u2 * u3
    tl.store(g + 11, s23, mask)
    tl.store(g + 14, s23, mask)


@triton.jit
def _divide_root(tr, ti, a, b, m):
    """Return t/√(a + ib), m = a² + b², b > 0."""
    size = tl.sqrt(m)
    t = tl.sqrt(0.5 * (size + tl.abs(a)))
    u = 0.5 * b / t
    rr, ri = tl.where(a >= 0.0, t, u), tl.where(a >= 0.0, u, t)
    k = 1.0 / size
    return (tr * rr + ti * ri) * k, (ti * rr - tr * ri) * k
