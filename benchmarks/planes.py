"""Planes of depth images: `find_planes` against RANSAC and region growing, by plane-wise precision and recall.

Simulated rooms have labels; recorded images have none, so what is compared there is how much each method explains.
``python benchmarks/planes.py [ROOMS] [FOLDER]``
"""

from __future__ import annotations

import sys
import time
from collections import deque
from pathlib import Path

import numpy as np
from bingham.simulate.scene import random_room, render
from bingham.surfaces.extraction import find_planes
from bingham.surfaces.normals import back_project, organised_normals
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
# Both peers know the noise of a structured-light sensor, as a user would set it; shares are those of `find_planes`.
SHARE, TRIES, WITHIN, TURN = 0.01, 400, 3.0, np.cos(np.deg2rad(20.0))


def sigma(z: FloatArray) -> FloatArray:
    return 0.0012 + 0.0019 * (z - 0.4) ** 2


def ransac(points: FloatArray) -> IntArray:
    """Peel off the plane with most inliers, again and again."""
    rng, flat = np.random.default_rng(0), points.reshape(-1, 3)
    usable = np.isfinite(flat).all(axis=1) & (flat[:, 2] > 0.0)
    label, minimum = np.full(len(flat), -1), SHARE * usable.sum()
    for k in range(30):
        left = np.flatnonzero(usable & (label < 0))
        if len(left) < minimum:
            break
        some = rng.choice(left, min(4000, len(left)), replace=False)
        best: tuple[int, FloatArray] = (0, np.zeros(4))
        for _ in range(TRIES):
            a, b, c = flat[rng.choice(some, 3, replace=False)]
            n = np.cross(b - a, c - a)
            size = np.linalg.norm(n)
            if size > 1e-9:
                plane = np.append(n, n @ a) / size
                inside = np.abs(flat[some] @ plane[:3] - plane[3]) < WITHIN * sigma(flat[some, 2])
                if inside.sum() > best[0]:
                    best = int(inside.sum()), plane
        rows = left[np.abs(flat[left] @ best[1][:3] - best[1][3]) < WITHIN * sigma(flat[left, 2])]
        if len(rows) < minimum:
            break
        label[rows] = k
    return label.reshape(points.shape[:2])


def region_growing(points: FloatArray) -> IntArray:
    """Grow regions of pixels with like normals from the flattest ones on."""
    found = organised_normals(points, radius=3)
    h, w = points.shape[:2]
    label, k = np.full((h, w), -1), 0
    order = np.argsort(found.residual, axis=None)
    minimum = SHARE * np.isfinite(found.residual).sum()
    for seed in order:
        v, u = divmod(int(seed), w)
        if label[v, u] >= 0 or not np.isfinite(found.residual[v, u]):
            continue
        n, d = found.normals[v, u], found.normals[v, u] @ points[v, u]
        rows, todo = [(v, u)], deque([(v, u)])
        label[v, u] = k
        while todo:
            y, x = todo.popleft()
            for i, j in ((y + 1, x), (y - 1, x), (y, x + 1), (y, x - 1)):
                if 0 <= i < h and 0 <= j < w and label[i, j] == -1 and np.isfinite(found.residual[i, j]):
                    off = abs(points[i, j] @ n - d)
                    if found.normals[i, j] @ n > TURN and off < 2.0 * WITHIN * sigma(points[i, j, 2]):
                        label[i, j] = k
                        rows.append((i, j))
                        todo.append((i, j))
        if len(rows) < minimum:
            label[tuple(np.array(rows).T)] = -2
        else:
            k += 1
    return np.maximum(label, -1)


def overlaps(found: IntArray, truth: IntArray, seen: NDArray[np.bool_]) -> tuple[float, float]:
    """Precision and recall of planes by half their union."""
    real = [k for k in np.unique(truth[seen]) if k >= 0 and np.sum((truth == k) & seen) >= SHARE * seen.sum()]
    ours = [q for q in np.unique(found) if q >= 0]
    hits = np.array([[np.sum((truth == k) & (found == q) & seen) >= 0.5 * np.sum(((truth == k) | (found == q)) & seen)
                      for q in ours] for k in real])  # fmt: skip
    return float(hits.any(axis=0).mean()), float(hits.any(axis=1).mean())


METHODS = {"bingham": lambda p: find_planes(p, rng=0).label, "ransac": ransac, "region growing": region_growing}


def main(rooms: int, folder: Path) -> None:
    scores: dict[str, list[tuple[float, float, float]]] = {name: [] for name in METHODS}
    for seed in range(300, 300 + rooms):
        scene, camera = random_room(seed, width=320, height=240, focal=262.5)
        view = render(scene, camera, rng=seed)
        points = back_project(view.depth, *camera.intrinsics)
        for name, method in METHODS.items():
            start = time.process_time()
            label = method(points)
            scores[name].append((*overlaps(label, view.label, view.depth > 0.0), time.process_time() - start))
    print(f"{rooms} rooms: precision, recall, CPU s")
    for name, rows in scores.items():
        print(f"  {name:15s}", *(f"{x:.2f}" for x in np.mean(rows, axis=0)))
    for path in sorted(folder.glob("*.npz")):
        archive = np.load(path)
        if "xyz_mm" in archive:
            points = archive["xyz_mm"] * 1e-3
            points[points[..., 2] <= 0.0] = np.nan
        elif "depth_mm" in archive:
            f = [float(archive[key]) for key in ("fx", "fy", "cx", "cy")]
            points = back_project(archive["depth_mm"] * 1e-3, *f)[::2, ::2]
        else:
            continue
        seen = np.isfinite(points).all(axis=-1)
        print(f"{path.name}: planes, share of the points in them, rms distance, mm")
        labels = {name: method(points) for name, method in METHODS.items()}
        for name, label in labels.items():
            off = []
            for q in np.unique(label[label >= 0]):
                p = points[label == q]
                rays = p / p[:, 2:]
                theta = np.linalg.lstsq(rays, 1.0 / p[:, 2], rcond=None)[0]
                off.append((p @ theta - 1.0) / np.linalg.norm(theta))
            rms = 1e3 * float(np.sqrt(np.mean(np.concatenate(off) ** 2))) if off else np.nan
            agree = overlaps(label, labels["bingham"], seen) if name != "bingham" else (1.0, 1.0)
            share = (label[seen] >= 0).mean()
            same = " ".join(f"{x:.2f}" for x in agree)
            print(f"  {name:15s} {len(off):2d} {share:.2f} {rms:6.1f}   agrees with bingham {same}")


if __name__ == "__main__":
    arguments = [*sys.argv[1:], *("8", "../shared/data/planes")[len(sys.argv) - 1 :]]
    main(int(arguments[0]), Path(arguments[1]))
