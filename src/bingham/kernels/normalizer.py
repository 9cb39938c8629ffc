"""Normaliser of the Bingham density and its derivatives by an 8-node contour rule.

F(z) = ∫_{S^{d−1}} exp(Σ zᵢ xᵢ²) dx = 2 π^{d/2} L⁻¹{∏ᵢ (s − zᵢ)^{−1/2}}(1), so

    F = 2 π^{d/2} Σₖ Im[cₖ ∏ᵢ (sₖ − zᵢ)^{−1/2}],    max z = 0.

The nodes sₖ are the poles of the near-best (Carathéodory–Fejér) 16-pole rational approximation of eˢ on (−∞, 0]
(Trefethen, Weideman & Schmelzer 2006), shifted by ½; the weights were then fitted in high precision to F over a
family of spectra. ``tests/reference/derive_rule.py`` derives both and measures their error: for d ≤ 4 below 3e-13 in F
and 5e-13 in the moments, half of it rounding; it triples with each further dimension. ∂/∂zᵢ multiplies a term by
½/(sₖ−zᵢ); second derivatives by ¼/((sₖ−zᵢ)(sₖ−zⱼ)) and ¾/(sₖ−zᵢ)².

Every function here wants max z = 0 and |z| ≤ ``LARGEST``; the facades see to both.
"""

from __future__ import annotations

import math

import numpy as np

from bingham.kernels.compile import compiled

__all__ = ["LARGEST", "RULE_DIMENSION", "derivatives", "derivatives_2", "derivatives_4",
           "gradient_4", "node_4", "scalars_4"]  # fmt: skip

# Largest |z|: products of eight factors stay within the range of a double.
LARGEST = 1e30
# Largest dimension the rule serves; beyond it the parabola of `kernels.contour` takes over, slower and exact to 1e-13.
RULE_DIMENSION = 4

SR = np.array([6.916177699099483, 6.448152268951234, 5.493174737718069, 4.009103608415018,
               1.9193758971858133, -0.913928462488652, -4.764971343442207, -10.343917078695654])  # fmt: skip
SI = np.array([1.1941223933701346, 3.58745736201831, 5.996881713603921, 8.436198985884344,
               10.92536348449668, 13.497725698892689, 16.22022147316785, 19.27744616718121])  # fmt: skip
CR = np.array([-740.5871543094853, 336.1650904675204, -36.899671633796615, -18.964928452773304,
               5.8320508784218745, -0.5191317497809719, 0.014473454252311242, -7.986412852745128e-05])  # fmt: skip
CI = np.array([212.68793914292942, -373.9225707971421, 206.15080690186446, -49.65811712485637,
               4.877909103488713, -0.1352714380547741, -0.0006974667025341759, 1.6784694558666345e-06])  # fmt: skip


@compiled(inline=True)
def _branch(pr, pi, t, u):
    """Square root of pr + i·pi with positive imaginary part, from t = √((|p| + |pr|)/2) and u = pi/(2t)."""
    if pr >= 0.0:
        return math.copysign(t, pi), abs(u)
    return u, t


