"""Nonlinear Bingham filter by sampling: any motion, any likelihood, any sampler (d ≥ 2)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution, check_process_noise
from bingham.errors import ConvergenceError, InvalidArgumentError
from bingham.filters.run import RecursiveFilter
from bingham.filters.track import BinghamTrack
from bingham.filters.user_functions import checked_log_likelihood, checked_motion
from bingham.models.motion import MotionModel, on_side
from bingham.rotations import left_matrix, right_matrix
from bingham.sampling.protocol import Sampler
from bingham.sampling.riemannian import RiemannianSampling
from bingham.validation import as_array, check_noise_side, is_missing, unit_rows

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

    @property
    def nis(self) -> float:
        """NaN: a likelihood that is only a function has no innovation."""
        return math.nan


@dataclass(frozen=True)
class SampledFilter(RecursiveFilter[Bingham, BinghamTrack]):
    """Bingham filter for x' = a(x) ⊕ w and any f(z | x): they are sampled, moved or weighed, and refitted.

    With `Unscented` it is the unscented Bingham filter, with `RiemannianSampling` that of Li et al. 2019, with
    `RandomSampling` a Bingham particle filter; ``progressive=True`` makes the progressive version of each. User
    functions get all samples at once and must not tell x from −x.

    Parameters
    ----------
    motion : callable, optional
        a: (points (m, d), control, dt) → unit vectors (m, d). Without one, x' = x ⊕ control ⊕ w, without sampling.
    process_noise : Bingham or MotionModel, optional
        Distribution of w, once per step, composed exactly (d = 2, 4); `Diffusion` for noise that grows with time.
    log_likelihood : callable, optional
        (z, points (m, d)) → log f(z | x) (m,); −∞ where z is impossible. `update` takes another one on request.
    sampler : Sampler
        What represents a distribution by points.
    progressive : bool
        Fuse the likelihood by powers f(z|x)^γ, Σγ = 1, each as large as `min_share` allows, with new samples for
        each; at most 500, of which the last takes what remains.
    noise_side : {"right", "left"}
        "right": a(x) ⊕ w (body frame); "left": w ⊕ a(x). Controls of a filter without motion act on the same side.
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
    process_noise: Bingham | MotionModel | None = None
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
            check_process_noise(noise)
        if isinstance(noise, Bingham) and (noise.shape or noise.dim not in (2, 4)):
            raise InvalidArgumentError("process_noise", "a single distribution of dimension 2 or 4", repr(noise))

    @property
    def needs_times(self) -> bool:
        """Whether the process noise is a motion in continuous time."""
        return getattr(self.process_noise, "continuous_time", None) is True

    @property
    def noise_per_step(self) -> bool:
        """Whether the process noise is that of one step, and no function of the user is asked what time does."""
        return isinstance(self.process_noise, Bingham) and self.motion is None

    def predict(self, state: Bingham, control: Any = None, dt: float | None = None) -> Bingham:
        """Return the Bingham distribution with the second moment of a(x) ⊕ w, x ~ `state` sampled.

        Raises
        ------
        InvalidArgumentError
            If the motion returns other than finite unit vectors (m, d).
        """
        check_distribution(state, "state")
        left = self.noise_side == "left"
        moment, frame = state.moment(), state.M
        w = self.process_noise
        if self.motion is not None:
            points, weights = self.sampler.sample(state)
            moved = checked_motion(self.motion, points, control, dt, "predict")
            moment, control = (moved.T * weights) @ moved, None
        elif control is not None and (w is None or isinstance(w, Bingham)):
            u = unit_rows(control, state.dim, "control")
            turn = left_matrix(u) if left else right_matrix(u)
            moment, frame = turn @ moment @ turn.T, turn @ frame
        if w is not None and not isinstance(w, Bingham):
            moved_state = state if self.motion is None else self._refit(moment, frame, "predict")[0]
            return on_side(w, left).propagate(moved_state, None if control is None else as_array(control), dt)
        if w is not None:
            if state.z.shape != w.z.shape:
                raise InvalidArgumentError("state", f"a single distribution of dimension {w.dim}", repr(state))
            matrices, shares = self._noise
            moment = np.einsum("n,nij,jk,nlk->il", shares, matrices, moment, matrices, optimize=False)
        return self._refit(moment, frame, "predict")[0]

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

    def _check_prior(self, prior: Bingham) -> None:
        check_distribution(prior, "prior")

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
        assert isinstance(self.process_noise, Bingham)
        axes = np.ascontiguousarray(self.process_noise.M.T)
        matrices = left_matrix(axes) if self.noise_side == "left" else right_matrix(axes)
        return matrices, self.process_noise.axis_moments
