"""Refusal of what is no Bingham law where one is asked for: states, priors, noises."""

from __future__ import annotations

from typing import Any

from bingham.distributions.arguments import described
from bingham.distributions.bingham import Bingham
from bingham.distributions.mixture import BinghamMixture
from bingham.errors import InvalidArgumentError

__all__ = ["check_law", "check_mixture"]

NEW_LAW = "make one by Bingham.uniform(d), Bingham.from_covariance(q, C, frame=...) or Bingham(z, M)"


def check_law(law: Any, name: str, remedy: str = NEW_LAW) -> None:
    """Refuse what is no `Bingham`, and say how to mend the call."""
    if isinstance(law, Bingham):
        return
    if isinstance(law, BinghamMixture):
        remedy = "mixtures go into MixtureFilter; one of the laws is mixture.components[k]"
    elif isinstance(getattr(law, "final", None), Bingham):
        remedy = "the last law of a track is track.final"
    raise InvalidArgumentError(name, "a Bingham law", described(law), remedy)


def check_mixture(mixture: Any, name: str) -> None:
    """Refuse what is no `BinghamMixture`, and say how to make one of it."""
    if isinstance(mixture, BinghamMixture):
        return
    single = isinstance(mixture, Bingham)
    remedy = "BinghamMixture.single(law)" if single else "BinghamMixture.single(Bingham.uniform(d)) knows nothing"
    raise InvalidArgumentError(name, "a BinghamMixture", described(mixture), remedy)
