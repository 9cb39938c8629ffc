"""Several hypotheses of the spin: second-order Bingham filters whose weights are their evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation
from scipy.special import logsumexp

from bingham.distributions.bingham import Bingham
from bingham.distributions.mixture import BinghamMixture
from bingham.errors import InvalidArgumentError
from bingham.filters.protocol import MISSING, UpdateInfo
from bingham.filters.run import RecursiveFilter
from bingham.filters.second_order import SecondOrderBinghamFilter, SpinState
from bingham.filters.track import Track
from bingham.sampling.riemannian import RiemannianSampling
from bingham.validation import check_kind, integer

__all__ = ["SecondOrderMixtureFilter", "SpinMixture"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SpinMixture:
    """Weighted hypotheses of orientation and spin.

    Parameters
    ----------
    states : sequence of SpinState
        Each hypothesis's distributions.
    weights : (k,) ndarray
        Probabilities, sum 1.
    """

    states: Sequence[SpinState]
    weights: FloatArray

    def __post_init__(self) -> None:
        w = np.array(self.weights, dtype=np.float64)
        if not len(self.states) or w.shape != (len(self.states),) or not np.all(w >= 0.0) or not w.sum() > 0.0:
            raise InvalidArgumentError(
                "weights", f"{len(self.states)} numbers ≥ 0, not all 0, one a state", self.weights
            )
        object.__setattr__(self, "weights", w / w.sum())

    @classmethod
    def spread(cls, state: SpinState, components: int = 16, concentration: float = 10.0) -> SpinMixture:
        """Return ``components`` hypotheses that cover the spin's distribution, isotropic with z = −concentration each.

        Their modes are deterministic samples of it (`RiemannianSampling`), which repeat its second moment.
        """
        integer(components, "components", 6)
        modes = RiemannianSampling(components).sample(state.spin).points
        one = Bingham([-concentration] * 3 + [0.0], np.eye(4)[:, [1, 2, 3, 0]])
        states = [SpinState(state.orientation, one.rotate(left=m)) for m in modes]
        return cls(states, np.full(components, 1.0 / components))

    @property
    def selected(self) -> SpinState:
        """The most probable hypothesis."""
        return self.states[int(np.argmax(self.weights))]

    @property
    def mode(self) -> FloatArray:
        """Orientation (4,) of the most probable hypothesis."""
        return self.selected.mode

    @property
    def spin(self) -> BinghamMixture:
        """Distribution of the spin."""
        spins = [s.spin for s in self.states]
        batch = Bingham.from_spectrum(np.stack([p.z for p in spins]), np.stack([p.M for p in spins]))
        return BinghamMixture(self.weights, batch)


@dataclass(frozen=True)
class SecondOrderMixtureFilter(RecursiveFilter[SpinMixture, Track[SpinMixture]]):
    """A few second-order filters in place of one: rotations seen now and then alias by half turns.

    A single Bingham distribution of the spin settles on one of the spins that explain the first orientations, and may
    stay there. Here every hypothesis is filtered by itself and weighed by its evidence; light ones are dropped, and of
    two that have become alike the heavier takes the other's weight.

    Parameters
    ----------
    member : SecondOrderBinghamFilter
        The filter of every hypothesis.
    max_components : int
        At most so many are kept.
    min_weight : float
        Lighter ones are dropped.
    merge_cost : float
        KL divergence, nats, of orientation and of spin below which two hypotheses are one.

    Examples
    --------
    >>> near = np.eye(4)[:, ::-1]
    >>> f = SecondOrderMixtureFilter(SecondOrderBinghamFilter(Bingham([-1e4] * 3 + [0], near),
    ...                                                       Bingham([-400] * 3 + [0], near)))
    >>> state = SpinMixture.spread(SpinState(Bingham.uniform(4), Bingham([-3] * 3 + [0], near)))
    >>> for _ in range(10):
    ...     state, info = f.update(f.predict(state), [1.0, 0.0, 0.0, 0.0])
    >>> np.abs(state.selected.spin.mode).round(2) + 0.0
    array([1., 0., 0., 0.])
    """

    member: SecondOrderBinghamFilter
    max_components: int = 24
    min_weight: float = 1e-4
    merge_cost: float = 0.02

    def __post_init__(self) -> None:
        check_kind(self.member, SecondOrderBinghamFilter, "member")
        integer(self.max_components, "max_components", 1)

    @property
    def several(self) -> bool:
        """Whether a measurement may have several interpretations: it may."""
        return True

    def predict(
        self, state: SpinMixture, control: ArrayLike | Rotation | None = None, dt: float | None = None
    ) -> SpinMixture:
        """Return every hypothesis one step, or dt seconds, later."""
        check_kind(state, SpinMixture, "state", "start from SpinMixture.spread(SpinState(orientation, spin))")
        return SpinMixture([self.member.predict(s, control, dt) for s in state.states], state.weights)

    def update(
        self, state: SpinMixture, z: ArrayLike | Rotation, *, noise: Bingham | None = None
    ) -> tuple[SpinMixture, UpdateInfo]:
        """Return the hypotheses given a measured orientation, as `SecondOrderBinghamFilter.update`.

        ``log_evidence`` is that of the mixture.
        """
        check_kind(state, SpinMixture, "state", "start from SpinMixture.spread(SpinState(orientation, spin))")
        results = [self.member.update(s, z, noise=noise) for s in state.states]
        if not results[0][1].accepted:
            return state, MISSING
        with np.errstate(divide="ignore"):
            logs = np.log(state.weights) + np.array([info.log_evidence for _, info in results])
        total = float(np.asarray(logsumexp(logs)))
        states, weights = self._reduced([s for s, _ in results], np.exp(logs - total))
        best = results[int(np.argmax(logs))][1]
        return SpinMixture(states, weights), best._replace(log_evidence=total)

    def _reduced(self, states: list[SpinState], weights: FloatArray) -> tuple[list[SpinState], FloatArray]:
        kept: list[SpinState] = []
        masses: list[float] = []
        for k in np.argsort(-weights, kind="stable"):
            one, mass = states[k], float(weights[k])
            alike = next((i for i, other in enumerate(kept) if self._alike(one, other)), None)
            if alike is not None:
                masses[alike] += mass
            elif not kept or (mass >= self.min_weight and len(kept) < self.max_components):
                kept.append(one)
                masses.append(mass)
        return kept, np.array(masses)

    def _alike(self, a: SpinState, b: SpinState) -> bool:
        cost = self.merge_cost
        return a.spin.kl_divergence(b.spin) < cost and a.orientation.kl_divergence(b.orientation) < cost
