"""log F, gradient and Hessian: batches and single calls, beside the reference methods and PyRecEst's quadrature."""

from __future__ import annotations

import sys
from pathlib import Path

import bingham
import numba
import numpy as np
from bingham.distributions.normalizer import log_normalizer_derivatives

from timing import Row, best_of, best_once

TOPIC = "log F, gradient, Hessian (d = 4)"


def spectra(count: int, d: int = 4) -> np.ndarray:
    """Concentrations (count, d) from −0.1 to −10⁴, in ascending order with largest 0."""
    z = -np.sort(10.0 ** np.random.default_rng(1).uniform(-1.0, 4.0, (count, d)), axis=1)[:, ::-1]
    z[:, -1] = 0.0
    return np.ascontiguousarray(z)


def measure() -> list[Row]:
    """Return the rows of this topic."""
    from bingham.kernels.rows import derivatives_lanes

    n = 100_000
    z = spectra(n)
    out = (np.empty(n), np.empty((n, 4)), np.empty((n, 4, 4)))
    numba.set_num_threads(1)
    rows = [
        Row(
            TOPIC,
            "bingham, compiled batch",
            best_of(lambda: derivatives_lanes(z, *out), per=n),
            "distribution",
            True,
            1e-7,
        ),
        Row(
            TOPIC,
            "bingham, `log_normalizer_derivatives`",
            best_of(lambda: log_normalizer_derivatives(z), per=n),
            "distribution",
        ),
        Row(
            TOPIC,
            "bingham, `log_normalizer`, batch (no derivatives)",
            best_of(lambda: bingham.log_normalizer(z), per=n),
            "distribution",
        ),
    ]
    single = np.array([-900.0, -500.0, -3.0, 0.0])
    rows.append(
        Row(
            TOPIC,
            "bingham, one distribution from Python",
            best_of(lambda: log_normalizer_derivatives(single)),
            "distribution",
        )
    )
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "reference"))
    try:
        import oracles
    except ModuleNotFoundError:
        oracles = None
    if oracles is not None:
        for name, method in (
            ("Wood's integral (log F, gradient)", oracles.wood),
            ("series, Glover & Kaelbling eq. 8 (log F, gradient)", oracles.series),
            ("saddlepoint, Kume & Wood (log F, gradient; error to 5 %)", oracles.saddlepoint),
        ):
            rows.append(Row(TOPIC, name, best_of(lambda m=method: m(single), repeats=3), "distribution"))
    rows.append(Row(TOPIC, "PyRecEst 2.4.2 (F, gradient)", pyrecest(), "distribution"))
    return rows


def pyrecest() -> float:
    """Seconds of PyRecEst's F and gradient, each time for a new distribution."""
    from peers import pyrecest_distribution

    step = iter(range(1, 1000))

    def once() -> None:
        distribution = pyrecest_distribution([-900.0, -500.0, -3.0, 0.0], 1e-6 * next(step))
        _ = distribution.F, distribution.dF

    once()
    return best_once(once, repeats=5)
