"""Limits of R among near concentrations, checked or found: ``python benchmarks/neighbours.py [REPLICATES] [--find]``.

Samples are of the limit of narrow distributions: the scatter across the mode is Wishart with n − 1 degrees of freedom.
For 72 sets of true gaps and four sizes R, corrected for its skewness, is drawn with the gaps of its sample; printed is
the least and the largest share within `bingham.inference.neighbours.LIMITS`. With ``--find``, limits are sought that
bring all shares near 0.95 (least squares, large deviations counting more), smooth in the gaps and near 1.96 where
nothing else is asked.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from itertools import product

import numpy as np
from bingham.distributions.marginal import marginal_fit
from bingham.distributions.normalizer import solve_moments
from bingham.inference.neighbours import KNOTS, LIMITS, NORMAL, cells, gaps, pivot
from scipy.optimize import least_squares

GAPS = [0.0, 0.35, 0.7, 1.1, 1.7, 2.5, 3.5, 5.0]
SIZES = [10, 16, 40, 400]  # the last as good as infinitely many
FLATTEST = -1000.0
LEAST, MOST = 0.8, 2.5  # of limits, so that intervals stay within reason
SMOOTH, NEAR_NORMAL, WIDTH = 1.5, 0.25, 0.05


def concentrations(steps, n):
    """Return z, ascending, with gaps g = √n (r − 1/r)/2 between neighbours, r² the ratio of their concentrations."""
    z = [FLATTEST]
    for g in reversed(steps):
        z.insert(0, z[0] * (g / np.sqrt(n) + np.sqrt(g * g / n + 1.0)) ** 2)
    return np.array([*z, 0.0])


def draw(z, n, replicates, rng):
    """Yield for each concentration its place, R (R,), and the gaps (2, R) that its limits are functions of."""
    d = len(z)
    x = rng.standard_normal((replicates, n - 1, d - 1)) / np.sqrt(-2.0 * z[:-1])
    w = np.linalg.eigvalsh(np.swapaxes(x, -1, -2) @ x / n)
    w = np.concatenate([w, 1.0 - w.sum(axis=-1, keepdims=True)], axis=-1)
    plain = solve_moments(w)[0]
    best_z, best = marginal_fit(w, n, np.array(plain))
    near = gaps(plain, w, n)
    far = np.full(replicates, np.inf)
    for k in range(d - 1):
        root = pivot(k, np.full(replicates, z[k]), best_z, w, n, best, np.full((2, replicates), NORMAL))
        if 0 < k < d - 2:
            yield "between", root, np.stack([near[:, k - 1], near[:, k]])
        elif k == 0:
            yield "steepest", root, np.stack([near[:, 0], near[:, 1] if d > 3 else far])
        else:
            yield "flattest", root, np.stack([near[:, -1], near[:, -2] if d > 3 else far])


def corners(pair):
    """Return indices into a table's 25 entries and weights, each (4, R), of its value at gaps (2, R)."""
    (i, s), (j, t) = cells(pair[0]), cells(pair[1])
    m = len(KNOTS)
    index = np.stack([i * m + j, (i + 1) * m + j, i * m + j + 1, (i + 1) * m + j + 1])
    return index, np.stack([(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t])


def misses(drawn, table, width=0.0):
    """Return the share above and below the limits (D, 2), with a soft edge of a width also its gradient (D, 50)."""
    half = len(KNOTS) ** 2
    shares, slopes = [], []
    for root, index, weight in drawn:
        share, slope = [], []
        for sign, flat in zip((1.0, -1.0), table.reshape(2, half), strict=True):
            excess = sign * root - np.sum(flat[index] * weight, axis=0)
            if width > 0.0:
                soft = 1.0 / (1.0 + np.exp(-np.clip(excess / width, -40.0, 40.0)))
                bend = -soft * (1.0 - soft) / (width * len(root))
                share.append(soft.mean())
                slope.append(np.bincount(index.ravel(), (weight * bend).ravel(), half))
            else:
                share.append(np.mean(excess > 0.0))
        shares.append(share)
        slopes.append(np.concatenate(slope) if slope else None)
    return np.array(shares), slopes


def find(drawn):
    """Return limits (2, 5, 5) that bring all shares beyond them near 0.05."""
    m = len(KNOTS)
    eye = np.eye(2 * m * m)
    grid = eye.reshape(2, m, m, -1)
    bends = np.concatenate([np.diff(grid, 2, axis=axis).reshape(-1, 2 * m * m) for axis in (1, 2)])
    ends = eye[[m * m - 1, -1]]

    def residuals(p):
        off = 100.0 * (misses(drawn, p, WIDTH)[0].sum(axis=1) - 0.051)
        outside = 20.0 * (np.minimum(p - LEAST, 0.0) + np.maximum(p - MOST, 0.0))
        return np.concatenate(
            [off + 0.4 * off**3, SMOOTH * bends @ p, NEAR_NORMAL * (p - NORMAL), outside, 10.0 * (ends @ p - NORMAL)]
        )

    def jacobian(p):
        share, slope = misses(drawn, p, WIDTH)
        off = 100.0 * (share.sum(axis=1) - 0.051)
        outside = 20.0 * np.diag(((p < LEAST) | (p > MOST)).astype(float))
        first = 100.0 * np.array(slope) * (1.0 + 1.2 * off**2)[:, None]
        return np.concatenate([first, SMOOTH * bends, NEAR_NORMAL * eye, outside, 10.0 * ends])

    found = least_squares(residuals, np.full(2 * m * m, 1.9), jac=jacobian, max_nfev=60)
    return found.x.reshape(2, m, m)


def main() -> None:
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    replicates = numbers[0] if numbers else 4000
    rng = np.random.default_rng(0)
    drawn = defaultdict(list)
    for n in SIZES:
        for steps in [*((g,) for g in GAPS), *product(GAPS, repeat=2)]:
            for place, root, pair in draw(concentrations(steps, n), n, replicates, rng):
                drawn[place].append((root, *corners(pair)))
    for place, rows in drawn.items():
        tables = {"in use": LIMITS[place]}
        if "--find" in sys.argv:
            tables["found"] = find(rows)
            print(np.array2string(tables["found"], precision=2, suppress_small=True))
        for name, table in tables.items():
            held = 1.0 - misses(rows, table)[0].sum(axis=1)
            print(f"{place:<9} {name:<7} {held.min():.3f} to {held.max():.3f}, deviation {held.std():.4f}", flush=True)


if __name__ == "__main__":
    main()
