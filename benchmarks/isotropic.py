"""The isotropic fit beside the general one, on the same samples: one call each, and whole batches."""

from __future__ import annotations

import bingham
import numpy as np
from bingham.distributions.isotropic import fit_isotropic

from timing import Row, best_of

TOPIC = "isotropic fit, beside the general one on the same samples"
# Samples in a call, and axes in a sample.
CALLS = [(1, 10), (1, 1000), (1, 100_000), (1000, 10), (1000, 100), (100, 1000)]
ASKED = 20.0


def measure() -> list[Row]:
    """Return the rows of this topic; how many times longer the general fit takes is in the notes."""
    rows = []
    for d in (2, 3, 4):
        for m, n in CALLS:
            what = f"d = {d}, {f'{m} samples of {n} axes in a batch' if m > 1 else f'one sample of {n} axes'}"
            x = bingham.Bingham([*[-30.0] * (d - 1), 0.0], np.eye(d)).rvs(m * n, rng=1).reshape(m, n, d)
            x = x if m > 1 else x[0]
            isotropic = best_of(lambda x=x: fit_isotropic(x), per=m)
            general = best_of(lambda x=x: bingham.Bingham.fit(x), per=m)
            # The project asks it of single calls.
            limit = general / ASKED if m == 1 else None
            note = f"`Bingham.fit` {general * 1e6:.1f} µs, {general / isotropic:.3g} times as long"
            rows.append(Row(TOPIC, what, isotropic, "fit", True, limit, note))
    return rows
