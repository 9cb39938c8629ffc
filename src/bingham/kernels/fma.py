"""a·b + c with one rounding, named: quick as a contraction that the compiler picks, but the same bits in every copy."""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import intrinsic, overload

__all__ = ["fma"]


def fma(a: Any, b: Any, c: Any) -> Any:
    """Return a·b + c; compiled code rounds once, Python twice."""
    return a * b + c


def _generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.fma(*arguments)


@intrinsic
def _fused(context: Any, a: Any, b: Any, c: Any) -> Any:
    return types.float64(types.float64, types.float64, types.float64), _generate


@overload(fma)
def _(a: Any, b: Any, c: Any) -> Any:
    def compiled(a: Any, b: Any, c: Any) -> Any:
        return _fused(a, b, c)  # pyright: ignore[reportCallIssue]

    return compiled
