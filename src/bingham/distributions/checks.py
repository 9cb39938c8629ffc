"""Rejection of what is no Bingham distribution where one is asked for: states, priors, noises."""

from __future__ import annotations

from typing import Any

from bingham.distributions.bingham import Bingham
from bingham.errors import InvalidArgumentError
from bingham.validation import described

__all__ = ["check_distribution", "check_measurement_noise", "check_mixture", "check_process_noise"]

NEW_DISTRIBUTION = "make one by Bingham.uniform(d), Bingham.from_covariance(q, C, frame=...) or Bingham(z, M)"
DISTRIBUTION_OF_NOISE = "for a covariance C about the identity: Bingham.from_covariance([1, 0, 0, 0], C, frame='body')"


def check_distribution(distribution: Any, name: str, hint: str = NEW_DISTRIBUTION) -> None:
    """Reject what is no `Bingham`, and say how to fix the call."""
    if isinstance(distribution, Bingham):
        return
    if _is_mixture(distribution):
        hint = "mixtures go into MixtureFilter; one of the distributions is mixture.components[k]"
    elif isinstance(getattr(distribution, "final", None), Bingham):
        hint = "the last distribution of a track is track.final"
    raise InvalidArgumentError(name, "a Bingham distribution", described(distribution), hint)


def check_mixture(mixture: Any, name: str) -> None:
    """Reject what is no `BinghamMixture`, and say how to make one of it."""
    if _is_mixture(mixture):
        return
    single = isinstance(mixture, Bingham)
    hint = (
        "BinghamMixture.single(distribution)" if single else "BinghamMixture.single(Bingham.uniform(d)) knows nothing"
    )
    raise InvalidArgumentError(name, "a BinghamMixture", described(mixture), hint)


def check_process_noise(w: Any) -> None:
    """Reject what is neither a distribution nor has the methods of a `MotionModel`."""
    if isinstance(w, Bingham) or (callable(getattr(w, "propagate", None)) and not isinstance(w, type)):
        return
    expected = "a Bingham distribution or a motion model with propagate(state, control, dt)"
    if callable(getattr(w, "likelihood", None)):
        hint = "swap them: the process noise comes first, the sensor second"
    else:
        hint = DISTRIBUTION_OF_NOISE + ", or take Diffusion(σ) or Gyroscope(noise density)"
    raise InvalidArgumentError("process_noise", expected, described(w), hint)


def check_measurement_noise(v: Any, *, mixtures: bool = False) -> None:
    """Reject what is no distribution (or mixture, where filters take them) and has not the method of a `Sensor`."""
    if isinstance(v, Bingham) or (mixtures and _is_mixture(v)):
        return
    if callable(getattr(v, "likelihood", None)) and not isinstance(v, type):
        return
    distributions = "a Bingham distribution, a BinghamMixture" if mixtures else "a Bingham distribution"
    if callable(getattr(v, "propagate", None)):
        hint = "swap them: the process noise, or motion model, comes first, the sensor second"
    elif _is_mixture(v):
        hint = "MixtureFilter takes mixtures"
    else:
        hint = DISTRIBUTION_OF_NOISE
    expected = f"{distributions} or a sensor with likelihood(z, predicted)"
    raise InvalidArgumentError("measurement_noise", expected, described(v), hint)


def _is_mixture(x: Any) -> bool:
    """Whether x is a `BinghamMixture`, whose module, with what it loads, the filters of one distribution do without."""
    from bingham.distributions.mixture import BinghamMixture

    return isinstance(x, BinghamMixture)
