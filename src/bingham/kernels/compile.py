"""One decorator for every compiled kernel, so that all share the same numerical flags and the same cache."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba import types
from numba.core.registry import CPUDispatcher

from bingham.kernels.brisk import brisk_compilation
from bingham.kernels.cache import kernel_cache

__all__ = ["compiled"]

F = TypeVar("F", bound=Callable[..., Any])

# Contraction and reassociation only: flags that assume away NaN or infinity would hide errors.
FAST_MATH = {"contract", "reassoc"}


class _Kernel(CPUDispatcher):
    """A function that is compiled once for its types, not once more for every constant that a caller passes."""

    def get_call_template(self, args: Any, kws: Any) -> Any:
        return super().get_call_template(tuple(types.unliteral(a) for a in args), kws)

    def compile(self, sig: Any) -> Any:
        with brisk_compilation():
            return super().compile(sig)


class _Inner(_Kernel):
    """A function whose machine code only compiled code can call."""

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return self.py_func(*args, **kwargs)


def compiled(
    *, inner: bool = False, inline: bool = False, parallel: bool = False, fast: bool = False
) -> Callable[[F], F]:
    """Compile a function with Numba at its first call and keep the machine code on disk.

    Parameters
    ----------
    inner : bool
        Only compiled code calls the function: it needs no way in from Python, where its source runs instead. So with
        a leading underscore or `inline`.
    inline : bool
        Copy the function into its compiled callers (LLVM ``alwaysinline``), for the scalar helpers of hot loops.
    parallel : bool
        Allow ``numba.prange``.
    fast : bool
        Allow contraction and reassociation, for batches. The bits of the result then depend on where arrays lie: a
        vectorised loop is left for a scalar one where two happen to lie close together in memory.

    Returns
    -------
    decorator
        Leaves the function's type as it is; the plain Python source stays reachable as ``function.py_func``.
    """

    def decorate(function: F) -> F:
        # Wrappers that nothing calls are a tenth of the time to compile.
        options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
        if fast:
            options["fastmath"] = FAST_MATH
        if inline:
            options["forceinline"] = True
        only_inner = inner or inline or function.__name__.startswith("_")
        options["no_cpython_wrapper"] = only_inner
        if parallel:
            options["parallel"] = True
        dispatcher: Any = numba.njit(**options)(function)
        dispatcher.__class__ = _Inner if only_inner else _Kernel
        dispatcher._cache = kernel_cache(function)
        return cast(F, dispatcher)

    return decorate
