"""An hour at 200 Hz, nine columns of text (64 MB): reading beside pandas, and all that `bingham track` does with it."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import numpy as np
import pandas as pd
from bingham.io import read_recording

from timing import Row

TOPIC = "an hour at 200 Hz as CSV, 64 MB"
ROWS = 720_000
REPEATS = 9  # in turns, so that both have the same minutes of the machine


def write(path: Path) -> None:
    """Write a body that swings, with the noise of a good sensor."""
    rng = np.random.default_rng(0)
    t = np.arange(ROWS) / 200.0
    angle = 0.8 * np.sin(0.7 * t)
    columns = {"t": t, "gx": 0.56 * np.cos(0.7 * t)}
    zero = np.zeros(ROWS)
    columns |= {"gy": zero, "gz": zero, "ax": zero, "ay": 9.81 * np.sin(angle), "az": 9.81 * np.cos(angle)}
    columns |= {"mx": zero, "my": 20.0 * np.cos(angle) - 40.0 * np.sin(angle)}
    columns |= {"mz": -20.0 * np.sin(angle) - 40.0 * np.cos(angle)}
    for name, scale in (("g", 0.002), ("a", 0.03), ("m", 0.3)):
        for axis in "xyz":
            columns[name + axis] = columns[name + axis] + scale * rng.standard_normal(ROWS)
    pd.DataFrame(columns).to_csv(path, index=False, float_format="%.5f")


def in_turns(path: Path) -> tuple[float, float]:
    """Return seconds on the wall of this package and of pandas, the median of each after a first call."""
    read_recording(path)
    pd.read_csv(path)
    took: dict[str, list[float]] = {"bingham": [], "pandas": []}
    for _ in range(REPEATS):
        for name, read in (("bingham", read_recording), ("pandas", pd.read_csv)):
            start = perf_counter()
            read(path)
            took[name].append(perf_counter() - start)
    return float(np.median(took["bingham"])), float(np.median(took["pandas"]))


def tracked(path: Path, *options: str) -> tuple[float, float]:
    """Return seconds of the processor and the largest memory, MB, of `bingham track` in a process of its own."""
    command = [sys.executable, "-m", "bingham", "track", str(path), "-o", str(path.parent / "out"), *options]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0


def measure() -> list[Row]:
    """Return the rows of this topic: reading on the wall, the command's time of the processor."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "hour.csv"
        write(path)
        # In a process of its own, as for who reads a file: other topics leave a million objects to the collector.
        told = subprocess.run([sys.executable, __file__, path], capture_output=True, text=True, check=True).stdout
        ours, pandas = map(float, told.split())
        rows = [
            Row(TOPIC, "bingham, `read_recording`", ours, "file", True, 1.5 * pandas, "on the wall, median"),
            Row(TOPIC, f"pandas {pd.__version__}, `read_csv`", pandas, "file", note="in turns with it"),
        ]
        tracked(path)  # compiles
        for what, options, limit in (("", (), 8.0), (" --no-csv --no-figure", ("--no-csv", "--no-figure"), 3.0)):
            seconds, memory = min(tracked(path, *options) for _ in range(3))
            rows.append(Row(TOPIC, f"`bingham track{what}`", seconds, "file", limit=limit, note=f"{memory:.0f} MB"))
    return rows


if __name__ == "__main__":
    print(*in_turns(Path(sys.argv[1])))
