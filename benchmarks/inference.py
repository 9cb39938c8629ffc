"""Coverage of confidence regions, sizes and powers of tests: ``python benchmarks/inference.py [REPLICATES]``.

Prints tables; with matplotlib also draws power curves into ``power.png``. Nominal values are 0.95 and 0.05.
"""

from __future__ import annotations

import sys

import numpy as np
from bingham import Bingham
from bingham.inference import (
    cluster_girdle_test,
    common_axis_test,
    concentration_intervals,
    confidence_ellipse,
    equality_test,
    mean_axis_test,
    symmetry_test,
    uniformity_test,
)

SHAPES = {
    "d = 3 bipolar": [-20.0, -15.0, 0.0],
    "d = 3 girdle": [-20.0, -3.0, 0.0],
    "d = 3 triaxial": [-30.0, -8.0, 0.0],
    "d = 4 bipolar": [-30.0, -25.0, -20.0, 0.0],
    "d = 4 girdle": [-60.0, -20.0, -3.0, 0.0],
    "d = 4 triaxial": [-60.0, -25.0, -9.0, 0.0],
}


def sample(z, shape, seed):
    return Bingham(z, np.eye(len(z))).rvs(shape, rng=seed)


def coverage(replicates: int) -> None:
    print(
        "Coverage at 0.95: mean axis by χ² (the usual ellipse), F, likelihood; every axis by likelihood; concentrations"
    )
    for name, z in SHAPES.items():
        d = len(z)
        for n in (10, 20, 50):
            x = sample(z, (replicates, n), n)
            mode = np.eye(d)[-1]
            by = [confidence_ellipse(x, method=m).contains(mode).mean() for m in ("chi2", "f")]
            axes = [np.mean(mean_axis_test(x, np.eye(d)[k], index=k).pvalue > 0.05) for k in range(d)]
            found = concentration_intervals(x)
            inside = np.mean((found.low <= z) & (z <= found.high), axis=0)[:-1]
            said = f"χ² {by[0]:.3f}  F {by[1]:.3f}  likelihood {axes[-1]:.3f}"
            others = " ".join(f"{a:.3f}" for a in axes[:-1])
            print(f"{name:<16} n = {n:<3} {said}  axes {others}  z {' '.join(f'{c:.3f}' for c in inside)}", flush=True)


def sizes(replicates: int) -> None:
    print("\nSizes at 0.05")
    for n in (20, 100):
        for d in (2, 3, 4):
            x = Bingham.uniform(d).rvs((replicates, n), rng=n)
            row = {m: uniformity_test(x, method=m) for m in (("bingham", "rayleigh") if d == 2 else ("bingham",))}
            row["gine"] = uniformity_test(x, method="gine")
            said = "  ".join(f"{m} {np.mean(r.pvalue < 0.05):.3f}" for m, r in row.items())
            print(f"uniformity d = {d}, n = {n}: {said}; mean of S {np.mean(row['bingham'].statistic):.3f}", flush=True)
        for kind, z in (("bipolar", [-10.0, -10.0, 0.0]), ("girdle", [-30.0, 0.0, 0.0])):
            x = sample(z, (replicates, n), n)
            print(f"symmetry {kind}, n = {n}: {np.mean(symmetry_test(x, kind=kind).pvalue < 0.05):.3f}")
        x = sample([-16.0, -8.0, 0.0], (replicates, n), n)
        print(f"cluster against girdle, n = {n}: {np.mean(cluster_girdle_test(x).pvalue < 0.05):.3f}")
        for name, z in SHAPES.items():
            x, y = sample(z, (replicates, n), 1), sample(2 * np.array(z), (replicates, n), 2)
            same = sample(z, (replicates, n), 3)
            tests = {
                "mean axis": mean_axis_test(x, np.eye(len(z))[-1]),
                "common axis": common_axis_test(x, y),
                "equality (asymptotic)": equality_test(x, same, null="asymptotic"),
            }
            said = "  ".join(f"{t} {np.mean(r.pvalue < 0.05):.3f}" for t, r in tests.items())
            print(f"{name:<16} n = {n:<3} {said}", flush=True)


def powers(replicates: int) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return for each test, d = 3 and n = 20, the strength of the alternative and the share of rejections."""
    n = 20
    steps = np.linspace(0.0, 1.0, 9)
    curves: dict[str, list[float]] = {}
    for s in steps:
        k = 4.0 * s
        base = sample([-20.0, -12.0, 0.0], (replicates, n), 1)
        angle = np.radians(20.0 * s)
        axis = np.array([0.0, np.sin(angle), np.cos(angle)])
        rotation = np.array([[1, 0, 0], [0, np.cos(angle), np.sin(angle)], [0, -np.sin(angle), np.cos(angle)]])
        turned = sample([-20.0, -12.0, 0.0], (replicates, n), 2) @ rotation.T
        row = {
            "uniformity, S: z = (−4s, −4s, 0)": uniformity_test(sample([-k, -k, 0.0], (replicates, n), 3)),
            "symmetry: z = (−10 − 40s, −10, 0)": symmetry_test(sample([-10 - 10 * k, -10.0, 0.0], (replicates, n), 4)),
            "mean axis 20°·s off": mean_axis_test(base, axis),
            "common axis, 20°·s apart": common_axis_test(base, turned),
            "equality: concentrations × (1 + 4s)": equality_test(
                base, sample(np.array([-20.0, -12.0, 0.0]) * (1 + k), (replicates, n), 5), null="asymptotic"
            ),
            "cluster/girdle: z₂ = −10(1 − s)": cluster_girdle_test(
                sample([-20.0, -10.0 * (1 - s), 0.0], (replicates, n), 6)
            ),
        }
        for name, result in row.items():
            curves.setdefault(name, []).append(float(np.mean(result.pvalue < 0.05)))
    return {name: (steps, np.array(values)) for name, values in curves.items()}


def main() -> None:
    replicates = int(sys.argv[1]) if len(sys.argv) > 1 else 5000
    coverage(replicates)
    sizes(replicates)
    curves = powers(replicates)
    print("\nPower at 0.05, n = 20, strength s = 0, 1/8, …, 1")
    for name, (_, values) in curves.items():
        print(f"{name:<38}{' '.join(f'{v:.3f}' for v in values)}")
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return
    figure = Figure(figsize=(7.0, 4.5), layout="constrained")
    ax = figure.subplots()
    for name, (steps, values) in curves.items():
        ax.plot(steps, values, marker="o", ms=3, label=name)
    ax.axhline(0.05, color="0.6", lw=0.8, ls="--")
    ax.set(xlabel="strength s of the alternative", ylabel="share of rejections at 0.05", ylim=(0, 1.02))
    ax.set_title(f"Power of the tests, d = 3, n = 20, {replicates} samples", fontsize=10)
    ax.legend(fontsize=8, frameon=False)
    figure.savefig("power.png", dpi=150)


if __name__ == "__main__":
    main()
