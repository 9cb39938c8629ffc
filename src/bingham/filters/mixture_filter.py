"""Filter for several hypotheses: Bingham mixtures as states and as measurement noise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation
from scipy.special import logsumexp

from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution, check_measurement_noise, check_mixture, check_process_noise
from bingham.distributions.mixture import BinghamMixture
from bingham.distributions.mixture_density import log_area
from bingham.errors import InvalidArgumentError
from bingham.filters.protocol import MISSING, UpdateInfo
from bingham.filters.run import RecursiveFilter
from bingham.filters.track import Track
from bingham.models.motion import MotionModel, RandomWalk, on_side
from bingham.models.sensors import OrientationSensor, Sensor, condition
from bingham.validation import as_array, as_numbers, check_noise_side, integer, is_missing

__all__ = ["MixtureFilter", "ambiguous_noise"]


def ambiguous_noise(noise: Bingham, symmetries: ArrayLike) -> BinghamMixture:
    """Return the distribution of g ⊕ v, g uniform on `symmetries` (m, d): noise of a sensor that confuses x and x ⊕ g.

    Examples
    --------
    A two-fold axis along z: turns by 0 and by 180°.

    >>> import numpy as np
    >>> v = Bingham([-300.0, -300.0, -300.0, 0.0], np.eye(4)[:, ::-1])
    >>> ambiguous_noise(v, [[1.0, 0, 0, 0], [0, 0, 0, 1.0]]).size
    2
    """
    check_distribution(noise, "noise")
    g = as_numbers(symmetries, "symmetries")
    if g.ndim != 2 or noise.shape or g.shape[1] != noise.dim:
        raise InvalidArgumentError(
            "symmetries", f"unit rows, shape (m, {noise.dim}), with one noise distribution", g.shape
        )
    return BinghamMixture(np.full(len(g), 1.0 / len(g)), noise.rotate(left=g))


@dataclass(frozen=True)
class MixtureFilter(RecursiveFilter[BinghamMixture, Track[BinghamMixture]]):
    """Recursive estimation with several hypotheses; with one component it is the first-order `BinghamFilter`.

    Parameters
    ----------
    process_noise : Bingham or MotionModel
        As for `BinghamFilter`; every component moves by itself.
    measurement_noise : Bingham, BinghamMixture or Sensor
        A mixture v stands for z = x ⊕ v: symmetric objects (`ambiguous_noise`), sensors with several failure modes,
        and by its background for outliers anywhere.
    noise_side : {"right", "left"}
        Side of noises and controls, as for `BinghamFilter`.
    max_components : int
        The posterior is merged down to this many (`BinghamMixture.reduce`).
    min_weight : float
        Lighter hypotheses are dropped.
    merge_cost : float
        Pairs of components are merged while the KL divergence that costs is below this, in nats.

    Examples
    --------
    >>> import numpy as np
    >>> identity_last = np.eye(4)[:, ::-1]
    >>> v = Bingham([-500.0, -500.0, -500.0, 0.0], identity_last)
    >>> f = MixtureFilter(v, ambiguous_noise(v, [[1.0, 0, 0, 0], [0, 0, 0, 1.0]]))
    >>> state, info = f.update(BinghamMixture.single(Bingham.uniform(4)), [1.0, 0.0, 0.0, 0.0])
    >>> state.weights.round(12)
    array([0.5, 0.5])
    """

    process_noise: Bingham | MotionModel
    measurement_noise: Bingham | BinghamMixture | Sensor
    noise_side: Literal["right", "left"] = "right"
    max_components: int = 24
    min_weight: float = 1e-4
    merge_cost: float = 1e-4

    def __post_init__(self) -> None:
        check_noise_side(self.noise_side)
        check_process_noise(self.process_noise)
        check_measurement_noise(self.measurement_noise, mixtures=True)
        integer(self.max_components, "max_components", 1)

    @property
    def motion(self) -> MotionModel:
        """The motion model, on its side."""
        w, left = self.process_noise, self.noise_side == "left"
        return RandomWalk(w, left) if isinstance(w, Bingham) else on_side(w, left)

    @property
    def needs_times(self) -> bool:
        """Whether the motion model is one in continuous time."""
        return getattr(self.motion, "continuous_time", None) is True

    @property
    def noise_per_step(self) -> bool:
        """Whether the process noise is that of one step."""
        return getattr(self.motion, "continuous_time", None) is False

    def _sensors(self) -> tuple[list[Sensor], list[float], float]:
        """Return the sensors, their weights and the weight of outliers."""
        v, left = self.measurement_noise, self.noise_side == "left"
        if isinstance(v, BinghamMixture):
            sensors: list[Sensor] = [OrientationSensor(v.components[k], left) for k in range(v.size)]
            return sensors, [float(w) for w in v.weights], v.background
        return [OrientationSensor(v, left) if isinstance(v, Bingham) else on_side(v, left)], [1.0], 0.0

    def _check_prior(self, prior: BinghamMixture) -> None:
        check_mixture(prior, "prior")

    def predict(
        self, state: BinghamMixture, control: ArrayLike | Rotation | None = None, dt: float | None = None
    ) -> BinghamMixture:
        """Move every component by the motion model; a uniform background stays uniform."""
        check_mixture(state, "state")
        control = None if control is None else as_array(control)
        moved = [self.motion.propagate(state.components[k], control, dt) for k in range(state.size)]
        return BinghamMixture(state.weights, _batch(moved), state.background)

    def update(self, state: BinghamMixture, z: ArrayLike | Rotation) -> tuple[BinghamMixture, UpdateInfo]:
        """Posterior ∝ f(z | x) f(x): every component meets every component of the noise.

        Hypothesis (k, m) has the matrix Aₖ + L_m(z) and the weight αₖ β_m F(Aₖ + L_m) / (F(Aₖ) F(L_m)); outliers
        leave a component as it was, with weight αₖ β₀ / area. Light hypotheses are then dropped, alike ones merged.
        NaN throughout is a missing measurement.

        Returns
        -------
        BinghamMixture
            The posterior.
        UpdateInfo
            Its log_evidence is exact, before dropping and merging; the NIS is the smallest one of all hypotheses.
        """
        check_mixture(state, "state")
        z = as_array(z)
        if is_missing(z):
            return state, MISSING
        sensors, shares, outliers = self._sensors()
        distributions, weights = state.distributions()
        found: list[Bingham] = []
        logs: list[float] = []
        nis = math.inf
        for k in range(len(weights)):
            prior = distributions[k]
            for sensor, share in zip(sensors, shares, strict=True):
                if weights[k] == 0.0 or share == 0.0:
                    continue
                posterior, top, log_noise, _ = condition(prior, sensor, z)
                found.append(posterior)
                logs.append(
                    math.log(weights[k] * share)
                    + float(posterior.log_normalizer + top - prior.log_normalizer - log_noise)
                )
                nis = min(nis, -2.0 * top)
        background = -math.inf
        if outliers > 0.0:
            level = math.log(outliers) - log_area(state.dim)
            for k in range(state.size):
                if state.weights[k] > 0.0:
                    found.append(state.components[k])
                    logs.append(level + math.log(state.weights[k]))
            background = level + math.log(state.background) if state.background > 0.0 else -math.inf
        evidence = float(np.asarray(logsumexp([*logs, background])))
        mixture = BinghamMixture(np.exp(np.array(logs) - evidence), _batch(found), math.exp(background - evidence))
        small = mixture.prune(self.min_weight).merge(self.merge_cost).reduce(self.max_components)
        return small, UpdateInfo(evidence, nis, math.inf, True, "")


def _batch(distributions: list[Bingham]) -> Bingham:
    return Bingham.from_spectrum(
        np.stack([distribution.z for distribution in distributions]),
        np.stack([distribution.M for distribution in distributions]),
    )
