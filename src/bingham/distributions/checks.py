"""Rejection of what is no Bingham distribution where one is asked for: states, priors, noises."""

from __future__ import annotations

from typing import Any

from bingham.distributions.arguments import described
from bingham.distributions.bingham import Bingham
from bingham.distributions.mixture import BinghamMixture
from bingham.errors import InvalidArgumentError

__all__ = ["check_distribution", "check_mixture"]

NEW_DISTRIBUTION = "make one by Bingham.uniform(d), Bingham.from_covariance(q, C, frame=...) or Bingham(z, M)"


def check_distribution(distribution: Any, name: str, hint: str = NEW_DISTRIBUTION) -> None:
    """Reject what is no `Bingham`, and say how to fix the call."""
    if isinstance(distribution, Bingham):
        return
    if isinstance(distribution, BinghamMixture):
        hint = "mixtures go into MixtureFilter; one of the distributions is mixture.components[k]"
    elif isinstance(getattr(distribution, "final", None), Bingham):
        hint = "the last distribution of a track is track.final"
    raise InvalidArgumentError(name, "a Bingham distribution", described(distribution), hint)


def check_mixture(mixture: Any, name: str) -> None:
    """Reject what is no `BinghamMixture`, and say how to make one of it."""
    if isinstance(mixture, BinghamMixture):
        return
    single = isinstance(mixture, Bingham)
    hint = (
        "BinghamMixture.single(distribution)" if single else "BinghamMixture.single(Bingham.uniform(d)) knows nothing"
    )
    raise InvalidArgumentError(name, "a BinghamMixture", described(mixture), hint)
