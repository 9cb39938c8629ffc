"""Published samples of axes, where they lie beside the project."""

from pathlib import Path

import numpy as np
import pytest

AXIAL = Path(__file__).resolve().parents[2] / "../shared/data/axial"


@pytest.fixture
def published():
    """Read the unit vectors n, e, d of a published sample by its name."""

    def read(name):
        if not AXIAL.is_dir():
            pytest.skip("no samples of axes beside the project")
        lines = [line for line in (AXIAL / f"{name}.csv").read_text().splitlines() if not line.startswith("#")]
        names = lines[0].split(",")
        x = np.array([[float(line.split(",")[names.index(c)]) for c in "ned"] for line in lines[1:]])
        return x / np.linalg.norm(x, axis=1, keepdims=True)

    return read
