"""Checks of arguments that the layers above share; cheap enough for every call."""

from __future__ import annotations

from operator import index
from typing import Any

import numpy as np

from bingham.errors import InvalidArgumentError

__all__ = ["as_generator", "check_kind", "check_number", "described", "whole_number"]


def described(x: Any) -> str:
    """Return what x is, in a few words: text as written, arrays by shape, other things by type."""
    if isinstance(x, np.ndarray):
        return f"an array of shape {x.shape}"
    if x is None or isinstance(x, (bool, int, float)):
        return str(x)
    if isinstance(x, str):
        return repr(x)
    return f"the class {x.__name__}" if isinstance(x, type) else f"a {type(x).__name__}"


def check_kind(x: Any, kind: type[Any], name: str, remedy: str = "") -> None:
    """Refuse what is no instance of kind."""
    if not isinstance(x, kind):
        raise InvalidArgumentError(name, f"a {kind.__name__}", described(x), remedy)


def check_number(x: Any, name: str, expected: str, *, above: float = -np.inf, least: float = -np.inf) -> None:
    """Refuse what is no single finite number x > above, x ≥ least."""
    try:
        good = bool(np.isfinite(x) and x > above and x >= least)
    except (TypeError, ValueError):
        good = False
    if not good:
        raise InvalidArgumentError(name, expected, described(x))


def whole_number(x: Any, name: str, least: int) -> int:
    """Return x as an int, at least `least`; a float is refused even where it is whole."""
    try:
        number = index(x)
    except TypeError:
        raise InvalidArgumentError(name, f"a whole number ≥ {least}", described(x)) from None
    if number < least:
        raise InvalidArgumentError(name, f"a whole number ≥ {least}", number)
    return number


def as_generator(rng: Any) -> np.random.Generator:
    """Return ``numpy.random.default_rng(rng)``; what it does not take is refused by name."""
    try:
        return np.random.default_rng(rng)
    except (TypeError, ValueError):
        raise InvalidArgumentError(
            "rng", "None, a whole number ≥ 0 or a numpy.random.Generator", described(rng)
        ) from None
