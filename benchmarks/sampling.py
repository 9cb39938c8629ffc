"""Exact samples a second."""

from __future__ import annotations

import numpy as np
from bingham import Bingham

from timing import Row, best_of, best_once

TOPIC = "samples at z = (−900, −500, −3, 0)"
Z = [-900.0, -500.0, -3.0, 0.0]


def measure() -> list[Row]:
    """Return the rows of this topic."""
    from peers import pyrecest_distribution

    p = Bingham(Z, np.eye(4)[:, ::-1])
    n, m = 1_000_000, 2_000
    ours = best_of(lambda: p.rvs(n, rng=1), per=n)
    peer = best_once(lambda: pyrecest_distribution(Z).sample(m), per=m)
    return [
        Row(TOPIC, "bingham, `rvs`, independent", ours, "sample", True, 1 / 3e6, f"{1e-6 / ours:.2f} million/s"),
        Row(
            TOPIC,
            "PyRecEst 2.4.2, Metropolis–Hastings",
            peer,
            "sample",
            note=f"{1e-3 / peer:.2f} thousand/s, correlated",
        ),
    ]
