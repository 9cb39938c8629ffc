"""Peers under short names; imports that are slow or print warnings are made once, here."""

from __future__ import annotations

import logging
import warnings

import numpy as np

logging.disable(logging.WARNING)
warnings.simplefilter("ignore")

from pyrecest.distributions.hypersphere_subset.bingham_distribution import BinghamDistribution  # noqa: E402
from pyrecest.filters.bingham_filter import BinghamFilter as PyRecEstFilter  # noqa: E402

__all__ = ["BinghamDistribution", "PyRecEstFilter", "pyrecest_distribution"]


def pyrecest_distribution(z: list[float], nudge: float = 0.0) -> BinghamDistribution:
    """Return the distribution with concentrations z about the last axis, rotated so that the mode is the identity.

    PyRecEst remembers normalisers it has computed: ``nudge`` makes a new one, as every step of a real filter does.
    """
    d = len(z)
    return BinghamDistribution(np.array(z) * (1.0 + nudge), np.eye(d)[:, ::-1].copy())
