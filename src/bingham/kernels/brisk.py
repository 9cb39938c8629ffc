"""Compilation in two thirds of the time: Numba resolves the same operators of the same types over and over."""

from __future__ import annotations

import gc
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

from numba.core.compiler_lock import global_compiler_lock
from numba.core.types.functions import BaseFunction

__all__ = ["brisk_compilation"]

_depth = 0


@contextmanager
def brisk_compilation() -> Generator[None]:
    """Remember within the outermost compilation which signature an operator or built-in function has for given types.

    The garbage collector rests meanwhile: the compiler's graphs are large, and nothing of them can be freed before it
    is done. What is compiled is the same.
    """
    global _depth
    with global_compiler_lock:
        outermost = _depth == 0 and gc.isenabled()
        resolve = BaseFunction.get_call_type
        if outermost:
            gc.disable()
            BaseFunction.get_call_type = _remembering(resolve)
        _depth += 1
        try:
            yield
        finally:
            _depth -= 1
            if outermost:
                BaseFunction.get_call_type = resolve
                gc.enable()


def _remembering(resolve: Any) -> Any:
    known: dict[Any, Any] = {}

    def get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
        key = (self, context, tuple(args), tuple(kws.items()))
        if key not in known:
            known[key] = resolve(self, context, args, kws)
        return known[key]

    return get_call_type
