"""Published and independent values beside what the library gives: ``python benchmarks/published.py [FOLDER]``.

FOLDER holds the samples of axes (by default ``../shared/data/axial`` beside the project). Writes the rows that
``docs/theory/inference.rst`` shows.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from bingham import Bingham, concentrations, log_normalizer
from bingham.distributions.fibre import FibreLobe
from bingham.distributions.matrix_fisher import MatrixFisher
from bingham.distributions.sibling import select
from bingham.geology import fabric
from bingham.inference import confidence_ellipse, symmetry_test, uniformity_test

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "docs/studies/results/published.json"


def read(path: Path) -> np.ndarray:
    lines = [line.split(",") for line in path.read_text().splitlines() if not line.startswith("#")]
    columns = [lines[0].index(name) for name in "ned"]
    x = np.array([[float(line[c]) for c in columns] for line in lines[1:]])
    return x / np.linalg.norm(x, axis=1, keepdims=True)


def values(folder: Path) -> Iterator[tuple[str, float, float, float]]:
    """Yield what, the published value, its tolerance (half its last digit) and ours."""
    x = read(folder / "quetico_lineations.csv")
    result = fabric(x)
    for k, published in enumerate((0.89045, 0.06737, 0.04218)):
        yield f"Quetico lineations: eigenvalue {k + 1}", published, 5e-6, result.eigenvalues[k]
    yield "Quetico lineations: Woodcock's K", 5.515, 5e-4, result.K
    yield "Quetico lineations: Woodcock's C", 3.050, 5e-4, result.C
    yield "Quetico lineations: plunge of the mean axis, °", 14.8, 0.05, result.mean_axis[1]
    yield "Quetico lineations: trend of the mean axis, °", 69.1, 0.05, result.mean_axis[0]
    symmetry = symmetry_test(x)
    yield "Quetico lineations: symmetry statistic", 3.549, 5e-4, symmetry.statistic
    yield "Quetico lineations: its p", 0.170, 5e-4, symmetry.pvalue
    found = {f.name: f for f in select(x, ["watson", "bingham"]).ranking}
    yield "Quetico lineations: Watson's κ", 9.81189, 5e-6, found["watson"].distribution.kappa
    gain = 2.0 * (found["bingham"].log_likelihood - found["watson"].log_likelihood)
    yield "Quetico lineations: likelihood ratio; Bingham to Watson", 4.493, 5e-4, gain
    kamb = symmetry_test(read(folder / "kamb1959_fig7.csv"))
    yield "Kamb (1959): symmetry statistic", 6.78, 5e-3, kamb.statistic
    yield "Kamb (1959): its p", 0.034, 5e-4, kamb.pvalue
    yield "Gray (1980): Woodcock's K", 0.0092, 5e-5, fabric(read(folder / "gray1980_poles.csv")).K
    semi = np.degrees(confidence_ellipse(read(folder / "pmagpy_gobing.csv"), method="chi2").semi_axes)
    yield "PmagPy's sample: smaller semi-axis by χ², °", 3.42, 5e-3, semi[0]
    yield "PmagPy's sample: larger semi-axis by χ², °", 4.04, 5e-3, semi[1]
    table = np.loadtxt(folder / "mardia_zemroch_table.csv", delimiter=",", skiprows=1)
    table = table[table[:, 4] <= 2e-4]
    z = concentrations(np.column_stack([table[:, :2], 1 - table[:, :2].sum(axis=1)]))
    near = np.abs(z[:, :2] - z[:, 2:] - table[:, 2:4]) <= 0.005 + 5e-4 * np.abs(table[:, 2:4])
    yield "Mardia & Zemroch: share of 203 rows within 0.005 + 0.05 %", 1.0, 0.01, np.all(near, axis=1).mean()
    p = MatrixFisher(np.diag([25.0, 5.0, 1.0]))
    yield "matrix Fisher; s = (25; 5; 1): log c", 25.195066286054, 1e-12, float(p.log_normalizer)
    for k, published in enumerate((0.963744, 0.895432, 0.892817)):
        yield f"matrix Fisher: singular value {k + 1} of E[R]", published, 5e-7, np.linalg.svd(p.mean())[1][k]
    for steep, flat, published in ((30.0, 10.0, 0.37665), (15.0, 4.0, 0.90674)):
        density = FibreLobe(1.0, steep, flat).fibre_density
        yield f"fibre density of k = ({steep:g}; {flat:g})", published, 5e-6, density
    uniform = Bingham.uniform(3).rvs((20_000, 20), rng=1)
    yield "mean of S of uniform axes; d = 3", 5.0, 0.1, float(np.mean(uniformity_test(uniform).statistic))


def speeds() -> Iterator[tuple[str, float, float]]:
    """Yield what, the time asked for and ours: the best of several in seconds of process time."""

    def best(call, count: int) -> float:
        call()
        times = []
        for _ in range(7):
            start = time.process_time()
            call()
            times.append(time.process_time() - start)
        return min(times) / count

    w = np.random.default_rng(0).dirichlet([1.0, 2.0, 5.0], 100_000)
    z = concentrations(w)
    x = Bingham([-20.0, -9.0, 0.0], np.eye(3)).rvs(1000, rng=0)
    yield "log F; d = 3; µs", 0.12, 1e6 * best(lambda: log_normalizer(z), len(z))
    yield "moments to concentrations; d = 3; µs", 0.5, 1e6 * best(lambda: concentrations(w), len(w))
    yield "all siblings of 1000 axes compared; ms", 50.0, 1e3 * best(lambda: select(x), 1)


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "../shared/data/axial"
    table = []
    for name, published, tolerance, found in values(folder):
        held = abs(float(found) - published) <= tolerance * (1.0 + 1e-9)
        print(f"{'holds' if held else 'DIFFERS':<9}{name:<62}{published:<18.14g}{float(found):.14g}")
        for metric, value in (("published", published), ("found", float(found)), ("held", float(held))):
            table.append({"case": "published", "filter": name, "metric": metric, "value": value})
    for name, asked, found in speeds():
        print(f"{'holds' if found <= asked else 'SLOWER':<9}{name:<62}{asked:<18g}{found:.3g}")
    rows = ",\n".join(json.dumps(row | {"stderr": None, "paper": None}, ensure_ascii=False) for row in table)
    RESULTS.write_text(f'{{"study": "published", "runs": 1, "seed": 1, "table": [\n{rows}\n]}}\n', encoding="utf-8")


if __name__ == "__main__":
    main()
