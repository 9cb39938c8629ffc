"""Checks of arguments that the layers above share; cheap enough for every call."""

from __future__ import annotations

from operator import index
from typing import Any

import numpy as np

from bingham.errors import InvalidArgumentError

__all__ = ["as_generator", "check_kind", "check_number", "described", "integer"]


def described(x: Any) -> str:
    """Return what x is, in a few words: text as written, arrays by shape, other things by type."""
    if isinstance(x, np.ndarray):
        return f"an array of shape {x.shape}"
    if x is None or isinstance(x, (bool, int, float)):
        return str(x)
    if isinstance(x, str):
        return repr(x)
    return f"the class {x.__name__}" if isinstance(x, type) else f"a {type(x).__name__}"


def check_kind(x: Any, kind: type[Any], name: str, hint: str = "") -> None:
    """Reject what is no instance of kind."""
    if not isinstance(x, kind):
        raise InvalidArgumentError(name, f"a {kind.__name__}", described(x), hint)


def check_number(x: Any, name: str, expected: str, *, above: float = -np.inf, minimum: float = -np.inf) -> None:
    """Reject what is no single finite number x > above, x ≥ minimum."""
    try:
        good = bool(np.isfinite(x) and x > above and x >= minimum)
    except (TypeError, ValueError):
        good = False
    if not good:
        raise InvalidArgumentError(name, expected, described(x))


def integer(x: Any, name: str, minimum: int) -> int:
    """Return x as an int, at least `minimum`; a float is rejected even where it is whole."""
    try:
        number = index(x)
    except TypeError:
        raise InvalidArgumentError(name, f"an integer ≥ {minimum}", described(x)) from None
    if number < minimum:
        raise InvalidArgumentError(name, f"an integer ≥ {minimum}", number)
    return number


def as_generator(rng: Any) -> np.random.Generator:
    """Return ``numpy.random.default_rng(rng)``; what it does not take is rejected by name."""
    try:
        return np.random.default_rng(rng)
    except (TypeError, ValueError):
        raise InvalidArgumentError("rng", "None, an integer ≥ 0 or a numpy.random.Generator", described(rng)) from None
