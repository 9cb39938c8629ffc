"""Processor time until the first result, in new processes: with an empty cache of compiled code, then with a full one.

python benchmarks/first_use.py. The column "before" holds the figures of release 0.1.0 that the project set out from.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

FRAME = "import numpy as np; from bingham import Bingham; M = np.eye(4)[:, ::-1]; "
NOISE = "p = Bingham([-800.0, -600.0, -400.0, 0.0], M); s = Bingham([-120.0, -80.0, -50.0, 0.0], M); "
RUN = "from bingham import BinghamFilter; BinghamFilter(p, s).run(p, np.tile([1.0, 0.0, 0.0, 0.0], (1000, 1)))"
AXES = "x = np.random.default_rng(0).normal(size=(100, 4)); x /= np.linalg.norm(x, axis=1)[:, None]; "
SIMULATE = ["-m", "bingham", "simulate", "tumbling", "-o", "recording.npz"]
# Name, arguments of Python, seconds of 0.1.0, seconds asked for: cold, and on the wall when warm.
CASES: list[tuple[str, list[str], float | None, float | None, float | None]] = [
    ("bingham track", ["-m", "bingham", "track", "recording.npz", "-o", "out"], 45.0, 15.0, 3.0),
    (
        "BinghamFilter.run",
        ["-c", FRAME + NOISE + RUN],
        27.0,
        6.0,
        None,
    ),
    ("Bingham.fit", ["-c", FRAME + AXES + "Bingham.fit(x)"], 7.6, 2.0, None),
    ("Bingham(...).logpdf", ["-c", FRAME + NOISE + "p.logpdf([1.0, 0.0, 0.0, 0.0])"], 2.9, 0.8, None),
    ("bingham fit", ["-m", "bingham", "fit", "axes.csv"], None, None, 1.5),
    ("bingham --help", ["-m", "bingham", "--help"], None, None, 0.3),
]


def run(arguments: list[str], folder: str, cache: str) -> tuple[float, float]:
    """Return processor and wall time, s, of Python with these arguments, children included."""
    environment = os.environ | {"NUMBA_CACHE_DIR": cache, "MPLBACKEND": "Agg"}
    environment |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # as users have it: Python keeps its own compiled modules too
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), perf_counter()
    subprocess.run([sys.executable, *arguments], cwd=folder, env=environment, check=True, capture_output=True)
    wall, after = perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall


def text(value: float | None, limit: float | None = None) -> str:
    """Return seconds, with what was asked for."""
    if value is None:
        return ""
    return f"{value:.2f}" + ("" if limit is None else f" ({'held' if value <= limit else 'MISSED'}: {limit:g})")


def main() -> None:
    """Measure every case and print the table."""
    import numpy as np

    print("| first result | before, s | cold, processor s | warm, processor s | warm, wall s |\n|---|--:|--:|--:|--:|")
    for name, arguments, before, cold_limit, warm_limit in CASES:
        with tempfile.TemporaryDirectory() as folder:
            cache = str(Path(folder) / "cache")
            if "recording.npz" in arguments:
                run(SIMULATE, folder, str(Path(folder) / "other"))
            if "axes.csv" in arguments:
                x = np.random.default_rng(0).normal(size=(200, 3))
                x /= np.linalg.norm(x, axis=1)[:, None]
                np.savetxt(Path(folder) / "axes.csv", x, delimiter=",", header="x,y,z", comments="")
            cold, _ = run(arguments, folder, cache)
            warm = [run(arguments, folder, cache) for _ in range(3)]
        processor, wall = min(w[0] for w in warm), min(w[1] for w in warm)
        print(f"| {name} | {text(before)} | {text(cold, cold_limit)} | {text(processor)} | {text(wall, warm_limit)} |")


if __name__ == "__main__":
    main()
