"""Recordings in, tracks out: readers with errors that name file, place and hint, and writers that leave no halves."""

from __future__ import annotations

from bingham._lazy import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
