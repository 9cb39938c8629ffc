"""Sequences of measurements that have no compiled loop, row by row through a filter's `predict` and `update`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.filters.sequence import sequence_steps
from bingham.filters.track import Track
from bingham.rotations import missing_rows

if TYPE_CHECKING:
    from bingham.filters.first_order import BinghamFilter

__all__ = ["run_rows"]

FloatArray = NDArray[np.float64]


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
    z, missing = _rows(measurements, "measurements")
    length, d = len(z), prior.dim
    if prior.shape:
        raise InvalidArgumentError(
            "prior", f"a single law, for {type(bingham_filter.sensor).__name__}", f"a batch {prior.shape}"
        )
    steps = sequence_steps(bingham_filter.motion, times, start_time, length)
    turns = None if controls is None else _rows(controls, "controls")[0]
    if turns is not None and len(turns) != length:
        raise InvalidArgumentError("controls", f"{length} rows, one for each measurement", len(turns))
    concentrations, frames = np.empty((length, d)), np.empty((length, d, d))
    evidence, statistic = np.zeros(length), np.full(length, np.nan)
    decision = np.full(length, -1, dtype=np.int8)
    state, threshold = prior, np.inf
    for t in range(length):
        try:
            state = bingham_filter.predict(
                state, None if turns is None else turns[t], None if times is None else float(steps[t])
            )
            if not missing[t]:
                state, info = bingham_filter.update(state, z[t])
                evidence[t], statistic[t], decision[t] = info.log_evidence, info.statistic, info.accepted
                threshold = info.threshold
        except InvalidArgumentError as error:
            error.add_note(f"in row {t} of the sequence")
            raise
        concentrations[t], frames[t] = state.z, state.M
    kept = slice(None) if keep == "all" else slice(-1, None)
    time = None if times is None else np.array(times, dtype=np.float64)[kept]
    return Track(
        time, concentrations[kept], frames[kept], evidence[kept], statistic[kept], decision[kept], threshold=threshold
    )


def _rows(x: ArrayLike | Rotation, name: str) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return rows (T, n) and which of them are NaN throughout."""
    a = x.as_quat(scalar_first=True) if isinstance(x, Rotation) else np.asarray(x, dtype=np.float64)
    if a.ndim != 2:
        raise InvalidArgumentError(
            name, "shape (T, n), one row for each step", a.shape, "run the recordings of a batch one by one"
        )
    return a, missing_rows(a, name)
