"""Time of a plain import, in a new process."""

from __future__ import annotations

import subprocess
import sys

from timing import Row

TOPIC = "import"
CODE = "import time; t = time.perf_counter(); import {}; print(time.perf_counter() - t)"


def measure() -> list[Row]:
    """Return the rows of this topic."""
    return [
        Row(TOPIC, "bingham", fastest("bingham"), "import", True, 0.5),
        Row(
            TOPIC,
            "bingham, with a first normaliser (from the disk cache)",
            fastest("bingham; bingham.moments([0.0, 0.0])"),
            "import",
        ),
        Row(TOPIC, "PyRecEst 2.4.2 with its Bingham filter", fastest("pyrecest.filters.bingham_filter"), "import"),
        Row(TOPIC, "numpy", fastest("numpy"), "import"),
    ]


def fastest(what: str, repeats: int = 3) -> float:
    """Return the seconds of the fastest of several imports."""
    command = [sys.executable, "-c", CODE.format(what)]
    times = [subprocess.run(command, capture_output=True, text=True, check=True).stdout for _ in range(repeats)]
    return min(float(text.split()[-1]) for text in times)
