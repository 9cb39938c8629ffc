"""Derive the library's 8-node quadrature rule and measure its error: writes `rule.json` and `rule_errors.md`.

Run from the project root: ``python tests/reference/derive_rule.py`` (about ten minutes on one core); with
``--errors`` only the error table is made again, from the rule as committed.

The rule is F(z) = 2 π^{d/2} Σₖ Im[cₖ ∏ᵢ (sₖ − zᵢ)^{−1/2}], max z = 0. Three steps, all in 80-digit arithmetic:

1. poles of the Carathéodory–Fejér approximation of eˢ on (−∞, 0] by a rational function of degree 16 (Trefethen, Weideman
   & Schmelzer 2006, BIT 46:653, the method of their Fig. 4.1), shifted by +½: a start;
2. nodes and weights together minimise the squared relative errors of h over a family of spectra of dimension 2…8 (∂h/∂zᵢ
   and ∂²h/∂zᵢ∂zⱼ are h of dimension d + 2 and d + 4, so this is F, gradient and Hessian up to d = 4). The weights
   enter linearly and are eliminated (variable projection, Golub & Pereyra 1973); Levenberg–Marquardt moves the nodes.
3. nodes are rounded to doubles, weights solved for again and rounded.
"""

from __future__ import annotations

import json
import math
import random
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from exact import contour  # noqa: E402
from mpmath import mp, mpc, mpf  # noqa: E402

RULE = Path(__file__).with_name("rule.json")
ERRORS = Path(__file__).with_name("rule_errors.md")
DEGREE = 16
SHIFT = mpf("0.5")
RIDGE = mpf("3e-17")  # keeps the weights, and with them the rounding error, from growing
Spectrum = tuple[float, ...]


def caratheodory_fejer_poles(degree: int, terms: int = 75, points: int = 1024, scale: int = 9) -> list[mpc]:
    """Poles in the upper half-plane of the near-best rational approximation of eˢ on (−∞, 0]."""
    cosines = [mp.cos(2 * mp.pi * k / points) for k in range(points)]
    samples = [mp.exp(scale * (x - 1) / (x + 1)) if x > -1 + mpf(10) ** -40 else mpf(0) for x in cosines]
    chebyshev = [mp.fsum(samples[k] * cosines[j * k % points] for k in range(points)) / points for j in range(terms + 1)]
    hankel = mp.matrix(terms, terms)
    for i in range(terms):
        for j in range(terms - i):
            hankel[i, j] = chebyshev[i + j + 1]
    values, vectors = mp.eigsy(hankel)
    column = sorted(range(terms), key=lambda i: -abs(values[i]))[degree]
    roots = mp.polyroots([vectors[k, column] for k in range(terms)], maxsteps=400, extraprec=400)
    poles = [scale * (r - 1) ** 2 / (r + 1) ** 2 for r in roots if abs(r) > 1]
    return sorted((p for p in poles if p.imag > 0), key=lambda p: p.imag)


