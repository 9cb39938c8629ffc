"""Bingham distributions on unit hyperspheres and the recursive filters built on them.

The names that most users want are here; everything else is in the subpackages, which need no import of their own:
``bingham.filters.FilterBank``. All of it loads when first used, so that ``import bingham`` stays fast;
``__init__.pyi`` lists the names.
"""

from __future__ import annotations

from bingham._lazy import attach

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = attach(__name__, __file__)
