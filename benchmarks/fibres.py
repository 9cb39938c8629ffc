"""Lobes of fibre orientation distributions, dipy's numbers beside exact ones: ``python benchmarks/fibres.py [FILE]``.

dipy sums a lobe over the vertices of a subdivided icosahedron, each for the same area; the exact integral is f₀ F(z).
The lobe is turned at random, as its sum depends on where it points. Needs dipy, which the package itself never does.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from bingham.distributions.fibre import FibreLobe
from dipy.data import get_sphere
from dipy.reconst.bingham import bingham_fiber_density, k2odi, sf_to_bingham
from scipy.spatial.transform import Rotation

RESULTS = Path(__file__).resolve().parents[1] / "docs/studies/results/fibres.json"
LOBES = ((30.0, 10.0), (15.0, 4.0), (100.0, 20.0), (300.0, 100.0), (5.0, 1.0))
TURNS = 100


def main() -> None:
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else RESULTS
    frames = Rotation.random(TURNS, rng=0).as_matrix()
    sphere = get_sphere(name="repulsion724").subdivide(n=1)
    table = []
    for steep, flat in LOBES:
        name = f"k = ({steep:g}; {flat:g})"
        lobe = FibreLobe(1.0, steep, flat)
        # dipy's rows: f0, the smaller k and the larger one, peak and the axes of both.
        rows = np.zeros((TURNS, 1, 12))
        rows[:, 0, :3] = 1.0, flat, steep
        rows[:, 0, 3:] = np.concatenate([frames[:, :, 2], frames[:, :, 1], frames[:, :, 0]], axis=1)
        exact = float(lobe.fibre_density)
        values = {"exact": exact, "total dispersion": float(lobe.dispersion.total)}
        for subdivide in (3, 5):
            found = bingham_fiber_density(rows, subdivide=subdivide)[:, 0] / exact - 1.0
            values |= {f"dipy {subdivide} least": found.min(), f"dipy {subdivide} most": found.max()}
        values["dipy total dispersion"] = float(k2odi(np.array([np.sqrt(steep * flat)]))[0])
        # What dipy finds from the lobe's values on a sphere of 2889 directions.
        across = sphere.vertices @ frames[0]
        density = np.exp(-steep * across[:, 0] ** 2 - flat * across[:, 1] ** 2)
        fitted = sf_to_bingham(density[None], sphere, max_search_angle=45.0, npeaks=1)
        k = fitted.model_params[0, 0, 1:3]
        values |= {"dipy fit steep": k.max(), "dipy fit flat": k.min()}
        for metric, value in values.items():
            print(f"{name:<20}{metric:<24}{float(value):.5f}")
            row = {"case": "fibres", "filter": name, "metric": metric, "value": round(float(value), 6)}
            table.append(row | {"stderr": None, "paper": None})
    rows = ",\n".join(json.dumps(row, ensure_ascii=False) for row in table)
    path.write_text(f'{{"study": "fibres", "runs": {TURNS}, "seed": 0, "table": [\n{rows}\n]}}\n', encoding="utf-8")


if __name__ == "__main__":
    main()