@compiled(inline=True)
def node_4(sr, si, cr, ci, z0, z1, z2):
    """Return what the node s = sr + i·si with weight cr + i·ci adds to the sums for d = 4 and z₃ = 0.

    With t = c ∏ᵢ (s − zᵢ)^{−1/2} that is Im t, then Im t/(s − zᵢ) for i = 0…3, then Im t/((s − zᵢ)(s − zⱼ)) for
    ij = 00, 01, 02, 11, 12, 22. Written for short chains of dependent operations, and without jumps.
    """
    a0, a1, a2 = sr - z0, sr - z1, sr - z2
    ss = si * si
    m0, m1, m2, m3 = a0 * a0 + ss, a1 * a1 + ss, a2 * a2 + ss, sr * sr + ss
    # One root of the product r of all four factors, |r|² = ∏ mᵢ; n = 1/|r|².
    m01, m23 = m0 * m1, m2 * m3
    pr, pi = a0 * a1 - ss, si * (a0 + a1)
    qr, qi = a2 * sr - ss, si * (a2 + sr)
    rr, ri = pr * qr - pi * qi, pr * qi + pi * qr
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
    rotated = (not low) if above != (qi > 0.0) else (not above)
    k = size * n
    k = -k if rotated else k
    fr, fi = (cr * xr + ci * xi) * k, (ci * xr - cr * xi) * k
    m01 *= n
    m23 *= n
    n0, n1, n2, n3 = m23 * m1, m23 * m0, m01 * m3, m01 * m2
    # 1/(s − zᵢ) = nᵢ (aᵢ − i·si)
    hr, hi = fr * si, fi * si
    r0, i0 = (fr * a0 + hi) * n0, (fi * a0 - hr) * n0
    r1, i1 = (fr * a1 + hi) * n1, (fi * a1 - hr) * n1
    r2, i2 = (fr * a2 + hi) * n2, (fi * a2 - hr) * n2
    i3 = (fi * sr - hr) * n3
    r0 *= si
    r1 *= si
    r2 *= si
    return (fi, i0, i1, i2, i3, (i0 * a0 - r0) * n0, (i0 * a1 - r0) * n1, (i0 * a2 - r0) * n2,
            (i1 * a1 - r1) * n1, (i1 * a2 - r1) * n2, (i2 * a2 - r2) * n2)  # fmt: skip


@compiled(inline=True)
def scalars_4(z0, z1, z2):
    """Return F, ω (four scalars) and h00, h01, h02, h11, h12, h22 of the Hessian of log F, for d = 4 and z₃ = 0.

    The compiler drops what a caller does not use.
    """
    f = g0 = g1 = g2 = g3 = 0.0
    h00 = h01 = h02 = h11 = h12 = h22 = 0.0
    for k in range(8):
        t, t0, t1, t2, t3, t00, t01, t02, t11, t12, t22 = node_4(SR[k], SI[k], CR[k], CI[k], z0, z1, z2)
        f += t
        g0 += t0
        g1 += t1
        g2 += t2
        g3 += t3
        h00 += t00
        h01 += t01
        h02 += t02
        h11 += t11
        h12 += t12
        h22 += t22
    # Σω = 1 is exact in theory; dividing by the sum removes the common part of the quadrature error.
    n = 1.0 / (g0 + g1 + g2 + g3)
    g0 *= n
    g1 *= n
    g2 *= n
    g3 *= n
    n = 0.25 / f
    h00, h11, h22 = 3.0 * n * h00 - g0 * g0, 3.0 * n * h11 - g1 * g1, 3.0 * n * h22 - g2 * g2
    h01, h02, h12 = n * h01 - g0 * g1, n * h02 - g0 * g2, n * h12 - g1 * g2
    return 2.0 * math.pi**2 * f, g0, g1, g2, g3, h00, h01, h02, h11, h12, h22


@compiled()
def gradient_4(z, gradient):
    """Return F for d = 4; write ω = ∇ log F. z (4,) in, its largest entry z[3] = 0; gradient (4,) out."""
    f, gradient[0], gradient[1], gradient[2], gradient[3], _, _, _, _, _, _ = scalars_4(z[0], z[1], z[2])
    return f


@compiled()
def derivatives_4(z, gradient, hessian):
    """Return F for d = 4; write ω = ∇ log F and the 4×4 Hessian of log F.

    z (4,) in, its largest entry z[3] = 0: the last row of the Hessian comes from the others and would lose the relative
    accuracy of a small entry. gradient (4,), hessian (4, 4) out.
    """
    f, g0, g1, g2, g3, h00, h01, h02, h11, h12, h22 = scalars_4(z[0], z[1], z[2])
    gradient[0], gradient[1], gradient[2], gradient[3] = g0, g1, g2, g3
    # log F(z + c) = log F(z) + c, hence every row of the Hessian sums to zero.
    h03, h13, h23 = -h00 - h01 - h02, -h01 - h11 - h12, -h02 - h12 - h22
    hessian[0, 0], hessian[0, 1], hessian[0, 2], hessian[0, 3] = h00, h01, h02, h03
    hessian[1, 0], hessian[1, 1], hessian[1, 2], hessian[1, 3] = h01, h11, h12, h13
    hessian[2, 0], hessian[2, 1], hessian[2, 2], hessian[2, 3] = h02, h12, h22, h23
    hessian[3, 0], hessian[3, 1], hessian[3, 2], hessian[3, 3] = h03, h13, h23, -h03 - h13 - h23
    return f


