"""The 8-node rule of `kernels.numpy_rule`, compiled: normaliser and derivatives for d ≤ 4.

One code serves d = 2, 3 and 4: a factor s^{½} in the weights cancels an axis with z = 0, so that a smaller sphere is
the d = 4 rule with weights cₖ sₖ^{(4−d)/2} and zᵢ = 0 on the axes d − 1 … 2, whose derivatives nobody reads.

Every function here wants its largest z, 0, last and |z| ≤ ``LARGEST``; the facades see to both.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled
from bingham.kernels.fma import fma
from bingham.kernels.numpy_rule import CI, CR, LOG_FRONT, SI, SR

__all__ = ["WEIGHTS_I", "WEIGHTS_R", "moments_2", "moments_4", "node_4", "sums_4"]

# Weights for d = 2, 3, 4 in rows 0, 1, 2: see above.
_weights = np.array([(CR + 1j * CI) * (SR + 1j * SI) ** (0.5 * (4 - d)) for d in (2, 3, 4)])
WEIGHTS_R, WEIGHTS_I = np.ascontiguousarray(_weights.real), np.ascontiguousarray(_weights.imag)
LOG_FRONT_4 = float(LOG_FRONT[2])


@compiled(inline=True)
def node_4(sr, si, cr, ci, z0, z1, z2):
    """Return what the node s = sr + i·si with weight cr + i·ci adds to the sums for d = 4 and z₃ = 0.

    With t = c ∏ᵢ (s − zᵢ)^{−1/2} that is Im t, then Im t/(s − zᵢ) for i = 0…3, then Im t/((s − zᵢ)(s − zⱼ)) for
    ij = 00, 01, 02, 11, 12, 22. Written for short chains of dependent operations, and without jumps.
    """
    a0, a1, a2 = sr - z0, sr - z1, sr - z2
    ss = si * si
    m0, m1, m2, m3 = fma(a0, a0, ss), fma(a1, a1, ss), fma(a2, a2, ss), fma(sr, sr, ss)
    # One root of the product r of all four factors, |r|² = ∏ mᵢ; n = 1/|r|².
    m01, m23 = m0 * m1, m2 * m3
    pr, pi = fma(a0, a1, -ss), si * (a0 + a1)
    qr, qi = fma(a2, sr, -ss), si * (a2 + sr)
    rr, ri = fma(pr, qr, -(pi * qi)), fma(pr, qi, pi * qr)
    n = 1.0 / (m01 * m23)
    size = math.sqrt(m01 * m23)
    x = 0.5 * (size + abs(rr))
    t = math.sqrt(x)
    u = 0.5 * ri * t * (1.0 / x)
    # The root with positive imaginary part; √p·√q of the pairs' own such roots, whose arguments add, is its negative if
    # their sum exceeds 2π: if neither or, where one pair lies above the real axis, if r lies on or above it.
    low = ri < 0.0
    left = rr < 0.0
    xr = u if left else (-t if low else t)
    xi = t if left else abs(u)
    above = pi > 0.0
    negative = (not low) if above != (qi > 0.0) else (not above)
    k = size * n
    k = -k if negative else k
    fr, fi = fma(cr, xr, ci * xi) * k, fma(ci, xr, -(cr * xi)) * k
    m01 *= n
    m23 *= n
    n0, n1, n2, n3 = m23 * m1, m23 * m0, m01 * m3, m01 * m2
    # 1/(s − zᵢ) = nᵢ (aᵢ − i·si)
    hr, hi = fr * si, fi * si
    r0, i0 = fma(fr, a0, hi) * n0, fma(fi, a0, -hr) * n0
    r1, i1 = fma(fr, a1, hi) * n1, fma(fi, a1, -hr) * n1
    r2, i2 = fma(fr, a2, hi) * n2, fma(fi, a2, -hr) * n2
    i3 = fma(fi, sr, -hr) * n3
    r0 *= si
    r1 *= si
    r2 *= si
    return (fi, i0, i1, i2, i3, fma(i0, a0, -r0) * n0, fma(i0, a1, -r0) * n1, fma(i0, a2, -r0) * n2,
            fma(i1, a1, -r1) * n1, fma(i1, a2, -r1) * n2, fma(i2, a2, -r2) * n2)  # fmt: skip


@compiled(inline=True)
def _add_up(terms, count):
    """Add the 8 terms of each sum, the nodes', in a fixed order, to the first of them.

    Terms first, then sums: the compiler makes vectors of it, and the bits are the same wherever it is copied to.
    """
    for j in range(0, 8 * count, 8):
        even = (terms[j] + terms[j + 4]) + (terms[j + 2] + terms[j + 6])
        terms[j] = even + ((terms[j + 1] + terms[j + 5]) + (terms[j + 3] + terms[j + 7]))


@compiled(inline=True)
def sums_4(z0, z1, z2, d, cr, ci, terms):
    """Return F / (2 π^{d/2}), ω (four) and h00, h01, h02, h11, h12, h22 of the Hessian of log F, z₃ = 0.

    cr, ci (8,): weights for d; where d < 4 the last of z0, z1, z2 are 0 and stand for no axis. terms (88,) is scratch.
    """
    for k in range(8):
        (terms[k], terms[8 + k], terms[16 + k], terms[24 + k], terms[32 + k], terms[40 + k], terms[48 + k],
         terms[56 + k], terms[64 + k], terms[72 + k], terms[80 + k]) = node_4(
            SR[k], SI[k], cr[k], ci[k], z0, z1, z2)  # fmt: skip
    _add_up(terms, 11)
    f, g0, g1, g2, g3 = terms[0], terms[8], terms[16], terms[24], terms[32]
    # Σω = 1 is exact in theory; dividing by the sum removes the common part of the quadrature error.
    n = g0 + g3
    if d > 2:
        n += g1
    if d > 3:
        n += g2
    n = 1.0 / n
    g0 *= n
    g1 *= n
    g2 *= n
    g3 *= n
    n = 0.25 / f
    three = 3.0 * n
    h00, h11, h22 = (
        fma(three, terms[40], -(g0 * g0)),
        fma(three, terms[64], -(g1 * g1)),
        fma(three, terms[80], -(g2 * g2)),
    )
    h01, h02, h12 = fma(n, terms[48], -(g0 * g1)), fma(n, terms[56], -(g0 * g2)), fma(n, terms[72], -(g1 * g2))
    return f, g0, g1, g2, g3, h00, h01, h02, h11, h12, h22


@compiled(inner=True)
def moments_4(z, w, terms):
    """Return log F for d = 4; write ω = ∇ log F. z (4,) in, its largest entry z[3] = 0; w (4,) out."""
    f, w[0], w[1], w[2], w[3], _, _, _, _, _, _ = sums_4(z[0], z[1], z[2], 4, CR, CI, terms)
    return math.log(f) + LOG_FRONT_4


@compiled(inner=True)
def moments_2(z1, terms):
    """Return (log F, ω₁, ∂ω₁/∂z₁) for d = 2 and z = (z₁ ≤ 0, 0); ω₂ = 1 − ω₁ and the Hessian is ±∂ω₁/∂z₁.

    terms (≥ 32,) is scratch.
    """
    for k in range(8):
        si = SI[k]
        a, c = SR[k] - z1, SR[k]
        ss = si * si
        pr, pi = fma(a, c, -ss), si * (a + c)
        # √p with positive imaginary part.
        t = math.sqrt(0.5 * (math.sqrt(fma(pr, pr, pi * pi)) + abs(pr)))
        u = 0.5 * pi / t
        right = pr >= 0.0
        rr, ri = math.copysign(t, pi) if right else u, abs(u) if right else t
        n = 1.0 / fma(rr, rr, ri * ri)
        fr, fi = fma(CR[k], rr, CI[k] * ri) * n, fma(CI[k], rr, -(CR[k] * ri)) * n
        n = 1.0 / fma(a, a, ss)
        a, b = a * n, -si * n
        n = 1.0 / fma(c, c, ss)
        tr, ti = fma(fr, a, -(fi * b)), fma(fr, b, fi * a)
        terms[k], terms[8 + k], terms[16 + k], terms[24 + k] = (
            fi, ti, fma(fi, c, -(fr * si)) * n, fma(tr, b, ti * a))  # fmt: skip
    _add_up(terms, 4)
    f, g1, g2, h = terms[0], terms[8], terms[16], terms[24]
    w = g1 / (g1 + g2)
    return math.log(2.0 * math.pi * f), w, 0.75 * h / f - w * w
