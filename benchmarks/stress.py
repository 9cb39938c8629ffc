"""Filter steps and operations on distributions in random order over 1e-12 … 1e12, with what must hold after each.

python benchmarks/stress.py [STEPS] [OPERATIONS] [SEED]; 1e6 of each by default, 1e8 for a night. After every step or
operation: finite, sorted, last concentration 0, axes orthonormal to 1e-12, moments positive with sum 1, KL ≥ 0,
NIS ≥ 0; the evidence of some updates against its closed form for d = 2, against quadrature for d = 4.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
from bingham import Bingham, BinghamFilter, concentrations, log_normalizer, moments
from scipy.special import i0e

BATCH, LENGTH = 64, 250


def spectra(rng: np.random.Generator, n: int, d: int) -> np.ndarray:
    """Concentrations (n, d) from 1e-12 to 1e12, some of them equal, with largest 0."""
    z = -(10.0 ** rng.uniform(-12.0, 12.0, (n, d)))
    tied = rng.random(n) < 0.2
    z[tied, 0] = z[tied, -1]
    return z - z.max(axis=-1, keepdims=True)


def frames(rng: np.random.Generator, n: int, d: int) -> np.ndarray:
    """Orthogonal matrices (n, d, d), some of them near the identity."""
    tilt = 10.0 ** rng.uniform(-16.0, 1.0, (n, 1, 1))
    return np.linalg.qr(np.eye(d) + tilt * rng.normal(size=(n, d, d)))[0]


def check(p: Bingham, what: str) -> None:
    """Raise if p is no distribution in canonical form."""
    gram = np.swapaxes(p.M, -1, -2) @ p.M - np.eye(p.dim)
    faults = {
        "not finite": not (np.isfinite(p.z).all() and np.isfinite(p.log_normalizer).all()),
        "not sorted": bool((np.diff(p.z, axis=-1) < 0.0).any()),
        "last not 0": bool((p.z[..., -1] != 0.0).any()),
        "not orthonormal": bool(np.abs(gram).max() > 1e-12),
        "moments": not ((p.axis_moments > 0.0).all() and np.abs(p.axis_moments.sum(axis=-1) - 1.0).max() < 1e-12),
    }
    if any(faults.values()):
        raise AssertionError(f"{what}: {[name for name, wrong in faults.items() if wrong]}: {p!r}")


def steps(rng: np.random.Generator, d: int) -> int:
    """Filter a batch of sequences with noises and priors of any size; return the steps done."""
    process, sensor = (Bingham(spectra(rng, 1, d)[0], frames(rng, 1, d)[0]) for _ in "12")
    prior = Bingham(spectra(rng, BATCH, d), frames(rng, BATCH, d))
    y = rng.normal(size=(BATCH, LENGTH, d))
    y /= np.linalg.norm(y, axis=-1, keepdims=True)
    y[rng.random((BATCH, LENGTH)) < 0.05] = np.nan
    f = BinghamFilter(process, sensor)
    track = f.run(prior, y)
    check(track.distributions, f"steps, d = {d}")
    given = track.decision >= 0
    assert (track.nis[given] >= 0.0).all() and np.isfinite(track.log_evidence).all()
    (evidence_2 if d == 2 else evidence_4)(f, sensor, track, y)
    return BATCH * LENGTH


def evidence_2(f: BinghamFilter, noise: Bingham, track: object, y: np.ndarray) -> None:
    """Compare an update's evidence with F(A + L)/(F(A) F(noise)), F = 2π e^{z/2} I₀(z/2) in the plane."""
    for _ in range(5):
        predicted = f.predict(track.distributions[0][3])  # type: ignore[attr-defined]
        z = next(row for row in y[0] if not np.isnan(row[0]))
        _, info = f.update(predicted, z)
        a, b = -0.5 * predicted.z[0], -0.5 * noise.z[0]
        u = complex(*z) * complex(*noise.mode).conjugate() * complex(*predicted.mode).conjugate()
        # The resultant of two von Mises distributions whose doubled angles differ by that of u².
        r = np.hypot(a - b, 2.0 * np.sqrt(a * b) * abs(u.real))
        gap = -4.0 * a * b * u.imag**2 / (a + b + r) if a + b > 0.0 else 0.0
        exact = np.log(i0e(r) / i0e(a) / i0e(b) / (2.0 * np.pi)) + gap
        assert abs(info.log_evidence - exact) <= 1e-9 * (1.0 + abs(exact)), (info.log_evidence, exact)


