"""Forty-digit log-normalisers of the Bingham distribution, by two methods that share nothing but the definition.

With b(z) = ∫_{S^{d−1}} exp(xᵀ diag(z) x) dx = 2 π^{d/2} · h(z), where h(z) = L⁻¹{∏ᵢ (s − zᵢ)^{−1/2}}(1):

`contour`
    fixed-Talbot inversion (Abate & Valkó 2004, Int. J. Numer. Meth. Engng 60:979) at 200 digits with 220 nodes; a
    contour and an order other than those of the library.
`series`
    no complex number at all: the positive power series in z − min z (Glover & Kaelbling 2013, eq. 8) over the
    concentrations above −400, times the asymptotic series of Laplace's method over those below.

Derivatives need no code of their own: ∂h/∂zᵢ = ½ h(z ∪ {zᵢ, zᵢ}), because each brings a factor ½/(s − zᵢ).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import cache

from mpmath import mp, mpc, mpf

CONTOUR_NODES = 220
SERIES_DIGITS = 400
ASYMPTOTIC_BEYOND = 400


@cache
def _contour_nodes(m: int) -> list[tuple[mpc, mpc]]:
    """Nodes sₖ and weights cₖ with L⁻¹{G}(1) = Σ Re(cₖ G(sₖ)), to 0.6 m digits."""
    r = mpf(2 * m) / 5
    nodes = [(mpc(r), mpc(r / m * mp.exp(r) / 2))]
    for k in range(1, m):
        theta = mp.pi * k / m
        cot = mp.cot(theta)
        s = r * theta * mpc(cot, 1)
        nodes.append((s, r / m * mp.exp(s) * mpc(1, theta + (theta * cot - 1) * cot)))
    return nodes


def contour(
    z: Sequence[float], hessian: Sequence[tuple[int, int]] = (), nodes: int = CONTOUR_NODES
) -> tuple[mpf, list[mpf], list[mpf]]:
    """Return h(z), its gradient and the chosen entries of its Hessian; max z must be 0."""
    with mp.workdps(nodes + 20):
        exact = [mpf(v) for v in z]
        counts = Counter(exact)
        value = mpf(0)
        gradient = dict.fromkeys(counts, mpf(0))
        second = [mpf(0)] * len(hessian)
        for s, c in _contour_nodes(nodes):
            term = c
            inverse = {}
            for v, m in counts.items():
                inverse[v] = 1 / (s - v)
                root = mp.sqrt(inverse[v])
                term *= root if m == 1 else root**m
            value += term.real
            for v in counts:
                gradient[v] += (term * inverse[v]).real / 2
            for k, (i, j) in enumerate(hessian):
                factor = mpf(3) / 4 if i == j else mpf(1) / 4
                second[k] += factor * (term * inverse[exact[i]] * inverse[exact[j]]).real
        return value, [gradient[v] for v in exact], second


def _power_series(roots: Counter, terms: int) -> list[mpf]:
    """Coefficients aₙ of ∏ (1 − λ x)^{−m/2} over the roots λ with multiplicities m.

    Q A' = P A with Q = ∏ (1 − λ x) and P = ½ Σ m λ Q/(1 − λ x) gives a recurrence as long as the distinct roots.
    """
    q = [mpf(1)]
    p: list[mpf] = []
    for lam, m in roots.items():
        p = [
            a - lam * b + m * lam * c / 2
            for a, b, c in zip([*p, mpf(0)], [mpf(0), *p], [*q, mpf(0)][: len(p) + 1], strict=True)
        ]
        q = [a - lam * b for a, b in zip([*q, mpf(0)], [mpf(0), *q], strict=True)]
    a = [mpf(1)]
    for n in range(terms - 1):
        total = mp.fsum(p[k] * a[n - k] for k in range(min(len(p), n + 1)))
        total -= mp.fsum(q[k] * (n + 1 - k) * a[n + 1 - k] for k in range(1, min(len(q), n + 2)))
        a.append(total / (n + 1))
    return a


def series(z: Sequence[float]) -> mpf:
    """Return h(z) by power series and asymptotic series; max z must be 0."""
    with mp.workdps(SERIES_DIGITS):
        near = [mpf(v) for v in z if v > -ASYMPTOTIC_BEYOND]
        far = Counter(-1 / mpf(-v) for v in z if v <= -ASYMPTOTIC_BEYOND)
        lowest = min(near)
        reach = float(-lowest)
        terms = int(reach + 30 * reach**0.5 + 150)
        a = _power_series(Counter(v - lowest for v in near if v != lowest), terms)
        half = mpf(len(near)) / 2
        nearest = min((-1 / lam for lam in far), default=None)
        orders = 1 if nearest is None else 80 if nearest < 1e5 else 20
        # u[j] = L⁻¹{(s − lowest)^j G}(1) e^{−lowest}, by 1/Γ(m − 1) = (m − 1)/Γ(m)
        u = [mpf(0)] * orders
        reciprocal = mp.rgamma(half)
        for n, coefficient in enumerate(a):
            if coefficient == 0:
                break
            m, factor = half + n, reciprocal * coefficient
            for j in range(orders):
                u[j] += factor
                factor *= m - 1 - j
            reciprocal /= m
        if not far:
            return mp.exp(lowest) * u[0]
        b = _power_series(far, orders)
        total = mpf(0)
        for k in range(orders):
            derivative = mp.fsum(mp.binomial(k, j) * lowest ** (k - j) * u[j] for j in range(k + 1))
            term = b[k] * derivative
            total += term
        if abs(term) > abs(total) * mpf(10) ** -45:
            raise ArithmeticError(f"asymptotic series stopped at {mp.nstr(term / total, 3)}, wants 1e-45")
        scale = mp.fprod(mp.sqrt(-lam) ** m for lam, m in far.items())
        return mp.exp(lowest) * scale * total


def log_normalizer(h: mpf, d: int) -> mpf:
    """Return log(2 π^{d/2} h)."""
    with mp.workdps(60):
        return mp.log(2 * h) + mpf(d) / 2 * mp.log(mp.pi)
