"""Symmetric eigenproblem by Jacobi rotations, with eigenvalues accurate to their own size; linear systems.

At high concentration a second moment has eigenvalues of 1e-9 beside 1. Jacobi's method keeps the relative accuracy of
graded definite matrices (Demmel & Veselić 1992); tridiagonalisation, as in LAPACK's ``syev``, does not. Callers pass
the matrix in the frame of the last known eigenvectors, so that it is nearly diagonal and three sweeps are enough.

Frames are stored by rows here: ``frame[j]`` is the j-th eigenvector (the public M is ``frame.T``).
"""

from __future__ import annotations

import math

from bingham.kernels.compile import compiled
from bingham.kernels.fma import fma

__all__ = ["diagonalize", "diagonalize_4", "dot_4", "orthonormalize_4", "solve"]

MAX_SWEEPS = 30
# Squares of relative sizes below which an off-diagonal entry no longer moves an eigenvalue (or vector) in a double.
NEGLIGIBLE = (1e-16) ** 2
NEGLIGIBLE_GAP = (1e-17) ** 2
SMALL = (1e-3) ** 2


@compiled(inline=True)
def dot_4(a, i, b, j):
    """Return Σ a[i, k] b[j, k] over k < 4."""
    return fma(a[i, 0], b[j, 0], a[i, 1] * b[j, 1]) + fma(a[i, 2], b[j, 2], a[i, 3] * b[j, 3])


@compiled(inline=True)
def _turned(c, s, x, y):
    """Return (c x − s y, s x + c y)."""
    return fma(c, x, -(s * y)), fma(s, x, c * y)


@compiled(inline=True)
def _rotation(p, q, x):
    """Cosine, sine and eigenvalue shift t·x of the rotation that clears x between diagonal entries p and q."""
    gap = q - p
    xx = x * x
    if xx <= NEGLIGIBLE * abs(p * q) or xx <= NEGLIGIBLE_GAP * gap * gap:
        return 1.0, 0.0, 0.0
    if xx <= SMALL * gap * gap:
        # Series of both to the last bit of a double: one division instead of two and two square roots in a row.
        t = x / gap
        rr = t * t
        t *= 1.0 - rr * (1.0 - 2.0 * rr)
        rr = t * t
        c = 1.0 - rr * (0.5 - 0.375 * rr)
        return c, t * c, t * x
    # t = 2x/h is the smaller root of t² + 2θt − 1 = 0, θ = gap/(2x); c = 1/√(1 + t²) without waiting for t.
    h = gap + math.copysign(math.sqrt(gap * gap + 4.0 * xx), gap)
    n = 1.0 / math.sqrt(h * h + 4.0 * xx)
    return abs(h) * n, math.copysign(2.0 * n, h) * x, 2.0 * xx / h


@compiled()
def diagonalize_4(b, values, frame):
    """Write the eigenvalues of the symmetric b (4, 4; upper triangle read), ascending, to values (4,).

    frame (4, 4), on entry any frame U by rows, leaves as (U·V) by rows with b = V diag(values) Vᵀ.
    Returns the number of sweeps; `MAX_SWEEPS` means that b held a NaN or an infinity.
    """
    b0, b1, b2, b3 = b[0, 0], b[1, 1], b[2, 2], b[3, 3]
    b01, b02, b03, b12, b13, b23 = b[0, 1], b[0, 2], b[0, 3], b[1, 2], b[1, 3], b[2, 3]
    sweep = 0
    while sweep < MAX_SWEEPS:
        quiet = True
        # Rows of the frame that belong to b1, b2, b3: after a pair of rotations the three change places in a circle.
        i1, i2, i3 = 1, 2, 3
        for _ in range(3):
            # Disjoint pairs go together: their square roots and divisions overlap.
            c, s, t = _rotation(b0, b1, b01)
            d, r, u = _rotation(b2, b3, b23)
            if s != 0.0 or r != 0.0:
                quiet = False
                b0, b1, b2, b3 = b0 - t, b1 + t, b2 - u, b3 + u
                b01 = b23 = 0.0
                b02, b12 = _turned(c, s, b02, b12)
                b03, b13 = _turned(c, s, b03, b13)
                b02, b03 = _turned(d, r, b02, b03)
                b12, b13 = _turned(d, r, b12, b13)
                for k in range(4):
                    frame[0, k], frame[i1, k] = _turned(c, s, frame[0, k], frame[i1, k])
                for k in range(4):
                    frame[i2, k], frame[i3, k] = _turned(d, r, frame[i2, k], frame[i3, k])
            b1, b2, b3, i1, i2, i3 = b2, b3, b1, i2, i3, i1
            b01, b02, b03, b23, b13, b12 = b02, b03, b01, b13, b12, b23
        if quiet:
            break
        sweep += 1
    values[0], values[1], values[2], values[3] = b0, b1, b2, b3
    _sort_rows(values, frame)
    return sweep


