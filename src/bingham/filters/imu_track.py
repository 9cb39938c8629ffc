"""What the inertial filter says about a recording."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.uncertainty import frame_required
from bingham.errors import InvalidArgumentError
from bingham.filters.tangent import distribution_of_covariance
from bingham.filters.track import TrackMethods
from bingham.rotations import rotate

if TYPE_CHECKING:
    from bingham.filters.imu_state import ImuState
    from bingham.filters.orientation_log import OrientationLog

__all__ = ["MAGNETOMETER_CODES", "UNIFORM_INCLINATION", "UNIFORM_VARIANCE", "ImuTrack", "bounded"]

FloatArray = NDArray[np.float64]

MAGNETOMETER_CODES = {
    0: "no sample",
    1: "used",
    2: "field strength unlike the expected",
    3: "field dip unlike the expected",
    4: "heading contradicted by the estimate",
    5: "repeats the sample before",
    6: "waits for the next update",
    7: "before the first accelerometer sample",
    8: "unlike any field",
}

# Variance of an angle that is uniform on the circle, rad².
UNIFORM_VARIANCE = np.pi**2 / 3.0
# Mean square, rad², of the angle between the vertical and its estimate where nothing is known: ∫ θ² sin θ dθ/2.
UNIFORM_INCLINATION = (np.pi**2 - 4.0) / 2.0


def bounded(c: FloatArray) -> FloatArray:
    """Return covariances (..., 3, 3) with every angle's variance at most that of an angle uniform on the circle."""
    variances = np.diagonal(c, axis1=-2, axis2=-1)
    shrink = np.sqrt(np.minimum(1.0, UNIFORM_VARIANCE / np.maximum(variances, 1e-300)))
    return c * shrink[..., :, None] * shrink[..., None, :]


