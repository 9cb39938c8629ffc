"""What became of orientations measured beside a gyroscope."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bingham.errors import RecordingWarning
from bingham.kernels.imu_orientation import ORIENTATION_LIMIT, ORIENTATION_REJECTED, ORIENTATION_USED

__all__ = ["ORIENTATION_CODES", "OrientationLog"]

ORIENTATION_CODES = {
    0: "before the filter's start",
    1: "used",
    2: "contradicted by the estimate",
    3: "waits for the gyroscope",
}
# More than this share of the orientations rejected says that something else is wrong; of fewer nothing is said.
MOST, FEW = 0.5, 3
HINT = (
    "is their covariance too small, are camera and sensor rotated against each other, are the worlds different, is a "
    "clock shifted? bingham.filters.align_orientations finds constant rotations"
)


@dataclass(frozen=True, eq=False)
class OrientationLog:
    """Decisions about orientations, one for each (M,).

    Attributes
    ----------
    time : (M,) ndarray
        Seconds.
    code : (M,) int8 ndarray
        1 used, 2 rejected, 3 waiting at the end, 0 before the start; `reasons` has the words.
    nis : (M,) ndarray
        Normalised innovation squared, three degrees of freedom; NaN where it was not looked at.
    log_evidence : (M,) ndarray
        Log-density of the measurement, given all before; NaN where it was not looked at.
    """

    time: NDArray[np.float64]
    code: NDArray[np.int8]
    nis: NDArray[np.float64]
    log_evidence: NDArray[np.float64]

    @classmethod
    def of(cls, seen: NDArray[Any]) -> OrientationLog:
        """Return the log in records of ``kernels.imu_loop.SEEN``."""
        return cls(seen["time"].copy(), seen["code"].astype(np.int8), seen["nis"].copy(), seen["evidence"].copy())

    def __len__(self) -> int:
        return len(self.time)

    @property
    def used(self) -> NDArray[np.bool_]:
        """Orientations that were used (M,)."""
        return self.code == ORIENTATION_USED

    @property
    def rejected(self) -> NDArray[np.bool_]:
        """Orientations that the estimate could not explain (M,)."""
        return self.code == ORIENTATION_REJECTED

    def reasons(self) -> list[str]:
        """What became of each, in words."""
        return [
            f"NIS {nis:.4g} above {ORIENTATION_LIMIT:.4g}" if code == ORIENTATION_REJECTED else ORIENTATION_CODES[code]
            for code, nis in zip(self.code.tolist(), self.nis.tolist(), strict=True)
        ]

    def warn(self, name: str) -> None:
        """Say so where most were rejected, or all came too early or too late to be used."""
        rejected, used = int(self.rejected.sum()), int(self.used.sum())
        if rejected + used >= FEW and rejected > MOST * (rejected + used):
            first = self.time[np.argmax(self.rejected)]
            told = f"{rejected} of {rejected + used} orientations rejected, the first at {first:.6g} s: {HINT}"
            warnings.warn(f"{name}: {told}", RecordingWarning, stacklevel=5)
