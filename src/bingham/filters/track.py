"""The result of filtering a sequence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.uncertainty import frame_required
from bingham.rotations import align_signs

__all__ = ["Track"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Track:
    """Filtered distributions over time; a leading batch axis B where several sequences were filtered at once.

    Attributes
    ----------
    time : (T,) ndarray or None
        Seconds, where times were given.
    concentrations : (T, d) ndarray
        z of each distribution, ascending.
    frames : (T, d, d) ndarray
        M of each distribution; column i is the axis of zᵢ.
    log_evidence : (T,) ndarray
        log f(zₜ | z₁ … zₜ₋₁); 0 where the measurement is missing.
    nis : (T,) ndarray
        NIS of each measurement; NaN where it is missing.
    decision : (T,) int8 ndarray
        1 accepted, 0 rejected by the gate, −1 missing.
    threshold : float
        What the gate allowed; infinite without one.
    """

    time: FloatArray | None
    concentrations: FloatArray
    frames: FloatArray
    log_evidence: FloatArray
    nis: FloatArray
    decision: NDArray[np.int8]
    threshold: float = np.inf

    def __len__(self) -> int:
        return self.concentrations.shape[-2]

    @property
    def distributions(self) -> Bingham:
        """All distributions as one batch (..., T)."""
        return Bingham.from_spectrum(self.concentrations, self.frames)

    @property
    def final(self) -> Bingham:
        """The last distribution; filtering on from it continues the track bit for bit."""
        return Bingham.from_spectrum(self.concentrations[..., -1, :].copy(), self.frames[..., -1, :, :].copy())

    @property
    def modes(self) -> FloatArray:
        """Most probable values (..., T, d), signs as the filter left them; see `aligned_modes`."""
        return np.ascontiguousarray(self.frames[..., -1])

    @property
    def aligned_modes(self) -> FloatArray:
        """Modes (T, d) with signs chosen so that neighbours agree."""
        return align_signs(self.modes)

    @property
    def matrices(self) -> FloatArray:
        """A = M diag(z) Mᵀ (..., T, d, d)."""
        return self.distributions.matrix

    @property
    def accepted(self) -> NDArray[np.bool_]:
        """Which measurements were used (..., T)."""
        return self.decision == 1

    @property
    def total_log_evidence(self) -> Any:
        """Log-probability density of all measurements (...): the sum of `log_evidence`."""
        return self.log_evidence.sum(axis=-1)

    def reasons(self) -> list[str]:
        """Why each measurement was not used; empty strings where it was (single sequences)."""
        words = {1: "", -1: "missing"}
        return [
            words.get(int(c), f"NIS {s:.4g} above {self.threshold:.4g}")
            for c, s in zip(self.decision, self.nis, strict=True)
        ]

    @frame_required
    def covariance(self, *, frame: Literal["body", "world"], undefined: Literal["raise", "nan"] = "nan") -> FloatArray:
        """Return 3×3 covariances (..., T, 3, 3), rad²; see `Bingham.covariance`.

        Where a distribution has no clear mode its covariance is NaN, unlike that of a single distribution: the first
        distributions of a track often have none. ``undefined="raise"`` rejects such tracks.
        """
        return self.distributions.covariance(frame=frame, undefined=undefined)
