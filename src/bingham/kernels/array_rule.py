"""The normaliser and its derivatives in plain array code, for any array library and any device.

The rules of `kernels.rule` in real arithmetic, the nodes along a leading axis: elementwise functions and sums are all
they need, so that one function serves PyTorch, JAX and CuPy, compiled or differentiated further by them. Arrays are in
double precision: the weights of the 8 nodes cancel, and single precision would keep four digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from bingham.kernels.contour import CROSSING, DECAY, NODES
from bingham.kernels.numpy_rule import CI, CR, RULE_DIMENSION, SI, SR

__all__ = ["derivatives_array", "repeat"]

NEWTON_STEPS, BISECTIONS = 40, 10


def repeat(count: int, body: Callable[[Any], Any], start: Any) -> Any:
    """Return body applied `count` times; JAX passes a compiled loop in place of this."""
    for _ in range(count):
        start = body(start)
    return start


def derivatives_array(
    z: Any,
    xp: Any,
    order: int,
    *,
    constant: Callable[[Any], Any],
    freeze: Callable[[Any], Any] = lambda a: a,
    loop: Callable[[int, Callable[[Any], Any], Any], Any] = repeat,
) -> tuple[Any, ...]:
    """Return log F (...), then ω (..., d) if order ≥ 1, then the Hessian of log F (..., d, d) if order = 2.

    Parameters
    ----------
    z : (..., d) array of `xp`, double precision
        Concentrations in any order; a common offset is allowed.
    xp : namespace
        With where, sqrt, exp, log, cos, sin and stack.
    order : int
        0, 1 or 2.
    constant : callable
        Turns a NumPy array into an array like z.
    freeze : callable
        Marks an array as constant for differentiation: F does not depend on the contour.
    loop : callable
        `repeat` or a compiled loop of the library.
    """
    d = z.shape[-1]
    parts = [z[..., i] for i in range(d)]
    top = parts[0]
    for p in parts[1:]:
        top = xp.where(p > top, p, top)
    top = freeze(top)
    parts = [p - top for p in parts]
    if d <= RULE_DIMENSION:
        column = (-1,) + (1,) * len(top.shape)
        sr, si, tr, ti = (constant(a).reshape(column) for a in (SR, SI, CR, CI))
        centre, front = 1.0, 0.0
    else:
        sr, si, tr, ti, centre, front = _parabola([freeze(p) for p in parts], xp, constant, loop)
    inverse, scale = [], 0.0
    for p in parts:
        # The factor 1/√(s − z), times √(centre − z) so that products stay of order one; Im s > 0 chooses the root.
        a, b, c = sr - p, si, centre - p
        m = a * a + b * b
        n = xp.sqrt(m)
        t = xp.sqrt(0.5 * (n + abs(a)))
        u = 0.5 * b / t
        k = xp.sqrt(c) / n
        rr, ri = xp.where(a >= 0.0, t, u) * k, xp.where(a >= 0.0, u, t) * k
        tr, ti = tr * rr + ti * ri, ti * rr - tr * ri
        inverse.append((a / m, -b / m))
        scale = scale + xp.log(c)
    f = ti.sum(0)
    log_f = xp.log(2.0 * f) + (0.5 * d * math.log(math.pi) + front) - 0.5 * scale + top
    if order == 0:
        return (log_f,)
    products = [(tr * ir - ti * ii, tr * ii + ti * ir) for ir, ii in inverse]
    gradient = xp.stack([pi.sum(0) for _, pi in products], -1)
    gradient = gradient / gradient.sum(-1)[..., None]
    if order == 1:
        return log_f, gradient
    g = [gradient[..., i] for i in range(d)]
    entries = {}
    for i, (pr, pi) in enumerate(products):
        for j in range(i, d):
            ir, ii = inverse[j]
            mean = (0.75 if i == j else 0.25) * (pr * ii + pi * ir).sum(0) / f
            entries[i, j] = entries[j, i] = mean - g[i] * g[j]
    return log_f, gradient, _rows_sum_to_zero(entries, parts, xp)


def _rows_sum_to_zero(entries: dict[tuple[int, int], Any], parts: list[Any], xp: Any) -> Any:
    """Return the Hessian (..., d, d), the row of the largest z, small by cancellation, from the others."""
    d = len(parts)
    first, found = [], parts[0] > 0.0
    for p in parts:
        first.append((p == 0.0) & ~found)
        found = found | (p == 0.0)
    zero = 0.0 * entries[0, 0]
    kept = {
        (i, j): entries[i, j] if i == j else xp.where(first[i] | first[j], zero, entries[i, j])
        for i in range(d)
        for j in range(d)
    }
    sums = [-sum(kept[i, j] for j in range(d)) for i in range(d)]
    corner = -sum(xp.where(first[i], zero, sums[i]) for i in range(d))
    rows = []
    for i in range(d):
        row = [
            xp.where(first[i], corner, kept[i, i])
            if i == j
            else xp.where(first[j], sums[i], xp.where(first[i], sums[j], kept[i, j]))
            for j in range(d)
        ]
        rows.append(xp.stack(row, -1))
    return xp.stack(rows, -2)


def _parabola(parts: list[Any], xp: Any, constant: Callable[[Any], Any], loop: Callable[..., Any]) -> tuple[Any, ...]:
    """Return nodes and weights of the contour of `kernels.contour`, its centre μ and the log of the factor in front."""

    def newton(mu: Any) -> Any:
        f, g = -1.0, 0.0
        for p in parts:
            t = 0.5 / (mu - p)
            f, g = f + t, g + t / (mu - p)
        return mu + f * (f + 1.0) / g

    mu = loop(NEWTON_STEPS, newton, 0.5 + 0.0 * parts[0])
    mu = xp.where(mu < CROSSING, CROSSING + 0.0 * mu, mu)

    def bisect(bounds: tuple[Any, Any]) -> tuple[Any, Any]:
        low, high = bounds
        middle = 0.5 * (low + high)
        fallen = mu * middle
        for p in parts:
            a, b = mu * (1.0 - middle) - p, mu - p
            fallen = fallen + 0.25 * xp.log((a / b) * (a / b) + 4.0 * (mu / b) * (mu / b) * middle)
        return xp.where(fallen < DECAY, middle, low), xp.where(fallen < DECAY, high, middle)

    length = xp.sqrt(loop(BISECTIONS, bisect, (0.0 * mu, 2.5 * DECAY / mu))[1])
    v = constant((np.arange(NODES) + 0.5) / NODES).reshape((-1,) + (1,) * len(mu.shape)) * length
    # s = μ (1 + iv)², weight i (1 + iv) e^{s − μ}.
    size, angle = xp.exp(-mu * v * v), 2.0 * mu * v
    cosine, sine = size * xp.cos(angle), size * xp.sin(angle)
    front = xp.log(2.0 * mu * length / (NODES * math.pi)) + mu
    return mu * (1.0 - v * v), angle, -(sine + v * cosine), cosine - v * sine, mu, front