@compiled()
def derivatives_2(z1):
    """Return (log F, ω₁, ∂ω₁/∂z₁) for d = 2 and z = (z₁ ≤ 0, 0); ω₂ = 1 − ω₁ and the Hessian is ±∂ω₁/∂z₁."""
    f = g1 = g2 = h = 0.0
    for k in range(8):
        si = SI[k]
        a, c = SR[k] - z1, SR[k]
        pr, pi = a * c - si * si, si * (a + c)
        t = math.sqrt(0.5 * (math.sqrt(pr * pr + pi * pi) + abs(pr)))
        rr, ri = _branch(pr, pi, t, 0.5 * pi / t)
        n = 1.0 / (rr * rr + ri * ri)
        fr, fi = (CR[k] * rr + CI[k] * ri) * n, (CI[k] * rr - CR[k] * ri) * n
        n = 1.0 / (a * a + si * si)
        a, b = a * n, -si * n
        n = 1.0 / (c * c + si * si)
        f += fi
        tr, ti = fr * a - fi * b, fr * b + fi * a
        g1 += ti
        g2 += (fi * c - fr * si) * n
        h += tr * b + ti * a
    w = g1 / (g1 + g2)
    return math.log(2.0 * math.pi * f), w, 0.75 * h / f - w * w


@compiled()
def derivatives(z, nodes, weights, shift, gradient, hessian):
    """Return log F for any d with any rule; write ω = ∇ log F and the Hessian of log F.

    F = 2 π^{d/2} e^{shift} Σₖ Im[weightsₖ ∏ᵢ (shift + nodesₖ − zᵢ)^{−1/2}].  z (d,) with max z = 0,
    nodes (K,), weights (K,) complex in; gradient (d,), hessian (d, d) out.
    """
    d = z.size
    inverse = np.empty(d, dtype=np.complex128)
    gradient[:] = 0.0
    hessian[:] = 0.0
    f = 0.0
    scale = 0.0
    for i in range(d):
        scale += math.log(1.0 + shift - z[i])
    for k in range(nodes.size):
        s = nodes[k] + shift
        term = weights[k]
        for i in range(d):
            inverse[i] = 1.0 / (s - z[i])
            # The real factor keeps the product of order one for any d and z; `scale` returns it.
            term *= np.sqrt((1.0 + shift - z[i]) * inverse[i])
        f += term.imag
        for i in range(d):
            t = term * inverse[i]
            gradient[i] += t.imag
            for j in range(i, d):
                hessian[i, j] += t.real * inverse[j].imag + t.imag * inverse[j].real
    total = 0.0
    for i in range(d):
        total += gradient[i]
    for i in range(d):
        gradient[i] /= total
    for i in range(d):
        for j in range(i, d):
            hessian[i, j] = (0.75 if i == j else 0.25) * hessian[i, j] / f - gradient[i] * gradient[j]
            hessian[j, i] = hessian[i, j]
    # Rows sum to zero; at high concentration that of the largest z is small by cancellation: it follows from the rest.
    top = 0
    for i in range(d):
        if z[i] > z[top]:
            top = i
    hessian[top, top] = 0.0
    for i in range(d):
        if i != top:
            row = 0.0
            for j in range(d):
                if j != top:
                    row += hessian[i, j]
            hessian[i, top] = hessian[top, i] = -row
            hessian[top, top] += row
    return math.log(2.0 * f) + 0.5 * d * math.log(math.pi) + shift - 0.5 * scale
