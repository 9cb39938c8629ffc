"""What the command line needs of a track, whichever filter made it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from bingham.distributions.bingham import Bingham
    from bingham.filters.imu_track import ImuTrack
    from bingham.filters.track import BinghamTrack

__all__ = ["Result", "of_imu_track", "of_track"]

FloatArray = NDArray[np.float64]

# Codes of magnetometer samples that an inertial filter rejected, not merely had no use for.
REJECTED = (2, 3, 4)
JUDGED = (1, *REJECTED)

# Beyond this share of a sensor's samples rejected, the sensor or its axes are in question.
DOUBTFUL_REJECTED = 0.5
CHECK = "disturbed field? Or check units, axes and handedness of gyroscope and magnetometer"


@dataclass(frozen=True, eq=False)
class Result:
    """A filtered recording.

    Parameters
    ----------
    distributions : Bingham
        Batch (T,).
    log_evidence : ndarray, shape (T,)
        Of the measurements of each sample.
    accepted, rejected : ndarray of bool, shape (T,)
        Whether measurements of a sample were used; whether the gate rejected one.
    reasons : list of str
        Why something was not used; empty where all was.
    covariance : callable
        From "body" or "world" to (T, 3, 3), rad², NaN where undefined; None for axes in the plane.
    more : mapping
        Further arrays for the npz file, the state to go on from among them.
    doubt : str
        What so many rejected samples of a sensor put in doubt; empty if there are few.
    """

    distributions: Bingham
    log_evidence: FloatArray
    accepted: NDArray[np.bool_]
    rejected: NDArray[np.bool_]
    reasons: list[str]
    covariance: Callable[[str], FloatArray] | None
    more: dict[str, Any]
    doubt: str = ""

    @property
    def modes(self) -> FloatArray:
        """Most probable values (T, d)."""
        return self.distributions.mode


def of_track(track: BinghamTrack) -> Result:
    """Return the result of a filter whose states are distributions."""
    state = getattr(track, "state", None)
    rest = {f.name: getattr(state, f.name) for f in fields(state)} if is_dataclass(state) else {}
    plain = {f"state_{k}": v for k, v in rest.items() if isinstance(v, (int, float, np.ndarray))}
    rotations = track.concentrations.shape[1] == 4
    return Result(
        distributions=track.distributions,
        log_evidence=track.log_evidence,
        accepted=track.accepted,
        rejected=(track.decision == 0).reshape(len(track), -1).any(axis=1),
        reasons=track.reasons(),
        covariance=(lambda frame: track.covariance(frame=frame)) if rotations else None,  # type: ignore[arg-type]
        more={
            "nis": track.nis,
            "decision": track.decision,
            "threshold": track.threshold,
            "state_z": track.final.z,
            "state_M": track.final.M,
            **plain,
        },
    )


def of_imu_track(track: ImuTrack) -> Result:
    """Return the result of the inertial filter with bias; "rejected" speaks of the magnetometer."""
    from bingham.filters.imu_track import MAGNETOMETER_CODES

    rejected = np.isin(track.magnetometer_code, REJECTED)

    share = rejected.sum() / max(int(np.isin(track.magnetometer_code, JUDGED).sum()), 1)
    doubt = f"{100 * share:.0f} % of the magnetometer's samples rejected: {CHECK}"

    def covariance(frame: str) -> FloatArray:
        return track.covariance(frame=frame)  # type: ignore[arg-type]

    return Result(
        distributions=track.distributions,
        log_evidence=track.log_evidence,
        accepted=~rejected,
        rejected=rejected,
        reasons=[MAGNETOMETER_CODES[c] if c in REJECTED else "" for c in track.magnetometer_code.tolist()],
        covariance=covariance,
        more={
            "rotation_covariance": track.rotation_covariance,
            "bias": track.bias,
            "bias_std": track.bias_std,
            "rest": track.rest,
            "magnetometer_code": track.magnetometer_code,
            "magnetometer_statistic": track.magnetometer_statistic,
            "state": track.final.to_json(),
        },
        doubt=doubt if share > DOUBTFUL_REJECTED else "",
    )
