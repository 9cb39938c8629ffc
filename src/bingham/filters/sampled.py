"""Nonlinear Bingham filter by sampling: any motion, any likelihood, any sampler (d ≥ 2)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution
from bingham.errors import ConvergenceError, InvalidArgumentError
from bingham.filters.sequence import time_steps
from bingham.filters.track import Track
from bingham.filters.user_functions import checked_log_likelihood, checked_motion
from bingham.rotations import left_matrix, right_matrix
from bingham.sampling.protocol import Sampler
from bingham.sampling.riemannian import RiemannianSampling
from bingham.validation import as_array, check_noise_side, is_missing, missing_rows, unit_rows

__all__ = ["SampledFilter", "SampledUpdateInfo"]

FloatArray = NDArray[np.float64]
Motion = Callable[[FloatArray, Any, Any], ArrayLike]
LogLikelihood = Callable[[Any, FloatArray], ArrayLike]

# More fractions than a distribution with its full dimension needs: each raises the information by a factor. Samples
# that have collapsed onto a smaller sphere (see `clamped`) may need ever more; the last fraction takes what remains.
MAX_FRACTIONS = 500


class SampledUpdateInfo(NamedTuple):
    """What a sampled update says about itself.

    ``log_evidence``: log Σ w f(z|x), of all fractions together. ``effective_sample_size``: 1/Σ ŵ² with the weights ŵ
    after the update, sum 1; the smallest of all fractions, near 1 when the update rests on a single sample.
    ``fractions``: the powers of the likelihood that were fused one after the other, sum 1. ``clamped``: whether
    samples left an axis with less than `least_moment`, which was put in its place. ``accepted``, ``reason``: False and
    "missing" where z is missing, with evidence 0 and no effective sample size.
    """

    log_evidence: float
    effective_sample_size: float
    fractions: tuple[float, ...]
    clamped: bool
    accepted: bool = True
    reason: str = ""


@dataclass(frozen=True)
class SampledFilter:
    """Bingham filter for x' = a(x) ⊕ w and any f(z | x): they are sampled, moved or weighed, and refitted.

    With `Unscented` it is the unscented Bingham filter, with `RiemannianSampling` that of Li et al. 2019, with
    `RandomSampling` a Bingham particle filter; ``progressive=True`` makes the progressive version of each. User
    functions get all samples at once and must not tell x from −x.

    Parameters
    ----------
    motion : callable, optional
        a: (points (m, d), control, dt) → unit vectors (m, d). Without one, x' = x ⊕ control ⊕ w, without sampling.
    process_noise : Bingham, optional
        Distribution of w, composed exactly (d = 2, 4).
    log_likelihood : callable, optional
        (z, points (m, d)) → log f(z | x) (m,); −∞ where z is impossible. `update` takes another one on request.
    sampler : Sampler
        What represents a distribution by points.
    progressive : bool
        Fuse the likelihood by powers f(z|x)^γ, Σγ = 1, each as large as `min_share` allows, with new samples for
        each; at most 500, of which the last takes what remains.
    noise_side : {"right", "left"}
        "right": a(x) ⊕ w (body frame); "left": w ⊕ a(x).
    min_share : float
        Share of effective samples that every fraction keeps, in (0, 1); larger makes more and smaller steps.
    least_moment : float
        Smallest E[(mᵢᵀx)²] of a refit (for rotations a quarter of the variance in rad²): samples that coincide
        would otherwise claim certainty; see `SampledUpdateInfo.clamped`.

    Examples
    --------
    >>> from bingham.rotations import rotate
    >>> def log_likelihood(z, q):  # a measured world vector: z = q ⊗ (0, 0, 1) ⊗ q* + noise of 0.1 per axis
    ...     return -50.0 * np.sum((z - rotate(q, [0.0, 0.0, 1.0])) ** 2, axis=-1)
    >>> f = SampledFilter(log_likelihood=log_likelihood, progressive=True)
    >>> state, info = f.update(Bingham.uniform(4), [0.0, 1.0, 0.0])
    >>> bool(np.allclose(rotate(state.mode, [0.0, 0.0, 1.0]), [0.0, 1.0, 0.0], atol=0.03))
    True
    """

    motion: Motion | None = None
    process_noise: Bingham | None = None
    log_likelihood: LogLikelihood | None = None
    sampler: Sampler = field(default_factory=RiemannianSampling)
    progressive: bool = False
    noise_side: Literal["right", "left"] = "right"
    min_share: float = 0.5
    least_moment: float = 1e-9

    def __post_init__(self) -> None:
        check_noise_side(self.noise_side)
        if not 0.0 < self.min_share < 1.0:
            raise InvalidArgumentError("min_share", "a number in (0, 1)", self.min_share)
        if not 0.0 < self.least_moment < 0.1:
            raise InvalidArgumentError("least_moment", "a number in (0, 0.1)", self.least_moment)
        if not isinstance(self.sampler, Sampler):
            raise InvalidArgumentError(
                "sampler", "an object with sample(distribution) -> points, weights", self.sampler
            )
        noise = self.process_noise
        if noise is not None:
            check_distribution(noise, "process_noise")
        if noise is not None and (noise.shape or noise.dim not in (2, 4)):
            raise InvalidArgumentError("process_noise", "a single distribution of dimension 2 or 4", repr(noise))

    def predict(self, state: Bingham, control: Any = None, dt: float | None = None) -> Bingham:
        """Return the Bingham distribution with the second moment of a(x) ⊕ w, x ~ `state` sampled.

        Raises
        ------
        InvalidArgumentError
            If the motion returns other than finite unit vectors (m, d).
        """
        check_distribution(state, "state")
        return self._predict(state, control, dt, "predict")

    def update(
        self, state: Bingham, z: Any, *, log_likelihood: LogLikelihood | None = None
    ) -> tuple[Bingham, SampledUpdateInfo]:
        """Return the Bingham distribution with the second moment of f(x | z) ∝ f(z | x) f(x), x ~ `state` sampled.

        An array z that is NaN throughout is a missing measurement; what is NaN in part is for the likelihood to judge.

        Raises
        ------
        InvalidArgumentError
            If the log-likelihood returns other than (m,) numbers below +∞, or is −∞ for every sample.
        """
        check_distribution(state, "state")
        if is_missing(z):
            return state, SampledUpdateInfo(0.0, math.nan, (), False, False, "missing")
        return self._update(state, z, log_likelihood, "update")

    def run(
        self,
        prior: Bingham,
        measurements: ArrayLike | Rotation,
        *,
        controls: ArrayLike | Rotation | None = None,
        times: ArrayLike | None = None,
        start_time: float | None = None,
    ) -> Track:
        """Filter a recording: predict, then update, for every row of measurements (T, k); NaN rows are missing.

        Parameters are those of `BinghamFilter.run`; the motion gets the row of controls and the seconds of each step.
        """
        check_distribution(prior, "prior")
        rows = np.asarray(as_array(measurements), dtype=np.float64)
        if rows.ndim != 2:
            raise InvalidArgumentError("measurements", "shape (T, k)", rows.shape)
        inputs = None if controls is None else np.asarray(as_array(controls), dtype=np.float64)
        if inputs is not None and len(inputs) != len(rows):
            raise InvalidArgumentError("controls", f"{len(rows)} rows, one for each measurement", len(inputs))
        steps = None if times is None else time_steps(times, start_time, len(rows))
        missing = missing_rows(rows, "measurements")
        d, count = prior.dim, len(rows)
        z, frames = np.empty((count, d)), np.empty((count, d, d))
        evidence, decision = np.zeros(count), np.ones(count, dtype=np.int8)
        state = prior
        for t in range(count):
            control = None if inputs is None else inputs[t]
            dt = None if steps is None else float(steps[t])
            state = self._predict(state, control, dt, f"predict, row {t}")
            if missing[t]:
                decision[t] = -1
            else:
                state, info = self._update(state, rows[t], None, f"update, row {t}")
                evidence[t] = info.log_evidence
            z[t], frames[t] = state.z, state.M
        clock = None if times is None else np.asarray(times, dtype=np.float64)
        return Track(clock, z, frames, evidence, np.full(count, np.nan), decision)

    def _predict(self, state: Bingham, control: Any, dt: float | None, step: str) -> Bingham:
        moment, frame = state.moment(), state.M
        if self.motion is not None:
            points, weights = self.sampler.sample(state)
            moved = checked_motion(self.motion, points, control, dt, step)
            moment = (moved.T * weights) @ moved
        elif control is not None:
            turn = right_matrix(unit_rows(control, state.dim, "control"))
            moment, frame = turn @ moment @ turn.T, turn @ frame
        if self.process_noise is not None:
            self._check_dimension(state)
            matrices, shares = self._noise
            moment = np.einsum("n,nij,jk,nlk->il", shares, matrices, moment, matrices, optimize=False)
        return self._refit(moment, frame, step)[0]

    def _update(
        self, state: Bingham, z: Any, other: LogLikelihood | None, step: str
    ) -> tuple[Bingham, SampledUpdateInfo]:
        from bingham.kernels.refit import fraction

        function = other if other is not None else self.log_likelihood
        if function is None:
            raise InvalidArgumentError("log_likelihood", "a function (z, points) -> (m,)", None,
                                       "give it to SampledFilter or to update")  # fmt: skip
        remaining, evidence, size, clamped = 1.0, 0.0, math.inf, False
        fractions: list[float] = []
        while remaining > 0.0:
            points, weights = self.sampler.sample(state)
            values = checked_log_likelihood(function, z, points, weights, step)
            power = remaining
            if self.progressive and len(fractions) < MAX_FRACTIONS - 1:
                power = fraction(weights, values, self.min_share, remaining)
            top = float(values.max())
            ratio = weights * np.exp(power * (values - top))
            total = float(ratio.sum())
            size = min(size, total * total / float(ratio @ ratio))
            evidence += power * top + math.log(total)
            state, low = self._refit((points.T * (ratio / total)) @ points, state.M, step)
            clamped |= low
            fractions.append(power)
            remaining = 0.0 if power == remaining else remaining - power
        return state, SampledUpdateInfo(evidence, size, tuple(fractions), clamped)

    def _refit(self, moment: FloatArray, frame: FloatArray, step: str) -> tuple[Bingham, bool]:
        """Return the distribution of a second moment and whether an axis was below `least_moment`."""
        from bingham.kernels.refit import refit

        z, axes, log_f, w, smallest = refit(
            np.ascontiguousarray(moment), np.ascontiguousarray(frame), self.least_moment
        )
        if not math.isfinite(log_f):
            raise ConvergenceError(f"refit in {step}", moment)
        return Bingham.from_spectrum(z, axes, log_f, w), bool(smallest < self.least_moment)

    @cached_property
    def _noise(self) -> tuple[FloatArray, FloatArray]:
        """Multiplication matrices (d, d, d) of the noise's axes and their moments (d,)."""
        assert self.process_noise is not None
        axes = np.ascontiguousarray(self.process_noise.M.T)
        matrices = left_matrix(axes) if self.noise_side == "left" else right_matrix(axes)
        return matrices, self.process_noise.axis_moments

    def _check_dimension(self, state: Bingham) -> None:
        if self.process_noise is not None and state.z.shape != self.process_noise.z.shape:
            raise InvalidArgumentError(
                "state", f"a single distribution of dimension {self.process_noise.dim}", repr(state)
            )
