"""Coverage of confidence regions, sizes and powers of tests: ``python benchmarks/inference.py [REPLICATES] [FILE]``.

Writes rows of case, sample, metric and value as the pages of the documentation read them (by default into
``docs/studies/results/inference.json``). Nominal values are 0.95 and 0.05.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from bingham import Bingham
from bingham.distributions.marginal import marginal_fit
from bingham.inference import (
    cluster_girdle_test,
    common_axis_test,
    confidence_ellipse,
    equality_test,
    goodness_of_fit_test,
    mean_axis_test,
    symmetry_test,
    uniformity_test,
)
from bingham.inference.neighbours import NORMAL, gaps, limits, pivot, profile_root

RESULTS = Path(__file__).resolve().parents[1] / "docs/studies/results/inference.json"
FIGURE = RESULTS.parents[2] / "_static/power.png"
RESAMPLES = 199  # (1 + count)/200 ≤ 0.05 has size 0.05 exactly
SHAPES = {
    "d = 3 bipolar": [-20.0, -15.0, 0.0],
    "d = 3 girdle": [-20.0, -3.0, 0.0],
    "d = 3 triaxial": [-30.0, -8.0, 0.0],
    "d = 4 bipolar": [-30.0, -25.0, -20.0, 0.0],
    "d = 4 girdle": [-60.0, -20.0, -3.0, 0.0],
    "d = 4 triaxial": [-60.0, -25.0, -9.0, 0.0],
}
TIES = {
    "(−20; −20; 0)": [-20.0, -20.0, 0.0],
    "(−20; 0; 0)": [-20.0, 0.0, 0.0],
    "(−30; −30; −30; 0)": [-30.0, -30.0, -30.0, 0.0],
    "uniform in space": [0.0, 0.0, 0.0],
}
# Concentrations that no limit was fitted to: equal, near, far apart, weak, narrow.
OTHERS = [
    [-12.0, -12.0, 0.0], [-4.0, -4.0, 0.0], [-45.0, -20.0, 0.0], [-400.0, -250.0, 0.0], [-200.0, -20.0, 0.0],
    [-15.0, 0.0, 0.0], [-6.0, -2.0, 0.0], [-40.0, -40.0, -40.0, 0.0], [-50.0, -50.0, -15.0, 0.0],
    [-50.0, -15.0, -15.0, 0.0], [-60.0, -38.0, -24.0, 0.0], [-300.0, -60.0, -10.0, 0.0], [-8.0, -5.0, -3.0, 0.0],
]  # fmt: skip
Row = tuple[str, str, str, float]


def sample(z, shape, seed):
    return Bingham(z, np.eye(len(z))).rvs(shape, rng=seed)


def axes_cover(x) -> Iterator[tuple[str, float]]:
    """Yield the share of samples whose region of each principal axis, by the default method, holds the true one."""
    d = x.shape[-1]
    for k in range(d):
        yield f"axis {k + 1}", np.mean(mean_axis_test(x, np.eye(d)[k], index=k).pvalue >= 0.05)


def concentrations_cover(x, z) -> Iterator[tuple[str, float]]:
    """Yield the share of samples whose interval of each concentration holds z: there the pivot is within its limits."""
    n = x.shape[-2]
    fitted = Bingham.fit(x)
    w, plain = fitted.axis_moments, np.array(fitted.z)
    best_z, best = marginal_fit(w, n, plain)
    near = gaps(plain, w, n)
    for k in range(len(z) - 1):
        given = k, np.full(len(x), z[k]), best_z, w, n, best
        yield f"z {k + 1}", np.mean(np.abs(pivot(*given, limits(k, near))) <= NORMAL)
        yield f"z {k + 1} by χ²", np.mean(np.abs(profile_root(*given)[0]) <= NORMAL)


def coverage(replicates: int) -> Iterator[Row]:
    for name, z in (SHAPES | TIES).items():
        d = len(z)
        for n in (10, 20, 50):
            x = sample(z, (replicates, n), n)
            case = "coverage" if name in SHAPES else "coverage at ties"
            label = f"{name} n = {n}"
            if name in SHAPES:
                for method in ("chi2", "f"):
                    yield case, label, method, confidence_ellipse(x, method=method).contains(np.eye(d)[-1]).mean()
            for metric, value in axes_cover(x):
                yield case, label, metric, value
            if name in SHAPES:
                for metric, value in concentrations_cover(x, z):
                    yield case, label, metric, value
    for z in OTHERS:
        for n in (10, 14, 30):
            label = "(" + "; ".join(f"{v:g}" for v in z).replace("-", "−") + f") n = {n}"
            for metric, value in concentrations_cover(sample(z, (replicates, n), n), z):
                yield "coverage elsewhere", label, metric, value


def sizes(replicates: int) -> Iterator[Row]:
    def rejected(result) -> float:
        return float(np.mean(result.pvalue <= 0.05))

    drawn = {"resamples": RESAMPLES, "rng": 0}
    for n in (20, 100):
        column = f"n = {n}"
        for d in (2, 3, 4):
            x = Bingham.uniform(d).rvs((replicates, n), rng=n)
            result = uniformity_test(x)
            yield "size", f"uniformity; Bingham's S; d = {d}", column, rejected(result)
            yield "null mean of S", f"d = {d}", column, float(np.mean(result.statistic))
            yield "size", f"uniformity; Giné's G; d = {d}", column, rejected(uniformity_test(x, method="gine"))
            if d == 2:
                yield "size", "uniformity; Rayleigh; d = 2", column, rejected(uniformity_test(x, method="rayleigh"))
            if d == 3:
                yield "size", "uniformity; simulation", column, rejected(uniformity_test(x, null="simulation", rng=0))
        for kind, d, z in (
            ("bipolar", 3, [-10.0, -10.0, 0.0]), ("girdle", 3, [-30.0, 0.0, 0.0]),
            ("bipolar", 4, [-30.0, -30.0, -30.0, 0.0]),
        ):  # fmt: skip
            x = sample(z, (replicates, n), n)
            yield "size", f"symmetry; {kind}; d = {d}", column, rejected(symmetry_test(x, kind=kind))
            yield "size", f"symmetry; {kind} found; d = {d}", column, rejected(symmetry_test(x))
            if d == 3:
                result = symmetry_test(x, kind=kind, null="simulation", **drawn)
                yield "size", f"symmetry; {kind}; random rotations", column, rejected(result)
        x = sample([-16.0, -8.0, 0.0], (replicates, n), n)
        yield "size", "cluster against girdle", column, rejected(cluster_girdle_test(x))
        for name, z in SHAPES.items():
            x, y = sample(z, (replicates, n), 1), sample(2 * np.array(z), (replicates, n), 2)
            same = sample(z, (replicates, n), 3)
            mode = np.eye(len(z))[-1]
            yield "size", f"mean axis; {name}", column, rejected(mean_axis_test(x, mode))
            yield "size", f"common axis; {name}", column, rejected(common_axis_test(x, y))
            yield "size", f"equality; {name}", column, rejected(equality_test(x, same, **drawn))
            yield "size", f"equality by F; {name}", column, rejected(equality_test(x, same, null="asymptotic"))
            if name in ("d = 3 girdle", "d = 3 triaxial"):
                half = mean_axis_test(x, mode, null="permutation", **drawn)
                yield "size", f"mean axis by half turns; {name}", column, rejected(half)
                boot = common_axis_test(x, y, null="bootstrap", **drawn)
                yield "size", f"common axis by bootstrap; {name}", column, rejected(boot)
            if name in ("d = 3 bipolar", "d = 3 girdle", "d = 4 triaxial"):
                yield "size", f"goodness of fit; {name}", column, rejected(goodness_of_fit_test(x, **drawn))


def powers(replicates: int) -> Iterator[Row]:
    """Yield for each test, d = 3 and n = 20, the share of rejections by the strength of the alternative."""
    n = 20
    for s in np.linspace(0.0, 1.0, 9):
        k = 4.0 * s
        base = sample([-20.0, -12.0, 0.0], (replicates, n), 1)
        angle = np.radians(20.0 * s)
        axis = np.array([0.0, np.sin(angle), np.cos(angle)])
        rotation = np.array([[1, 0, 0], [0, np.cos(angle), np.sin(angle)], [0, -np.sin(angle), np.cos(angle)]])
        turned = sample([-20.0, -12.0, 0.0], (replicates, n), 2) @ rotation.T
        denser = sample(np.array([-20.0, -12.0, 0.0]) * (1 + k), (replicates, n), 5)
        outliers = sample([-60.0, -40.0, 0.0], (replicates, n), 7)
        count = round(0.2 * s * n)
        outliers[:, :count] = Bingham.uniform(3).rvs((replicates, count), rng=8)
        part = slice(0, max(replicates // 5, 1))
        for name, result in {
            "uniformity: z = (−4s, −4s, 0)": uniformity_test(sample([-k, -k, 0.0], (replicates, n), 3)),
            "symmetry: z = (−10 − 40s, −10, 0)": symmetry_test(
                sample([-10 - 10 * k, -10.0, 0.0], (replicates, n), 4), kind="bipolar"
            ),
            "mean axis, 20° s off": mean_axis_test(base, axis),
            "common axis, 20° s apart": common_axis_test(base, turned),
            "equality: concentrations × (1 + 4s)": equality_test(base, denser, resamples=RESAMPLES, rng=0),
            "cluster or girdle: z₂ = −10 (1 − s)": cluster_girdle_test(
                sample([-20.0, -10.0 * (1 - s), 0.0], (replicates, n), 6)
            ),
            "goodness of fit: 20 % s of outliers": goodness_of_fit_test(outliers[part], resamples=RESAMPLES, rng=0),
        }.items():
            yield "power", name, f"{s:g}", float(np.mean(result.pvalue <= 0.05))


def draw(path: Path, figure_path: Path) -> None:
    """Draw the power curves of a results file."""
    from matplotlib.figure import Figure

    stored = json.loads(path.read_text(encoding="utf-8"))
    rows = [row for row in stored["table"] if row["case"] == "power"]
    figure = Figure(figsize=(7.0, 5.4), layout="constrained")
    ax = figure.subplots()
    for name, marker in zip(dict.fromkeys(row["filter"] for row in rows), "os^vDP*", strict=False):
        curve = [(float(row["metric"]), row["value"]) for row in rows if row["filter"] == name]
        ax.plot(*zip(*curve, strict=True), marker=marker, ms=4, lw=1.2, label=name)
    ax.axhline(0.05, color="0.6", lw=0.8, ls="--")
    ax.text(1.0, 0.055, "0.05", color="0.4", fontsize=8, ha="right", va="bottom")
    ax.set(xlabel="strength s of the alternative", ylabel="share of rejections at 0.05", xlim=(0, 1), ylim=(0, 1.02))
    part = stored["runs"] // 5
    ax.set_title(
        f"Power of the tests, d = 3, n = 20, {stored['runs']} samples; goodness of fit {part}, whole outliers",
        fontsize=9,
    )
    figure.legend(fontsize=7.5, frameon=False, ncols=2, loc="outside lower center")
    figure.savefig(figure_path, dpi=150)


def main() -> None:
    replicates = int(sys.argv[1]) if len(sys.argv) > 1 else 5000
    path = Path(sys.argv[2]) if len(sys.argv) > 2 else RESULTS
    table = []
    for part in (coverage, sizes, powers):
        for case, name, metric, value in part(replicates):
            print(f"{time.process_time():7.1f} s  {case:<18}{name:<40}{metric:<12}{value:.4f}", flush=True)
            row = {"case": case, "filter": name, "metric": metric, "value": round(float(value), 6), "stderr": None}
            table.append(row | {"paper": None})
    rows = ",\n".join(json.dumps(row, ensure_ascii=False) for row in table)
    head = f'{{"study": "inference", "runs": {replicates}, "seed": 0, "table": [\n'
    path.write_text(f"{head}{rows}\n]}}\n", encoding="utf-8")
    if path == RESULTS:
        draw(path, FIGURE)


if __name__ == "__main__":
    main()