def family(seed: int, dimensions: Sequence[int], step: float, draws: int) -> list[Spectrum]:
    """Two-valued spectra, dense in scale (between 1 and 400 the error oscillates), spread ones, several groups."""
    rng = random.Random(seed)
    found: set[Spectrum] = set()
    for d in dimensions:
        found.add((0.0,) * d)
        exponents = [step * (k + (seed > 0) * rng.random()) for k in range(math.ceil(2.6 / step))]
        for exponent in [*exponents, 3, 4, 6]:
            for m in {1, d // 2, d - 2, d - 1} - {0}:
                found.add((-(10.0**exponent),) * m + (0.0,) * (d - m))
        for _ in range(draws):
            found.add((*sorted(-(10.0 ** rng.uniform(-1, 3.5)) for _ in range(d - 1)), 0.0))
        for _ in range(draws // 2):
            values = [*(-(10.0 ** rng.uniform(-1, 7)) for _ in range(rng.choice((1, 2, 3)))), 0.0]
            found.add((*sorted(rng.choice(values) for _ in range(d - 1)), 0.0))
    return sorted(found, key=lambda z: (len(z), z))


def factors(z: Spectrum, s: mpc) -> tuple[mpc, mpc]:
    """Return G = ∏ (s − zᵢ)^{−1/2} and d log G/ds."""
    g, slope = mpc(1), mpc(0)
    for value, m in Counter(z).items():
        inverse = 1 / (s - value)
        root = mp.sqrt(inverse)
        g *= root if m == 1 else root**m
        slope -= m * inverse / 2
    return g, slope


class Fit:
    """Σ over the family of (weight · relative error)² + RIDGE² |c|², as a function of the nodes alone."""

    def __init__(self, spectra: Sequence[Spectrum], weight: Callable[[int], float]) -> None:
        self.spectra = spectra
        self.target = [mpf(weight(len(z))) for z in spectra]
        self.scale = [w / contour(z, nodes=120)[0] for z, w in zip(spectra, self.target, strict=True)]

    def design(self, s: Sequence[mpc]) -> list[list[tuple[mpc, mpc]]]:
        return [[factors(z, x) for x in s] for z in self.spectra]

    def weights(self, table: list[list[tuple[mpc, mpc]]]) -> tuple[list[mpc], mpf]:
        """Return the best weights for the nodes of the table, and the cost."""
        k = len(table[0])
        a = mp.matrix(len(table), 2 * k)
        for i, (row, scale) in enumerate(zip(table, self.scale, strict=True)):
            for j, (g, _) in enumerate(row):
                a[i, 2 * j], a[i, 2 * j + 1] = scale * g.imag, scale * g.real
        normal = a.T * a
        for j in range(2 * k):
            normal[j, j] += RIDGE**2
        x = mp.cholesky_solve(normal, a.T * mp.matrix(self.target))
        residual = a * x - mp.matrix(self.target)
        cost = mp.fsum(r**2 for r in residual) + RIDGE**2 * mp.fsum(v**2 for v in x)
        return [mpc(x[2 * j], x[2 * j + 1]) for j in range(k)], cost

    def step_equations(self, table: list[list[tuple[mpc, mpc]]], c: Sequence[mpc]) -> tuple[mp.matrix, mp.matrix]:
        """Return Gauss–Newton matrix and right side for the nodes, the weights projected out (Kaufman 1975)."""
        m = 2 * len(c)
        jacobian = mp.matrix(len(table), 2 * m)
        residual = mp.matrix(len(table), 1)
        for i, (row, scale) in enumerate(zip(table, self.scale, strict=True)):
            residual[i] = -self.target[i]
            for j, (g, slope) in enumerate(row):
                term = scale * c[j] * g
                residual[i] += term.imag
                term *= slope
                jacobian[i, 2 * j], jacobian[i, 2 * j + 1] = scale * g.imag, scale * g.real
                jacobian[i, m + 2 * j], jacobian[i, m + 2 * j + 1] = term.imag, term.real
        full = jacobian.T * jacobian
        for j in range(m):
            full[j, j] += RIDGE**2
        lower = mp.cholesky(full[:m, :m])
        projected = mp.matrix(m, m)
        for b in range(m):
            for a in range(m):
                known = mp.fsum(lower[a, k] * projected[k, b] for k in range(a))
                projected[a, b] = (full[a, m + b] - known) / lower[a, a]
        return full[m:, m:] - projected.T * projected, -(jacobian.T * residual)[m:]

    def refine(self, s: list[mpc], steps: int) -> list[mpc]:
        """Levenberg–Marquardt on the nodes."""
        damping = mpf("1e-2")
        table = self.design(s)
        c, cost = self.weights(table)
        for step in range(steps):
            matrix, right = self.step_equations(table, c)
            before = cost
            for _ in range(14):
                damped = matrix.copy()
                for a in range(damped.rows):
                    damped[a, a] *= 1 + damping
                x = mp.lu_solve(damped, right)
                trial = [v + mpc(x[2 * j], x[2 * j + 1]) for j, v in enumerate(s)]
                if max(abs(v) for v in x) < 1 and min(v.imag for v in trial) > 0.3:
                    table_trial = self.design(trial)
                    c_trial, cost_trial = self.weights(table_trial)
                    if cost_trial < cost:
                        s, c, table, cost = trial, c_trial, table_trial, cost_trial
                        break
                damping *= 5
            damping /= 8
            rms = mp.sqrt(cost / len(self.spectra))
            print(f"step {step}: root mean square error {mp.nstr(rms, 3)}", flush=True)
            if cost > mpf("0.998") * before:
                break
        return s


def derive() -> dict[str, list[float]]:
    """Return the rule as four lists of doubles."""
    fit = Fit(family(0, range(2, 9), 0.07, 6), lambda d: {7: 0.7, 8: 0.4}.get(d, 1.0))
    s = fit.refine([p + SHIFT for p in caratheodory_fejer_poles(DEGREE)], 25)
    nodes = [complex(v) for v in s]
    c, _ = fit.weights(fit.design([mpc(v) for v in nodes]))
    weights = [complex(v) for v in c]
    return {
        "re_s": [v.real for v in nodes],
        "im_s": [v.imag for v in nodes],
        "re_c": [v.real for v in weights],
        "im_c": [v.imag for v in weights],
    }


def kind(z: Spectrum) -> str:
    distinct = len(set(z))
    return "uniform" if distinct == 1 else "two values" if distinct == 2 else "spread or grouped"


def relative_errors(rule: dict[str, list[float]], spectra: Sequence[Spectrum]) -> dict[tuple[str, int], tuple[float, float]]:
    """Return {(kind, dimension): (error of the rule itself, error in double arithmetic)} of h, largest of each."""
    s = np.array(rule["re_s"]) + 1j * np.array(rule["im_s"])
    c = np.array(rule["re_c"]) + 1j * np.array(rule["im_c"])
    worst: dict[tuple[str, int], tuple[float, float]] = {}
    for z in spectra:
        h = contour(z, nodes=120)[0]
        exact = mp.fsum((mpc(ck) * factors(z, mpc(sk))[0]).imag for ck, sk in zip(c, s, strict=True))
        double = float(np.sum((c * np.prod(1 / np.sqrt(s[:, None] - np.array(z)), axis=1)).imag))
        old = worst.get((kind(z), len(z)), (0.0, 0.0))
        worst[kind(z), len(z)] = (
            max(old[0], float(abs(exact / h - 1))),
            max(old[1], float(abs(mpf(double) / h - 1))),
        )
    return worst


def error_table(rule: dict[str, list[float]]) -> str:
    """Return the Markdown table: fresh spectra, none of them used for the fit but the two-valued ones."""
    worst = relative_errors(rule, family(77, range(2, 9), 0.05, 20))
    lines = [
        "# Error of the 8-node rule",
        "",
        "Largest relative error over spectra that the fit has not seen, against 40-digit values;",
        "written by `derive_rule.py`. Each cell: error of the rule in exact arithmetic / in double arithmetic. The",
        "unnormalised first derivatives ∂F/∂zᵢ of a law in d dimensions are laws in d + 2, the second ones in d + 4.",
        "",
        "| spectra | d | F | ∂F | ∂²F |",
        "|---|---|---|---|---|",
    ]
    for name in ("uniform", "two values", "spread or grouped"):
        for d in range(2, 5):
            cells = [worst.get((name, d + extra)) for extra in (0, 2, 4)]
            text = " | ".join("" if v is None else f"{v[0]:.0e} / {v[1]:.0e}" for v in cells)
            lines.append(f"| {name} | {d} | {text} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    mp.dps = 80
    if "--errors" not in sys.argv:
        RULE.write_text(json.dumps(derive(), indent=1) + "\n")
    ERRORS.write_text(error_table(json.loads(RULE.read_text())))


if __name__ == "__main__":
    main()
