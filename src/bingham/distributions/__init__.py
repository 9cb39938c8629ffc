"""Immutable distributions and their algebra."""

from __future__ import annotations

from bingham._lazy import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
