"""Compute `normalizer.json`: log-normalisers, moments and Hessians of the Bingham distribution to 25 digits.

Run from the project root: ``python tests/reference/make_table.py`` (about ten minutes on one core).

Every spectrum is evaluated by both methods of `exact`; value, moments and Hessian entries must agree to 1e-40, or no
table is written. The special distributions that have closed forms are compared with those as well: Bessel's form for d
= 2 (Kurz et al. 2014, eq. 77), Wood's integral for d = 4, Kummer's function for isotropic distributions of any d. The
agreement reached is stored with the table.
"""

from __future__ import annotations

import json
import math
import random
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from exact import contour, log_normalizer, series
from mpmath import mp, mpf

TABLE = Path(__file__).with_name("normalizer.json")
DIGITS = 25
AGREEMENT = mpf(10) ** -40


def spectra() -> list[tuple[str, tuple[float, ...]]]:
    """Return (family, z) pairs: every regime in small dimensions, a sample of them in large ones."""
    rng = random.Random(20260101)
    found: list[tuple[str, tuple[float, ...]]] = []
    for d in (2, 3, 4, 5, 6, 10, 20, 50):
        small = d <= 6
        found.append(("uniform", (0.0,) * d))
        for k in (-8, -4, -2, -1, 0, 1, 1.25, 1.35, 1.6, 2, 3, 4, 5, 6, 9, 12) if small else (-4, 0, 1, 2, 4, 6, 12):
            scale = -(10.0**k)
            found.append(("equal", (scale,) * (d - 1) + (0.0,)))
            if d == 2:
                continue
            if k >= 0:
                found.append(("girdle", (scale,) + (0.0,) * (d - 1)))
                if small:
                    found.append(("nearly equal", (*(scale * (1 + 1e-9 * i) for i in range(d - 1, 0, -1)), 0.0)))
                    found.append(("nearly girdle", (scale, *(-1e-9 * i for i in range(d - 2, 0, -1)), 0.0)))
                if d >= 4:
                    found.append(("two groups", (scale,) * (d // 2) + (0.0,) * (d - d // 2)))
        for top in (2, 4, 6, 12):
            steps = [-(10.0 ** (top * (d - 1 - i) / (d - 1))) for i in range(d - 1)]
            found.append(("spread", (*steps, 0.0)))
        for low, high, count in ((-1, 2, 4), (0, 4, 4), (2, 6, 4), (-3, 12, 3)) if small else ((0, 4, 2), (-3, 12, 1)):
            for _ in range(count):
                found.append(("random", (*sorted(-(10 ** rng.uniform(low, high)) for _ in range(d - 1)), 0.0)))
    # printed with 12 digits, so that the table is short; parsed back, these are the doubles everything refers to
    rounded = [(family, tuple(float(f"{v:.12g}") for v in z)) for family, z in found]
    return list(dict.fromkeys(rounded))


def representatives(z: tuple[float, ...]) -> list[int]:
    """Return the positions of at most five distinct concentrations, the extremes included."""
    positions = [i for i, v in enumerate(z) if i == 0 or v != z[i - 1]]
    if len(positions) <= 5:
        return positions
    return [positions[k * (len(positions) - 1) // 4] for k in range(5)]


def closed_form(family: str, z: tuple[float, ...]) -> mpf | None:
    """Return h(z) where a textbook form exists."""
    d = len(z)
    if d == 2:
        return mp.exp(mpf(z[0]) / 2) * mp.besseli(0, mpf(z[0]) / 2)
    if family in ("equal", "uniform"):
        # E[exp(c(x_d² − 1))] under the uniform distribution, by Kummer's transformation free of cancellation
        c = -mpf(z[0])
        return mp.rgamma(mpf(d) / 2) * mp.hyp1f1(mpf(d - 1) / 2, mpf(d) / 2, -c)
    if family == "girdle":
        return mp.rgamma(mpf(d) / 2) * mp.hyp1f1(mpf(1) / 2, mpf(d) / 2, mpf(z[0]))
    if d == 4 and z[0] > -1e3:
        a, b, c, _ = (mpf(v) for v in z)

        def slice_(t: mpf) -> mpf:
            """Wood (1993): S³ as circles of squared radii t and 1 − t."""
            u = 1 - t
            left = mp.exp(t * (a + b) / 2) * mp.besseli(0, t * (b - a) / 2)
            return left * mp.exp(u * c / 2) * mp.besseli(0, -u * c / 2)

        return mp.quad(slice_, mp.linspace(0, 1, 9))
    return None


def entry(family: str, z: tuple[float, ...]) -> tuple[dict[str, object], mpf, mpf | None]:
    """Return a row of the table, the disagreement of the two methods and that with a closed form."""
    chosen = representatives(z)
    pairs = [(chosen[0], chosen[0]), (chosen[0], chosen[-1]), (chosen[-1], chosen[-1])]
    pairs = list(dict.fromkeys(pairs))
    h, gradient, second = contour(z, pairs)
    checks = [series(z) / h - 1]
    for i in (chosen[0], chosen[-1]):
        checks.append(series([*z, z[i], z[i]]) / (2 * gradient[i]) - 1)
    for (i, j), value in zip(pairs, second, strict=True):
        factor = mpf(3) / 4 if i == j else mpf(1) / 4
        checks.append(factor * series([*z, z[i], z[i], z[j], z[j]]) / value - 1)
    checks.append(mp.fsum(gradient) / h - 1)
    with mp.workdps(60):
        closed = closed_form(family, z)
        gap = None if closed is None else abs(closed / h - 1)
    moments = [g / h for g in gradient]
    hessian = [[i, j, v / h - moments[i] * moments[j]] for (i, j), v in zip(pairs, second, strict=True)]
    row: dict[str, object] = {
        "family": family,
        "z": list(z),
        "log_normalizer": mp.nstr(log_normalizer(h, len(z)), DIGITS),
        "moments": [[i, mp.nstr(moments[i], DIGITS)] for i in chosen],
        "hessian": [[i, j, mp.nstr(v, DIGITS)] for i, j, v in hessian],
    }
    return row, max(abs(c) for c in checks), gap


def main() -> None:
    mp.dps = 240
    rows, worst, worst_closed, closed_forms = [], mpf(0), mpf(0), 0
    for family, z in spectra():
        row, disagreement, gap = entry(family, z)
        if disagreement > AGREEMENT or (gap is not None and gap > AGREEMENT):
            raise ArithmeticError(f"{family} {z}: methods differ by {mp.nstr(disagreement, 3)}, closed form by {gap}")
        worst = max(worst, disagreement)
        if gap is not None:
            closed_forms, worst_closed = closed_forms + 1, max(worst_closed, gap)
        rows.append(row)
        if "-v" in sys.argv:
            print(
                len(rows), family, len(z), mp.nstr(disagreement, 2), "" if gap is None else mp.nstr(gap, 2), flush=True
            )
    header = {
        "contents": "log of the Bingham normaliser b(z) over the unit sphere of R^d, moments d log b/dz_i as"
        " [i, value], Hessian entries d2 log b/dz_i dz_j as [i, j, value]; z are doubles, values decimal to 25 digits",
        "spectra": len(rows),
        "worst_disagreement_of_two_methods": mp.nstr(worst, 3),
        "closed_forms_compared": closed_forms,
        "worst_disagreement_with_closed_forms": mp.nstr(worst_closed, 3),
    }
    lines = ",\n".join(json.dumps(row, separators=(",", ":")) for row in rows)
    TABLE.write_text(f'{{"about": {json.dumps(header, indent=1)},\n"rows": [\n{lines}\n]}}\n')
    print(header, math.ceil(TABLE.stat().st_size / 1024), "kB")


if __name__ == "__main__":
    main()
