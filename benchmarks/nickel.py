"""Mean orientations of grains over 14 scans of one nickel surface: ``python benchmarks/nickel.py [FILE.npz]``.

Do the means repeat within the deviations that each scan states by itself? χ² per degree of freedom of the means of a
grain about their average, with points taken for independent or linked (`mean_rotation`'s ``position``), and before and
after the rotation common to a scan, estimated from the other grains, is taken off. Writes the rows that
``docs/theory/inference.rst`` shows.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from bingham.distributions.crystal import misorientation, symmetry_group
from bingham.inference import mean_rotation
from bingham.rotations import compose
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "docs/studies/results/nickel.json"
GROUP = symmetry_group("432")
SCANS, SMALLEST = 14, 50


def between(a, b):
    """Return rotation vectors (..., 3), degrees, in the crystal's frame, of the smallest rotation from a to b."""
    e = compose(compose(a * [1, -1, -1, -1], b)[..., None, :], GROUP)
    e = np.take_along_axis(e, np.abs(e[..., 0]).argmax(axis=-1)[..., None, None], axis=-2)[..., 0, :]
    return np.degrees(2.0 * e[..., 1:] * np.sign(e[..., :1]))


def read(path: Path):
    """Return orientations (places, scans, 4), NaN where none was found, and positions (places, 2)."""
    data = np.load(path)
    places, row = np.unique(data["location"], return_inverse=True)
    good = data["is_rotation"]
    q = np.full((len(places), SCANS, 4), np.nan)
    found = data["quat"][good].astype(float)
    q[row[good], data["rep"][good] - 1] = found / np.linalg.norm(found, axis=1, keepdims=True)
    position = np.empty((len(places), 2))
    position[row] = np.column_stack([data["xpos"], data["ypos"]])
    return q, position


def grains(q, position):
    """Return places of each grain, the largest first: neighbours whose median records are within 2° of each other."""
    kept = np.flatnonzero(np.isfinite(q[..., 0]).sum(axis=1) >= SCANS // 2 + 1)
    middle = []
    for k in kept:
        own = q[k, np.isfinite(q[k, :, 0])]
        apart = np.linalg.norm(between(own[:, None], own[None]), axis=-1)
        middle.append(own[np.median(apart, axis=1).argmin()])
    middle = np.array(middle)
    pairs = cKDTree(position[kept]).query_pairs(0.25, output_type="ndarray")
    near = pairs[np.degrees(misorientation(middle[pairs[:, 0]], middle[pairs[:, 1]], "432").angle) < 2.0]
    graph = coo_matrix((np.ones(len(near)), near.T), shape=(len(kept), len(kept)))
    label = connected_components(graph, directed=False)[1]
    parts = [np.flatnonzero(label == k) for k in np.argsort(-np.bincount(label))]
    return [(kept[part], middle[part[len(part) // 2]]) for part in parts if len(part) >= SMALLEST]


def common(means, covariances, skip):
    """Return the rotation (scans, 3) that the other grains share in each scan, sample frame, and its covariance."""
    out, spread = np.zeros((SCANS, 3)), np.zeros((SCANS, 3, 3))
    for r in range(SCANS):
        others = [g for g in range(len(means)) if g != skip]
        precision = [np.linalg.inv(covariances[g][r]) for g in others]
        pull = sum(p @ (means[g][r] - means[g].mean(axis=0)) for p, g in zip(precision, others, strict=True))
        spread[r] = np.linalg.inv(sum(precision))
        out[r] = spread[r] @ pull
    return out, spread


def main() -> None:
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "../shared/data/nickel_ebsd/nickel.npz"
    q, position = read(path)
    parts = grains(q, position)
    means, plain, linked = [], [], []
    for places, middle in parts:
        to_sample = Rotation.from_quat(middle, scalar_first=True).as_matrix()
        found = []
        for r in range(SCANS):
            k = places[np.isfinite(q[places, r, 0])]
            found += [mean_rotation(q[k, r], group="432", position=p) for p in (None, position[k])]
        means.append(np.array([to_sample @ between(middle, f.mean) for f in found[::2]]))
        for out, some in ((plain, found[::2]), (linked, found[1::2])):
            out.append(np.array([f.covariance(frame="world") for f in some]) * np.degrees(1.0) ** 2)
    table = []
    inside = {}
    for g, (places, _) in enumerate(parts):
        row = {"points": len(places)}
        shared, spread = common(means, linked, g)
        for name, shift, covariance in (
            ("independent", 0.0, plain[g]), ("linked", 0.0, linked[g]),
            ("independent, common rotation off", shared, plain[g] + spread),
            ("linked, common rotation off", shared, linked[g] + spread),
        ):  # fmt: skip
            d = means[g] - shift
            d = d - d.mean(axis=0)
            square = np.einsum("ri,rij,rj->r", d, np.linalg.inv(covariance), d)
            row[name] = square.sum() / (3 * (SCANS - 1))
            inside.setdefault(name, []).append(square)
        row["repeat"] = np.sqrt(np.mean((means[g] - shared).var(axis=0, ddof=1)))
        row["stated"] = np.sqrt(np.mean(np.einsum("rii->ri", linked[g])))
        table += [
            {"case": "grains", "filter": f"grain {g + 1}", "metric": m, "value": float(v)} for m, v in row.items()
        ]
        print(f"grain {g + 1}", {m: round(float(v), 3) for m, v in row.items()})
    for name, squares in inside.items():
        share = float(np.mean(np.array(squares) <= 7.815))
        mean = float(np.mean(squares) * SCANS / (3 * (SCANS - 1)))
        print(f"{name}: χ²/dof {mean:.2f}, within the 95 % region {share:.3f}")
        for metric, value in (("square", mean), ("inside", share)):
            table.append({"case": "all", "filter": name.replace(",", ";"), "metric": metric, "value": value})
    rows = ",\n".join(json.dumps(row | {"stderr": None, "paper": None}, ensure_ascii=False) for row in table)
    RESULTS.write_text(f'{{"study": "nickel", "runs": {SCANS}, "seed": 0, "table": [\n{rows}\n]}}\n', encoding="utf-8")


if __name__ == "__main__":
    main()