@dataclass(frozen=True, eq=False, repr=False)
class ImuTrack(TrackMethods):
    """Estimates for every gyroscope sample of a recording.

    Attributes
    ----------
    time : (N,) ndarray
        Seconds.
    modes : (N, 4) ndarray
        Most probable orientation (w, x, y, z), body to world (east, north, up); NaN before the first accelerometer
        sample.
    rotation_covariance : (N, 3, 3) ndarray
        World axes, rad²: the covariance of the rotation error with no bound, as the distributions are made of it; an
        unknown heading has a variance of 20 rad² or more. To read, ``covariance(frame=...)`` is its bounded form. NaN
        before the first accelerometer sample, like `modes`.
    bias, bias_std : (N, 3) ndarray
        Gyroscope bias and its standard deviations, rad/s, body axes.
    rest : (N,) ndarray of bool
        Whether the body was found at rest.
    log_evidence : (N,) ndarray
        Log-density of what each update used, given the past; 0 between updates.
    magnetometer_code : (N,) int8 ndarray
        What became of each magnetometer sample, see `reasons`.
    magnetometer_statistic : (N,) ndarray
        For code 4 the squared heading residual over its variance; otherwise the heading error to be feared from the
        visible disturbance of the field, in units of the magnetometer's own error; NaN without a sample.
    final : ImuState
        State after the last sample, to continue from.
    smoothed : bool
        Whether the estimates use the whole recording.
    prior : Bingham, optional
        Distribution of the orientation before the first accelerometer sample; uniform unless given.
    relative_heading_std : (N,) ndarray
        Standard deviation of `relative_heading`, rad; NaN as soon as something has shown the heading itself.
    orientations : OrientationLog, optional
        What became of the orientations measured beside the gyroscope.
    """

    PER_ROW: ClassVar[tuple[str, ...]] = (
        "time", "modes", "rotation_covariance", "bias", "bias_std", "rest", "log_evidence", "magnetometer_code",
        "magnetometer_statistic", "relative_heading_std",
    )  # fmt: skip

    time: FloatArray
    modes: FloatArray
    rotation_covariance: FloatArray
    bias: FloatArray
    bias_std: FloatArray
    rest: NDArray[np.bool_]
    log_evidence: FloatArray
    magnetometer_code: NDArray[np.int8]
    magnetometer_statistic: FloatArray
    final: ImuState
    smoothed: bool = False
    prior: Bingham | None = None
    relative_heading_std: FloatArray = field(default_factory=lambda: np.empty(0))
    orientations: OrientationLog | None = None

    @property
    def relative_heading(self) -> FloatArray:
        """Heading (N,) since the start, rad, −π to π; 0 at the start unless a prior says otherwise; NaN as `modes`.

        The angle about the vertical that takes the world to the orientation, the rest being a rotation about a
        horizontal axis. With `relative_heading_std` this is what a sensor without magnetometer knows of its heading.
        """
        angle = 2.0 * np.arctan2(self.modes[:, 3], self.modes[:, 0])
        return angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return `Track.columns` and, where it is known, the heading since the start."""
        out = super().columns()
        if np.isfinite(self.relative_heading_std).any():
            out |= {"relative_heading": self.relative_heading, "relative_heading_std": self.relative_heading_std}
        return out

    @property
    def decision(self) -> NDArray[np.int8]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """What became of the magnetometer's samples (N,): 1 used, 0 rejected, −1 none or not looked at."""
        return np.select([self.magnetometer_code == 1, np.isin(self.magnetometer_code, (2, 3, 4))], [1, 0], -1).astype(
            np.int8
        )

    def _decided(self) -> str:
        # What each sensor is called: samples without a magnetometer's are no samples missing.
        told: list[str] = []
        if not self.missing.all():
            told.append(f"magnetometer {super()._decided()}")
        if self.orientations is not None:
            used, rejected = int(self.orientations.used.sum()), int(self.orientations.rejected.sum())
            told.append(f"{used} orientations used, {rejected} rejected")
        return "; ".join(told) or "no magnetometer"

    @property
    def nis(self) -> FloatArray:  # pyright: ignore[reportIncompatibleVariableOverride]
        """`magnetometer_statistic` (N,)."""
        return self.magnetometer_statistic

    @property
    def distributions(self) -> Bingham:
        """Distribution of every orientation, a batch (N,): narrow, a girdle (heading unknown) or anything between.

        Before the first accelerometer sample it is the prior.
        """
        known = np.isfinite(self.modes[:, 0])
        found = distribution_of_covariance(self.modes[known], self.rotation_covariance[known])
        if known.all():
            return found
        before = Bingham.uniform(4) if self.prior is None else self.prior
        z, frames = np.tile(before.z, (len(self), 1)), np.tile(before.M, (len(self), 1, 1))
        z[known], frames[known] = found.z, found.M
        return Bingham.from_spectrum(z, frames)

    @property
    def matrices(self) -> FloatArray:
        """A = M diag(z) Mᵀ (N, 4, 4) of `distributions`."""
        return self.distributions.matrix

    @property
    def concentrations(self) -> FloatArray:
        """Z (N, 4) of `distributions`, ascending."""
        return self.distributions.z

    @property
    def heading_std(self) -> FloatArray:
        """Standard deviation of the heading (N,), rad; π/√3 at most, which is an unknown heading."""
        return np.sqrt(np.minimum(self.rotation_covariance[:, 2, 2], UNIFORM_VARIANCE))

    def heading_credible_angle(self, p: float) -> FloatArray:
        """Return α (N,) with P(|heading error| ≤ α) = p, rad: the heading wraps around, α ≤ p π; NaN as `modes`."""
        from scipy.special import ndtr

        if not 0.0 < p < 1.0:
            raise InvalidArgumentError("p", "a probability between 0 and 1", p)
        sigma = np.sqrt(self.rotation_covariance[:, 2, 2])
        low, high = np.zeros_like(sigma), np.full_like(sigma, np.pi)
        # Beyond 4 rad the wrapped normal distribution is uniform within e^{-8}.
        turns = 2.0 * np.pi * np.arange(-3, 4)[:, None]
        for _ in range(50):
            middle = 0.5 * (low + high)
            narrow = np.sum(ndtr((turns + middle) / sigma) - ndtr((turns - middle) / sigma), axis=0)
            below = np.where(sigma < 4.0, narrow, middle / np.pi) < p
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return np.where(np.isnan(sigma), np.nan, high)

    @property
    def inclination_std(self) -> FloatArray:
        """Root mean square (N,), rad, of the inclination error: the angle between the vertical and its estimate."""
        c = self.rotation_covariance
        return np.sqrt(np.minimum(c[:, 0, 0] + c[:, 1, 1], UNIFORM_INCLINATION))

    @frame_required
    def covariance(self, *, frame: Literal["body", "world"]) -> FloatArray:
        """Return 3×3 covariances (N, 3, 3) of the rotation error, rad², in body or world (ENU) axes.

        An unknown angle has the variance π²/3 of one uniform on the circle.
        """
        if frame not in ("body", "world"):
            raise InvalidArgumentError("frame", "'body' or 'world'", repr(frame), "name the axes of the small rotation")
        c = bounded(self.rotation_covariance)
        if frame == "world":
            return c
        to_world = np.stack([rotate(self.modes, axis) for axis in np.eye(3)], axis=-1)
        return np.swapaxes(to_world, -1, -2) @ c @ to_world

    def reasons(self) -> list[str]:
        """What became of each magnetometer sample, in words."""
        return [MAGNETOMETER_CODES[int(code)] for code in self.magnetometer_code]
