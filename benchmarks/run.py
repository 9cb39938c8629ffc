"""Run the benchmarks, print the table and write it to RESULTS.md: python benchmarks/run.py [TOPIC ...] [--dry-run]."""

from __future__ import annotations

import datetime
import os
import platform
import sys
from importlib import import_module, metadata
from itertools import groupby
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

from timing import Row  # noqa: E402

TOPICS = [
    "normalizer",
    "moments",
    "isotropic",
    "steps",
    "sampling",
    "mixtures",
    "imu",
    "reading",
    "learning",
    "imports",
]
RESULTS = Path(__file__).parent / "RESULTS.md"
HEADER = "| what | time | per | ratio | asked | note |\n|---|--:|---|--:|--:|---|\n"


def quantity(seconds: float) -> str:
    """Return a time with three digits and a unit."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"


def table(rows: list[Row]) -> str:
    """Return the rows as Markdown, a table a topic; the ratio is to this package's first row of the topic."""
    parts = []
    for topic, group in groupby(rows, key=lambda row: row.topic):
        members = list(group)
        base = next(row.seconds for row in members if row.ours)
        lines = []
        for row in members:
            ratio = row.seconds / base
            asked = (
                "" if row.limit is None else f"{quantity(row.limit)} {'held' if row.seconds <= row.limit else 'MISSED'}"
            )
            text = "1" if row.ours else f"{ratio:,.0f}".replace(",", " ") if ratio >= 100 else f"{ratio:.3g}"
            lines.append(f"| {row.what} | {quantity(row.seconds)} | {row.unit} | {text} | {asked} | {row.note} |\n")
        parts.append(f"\n## {topic}\n\n{HEADER}{''.join(lines)}")
    return "".join(parts)


def machine() -> str:
    """Return the processor, the system and the versions that matter."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        cpu = next(
            (s.split(":", 1)[1].strip() for s in info.read_text().splitlines() if s.startswith("model name")), cpu
        )
    packages = ", ".join(f"{p} {metadata.version(p)}" for p in ("numpy", "scipy", "numba", "filterpy", "vqf", "ahrs"))
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{cpu}, {os.cpu_count()} cores{load}; {platform.system()}, Python {platform.python_version()}, {packages}"


def main(arguments: list[str]) -> None:
    """Measure the topics named, all by default."""
    dry = "--dry-run" in arguments
    topics = [a for a in arguments if not a.startswith("-")] or TOPICS
    rows: list[Row] = []
    for topic in topics:
        part = import_module(topic).measure()
        rows += part
        print(table(part), flush=True)
    if dry or topics != TOPICS:
        return
    RESULTS.write_text(
        "# Benchmarks\n\n"
        f"Made by `make bench` on {datetime.datetime.now(datetime.UTC):%Y-%m-%d %H:%M} UTC on {machine()}.\n\n"
        "Every row is the best of several repeats in one run: processor time of one thread, or, where threads are "
        "compared and for imports, time on the wall. The ratio is to the "
        "first row of its table: above 1 is slower than this package. The column “asked” is what the project asks of "
        f"itself on a machine like this.\n{table(rows)}",
        encoding="utf-8",
    )
    print(f"written to {RESULTS.relative_to(Path.cwd()) if RESULTS.is_relative_to(Path.cwd()) else RESULTS}")


if __name__ == "__main__":
    main(sys.argv[1:])
