"""One decorator for every compiled kernel, so that all share the same numerical flags."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

__all__ = ["compiled"]

F = TypeVar("F", bound=Callable[..., Any])

# Contraction and reassociation only: flags that assume away NaN or infinity would hide errors.
FAST_MATH = {"contract", "reassoc"}


def compiled(*, inline: bool = False, parallel: bool = False, exact: bool = False) -> Callable[[F], F]:
    """Compile a function with Numba at its first call and keep the machine code on disk.

    Parameters
    ----------
    inline : bool
        Copy the function into its callers (LLVM ``alwaysinline``), for the scalar helpers of hot loops.
    parallel : bool
        Allow ``numba.prange``.
    exact : bool
        Forbid reassociation, for code whose result must not depend on how it was vectorised.

    Returns
    -------
    decorator
        Leaves the function's type as it is; the plain Python source stays reachable as ``function.py_func``.
    """

    def decorate(function: F) -> F:
        options: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
        if not exact:
            options["fastmath"] = FAST_MATH
        if inline:
            options["forceinline"] = True
        if parallel:
            options["parallel"] = True
        return cast(F, numba.njit(**options)(function))

    return decorate
