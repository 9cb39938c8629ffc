"""The papers' Kalman filters, to compare with: the same methods, Gaussian states.

They take variances in place of distributions; ``bingham.distributions`` has `angular_variance` and `to_gaussian`, which
give those of a distribution.
"""

from __future__ import annotations

from bingham._lazy import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