@compiled()
def _sort_rows(values, frame):
    """Sort values (d,) ascending and the rows of frame (d, d) with them, in place."""
    d = values.size
    for i in range(1, d):
        for j in range(i, 0, -1):
            if values[j] >= values[j - 1]:
                break
            values[j], values[j - 1] = values[j - 1], values[j]
            for k in range(d):
                frame[j, k], frame[j - 1, k] = frame[j - 1, k], frame[j, k]


@compiled()
def orthonormalize_4(frame):
    """Remove rounding drift of a nearly orthonormal frame (4, 4) by rows, in place (Gram–Schmidt, last row first).

    The last row, the mode, only has its length restored.
    """
    for i in range(3, -1, -1):
        for j in range(3, i - 1, -1):
            t = dot_4(frame, i, frame, j)
            if j > i:
                for k in range(4):
                    frame[i, k] = fma(-t, frame[j, k], frame[i, k])
            else:
                # The drift of one step is at rounding level, where 1/√t = (3 − t)/2.
                t = 1.5 - 0.5 * t
                for k in range(4):
                    frame[i, k] *= t


@compiled()
def diagonalize(b, values, frame):
    """Any dimension: as `diagonalize_4`, b (d, d) is destroyed."""
    d = b.shape[0]
    sweep = 0
    while sweep < MAX_SWEEPS:
        quiet = True
        for p in range(d - 1):
            for q in range(p + 1, d):
                c, s, t = _rotation(b[p, p], b[q, q], b[p, q])
                b[p, q] = 0.0
                if s == 0.0:
                    continue
                quiet = False
                b[p, p] -= t
                b[q, q] += t
                for i in range(p):
                    b[i, p], b[i, q] = _turned(c, s, b[i, p], b[i, q])
                for i in range(p + 1, q):
                    b[p, i], b[i, q] = _turned(c, s, b[p, i], b[i, q])
                for i in range(q + 1, d):
                    b[p, i], b[q, i] = _turned(c, s, b[p, i], b[q, i])
                for i in range(d):
                    frame[p, i], frame[q, i] = _turned(c, s, frame[p, i], frame[q, i])
        if quiet:
            break
        sweep += 1
    for i in range(d):
        values[i] = b[i, i]
    _sort_rows(values, frame)
    return sweep


@compiled()
def solve(a, b):
    """Solve a x = b in place by elimination with row pivots; a (p, p) and b (p,) are destroyed, x is left in b."""
    p = b.size
    for k in range(p):
        pivot = k
        for i in range(k + 1, p):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if a[pivot, k] == 0.0:
            return False
        if pivot != k:
            for j in range(p):
                a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
            b[k], b[pivot] = b[pivot], b[k]
        for i in range(k + 1, p):
            t = a[i, k] / a[k, k]
            if t != 0.0:
                for j in range(k + 1, p):
                    a[i, j] -= t * a[k, j]
                b[i] -= t * b[k]
    for k in range(p - 1, -1, -1):
        t = b[k]
        for j in range(k + 1, p):
            t -= a[k, j] * b[j]
        b[k] = t / a[k, k]
    return True
