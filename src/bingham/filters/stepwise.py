"""Sequences of measurements that have no compiled loop, row by row through a filter's `predict` and `update`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.filters.protocol import each_step
from bingham.filters.sequence import sequence_steps
from bingham.filters.track import Track
from bingham.validation import as_numbers, missing_rows

if TYPE_CHECKING:
    from bingham.filters.first_order import BinghamFilter

__all__ = ["run_rows"]


def run_rows(
    bingham_filter: BinghamFilter,
    prior: Bingham,
    measurements: ArrayLike | Rotation,
    controls: ArrayLike | Rotation | None,
    times: ArrayLike | None,
    start_time: float | None,
    keep: Literal["all", "last"],
) -> Track:
    """Body of `BinghamFilter.run` for sensors and motions without a compiled loop."""
    z = as_numbers(measurements, "measurements")
    if z.ndim != 2:
        raise InvalidArgumentError(
            "measurements", "shape (T, n), one row for each step", z.shape, "run the recordings of a batch one by one"
        )
    missing = missing_rows(z, "measurements")
    length, d = len(z), prior.dim
    if prior.shape:
        raise InvalidArgumentError(
            "prior", f"a single distribution, for {type(bingham_filter.sensor).__name__}", f"a batch {prior.shape}"
        )
    steps = sequence_steps(bingham_filter.motion, times, start_time, length)
    concentrations, frames = np.empty((length, d)), np.empty((length, d, d))
    evidence, nis = np.empty(length), np.empty(length)
    decision = np.empty(length, dtype=np.int8)
    threshold = np.inf
    results = each_step(bingham_filter, prior, z, controls, None if times is None else steps)
    for t, (state, info) in enumerate(results):
        concentrations[t], frames[t] = state.z, state.M
        evidence[t], nis[t], decision[t] = info.log_evidence, info.nis, info.accepted
        if missing[t]:
            decision[t] = -1
        else:
            threshold = info.threshold
    kept = slice(None) if keep == "all" else slice(-1, None)
    time = None if times is None else np.array(times, dtype=np.float64)[kept]
    return Track(
        time, concentrations[kept], frames[kept], evidence[kept], nis[kept], decision[kept], threshold=threshold
    )
