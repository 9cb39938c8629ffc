"""Motion models: how a distribution moves and widens between two measurements.

Each is a small frozen value with ``propagate(state, control, dt) -> Bingham``; ``left`` says on which side
its noise acts: x ⊕ w (False; body frame, Kurz et al.) or w ⊕ x (True; world frame, Glover & Kaelbling).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Protocol

from numpy.typing import ArrayLike

from bingham.distributions.algebra import NoiseParts, compose_spectra, noise_parts
from bingham.distributions.bingham import Bingham
from bingham.distributions.checks import check_distribution
from bingham.errors import InvalidArgumentError
from bingham.validation import unit_rows

__all__ = ["ControlledRotation", "MotionModel", "RandomWalk", "check_single", "on_side"]


class MotionModel(Protocol):
    """What a filter asks of a motion model.

    A class attribute ``continuous_time`` may say that it scales with ``dt``, which it then has to be given (True), or
    that it is meant for steps of one length (False); without it a run takes any times, or none.
    """

    @property
    def dim(self) -> int:
        """Ambient dimension of the states it moves."""
        ...

    def propagate(self, state: Bingham, control: ArrayLike | None, dt: float | None) -> Bingham:
        """Return the predicted distribution."""
        ...


def check_single(state: Bingham, d: int) -> None:
    """Raise unless the state is a single distribution of dimension d."""
    if state.z.shape != (d,):
        raise InvalidArgumentError(
            "state", f"a single distribution of dimension {d}", f"dimension {state.dim}, batch {state.shape}"
        )


def on_side(model: Any, left: bool) -> Any:
    """Return the motion or sensor model on the filter's side, if it has a side and does not say which."""
    return replace(model, left=left) if getattr(model, "left", left) is None else model


@dataclass(frozen=True)
class RandomWalk:
    """x' = x ⊕ w (or w ⊕ x), w ~ `noise`, once per step whatever its duration (Kurz et al. 2014, eq. 40).

    Parameters
    ----------
    noise : Bingham
        d = 2 or 4; its mode may be a constant motion.
    left : bool, optional
        True for w ⊕ x. Unless given, as ``noise_side`` of the filter says; False without one.
    """

    continuous_time: ClassVar[bool] = False

    noise: Bingham
    left: bool | None = None

    def __post_init__(self) -> None:
        check_distribution(self.noise, "noise")
        if self.noise.dim not in (2, 4) or self.noise.shape:
            raise InvalidArgumentError("noise", "a single distribution of dimension 2 or 4", repr(self.noise))

    @property
    def dim(self) -> int:
        """Ambient dimension."""
        return self.noise.dim

    @cached_property
    def parts(self) -> NoiseParts:
        """The noise as the compiled steps take it."""
        return noise_parts(self.noise.z, self.noise.M, self.noise.axis_moments, left=bool(self.left))

    def propagate(self, state: Bingham, control: ArrayLike | None = None, dt: float | None = None) -> Bingham:
        """Return the moment match of x ⊕ w; ``control`` rotates the state first, as in `ControlledRotation`."""
        check_single(state, self.dim)
        if control is not None:
            u = unit_rows(control, self.dim, "control")
            state = state.rotate(left=u) if self.left else state.rotate(right=u)
        return Bingham.from_spectrum(*compose_spectra(state.z, state.M, self.parts, left=bool(self.left)))


@dataclass(frozen=True)
class ControlledRotation(RandomWalk):
    """x' = x ⊕ u ⊕ w (or w ⊕ u ⊕ x): a known rotation u, the control, then noise."""

    def propagate(self, state: Bingham, control: ArrayLike | None = None, dt: float | None = None) -> Bingham:
        """Return the predicted distribution; ``control`` (d,) is the unit quaternion or unit complex number u."""
        if control is None:
            raise InvalidArgumentError("control", f"the known rotation, shape ({self.dim},)", None)
        return super().propagate(state, control, dt)