# Panels of a quadrature over (0, ½] that sees every scale down to 1e-16, 20 nodes each.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)
EDGES = 0.5 * 4.0 ** np.arange(-28.0, 1.0)
WIDTH = np.diff(EDGES, prepend=0.0)[:, None]
POINTS, SHARES = (EDGES[:, None] + 0.5 * WIDTH * (NODES - 1.0)).ravel(), (0.5 * WIDTH * WEIGHTS).ravel()


def log_normalizer_4(z: np.ndarray) -> float:
    """Return log ∫ exp(Σ zᵢxᵢ²) over the unit sphere of four dimensions, z ascending, by quadrature.

    With u = x₃² + x₄² the circles of both pairs integrate to Bessel functions:
    2π² ∫₀¹ e^{(z₁ + z₂)(1 − u)/2 + (z₃ + z₄)u/2} I₀((z₂ − z₁)(1 − u)/2) I₀((z₄ − z₃)u/2) du.
    """
    a, b = 0.5 * (z[1] - z[0]), 0.5 * (z[3] - z[2])
    total = 0.0
    for u, v in ((POINTS, 1.0 - POINTS), (1.0 - POINTS, POINTS)):
        total += SHARES @ (np.exp((z[1] - z[3]) * v) * i0e(a * v) * i0e(b * u))
    return float(np.log(2.0 * np.pi**2 * total) + z[3])


def evidence_4(f: BinghamFilter, noise: Bingham, track: object, y: np.ndarray) -> None:
    """Compare an update's evidence with F(A + L)/(F(A) F(noise)) by quadrature, within what A + L is rounded by."""
    predicted = f.predict(track.distributions[0][3])  # type: ignore[attr-defined]
    seen = next(row for row in y[0] if not np.isnan(row[0]))
    _, info = f.update(predicted, seen)
    w, x, y_, z = seen
    # The noise x⁻¹ ⊕ z is linear in the state x.
    of_state = np.array([[w, x, y_, z], [x, -w, -z, y_], [y_, z, -w, -x], [z, -y_, x, -w]])
    total = np.linalg.eigvalsh(predicted.matrix + of_state.T @ noise.matrix @ of_state)
    exact = log_normalizer_4(total) - log_normalizer_4(predicted.z) - log_normalizer_4(noise.z)
    rounding = 32.0 * np.finfo(float).eps * (np.abs(predicted.z).max() + np.abs(noise.z).max())
    assert abs(info.log_evidence - exact) <= 1e-9 * (1.0 + abs(exact)) + rounding, (info.log_evidence, exact, rounding)


def operations(rng: np.random.Generator, n: int) -> int:
    """Do n operations in random order, on batches where they take batches; return how many."""
    d = int(rng.integers(2, 6))
    p, q = (Bingham(spectra(rng, n, d), frames(rng, n, d)) for _ in "12")
    check(p, "Bingham")
    w = moments(p.z)
    assert (w > 0.0).all() and np.isfinite(log_normalizer(p.z)).all()
    z = concentrations(np.maximum(w, 1e-29) / np.maximum(w, 1e-29).sum(axis=-1, keepdims=True))
    assert np.isfinite(z).all() and (z.max(axis=-1) == 0.0).all()
    assert (p.kl_divergence(q) >= 0.0).all()
    some: list[tuple[Callable[[], Bingham], int]] = [
        (lambda: p.multiply(q), n),
        (lambda: Bingham.from_matrix(p.matrix), n),
    ]
    if d in (2, 4):
        some += [(lambda: p.inverse(), n), (lambda: p.rotate(left=q.mode), n), (lambda: p[0].compose(q[0]), 1)]
    for i in rng.permutation(len(some)):
        check(some[i][0](), f"operation {i}, d = {d}")
    return 6 * n + sum(count for _, count in some)


def main(arguments: list[str]) -> None:
    """Run as many as asked for, and say how many."""
    wanted_steps, wanted_operations = (int(float(a)) for a in (arguments + ["1e6", "1e6"][len(arguments) :])[:2])
    rng = np.random.default_rng(int(arguments[2]) if len(arguments) > 2 else 0)
    done = [0, 0]
    with np.errstate(all="raise", under="ignore"):
        while done[0] < wanted_steps:
            done[0] += steps(rng, int(rng.choice([2, 4])))
        while done[1] < wanted_operations:
            done[1] += operations(rng, 1000)
    print(f"{done[0]:,} filter steps and {done[1]:,} operations: all hold".replace(",", " "))


if __name__ == "__main__":
    main(sys.argv[1:])
